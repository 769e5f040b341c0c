//! What a validation found, as it is written.

use serde::Serialize;

use super::posterior::PosteriorStudy;
use tongue_files::report::ByMuscle;
use tongue_input::measured::Vowel;

/// One way to predict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Opponent {
    /// Its name in tables and JSON.
    pub name: String,
    /// What it is.
    pub what: String,
    /// Numbers that are learned from other subjects.
    pub tuned_parameters: usize,
    /// Unknowns of each fit beside the tensions.
    pub unknowns_a_fit: usize,
    /// Root mean square error over fits.
    pub rms: f64,
    /// 95 % of bootstraps over fits: lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// In how many fits it is worse than "no change".
    pub worse_than_no_change: usize,
    /// Part of the bootstraps in which it is better than the constant.
    pub better_than_constant: f64,
    /// Pearson's correlation of predicted and measured stretches; null where the predictions do not vary.
    pub correlation: Option<f64>,
    /// What was chosen, for each subject that was left out.
    pub chosen: Vec<String>,
}

/// A passive muscle of a fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// The subject.
    pub subject: String,
    /// The vowel.
    pub vowel: Vowel,
    /// The muscle.
    pub muscle: String,
    /// Measured stretch.
    pub measured: f64,
    /// Predicted stretch by each opponent, by its name.
    #[serde(flatten)]
    pub predicted: ByMuscle<f64>,
}

/// An error by name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// The opponent.
    pub name: String,
    /// Root mean square error over fits.
    pub rms: f64,
}

/// Another vowel as baseline, with the model as it is by default.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherBaseline {
    /// The baseline.
    pub baseline: Vowel,
    /// The subjects.
    pub subjects: Vec<String>,
    /// Fits.
    pub fits: usize,
    /// One an opponent.
    pub scores: Vec<Score>,
}

/// Errors where a muscle was left out of the fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The opponent.
    pub name: String,
    /// Root mean square error over all muscles of all fits.
    pub rms: f64,
    /// How many.
    pub predictions: usize,
}

/// Errors where muscles bear each other's names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Permuted {
    /// Error with the true names.
    pub true_rms: f64,
    /// Lowest error with permuted ones.
    pub lowest: f64,
    /// Their mean.
    pub mean: f64,
    /// All of them.
    pub permuted_rms: Vec<f64>,
}

/// All that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// The table.
    pub data: String,
    /// The baseline.
    pub baseline: Vowel,
    /// Poisson's ratio of the body.
    pub poisson_ratio: f64,
    /// The subjects.
    pub subjects: Vec<String>,
    /// Fits.
    pub fits: usize,
    /// Seed.
    pub seed: u64,
    /// Every way to predict.
    pub opponents: Vec<Opponent>,
    /// Every passive muscle.
    pub predictions: Vec<Prediction>,
    /// Permuted names.
    pub permuted_labels: Permuted,
    /// Other baselines: all subjects together, then each.
    pub other_baselines: Vec<OtherBaseline>,
    /// Muscles left out.
    pub leave_one_muscle_out: Vec<LeftOut>,
    /// The posterior, every muscle predicted as a distribution from all others; null where it was not asked for and of bodies that
    /// have none.
    pub posterior: Option<PosteriorStudy>,
    /// A tone for each muscle, N per metre of thickness, fitted to all subjects: what `--tone` takes as a file.
    pub tone_by_muscle_n_per_m: ByMuscle<f64>,
}

impl Study {
    /// An opponent by its name.
    pub fn opponent(&self, name: &str) -> Option<&Opponent> {
        self.opponents.iter().find(|o| o.name == name)
    }
}
