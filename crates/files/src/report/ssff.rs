//! Tables over time as Simple Signal Files (`.ssff`) for the EMU system, and as storage files (`.sto`) for OpenSim.

use std::io::{self, Write};

use super::export::{Export, Provenance, joined};
use tongue_core::statistics::median;

/// A step between rows that is longer than this many usual steps is a hole, which has no values.
pub(super) const LONGEST_STEP: f64 = 2.5;
const MOST_RECORDS: usize = 1_000_000;

/// A table over time with a track for each column. The format has one rate, so that rows are interpolated linearly at the median step from
/// the first time on. It is described in the EMU manual, chapter "Simple Signal File Format": a header of text up to a line of dashes, then
/// binary numbers, record by record.
#[derive(Debug, Clone, PartialEq)]
pub struct Ssff(pub StoTable);

impl Export for Ssff {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let Self(StoTable { title, labels, rows }) = self;
        let steps = rows.windows(2).map(|pair| pair[1][0] - pair[0][0]).filter(|step| *step > 0.0);
        let start_s = rows.first().map_or(0.0, |row| row[0]);
        // Rounded, because differences of times have rounding errors.
        let rate_hz = (1e6 / median(steps).unwrap_or(1.0)).round().max(1.0) / 1e6;
        let step_s = 1.0 / rate_hz;
        let comment = title.replace(char::is_control, " ");
        write!(out, "SSFF -- (c) SHLRC\nMachine IBM-PC\nRecord_Freq {rate_hz}\nStart_Time {start_s}\n")?;
        for label in labels.iter().skip(1) {
            writeln!(out, "Column {} DOUBLE 1", label.replace(char::is_whitespace, "_"))?;
        }
        writeln!(out, "Original_Freq DOUBLE {rate_hz}\nComment CHAR {comment}")?;
        for (name, value) in by.entries() {
            writeln!(out, "tongue_fit_{name} CHAR {value}")?;
        }
        writeln!(out, "{}", "-".repeat(17))?;
        let records = rows.last().map_or(0, |row| ((row[0] - start_s) / step_s).round() as usize + 1);
        if records > MOST_RECORDS {
            let why = format!("{title}: its gaps are too long for a file of one rate; leave out ssff");
            return Err(io::Error::other(why));
        }
        for record in 0..records {
            let time_s = start_s + record as f64 * step_s;
            for value in interpolate(rows, time_s, LONGEST_STEP * step_s) {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }
}

/// The values of all columns but the time, at one time; NaN in a gap longer than `longest_s`.
fn interpolate(rows: &[Vec<f64>], time_s: f64, longest_s: f64) -> Vec<f64> {
    let after = rows.partition_point(|row| row[0] < time_s).min(rows.len() - 1);
    let (before, after) = (&rows[after.saturating_sub(1)], &rows[after]);
    let span_s = after[0] - before[0];
    let part = if span_s > 0.0 { ((time_s - before[0]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    Vec::from_iter(before.iter().zip(after).skip(1).map(|(a, b)| match part {
        1.0 => *b,
        0.0 => *a,
        _ if span_s > longest_s => f64::NAN,
        _ => a + (b - a) * part,
    }))
}

/// A table over time; its first column is `time`, s. The format is described in the OpenSim documentation, "Storage (.sto) Files": a name,
/// keys up to `endheader`, labels, numbers, separated by tabs.
#[derive(Debug, Clone, PartialEq)]
pub struct StoTable {
    pub title: String,
    pub labels: Vec<String>,
    pub rows: Vec<Vec<f64>>,
}

impl Export for StoTable {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        writeln!(out, "{}\nversion=1", self.title.replace(char::is_control, " "))?;
        for (name, value) in by.entries() {
            writeln!(out, "tongue_fit_{name}={value}")?;
        }
        let (rows, columns, labels) = (self.rows.len(), self.labels.len(), self.labels.join("\t"));
        writeln!(out, "nRows={rows}\nnColumns={columns}\ninDegrees=no\nendheader\n{labels}")?;
        for row in &self.rows {
            writeln!(out, "{}", joined(row, "\t"))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_lie_at_one_rate_and_gaps_have_no_values() {
        let rows = [[0.5, 1.0], [0.51, 2.0], [0.522, 4.0], [0.53, 3.0], [0.58, 8.0]].map(Vec::from);
        let labels = ["time", "GGa_tension"].map(String::from);
        let table = StoTable { title: "a\nword".into(), labels: labels.into(), rows: rows.into() };
        let mut bytes = Vec::new();
        Ssff(table).write(&mut bytes, &Provenance::new("a test")).unwrap();
        let dashes = b"-----------------\n";
        let end = bytes.windows(dashes.len()).position(|w| w == dashes).unwrap() + dashes.len();
        // The median of the steps is 11 ms.
        let (start_s, rate_hz) = (0.5, 90.909091);
        let begin = "SSFF -- (c) SHLRC\nMachine IBM-PC\nRecord_Freq 90.909091\nStart_Time 0.5\n\
                     Column GGa_tension DOUBLE 1\n";
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(header.starts_with(begin) && header.contains("\nComment CHAR a word\n"), "{header}");
        let values: Vec<f64> =
            bytes[end..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        let times: Vec<f64> = (0..values.len()).map(|i| start_s + i as f64 / rate_hz).collect();
        assert!((times.last().unwrap() - 0.58).abs() <= 0.5 / rate_hz, "{times:?}");
        assert_eq!(values[0], 1.0);
        for (t, value) in times.into_iter().zip(values) {
            // The times lie between the second and the third row, or in the gap after the fourth one.
            if (0.5101..0.5219).contains(&t) {
                assert!((value - (2.0 + 2.0 * (t - 0.51) / 0.012)).abs() < 1e-9);
            } else if (0.54..0.57).contains(&t) {
                assert!(value.is_nan());
            }
        }
    }
}
