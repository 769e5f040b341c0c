use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use tongue_fit::acoustics::{Articulation, Tract, VocalTract};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;

use super::inputs;

pub const FORMANTS: usize = 2;
/// A traced palate replaces the drawn one where the two are nearer to each other than this, mm.
const REACH_MM: f64 = 12.0;

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Sound")]
pub struct Arguments {
    /// Compute F1 and F2 of every frame: the built-in tract, placed by the mental spine and the hyoid, around the tongue
    #[arg(long, hide_short_help = true)]
    formants: bool,
    /// Tract (TOML) in the frame of the recordings instead of the built-in one
    #[arg(long, value_name = "FILE", requires = "formants", hide_short_help = true)]
    tract: Option<PathBuf>,
    /// Height of the opening between the lips in all frames, mm
    #[arg(long, value_name = "MM", requires = "formants", default_value_t = Articulation::default().lip_opening_mm, hide_short_help = true)]
    lip_opening: f64,
    /// Protrusion of the lips in all frames, mm
    #[arg(long, value_name = "MM", requires = "formants", default_value_t = 0.0, hide_short_help = true)]
    lip_protrusion: f64,
}

impl Arguments {
    /// The tract and the lips that the options give, checked; the tract is `None` for the built-in one, which is placed later. The result
    /// is `None` if no formants are wanted.
    pub fn read(&self) -> Result<Option<(Option<Tract>, Articulation)>> {
        if !self.formants {
            return Ok(None);
        }
        let given = self.tract.as_deref().map(inputs::tract).transpose()?;
        let lips = Articulation {
            lip_opening_mm: self.lip_opening,
            lip_protrusion_mm: self.lip_protrusion,
            ..Articulation::default()
        };
        let drawn = VocalTract::reference()?;
        given.as_ref().unwrap_or(&drawn).lip_sections(&lips)?;
        Ok(Some((given, lips)))
    }
}

/// The tract around a body, with the traced palate of the recordings.
pub fn tract_around(body: &Body<2>, own: Option<Tract>, palate: Option<&[Point]>) -> Result<Arc<VocalTract>> {
    let mut tract = own.map_or_else(|| VocalTract::reference_for(body), Ok)?;
    if let Some(palate) = palate {
        let palate: Vec<[f64; 2]> = palate.iter().map(|p| [1e3 * p.x, 1e3 * p.y]).collect();
        tract = tract.with_palate(&palate, REACH_MM);
    }
    Ok(Arc::new(VocalTract::round(body, tract)?))
}
