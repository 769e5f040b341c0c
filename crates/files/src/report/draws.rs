//! Draws of a posterior as a table for ArviZ: one row for each draw, with its chain and its number.

use std::io::{self, Write};

use super::export::{Export, Provenance};
use tongue_infer::posterior::Posterior;

/// Draws as CSV: `chain`, `draw`, a column for each number, then version and command. All chains have one
/// length, so they fill an array.
#[derive(Debug, Clone, Copy)]
pub struct Draws<'a>(pub &'a Posterior<'a>);

impl Export for Draws<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let muscles = &self.0.density.ground.muscles;
        let mut columns = vec!["chain".to_owned(), "draw".to_owned(), "log_density".to_owned()];
        for name in ["tension", "baseline_tension", "change"] {
            columns.extend(muscles.iter().map(|m| format!("{name}_{m}_n_per_m")));
        }
        columns.extend(["hyoid_x_mm", "hyoid_y_mm"].map(str::to_owned));
        columns.extend(muscles.iter().map(|m| format!("stretch_{m}")));
        let (names, values): (Vec<_>, Vec<_>) = by.entries().unzip();
        columns.extend(names.into_iter().map(str::to_owned));
        let mut writer = ::csv::Writer::from_writer(out);
        writer.write_record(&columns)?;
        for draw in &self.0.draws {
            for text in [draw.chain.to_string(), draw.number.to_string(), draw.log.to_string()] {
                writer.write_field(text)?;
            }
            let numbers = (0..muscles.len()).map(|m| draw.meaning.tensions[m]);
            let numbers = numbers.chain(draw.meaning.tones.iter().copied());
            let numbers = numbers.chain((0..muscles.len()).map(|m| draw.change(m)));
            let numbers = numbers.chain(draw.meaning.hyoid.iter().map(|d| 1e3 * d));
            for value in numbers.chain((0..muscles.len()).map(|m| draw.stretch(m))) {
                writer.write_field(value.to_string())?;
            }
            for value in &values {
                writer.write_field(value)?;
            }
            writer.write_record(None::<&[u8]>)?;
        }
        writer.flush()
    }
}
