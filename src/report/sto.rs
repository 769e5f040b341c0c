//! Lengths and tensions over time as OpenSim's storage file (`.sto`), which OpenSim, its plotter and its Moco read.

use std::fmt::Write as _;

use crate::muscle::{Muscle, PerMuscle};

/// A row for each time, in SI units as everything in OpenSim: `time` (s), the eight lengths `GGa_length_m` .. and tensions
/// `GGa_tension_n_per_m` .. (per metre of thickness). Rows hold time (s), lengths (m) and tensions (N per metre of thickness).
///
/// The format is that of the OpenSim documentation, "Storage (.sto) Files": a name, keys up to `endheader`, labels, numbers,
/// separated by tabs.
pub fn sto(name: &str, rows: &[(f64, PerMuscle<f64>, PerMuscle<f64>)]) -> String {
    let labels = std::iter::once("time".to_owned())
        .chain(Muscle::ALL.map(|m| format!("{m}_length_m")))
        .chain(Muscle::ALL.map(|m| format!("{m}_tension_n_per_m")))
        .collect::<Vec<_>>();
    let name = name.replace(char::is_control, " ");
    let mut out = format!(
        "{name}\nversion=1\nnRows={}\nnColumns={}\ninDegrees=no\nendheader\n{}\n",
        rows.len(),
        labels.len(),
        labels.join("\t")
    );
    for (time, lengths, tensions) in rows {
        let _ = write!(out, "{time}");
        lengths.iter().chain(tensions).for_each(|value| {
            let _ = write!(out, "\t{value}");
        });
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_counts_what_follows() {
        let row = |time: f64| (time, [0.04; 8], [0.0, 12.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let text = sto("two\nlines", &[row(0.0), row(0.5)]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[..6],
            ["two lines", "version=1", "nRows=2", "nColumns=17", "inDegrees=no", "endheader"]
        );
        let labels: Vec<&str> = lines[6].split('\t').collect();
        assert_eq!(
            (labels.len(), labels[0], labels[1], labels[16]),
            (17, "time", "GGa_length_m", "HGp_tension_n_per_m")
        );
        let last: Vec<f64> = lines[8].split('\t').map(|v| v.parse().unwrap()).collect();
        assert_eq!((last.len(), last[0], last[1], last[10]), (17, 0.5, 0.04, 12.5));
        assert_eq!(lines.len(), 9);
    }
}
