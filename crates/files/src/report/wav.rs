//! A voice as a WAV file with its provenance in the list of information.

use std::io::{self, Write};

use tongue_sound::voice;

use super::export::{Export, Provenance};

/// Samples between -1 and 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Wav {
    pub samples: Vec<f64>,
    pub rate_hz: u32,
}

impl Export for Wav {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let entries: Vec<String> = by.entries().map(|(name, value)| format!("{name}: {value}")).collect();
        out.write_all(&voice::wav(&self.samples, self.rate_hz, &entries.join("; ")))
    }
}
