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
