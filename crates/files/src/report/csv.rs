//! Records, tables and draws of a posterior (for ArviZ) as CSV, without cells that a spreadsheet would run as formulas.

use std::f64::consts::TAU;
use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::export::{Export, Provenance, text};
use tongue_infer::posterior::{Draw, Posterior};

/// Records as CSV: a column for each field, then those of the [`Provenance`].
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a, T>(pub &'a [T]);

impl<T: Serialize> Export for Rows<'_, T> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let mut table = Table::default();
        for row in self.0 {
            let Value::Object(fields) = serde_json::to_value(row)? else { continue };
            let (columns, cells) = fields.into_iter().map(|(name, value)| (name, text(value))).unzip();
            table.columns = columns;
            table.rows.push(cells);
        }
        if table.rows.is_empty() { Ok(()) } else { table.write(out, by) }
    }
}

/// A CSV table whose columns are known at run time only, such as those of muscles; its file has the columns of the [`Provenance`] too.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn csv(self) -> io::Result<String> {
        let mut out = Vec::new();
        lines(&mut out, std::iter::once(self.columns).chain(self.rows))?;
        String::from_utf8(out).map_err(io::Error::other)
    }
}

impl Export for Table {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        write(out, by, &self.columns, self.rows.iter().cloned(), false)
    }
}

/// Writes a table row by row. The last columns are the provenance, in every row or, if the table `is_long`, only in the first one.
pub(super) fn write(
    out: &mut dyn Write,
    by: &Provenance,
    columns: impl IntoIterator<Item = impl Into<String>>,
    rows: impl Iterator<Item = impl IntoIterator<Item = String>>,
    is_long: bool,
) -> io::Result<()> {
    let (names, values): (Vec<_>, Vec<_>) = by.entries().unzip();
    let header = columns.into_iter().map(Into::into).chain(names).collect();
    let rows = rows.enumerate().map(|(number, row)| {
        let by = values.iter().map(|v| if is_long && number > 0 { String::new() } else { v.clone() });
        row.into_iter().chain(by).collect()
    });
    lines(out, std::iter::once(header).chain(rows))
}

pub(super) fn lines(out: &mut dyn Write, lines: impl Iterator<Item = Vec<String>>) -> io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    for line in lines {
        writer.write_record(line.into_iter().map(harmless))?;
    }
    writer.flush()
}

/// A cell with an apostrophe in front of it if a spreadsheet would run it as a formula: it begins like one and is not a number. Names in
/// tables and recordings are written by others, and `=cmd|...` starts a program. A vowel may be called `@`, as in SAMPA.
fn harmless(cell: String) -> String {
    let is_formula = match cell.as_bytes() {
        [] | [_] => false,
        [b'@', ..] => cell.contains('('),
        [b'=' | b'+' | b'-' | b'\t' | b'\r', ..] => cell.parse::<f64>().is_err(),
        _ => false,
    };
    if is_formula { format!("'{cell}") } else { cell }
}

/// Draws as CSV: `chain`, `draw`, a column for each number, then version and command. All chains have the same length, so that they fill an
/// array. The columns are those of the posture with the given index; the tensions of other postures follow.
#[derive(Debug, Clone, Copy)]
pub struct Draws<'a>(pub &'a Posterior<'a>, pub usize);

impl Draws<'_> {
    /// At a draw, for each of these stretches the logarithm of its probability density given all other measured stretches, with which its
    /// errors are correlated: `ln(Q_ii / 2π)/2 - (Q r)_i²/(2 Q_ii)`, with residuals `r` and the inverse `Q` of their covariance (Bürkner,
    /// Gabry and Vehtari 2021, Computational Statistics 36, section 2). Leave-one-out by importance sampling needs it.
    fn log_likelihoods(&self, stretches: &[usize], draw: &Draw) -> Vec<f64> {
        let inverse = &self.0.problem.precision;
        let pulls = inverse * self.0.problem.residuals(&draw.lengths, &draw.auxiliary);
        let each = stretches.iter().map(|&i| {
            let precision = inverse[(i, i)];
            0.5 * ((precision / TAU).ln() - pulls[i] * pulls[i] / precision)
        });
        each.collect()
    }
}

impl Export for Draws<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let Self(Posterior { problem, draws, .. }, posture) = *self;
        let (muscles, measurements) = (&problem.posterior_model.muscles, &problem.measurements);
        let labels = &measurements.labels;
        let others: Vec<usize> = (0..labels.len()).filter(|p| *p != posture).collect();
        let mut columns = vec!["chain".to_owned(), "draw".to_owned(), "log_density".to_owned()];
        for name in ["tension", "baseline_tension", "change"] {
            columns.extend(muscles.iter().map(|m| format!("{name}_{m}_n_per_m")));
        }
        columns.extend(["hyoid_x_mm", "hyoid_y_mm", "hyoid_tilt_rad_per_m"].map(str::to_owned));
        let moves_in_baseline = problem.moves_hyoid_in_baseline();
        if moves_in_baseline {
            columns.extend(["baseline_hyoid_x_mm", "baseline_hyoid_y_mm"].map(str::to_owned));
        }
        columns.extend(muscles.iter().map(|m| format!("stretch_{m}")));
        let measured = measurements.of_posture(posture);
        columns
            .extend(measured.iter().map(|&i| format!("log_likelihood_{}", measurements.stretches[i].name)));
        for &other in &others {
            columns.extend(muscles.iter().map(|m| format!("tension_{}_{m}_n_per_m", labels[other])));
        }
        let rows = draws.iter().map(|draw| {
            let first = [draw.chain.to_string(), draw.number.to_string(), draw.log.to_string()];
            let (own, all) = (&draw.values.postures[posture], 0..muscles.len());
            let numbers = own.tensions.iter().chain(draw.values.tones()).copied();
            let numbers = numbers.chain(all.clone().map(|m| draw.change(posture, m)));
            let numbers = numbers.chain(own.hyoid.iter().map(|d| 1e3 * d)).chain([draw.values.tilt]);
            let baseline = draw.values.postures.last().filter(|_| moves_in_baseline);
            let numbers = numbers.chain(baseline.into_iter().flat_map(|b| b.hyoid.iter().map(|d| 1e3 * d)));
            let numbers = numbers.chain(all.map(|m| draw.stretch(posture * muscles.len() + m)));
            let numbers = numbers.chain(self.log_likelihoods(&measured, draw));
            let of_others = others.iter().flat_map(|&p| draw.values.postures[p].tensions.iter().copied());
            let numbers = numbers.chain(of_others).map(|value| value.to_string());
            first.into_iter().chain(numbers).collect::<Vec<_>>()
        });
        write(out, by, columns, rows, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_written_as_text_and_everything_else_as_it_was() {
        for formula in ["=1+1", "=cmd|' /C calc'!A0", "+cmd|x", "-2+3+cmd|x", "@SUM(1)", "\t=1", "=H(\"x\")"]
        {
            assert_eq!(harmless(formula.to_owned()), format!("'{formula}"));
        }
        for cell in
            ["-3.5", "+1e-3", "-", "", "@", "@`", "-inf", "a=b", "a,\"b\"", "tongue-fit -v", "ɯ", "\"=1\""]
        {
            assert_eq!(harmless(cell.to_owned()), cell);
        }
    }
}
