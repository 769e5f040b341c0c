//! Tables over time as OpenSim's storage file (`.sto`), for OpenSim, its plotter and Moco.

use std::io::{self, Write};

use super::export::{Export, Provenance};

/// A table over time; its first column is `time`, s. The format is that of the OpenSim documentation, "Storage
/// (.sto) Files": a name, keys up to `endheader`, labels, numbers, separated by tabs.
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
        let (rows, columns) = (self.rows.len(), self.labels.len());
        writeln!(
            out,
            "nRows={rows}\nnColumns={columns}\ninDegrees=no\nendheader\n{}",
            self.labels.join("\t")
        )?;
        for row in &self.rows {
            let row: Vec<String> = row.iter().map(f64::to_string).collect();
            writeln!(out, "{}", row.join("\t"))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::History;

    #[test]
    fn the_header_counts_what_follows() {
        let row = |time: f64| (time, vec![0.04; 8], vec![0.0, 12.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let muscles = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"].map(String::from).to_vec();
        let history = History { muscles, rows: vec![row(0.0), row(0.5)] };
        let text = history.sto().text(&Provenance::new("two\nlines")).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines[1], lines[3]), ("version=1", "tongue_fit_command=two lines"));
        assert_eq!(lines[4..8], ["nRows=2", "nColumns=17", "inDegrees=no", "endheader"]);
        let labels: Vec<&str> = lines[8].split('\t').collect();
        assert_eq!(
            (labels.len(), labels[0], labels[1], labels[16]),
            (17, "time", "GGa_length_m", "HGp_tension_n_per_m")
        );
        let last: Vec<f64> = lines[10].split('\t').map(|v| v.parse().unwrap()).collect();
        assert_eq!((last.len(), last[0], last[1], last[10]), (17, 0.5, 0.04, 12.5));
        assert_eq!(lines.len(), 11);
    }
}
