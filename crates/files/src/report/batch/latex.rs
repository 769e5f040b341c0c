//! `tensions.tex`: the tensions of a batch as a table for a paper, one row for each fit.

use super::BatchProvenance;
use super::record::AssessedRecord;
use super::tables::name;

/// Text of a cell without a value.
const NONE: &str = "--";

/// The text before the first row; `muscles` are the columns, `draws` is the number of draws for the
/// intervals.
pub fn head(muscles: &[String], draws: usize, p: &BatchProvenance) -> String {
    let names: String = muscles.iter().map(|m| format!(" & {}", escaped(m))).collect();
    let intervals = match draws {
        0 => String::new(),
        n => format!(
            ", in brackets rounding: the range of answers to lengths redrawn within their rounding ({n} draws a fit; none on a \
             bound or where most draws cannot be met); what else is uncertain is not in them"
        ),
    };
    let comments = [
        format!("tongue-fit {}: {}", p.version, p.command),
        format!("seed {}, inputs {}", p.seed, p.inputs_sha256),
        "\\usepackage{booktabs,longtable}; vowels are letters of the IPA in UTF-8: LuaLaTeX or XeLaTeX with a font \
         that has them, such as \\usepackage{fontspec}\\setmainfont{DejaVu Serif}"
            .to_owned(),
    ];
    let comments: String =
        comments.iter().map(|c| format!("% {}\n", c.replace(char::is_control, " "))).collect();
    format!(
        "{comments}\\begin{{longtable}}{{lll*{{{}}}{{r}}rr}}\n\
         \\caption{{Tensions of the tongue's muscles in newtons per metre of thickness{intervals}. {NONE}: taken as passive; empty: not \
         measured. Passive, no change: root mean square error of the stretches of the passive muscles, and of predicting that they \
         stay as in the baseline; \\ddag: the fit took, of the tensions that its target leaves open, those nearest to them, so the \
         error is none of prediction. *: did not converge. \\dag: no baseline of its own.}}\\\\\n\
         \\toprule\nSubject & Vowel & Fitted{names} & Passive & No change\\\\\n\\midrule\n\\endhead\n\\bottomrule\n\\endfoot\n",
        muscles.len()
    )
}

/// The row of one fit.
pub fn row(muscles: &[String], r: &AssessedRecord) -> String {
    let f = &r.fit;
    let tension = |m: &String| {
        let value = f.tensions_n.of(m).filter(|_| f.active.contains(m))?;
        let interval = r.intervals.as_ref().and_then(|all| *all.tensions_n.of(m)?);
        let interval = interval.map_or(String::new(), |i| format!(" [{:.1}, {:.1}]", i.low, i.high));
        Some(format!("{value:.1}{interval}"))
    };
    let none = |m: &String| if f.not_measured.contains(m) { "" } else { NONE };
    let tensions: String =
        muscles.iter().map(|m| format!(" & {}", tension(m).as_deref().unwrap_or(none(m)))).collect();
    let seen = f.identifiability.as_ref().is_some_and(|i| i.undetermined > 0);
    let optional = |value: Option<f64>| value.map_or(NONE.to_owned(), |v| format!("{v:.3}"));
    format!(
        "{}{} & /{}/ & {}{}{tensions} & {}{} & {}\\\\\n",
        escaped(&f.subject),
        if r.substitute_baseline { "\\dag" } else { "" },
        escaped(f.vowel.label()),
        f.target_kind,
        if name(&f.status) == "converged" { "" } else { "*" },
        optional(r.passive.rms_stretch),
        if seen { "\\ddag" } else { "" },
        optional(r.passive.no_change_rms_stretch),
    )
}

/// The text after the last row.
pub const FOOT: &str = "\\end{longtable}\n";

/// A text with LaTeX's special characters escaped.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latex_commands_are_escaped() {
        assert_eq!(escaped("A_1 50% \\x{y} ~^#$&"), {
            "A\\_1 50\\% \\textbackslash{}x\\{y\\} \\textasciitilde{}\\textasciicircum{}\\#\\$\\&"
        });
    }
}
