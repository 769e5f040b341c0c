//! `tensions.tex`: the tensions of a batch as a table for a paper, one row for each fit.

use super::BatchProvenance;
use crate::report::Told;

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
pub fn row(muscles: &[String], r: &Told) -> String {
    let tension = |m: &String| {
        let value = r.number_of("/tensions_n", m).filter(|_| r.lists("/active", m))?;
        let range = r.rounding("tensions_n", m);
        let range = range.map_or(String::new(), |[low, high]| format!(" [{low:.1}, {high:.1}]"));
        Some(format!("{value:.1}{range}"))
    };
    let none = |m: &String| if r.lists("/not_measured", m) { "" } else { NONE };
    let tensions: String =
        muscles.iter().map(|m| format!(" & {}", tension(m).as_deref().unwrap_or(none(m)))).collect();
    let seen = r.number("/identifiability/undetermined").is_some_and(|n| n > 0.0);
    let optional = |value: Option<f64>| value.map_or(NONE.to_owned(), |v| format!("{v:.3}"));
    format!(
        "{}{} & /{}/ & {}{}{tensions} & {}{} & {}\\\\\n",
        escaped(r.text("/subject")),
        if r.is("/substitute_baseline") { "\\dag" } else { "" },
        escaped(r.text("/vowel")),
        r.text("/target_kind"),
        if r.text("/status") == "converged" { "" } else { "*" },
        optional(r.number("/passive/rms_stretch")),
        if seen { "\\ddag" } else { "" },
        optional(r.number("/passive/no_change_rms_stretch")),
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
