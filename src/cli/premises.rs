//! Options of the baseline, and of the bones that a fit may displace.

use std::path::Path;

use miette::{IntoDiagnostic, miette};
use tongue_fit::body::{Body, HYOID};
use tongue_fit::inverse::{HyoidMotion, Said, Tone};
use tongue_fit::measured::{TargetKind, tone};

use super::choice::choice;
use super::output;

/// Premises of a fit.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Baseline and bones")]
pub struct Arguments {
    /// Tension of every muscle in the baseline, from which changes are counted: N per metre of thickness (0:
    /// the baseline is rest, as in the thesis), `table` (one for each muscle, fitted to the built-in lengths)
    /// or a CSV file of muscle,tone_n_per_m [default: 8 for fits of stretches, 0 for fits of ratios]
    #[arg(long, value_name = "N|table|FILE", allow_hyphen_values = true, hide_short_help = true)]
    tone: Option<String>,
    /// Whether the hyoid may be displaced in the vowel, near its place (5 mm): anywhere, forward and back, or
    /// not [default: free for fits of stretches, fixed for fits of ratios]
    #[arg(long, value_parser = choice::<HyoidMotion>(), hide_short_help = true)]
    hyoid: Option<HyoidMotion>,
    /// Another bone of the body that may be displaced in the same way, such as mental_spine; may be given
    /// several times
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    free_bone: Vec<String>,
}

impl Arguments {
    /// The choices for fits of these quantities; `thesis`: whether the thesis's assumptions are the default.
    pub fn said(&self, kinds: &[TargetKind], body: &Body<2>, thesis: bool) -> miette::Result<Said> {
        let tone = self.tone.as_deref().map(read_tone).transpose()?;
        let active = kinds.contains(&TargetKind::Stretch) && !thesis;
        let named = body.bones.iter().any(|b| b.name == HYOID);
        if active && self.hyoid.is_none() && !named && !body.bones.is_empty() {
            output::note("this body names no bone \"hyoid\": it stays where it is in every fit");
        }
        Ok(Said { thesis, tone, hyoid: self.hyoid, free_bones: self.free_bone.clone() })
    }
}

/// Parses the value of `--tone`.
fn read_tone(text: &str) -> miette::Result<Tone> {
    if let Ok(value) = text.trim().parse::<f64>() {
        return Ok(Tone::Uniform(value));
    }
    let table = match text {
        "table" => tone::reference(),
        path => {
            let read = tongue_fit::files::read_text(Path::new(path));
            let content = read.map_err(|e| {
                miette!("--tone {path}: neither a number nor `table`, nor a file that can be read ({e})")
            })?;
            tone::read(&content, path)
        }
    };
    table.map(Tone::ByMuscle).into_diagnostic()
}
