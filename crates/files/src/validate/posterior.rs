//! The posterior among the predictors: every muscle of every case is predicted from all others, as a distribution, and so it is by the
//! normal distribution of the other subjects, shrunk as is best inside the fold.
//!
//! The posterior takes each row alone, or a speaker's rows together, without and with a hyoid that tilts. As a control, rows of different
//! speakers are taken together: what helps there is not what a speaker's vowels have in common.

use serde::{Deserialize, Serialize};

use tongue_core::body::Body;
use tongue_core::parallel;
use tongue_core::statistics::{distinct, grouped};
use tongue_core::system::Model;
use tongue_infer::inverse::TargetOnBody;
use tongue_infer::posterior::{
    LeftOut, Measurements, MixtureComponent, PosteriorError, PosteriorModel, PosteriorProblem,
    PredictionMethod, Priors, left_out, predict_each_from_others,
};
use tongue_input::measured::{Dataset, Lengths, Vowel};

use super::cases::{Case, cases, permutations, subjects, with_muscle_order};
use super::scored::{
    GAUSSIAN, JOINT_TILT, Opponent, ROW, Scored, ScoredPrediction, all_scored, score, scored_predictions,
    verdict, warning,
};
use super::statistics::{best_shrunk, conditional_normal};

use super::ValidationPlan;
use crate::simulation::SimulationError;

