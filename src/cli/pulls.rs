//! Options that say how hard each muscle pulls: tensions, or measured activity.

use std::path::PathBuf;

use miette::{IntoDiagnostic, WrapErr, miette};
use tongue_fit::body::Body;
use tongue_fit::files;
use tongue_fit::measured::Vowel;
use tongue_fit::measured::emg::Activity;
use tongue_fit::measured::muscles::Muscles;

use super::body;

/// Tensions of muscles in the plane.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
pub struct Arguments {
    /// Tension of a muscle, N per metre of thickness; may be given several times
    #[arg(long, value_name = "MUSCLE=N", allow_hyphen_values = true)]
    tension: Vec<String>,
    /// Relative muscle activity of a vowel, 0 to 1, instead of --tension: CSV with a column muscle, a column for each vowel and, if
    /// known, full_n_per_m, the tension of a muscle at activity 1
    #[arg(long, value_name = "FILE", conflicts_with = "tension", requires_all = ["vowel", "full"])]
    emg: Option<PathBuf>,
    /// Vowel of --emg
    #[arg(long, value_name = "V", requires = "emg")]
    vowel: Option<String>,
    /// Tension at activity 1 of muscles without a tension of their own in --emg, N per metre of thickness
    #[arg(long, value_name = "N", requires = "emg")]
    full: Option<f64>,
}

impl Arguments {
    /// Muscles of the body with their tensions, N per metre of thickness.
    pub fn tensions<const D: usize>(&self, body: &Body<D>) -> miette::Result<Vec<(usize, f64)>> {
        let (Some(file), Some(vowel), Some(full)) = (&self.emg, &self.vowel, self.full) else {
            return body::tensions(&self.tension, body);
        };
        if !(full.is_finite() && full >= 0.0) {
            return Err(miette!(
                "--full {full}: write a tension in N per metre that is not negative, like 30"
            ));
        }
        let vowel = Vowel::new(vowel).into_diagnostic().wrap_err("--vowel")?;
        let origin = file.display().to_string();
        let text = files::read_text(file).into_diagnostic().wrap_err_with(|| origin.clone())?;
        let activity = Activity::read(&text, &origin).into_diagnostic()?;
        activity.tensions(&vowel, full, &body.mesh.muscle_names(), &Muscles::built_in()).into_diagnostic()
    }
}
