//! Pages of Markdown.

use std::io::{self, Write};

use super::export::{Export, Provenance};

#[derive(Debug, Clone)]
pub struct Markdown(pub String);

impl Export for Markdown {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        writeln!(out, "{}\n\n<sub>tongue-fit {}: `{}`</sub>", self.0.trim_end(), by.version, by.command)
    }
}
