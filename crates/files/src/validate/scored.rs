//! Scores of predicted distributions, and a sentence about them.

use serde::{Deserialize, Serialize};

use tongue_infer::posterior::{LeftOut, PredictionMethod};
use tongue_input::measured::Vowel;

use super::cases::Case;

/// Name of the opponent that predicts by the normal distribution of the other subjects' stretches.
pub const GAUSSIAN: &str = "gaussian";
/// Name of the opponent that predicts by the posterior of each row.
pub const ROW: &str = "posterior";
/// Name of the opponent that predicts by the posterior of a speaker's rows with a hyoid that tilts.
pub const JOINT_TILT: &str = "posterior_joint_tilt";

pub struct Opponent {
    pub name: &'static str,
    /// For every case the prediction of each muscle; `None` where there is none.
    pub predicted: Vec<Vec<Option<LeftOut>>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

pub fn score(opponent: &Opponent, all: &[Case], is_in: impl Fn(&Case) -> bool) -> Scored {
    let rows = all.iter().zip(&opponent.predicted).filter(|(case, _)| is_in(case));
    let each: Vec<(f64, &LeftOut)> = Vec::from_iter(rows.flat_map(|(case, row)| {
        case.target().values.iter().zip(row).filter_map(|(measured, p)| Some((*measured, p.as_ref()?)))
    }));
    let mean =
        |of: &dyn Fn(&(f64, &LeftOut)) -> f64| each.iter().map(of).sum::<f64>() / each.len().max(1) as f64;
    Scored {
        name: opponent.name.to_owned(),
        rms: mean(&|(y, p)| (p.spread.mean - y).powi(2)).sqrt(),
        crps: mean(&|(_, p)| p.crps),
        log_score: mean(&|(_, p)| p.log_score),
        coverage_50: mean(&|(y, p)| f64::from(u8::from(p.spread.holds_in_half(*y)))),
        coverage_95: mean(&|(y, p)| f64::from(u8::from(p.spread.holds(*y)))),
        predictions: each.len(),
        sampled: each.iter().filter(|(_, p)| p.how == PredictionMethod::Sampled).count(),
    }
}

pub fn all_scored(opponents: &[Opponent], all: &[Case], is_in: impl Fn(&Case) -> bool) -> Vec<Scored> {
    let each = opponents.iter().map(|opponent| score(opponent, all, &is_in));
    each.filter(|s| s.predictions > 0).collect()
}

pub fn scored_predictions(baseline: &Vowel, opponents: &[Opponent], all: &[Case]) -> Vec<ScoredPrediction> {
    let mut out = Vec::new();
    for (row, case) in all.iter().enumerate() {
        for m in 0..case.target().muscles.len() {
            for Opponent { name, predicted } in opponents {
                let Some(Some(left_out)) = predicted[row].get(m) else { continue };
                out.push(ScoredPrediction {
                    baseline: baseline.clone(),
                    subject: case.target().subject.clone(),
                    vowel: case.target().vowel.clone(),
                    muscle: case.target().muscles[m].clone(),
                    measured: case.target().values[m],
                    opponent: (*name).to_owned(),
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
        let row = scores.iter().find(|s| s.name == ROW);
        let is_worse = row.is_some_and(|row| c.log_score < row.log_score && c.rms > row.rms);
        let word = if is_worse { "worse" } else { "not worse" };
        format!(
            "; the control with other speakers' vowels ({:.3}, {:.2}) is {word} than single rows",
            c.rms, c.log_score
        )
    });
    format!(
        "Of all muscles left out, `{}` predicts best: RMS {:.3}, log score {:.2}, {:.0} % in its 95 % intervals; the best posterior exceeds the normal distribution of the other speakers by {gain:.2} ± {error:.2} in log score{control}.",
        first.name,
        first.rms,
        first.log_score,
        100.0 * first.coverage_95
    )
}

/// Why the best posterior is not reliable; empty if it is.
pub fn warning(scores: &[Scored]) -> String {
    let both = [GAUSSIAN, JOINT_TILT].map(|name| scores.iter().find(|s| s.name == name));
    let [Some(normal), Some(joint)] = both else { return String::new() };
    if joint.coverage_95 < 0.9 {
        format!("its 95 % intervals hold {:.0} %", 100.0 * joint.coverage_95)
    } else if joint.rms > normal.rms {
        "the normal distribution errs less".to_owned()
    } else {
        String::new()
    }
}
