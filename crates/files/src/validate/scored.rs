//! Scores of predicted distributions, and a sentence about them.

use serde::Serialize;

use tongue_infer::posterior::{LeftOut, PredictionMethod};
use tongue_input::measured::Vowel;

use super::cases::Case;

pub const OPPONENTS: [&str; 6] = [
    "no_change",
    "gaussian",
    "posterior",
    "posterior_joint",
    "posterior_joint_tilt",
    "control_other_speakers",
];
pub const FIRST_POSTERIOR: usize = 2;
/// Index of the posterior of a speaker's rows with a hyoid that tilts.
pub(super) const JOINT_TILT: usize = 4;

/// The predictions of every muscle of a case by each opponent; `None` for opponents that were not asked.
pub type Predicted = Vec<Vec<Option<LeftOut>>>;

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Scored {
    pub name: String,
    pub rms: f64,
    pub crps: f64,
    pub log_score: f64,
    /// Part of the measured stretches inside the 50 % intervals.
    pub coverage_50: f64,
    pub coverage_95: f64,
    pub predictions: usize,
    /// Predictions with a run of their own, since too few draws of the common run counted for them.
    pub sampled: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoredPrediction {
    pub baseline: Vowel,
    pub subject: String,
    pub vowel: Vowel,
    pub muscle: String,
    pub measured: f64,
    pub opponent: String,
    pub mean: f64,
    /// Lower end of the middle 95 %.
    pub low_95: f64,
    pub high_95: f64,
    pub log_score: f64,
    pub effective: f64,
}

pub fn score(which: usize, all: &[Case], predicted: &[Predicted], is_in: impl Fn(&Case) -> bool) -> Scored {
    let rows = all.iter().zip(predicted).filter(|(case, _)| is_in(case));
    let each: Vec<(f64, &LeftOut)> = Vec::from_iter(rows.flat_map(|(case, row)| {
        row.iter().enumerate().filter_map(|(m, p)| Some((case.target().values[m], p[which].as_ref()?)))
    }));
    let mean =
        |of: &dyn Fn(&(f64, &LeftOut)) -> f64| each.iter().map(of).sum::<f64>() / each.len().max(1) as f64;
    Scored {
        name: OPPONENTS[which].to_owned(),
        rms: mean(&|(y, p)| (p.spread.mean - y).powi(2)).sqrt(),
        crps: mean(&|(_, p)| p.crps),
        log_score: mean(&|(_, p)| p.log_score),
        coverage_50: mean(&|(y, p)| f64::from(u8::from(p.spread.holds_in_half(*y)))),
        coverage_95: mean(&|(y, p)| f64::from(u8::from(p.spread.holds(*y)))),
        predictions: each.len(),
        sampled: each.iter().filter(|(_, p)| p.how == PredictionMethod::Sampled).count(),
    }
}

pub fn all_scored(all: &[Case], predicted: &[Predicted], is_in: impl Fn(&Case) -> bool) -> Vec<Scored> {
    let each = (0..OPPONENTS.len()).map(|which| score(which, all, predicted, &is_in));
    each.filter(|s| s.predictions > 0).collect()
}

pub fn scored_predictions(baseline: &Vowel, all: &[Case], predicted: &[Predicted]) -> Vec<ScoredPrediction> {
    let mut out = Vec::new();
    for (case, row) in all.iter().zip(predicted) {
        for (m, of_muscle) in row.iter().enumerate() {
            for (which, left_out) in of_muscle.iter().enumerate() {
                let Some(left_out) = left_out else { continue };
                out.push(ScoredPrediction {
                    baseline: baseline.clone(),
                    subject: case.subject.clone(),
                    vowel: case.vowel.clone(),
                    muscle: case.target().muscles[m].clone(),
                    measured: case.target().values[m],
                    opponent: OPPONENTS[which].to_owned(),
                    mean: left_out.spread.mean,
                    low_95: left_out.spread.interval_95[0],
                    high_95: left_out.spread.interval_95[1],
                    log_score: left_out.log_score,
                    effective: left_out.effective,
                });
            }
        }
    }
    out
}

/// Names the opponent with the highest log score, its gain on the normal distribution, and how the control compares with single rows.
pub fn verdict(scores: &[Scored], [gain, error]: [f64; 2]) -> String {
    let is_control = |s: &&Scored| s.name.starts_with("control");
    let all = scores.iter().filter(|s| !is_control(s));
    let Some(first) = all.max_by(|a, b| a.log_score.total_cmp(&b.log_score)) else { return String::new() };
    let control = scores.iter().find(is_control).map_or_else(String::new, |c| {
        let row = scores.iter().find(|s| s.name == OPPONENTS[FIRST_POSTERIOR]);
        let is_behind = row.is_some_and(|row| c.log_score < row.log_score && c.rms > row.rms);
        let word = if is_behind { "behind" } else { "not behind" };
        format!(
            "; the control with other speakers' vowels ({:.3}, {:.2}) is {word} single rows",
            c.rms, c.log_score
        )
    });
    format!(
        "Of all muscles left out, `{}` predicts best: RMS {:.3}, log score {:.2}, {:.0} % in its 95 % intervals; the best posterior is {gain:+.2} ± {error:.2} before the normal distribution of the other speakers in log score{control}.",
        first.name,
        first.rms,
        first.log_score,
        100.0 * first.coverage_95
    )
}

/// Why the best posterior is not reliable; empty if it is.
pub fn warning(scores: &[Scored]) -> String {
    let both = [1, JOINT_TILT].map(|n| scores.iter().find(|s| s.name == OPPONENTS[n]));
    let [Some(normal), Some(joint)] = both else { return String::new() };
    if joint.coverage_95 < 0.9 {
        format!("its 95 % intervals hold {:.0} %", 100.0 * joint.coverage_95)
    } else if joint.rms > normal.rms {
        "the normal distribution errs less".to_owned()
    } else {
        String::new()
    }
}