/// Permutations of names take as long as the table itself each.
const MOST_PERMUTATIONS: u64 = 10;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScoredBaseline {
    pub baseline: Vowel,
    pub subjects: Vec<String>,
    /// Why the posterior is not reliable with this baseline; empty if it is.
    pub warning: String,
    /// Of no change, the normal distribution, the posterior of each row and that of a speaker's rows together.
    pub scores: Vec<Scored>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PosteriorStudy {
    pub poisson_ratio: f64,
    pub priors: Priors,
    pub scores: Vec<Scored>,
    /// Mean log score of the best posterior less that of the normal distribution, and the standard error of the difference over cases.
    pub log_score_gain: [f64; 2],
    pub other_baselines: Vec<ScoredBaseline>,
    #[serde(skip)]
    pub predictions: Vec<ScoredPrediction>,
    pub verdict: String,
    pub permuted_rms: Vec<f64>,
    pub permuted_log_score: Vec<f64>,
}

/// Rows that a posterior takes together, and whether its hyoid may tilt.
#[derive(Clone, Copy)]
struct PosteriorKind {
    name: &'static str,
    tilts: bool,
    groups: fn(&[Case]) -> Vec<Vec<usize>>,
}

const CONTROL: &str = "control_other_speakers";
const SINGLE_ROWS: PosteriorKind =
    PosteriorKind { name: ROW, tilts: false, groups: |all| (0..all.len()).map(|i| vec![i]).collect() };
const SPEAKERS: PosteriorKind = PosteriorKind { name: JOINT_TILT, tilts: true, groups: of_speakers };
const KINDS: [PosteriorKind; 4] = [
    SINGLE_ROWS,
    PosteriorKind { name: "posterior_joint", tilts: false, ..SPEAKERS },
    SPEAKERS,
    PosteriorKind { name: CONTROL, tilts: true, groups: of_other_speakers },
];

fn of_speakers(all: &[Case]) -> Vec<Vec<usize>> {
    grouped(0..all.len(), |&i| &all[i].target().subject)
}

/// The first row of one speaker, the second row of the next one, and so on, as if they were of one speaker.
fn of_other_speakers(all: &[Case]) -> Vec<Vec<usize>> {
    let speakers = of_speakers(all);
    let most = speakers.iter().map(Vec::len).max().unwrap_or(0);
    let group = |first| {
        let own = speakers.iter().enumerate();
        own.filter_map(|(speaker, own)| own.get((first + speaker) % most).copied()).collect()
    };
    (0..most).map(group).collect()
}

struct Predictors {
    /// The hyoid may tilt.
    posterior_model: PosteriorModel,
    without_tilt: PosteriorModel,
    seed: u64,
}

impl Predictors {
    /// Predicts every muscle of all cases, each from all others that are taken together with it.
    fn predict(&self, kind: PosteriorKind, all: &[Case]) -> Result<Opponent, PosteriorError> {
        let posterior_model = if kind.tilts { &self.posterior_model } else { &self.without_tilt };
        let groups = (kind.groups)(all);
        let predictions = parallel::map(&groups, |group| {
            let matched: Vec<&TargetOnBody> = group.iter().map(|&i| &all[i].matched).collect();
            let mut problem = PosteriorProblem::new(posterior_model, Measurements::of_vowels(&matched))?;
            let map_estimate = problem.map()?;
            let predicted = predict_each_from_others(&problem, &map_estimate)?;
            Ok(Vec::from_iter((0..group.len()).map(|posture| {
                let own = problem.measurements.of_posture(posture).into_iter().map(|i| predicted[i].clone());
                (group[posture], own.map(Some).collect::<Vec<_>>())
            })))
        });
        let predictions: Vec<Vec<_>> = predictions.into_iter().collect::<Result<_, PosteriorError>>()?;
        let mut predicted = vec![Vec::new(); all.len()];
        predictions.into_iter().flatten().for_each(|(case, own)| predicted[case] = own);
        Ok(Opponent { name: kind.name, predicted })
    }

    /// No change, the normal distribution, and these posteriors.
    fn opponents(&self, all: &[Case], kinds: &[PosteriorKind]) -> Result<Vec<Opponent>, PosteriorError> {
        let statistical = all.iter().map(|case| {
            let others: Vec<&Case> =
                all.iter().filter(|c| c.target().subject != case.target().subject).collect();
            statistical(&others, case, self.seed).into_iter().unzip()
        });
        let (no_change, gaussian) = statistical.unzip();
        let mut opponents = vec![
            Opponent { name: "no_change", predicted: no_change },
            Opponent { name: GAUSSIAN, predicted: gaussian },
        ];
        for kind in kinds {
            opponents.push(self.predict(*kind, all)?);
        }
        Ok(opponents)
    }
}

/// Predictions of every muscle of a case by no change and by the normal distribution of the others. "No change" has the spread of the
/// others' stretches about one.
fn statistical(others: &[&Case], case: &Case, seed: u64) -> Vec<(Option<LeftOut>, Option<LeftOut>)> {
    let how = best_shrunk(others);
    let squares = others.iter().flat_map(|c| c.target().values.iter().map(|v| (v - 1.0).powi(2)));
    let squares: Vec<f64> = squares.collect();
    let spread = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    let normal = |mean: f64, sd: f64, measured: f64| {
        let parts = vec![MixtureComponent { mean, weight: 1.0 }; 4000];
        left_out(&parts, sd, measured, (PredictionMethod::Together, parts.len() as f64), seed)
    };
    Vec::from_iter(case.each_left_out().enumerate().map(|(m, unseen)| {
        let measured = case.target().values[m];
        let gaussian =
            conditional_normal(others, &unseen, how).map(|e| normal(e[m].0, e[m].1.sqrt(), measured));
        ((spread > 0.0).then(|| normal(1.0, spread, measured)), gaussian)
    }))
}

/// Compares the posterior with the other predictors; `progress` gets the units of work done and the name of the part.
pub fn study(
    body: &Body<2>,
    model: &Model,
    data: &Dataset,
    plan: &ValidationPlan,
    progress: &dyn Fn(usize, &str),
) -> Result<PosteriorStudy, SimulationError> {
    let (baseline, seed) = (&plan.baseline, plan.seed);
    let priors = Priors::default();
    let mut fixed_tilt = priors.clone();
    fixed_tilt.hyoid_tilt.off = true;
    let posterior_model = PosteriorModel::new(body, model, &priors)?;
    let without_tilt = PosteriorModel::new(body, model, &fixed_tilt)?;
    let predictors = Predictors { posterior_model, without_tilt, seed };
    let all = cases(data, &body.mesh, baseline, Lengths::clone);
    let opponents = predictors.opponents(&all, &KINDS)?;
    progress(all.len(), "posterior");
    let scores = all_scored(&opponents, &all, |_| true);
    let mut predictions = scored_predictions(baseline, &opponents, &all);
    let log_score = |opponent: &Opponent| {
        scores.iter().find(|s| s.name == opponent.name).map_or(f64::NEG_INFINITY, |s| s.log_score)
    };
    let (gaussian, posteriors) = (&opponents[1], &opponents[2..]);
    let real = posteriors.iter().filter(|o| o.name != CONTROL);
    let best = real.max_by(|a, b| log_score(a).total_cmp(&log_score(b))).unwrap_or(&posteriors[0]);
    let both = best.predicted.iter().zip(&gaussian.predicted);
    let gains: Vec<f64> = both.map(|(best, normal)| mean_log_score(best) - mean_log_score(normal)).collect();
    let mean = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
    let spread = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>();
    let error = (spread / (gains.len().max(2) - 1) as f64 / gains.len().max(1) as f64).sqrt();
    let vowels: Vec<Vowel> = distinct(data.rows.iter().map(|row| row.lengths.vowel.clone()));
    let mut other_baselines = Vec::new();
    for vowel in vowels {
        let all = cases(data, &body.mesh, &vowel, Lengths::clone);
        if subjects(&all).len() < 2 || vowel == *baseline {
            continue;
        }
        let opponents = predictors.opponents(&all, &[SINGLE_ROWS, SPEAKERS])?;
        predictions.extend(scored_predictions(&vowel, &opponents, &all));
        progress(all.len(), "posterior with other baselines");
        for names in std::iter::once(subjects(&all)).chain(subjects(&all).into_iter().map(|s| vec![s])) {
            let scores = all_scored(&opponents, &all, |c| names.contains(&c.target().subject.as_str()));
            let warning = warning(&scores);
            let subjects = names.iter().map(|s| (*s).to_owned()).collect();
            other_baselines.push(ScoredBaseline { baseline: vowel.clone(), subjects, warning, scores });
        }
    }
    let (mut permuted_rms, mut permuted_log_score) = (Vec::new(), Vec::new());
    for order in permutations(data.muscles.len(), plan.permutations.min(MOST_PERMUTATIONS), seed) {
        let all = cases(data, &body.mesh, baseline, |lengths| with_muscle_order(lengths, &order));
        if let Ok(posterior) = predictors.predict(SINGLE_ROWS, &all) {
            let permuted = score(&posterior, &all, |_| true);
            permuted_rms.push(permuted.rms);
            permuted_log_score.push(permuted.log_score);
        }
        progress(1, "posterior with permuted names");
    }
    let log_score_gain = [mean, error];
    Ok(PosteriorStudy {
        poisson_ratio: predictors.posterior_model.model.poisson_ratio,
        priors: predictors.posterior_model.priors.clone(),
        verdict: verdict(&scores, log_score_gain),
        scores,
        log_score_gain,
        other_baselines,
        predictions,
        permuted_rms,
        permuted_log_score,
    })
}

fn mean_log_score(row: &[Option<LeftOut>]) -> f64 {
    let logs: Vec<f64> = row.iter().flatten().map(|p| p.log_score).collect();
    logs.iter().sum::<f64>() / logs.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_control_takes_each_row_once_and_never_two_rows_of_a_speaker() {
        let body = Body::tongue(8e-3).unwrap();
        // Three speakers have four vowels each; with /i/ as the baseline a fourth one has three.
        for (baseline, groups_of) in [("ɯ", 3), ("i", 4)] {
            let data = Dataset::reference().unwrap();
            let all = cases(&data, &body.mesh, &baseline.parse().unwrap(), Lengths::clone);
            let groups = of_other_speakers(&all);
            let mut taken: Vec<usize> = groups.concat();
            taken.sort_unstable();
            assert_eq!(taken, (0..all.len()).collect::<Vec<_>>());
            for group in &groups {
                let of_speakers = distinct(group.iter().map(|&i| all[i].target().subject.as_str())).len();
                let of_vowels = distinct(group.iter().map(|&i| all[i].target().vowel.clone())).len();
                assert_eq!(of_speakers, group.len());
                assert!((groups_of - 1..=groups_of).contains(&of_speakers) && of_vowels > 1, "{group:?}");
            }
        }
    }
}
