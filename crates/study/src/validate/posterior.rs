//! Validation of the posterior: every muscle of every case is predicted from all others, as a distribution.
//! Priors and settings were fixed beforehand, so nothing is tuned. It is compared with the normal
//! distribution of the other subjects, whose shrinkage is chosen inside the fold.

use serde::Serialize;

use tongue_core::body::Body;
use tongue_core::parallel;
use tongue_core::system::Model;
use tongue_infer::posterior::{
    Density, Ground, How, LeftOut, Mode, Pairs, Part, PosteriorError, Priors, Seen, left_out, unseen,
};
use tongue_input::measured::{Dataset, Vowel};

use super::cases::{Case, cases, of_rows, subjects};
use super::robustness::{orders, renamed};
use super::statistics::{best_shrunk, expected};
use crate::StudyError;

use super::Progress;

/// Candidate standard deviations of the discrepancy of a stretch, for the marginal likelihood.
const DISCREPANCIES: [f64; 8] = [0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06];
/// Maximum number of permutations of names: each takes as long as the whole table.
const MOST_PERMUTATIONS: u64 = 10;

/// Scores of predicted distributions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Name of the opponent.
    pub name: String,
    /// Root mean square error of the means.
    pub rms: f64,
    /// Mean continuous ranked probability score.
    pub crps: f64,
    /// Mean logarithm of the density of what was measured.
    pub log_score: f64,
    /// Part of the measured stretches inside the 50 % intervals.
    pub coverage_50: f64,
    /// Part of them inside the 95 % intervals.
    pub coverage_95: f64,
    /// Number of predictions.
    pub predictions: usize,
    /// Predictions with draws of their own, because too few pairs of shared draws counted.
    pub sampled: usize,
}

/// Scores with another vowel as baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoredBaseline {
    /// The baseline.
    pub baseline: Vowel,
    /// The subjects.
    pub subjects: Vec<String>,
    /// Why the posterior is not reliable with this baseline; empty if there is no reason.
    pub warning: String,
    /// Scores of no change, the normal distribution and the posterior.
    pub scores: Vec<Scored>,
}

/// Marginal likelihood of the data with a discrepancy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Evidence {
    /// Standard deviation of the discrepancy of a stretch.
    pub sd: f64,
    /// Sum of the logarithms of the marginal densities of all cases.
    pub log_evidence: f64,
}

/// Validation of the posterior.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PosteriorStudy {
    /// Poisson's ratio of the body.
    pub poisson_ratio: f64,
    /// Priors of the posterior.
    pub priors: Priors,
    /// Scores of no change, the normal distribution and the posterior, with the usual baseline.
    pub scores: Vec<Scored>,
    /// Difference of the mean log scores of posterior and normal distribution, and its standard error over
    /// cases.
    pub log_score_gain: [f64; 2],
    /// Scores with other baselines, for all subjects together and for each.
    pub other_baselines: Vec<ScoredBaseline>,
    /// Root mean square errors with permuted names of muscles.
    pub permuted_rms: Vec<f64>,
    /// Mean log scores with permuted names of muscles.
    pub permuted_log_score: Vec<f64>,
    /// Marginal likelihood by discrepancy.
    pub discrepancy: Vec<Evidence>,
}

/// Predictions of every muscle of a case by no change, the normal distribution and the posterior.
type Predicted = Vec<[Option<LeftOut>; 3]>;

const NAMES: [&str; 3] = ["no_change", "gaussian", "posterior"];

struct Judge {
    ground: Ground,
    seed: u64,
}

impl Judge {
    /// Predicts every muscle of a case from all others.
    fn posterior(&self, case: &Case) -> Result<Vec<LeftOut>, PosteriorError> {
        let mut density = Density::new(&self.ground, Seen::of(&case.matched))?;
        let mode = Mode::find(&mut density)?;
        let positions: Vec<usize> = (0..density.seen.muscles.len()).collect();
        unseen(&density, &mode, &positions, self.seed)
    }

    fn all(&self, all: &[Case]) -> Result<Vec<Predicted>, PosteriorError> {
        let rows = parallel::map(all, |case| {
            let others: Vec<&Case> = all.iter().filter(|c| c.subject != case.subject).collect();
            let posterior = self.posterior(case)?;
            let usual = statistical(&others, case, self.seed);
            Ok(posterior.into_iter().zip(usual).map(|(p, [none, normal])| [none, normal, Some(p)]).collect())
        });
        rows.into_iter().collect()
    }
}

/// Predictions by no change and by the normal distribution of others, for every muscle of a case. The spread
/// of "no change" is that of the others' stretches.
fn statistical(others: &[&Case], case: &Case, seed: u64) -> Vec<[Option<LeftOut>; 2]> {
    let count = case.target().muscles.len();
    let each =
        |c: &Case| (0..c.target().muscles.len()).map(|m| Case { unseen: vec![m], ..c.clone() }).collect();
    let how = best_shrunk(others, each, |p| p);
    let squares = others.iter().flat_map(|c| c.target().values.iter().map(|v| (v - 1.0).powi(2)));
    let squares: Vec<f64> = squares.collect();
    let usual = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    let normal = |mean: f64, sd: f64, measured: f64| {
        let parts = vec![Part { mean, weight: 1.0 }; 4000];
        left_out(&parts, sd, measured, How::Weighed, seed)
    };
    let one = |m: usize| {
        let measured = case.target().values[m];
        let unseen = Case { unseen: vec![m], ..case.clone() };
        let gaussian = expected(others, &unseen, how).map(|e| normal(e[m].0, e[m].1.sqrt(), measured));
        [(usual > 0.0).then(|| normal(1.0, usual, measured)), gaussian]
    };
    (0..count).map(one).collect()
}

/// Scores of one of the three opponents over cases.
fn scored(which: usize, all: &[Case], predicted: &[Predicted], is_in: impl Fn(&Case) -> bool) -> Scored {
    let rows = all.iter().zip(predicted).filter(|(case, _)| is_in(case));
    let each: Vec<(f64, &LeftOut)> = rows
        .flat_map(|(case, row)| {
            row.iter().enumerate().filter_map(|(m, p)| Some((case.target().values[m], p[which].as_ref()?)))
        })
        .collect();
    let mean =
        |of: &dyn Fn(&(f64, &LeftOut)) -> f64| each.iter().map(of).sum::<f64>() / each.len().max(1) as f64;
    Scored {
        name: NAMES[which].to_owned(),
        rms: mean(&|(y, p)| (p.spread.mean - y).powi(2)).sqrt(),
        crps: mean(&|(_, p)| p.crps),
        log_score: mean(&|(_, p)| p.log_score),
        coverage_50: mean(&|(y, p)| f64::from(u8::from(p.spread.holds_in_half(*y)))),
        coverage_95: mean(&|(y, p)| f64::from(u8::from(p.spread.holds(*y)))),
        predictions: each.len(),
        sampled: each.iter().filter(|(_, p)| p.how == How::Sampled).count(),
    }
}

/// Validates the posterior.
///
/// # Errors
/// [`StudyError::Posterior`] if the posterior cannot be made.
pub fn study(
    body: &Body<2>,
    model: &Model,
    data: &Dataset,
    baseline: &Vowel,
    [permutations, seed]: [u64; 2],
    progress: &Progress<'_>,
) -> Result<PosteriorStudy, StudyError> {
    let ground = Ground::new(body, model, &Priors::default())?;
    let judge = Judge { ground, seed };
    let all = cases(data, &body.mesh, baseline);
    let predicted = judge.all(&all)?;
    progress.add(all.len(), "posterior");
    let of_case = |which: usize, row: &Predicted| -> f64 {
        let logs: Vec<f64> = row.iter().filter_map(|p| Some(p[which].as_ref()?.log_score)).collect();
        logs.iter().sum::<f64>() / logs.len().max(1) as f64
    };
    let gains: Vec<f64> = predicted.iter().map(|row| of_case(2, row) - of_case(1, row)).collect();
    let mean = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
    let spread = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>();
    let error = (spread / (gains.len().max(2) - 1) as f64 / gains.len().max(1) as f64).sqrt();
    let mut vowels: Vec<Vowel> = Vec::new();
    for row in data.rows() {
        if !vowels.contains(&row.lengths.vowel) {
            vowels.push(row.lengths.vowel.clone());
        }
    }
    let mut other_baselines = Vec::new();
    for vowel in vowels {
        let all = cases(data, &body.mesh, &vowel);
        if subjects(&all).len() < 2 {
            continue;
        }
        let predicted = judge.all(&all)?;
        progress.add(all.len(), "posterior with other baselines");
        for names in std::iter::once(subjects(&all)).chain(subjects(&all).into_iter().map(|s| vec![s])) {
            let is_in = |c: &Case| names.contains(&c.subject.as_str());
            let scores: Vec<Scored> = (0..3).map(|w| scored(w, &all, &predicted, is_in)).collect();
            let warning = match () {
                () if scores[2].coverage_95 < 0.9 => {
                    format!("its 95 % intervals hold {:.0} %", 100.0 * scores[2].coverage_95)
                }
                () if scores[2].rms > scores[1].rms => {
                    "the normal distribution has the smaller error".to_owned()
                }
                () => String::new(),
            };
            let subjects = names.iter().map(|s| (*s).to_owned()).collect();
            other_baselines.push(ScoredBaseline { baseline: vowel.clone(), subjects, warning, scores });
        }
    }
    let (mut permuted_rms, mut permuted_log_score) = (Vec::new(), Vec::new());
    for order in orders(data.muscles().len(), permutations.min(MOST_PERMUTATIONS), seed) {
        let all = of_rows(data, &body.mesh, baseline, |lengths| renamed(lengths, &order));
        let rows: Vec<_> = parallel::map(&all, |case| judge.posterior(case));
        let rows: Vec<Predicted> = rows
            .into_iter()
            .flatten()
            .map(|row| row.into_iter().map(|p| [None, None, Some(p)]).collect())
            .collect();
        if rows.len() == all.len() {
            let found = scored(2, &all, &rows, |_| true);
            permuted_rms.push(found.rms);
            permuted_log_score.push(found.log_score);
        }
        progress.add(1, "posterior with permuted names");
    }
    Ok(PosteriorStudy {
        poisson_ratio: judge.ground.model.constants.poisson_ratio,
        priors: judge.ground.priors.clone(),
        scores: (0..3).map(|which| scored(which, &all, &predicted, |_| true)).collect(),
        log_score_gain: [mean, error],
        other_baselines,
        permuted_rms,
        permuted_log_score,
        discrepancy: discrepancies(&judge, &all)?,
    })
}

/// The marginal likelihood of all cases for each discrepancy; the covariance of the geometry is computed for
/// each case.
fn discrepancies(judge: &Judge, all: &[Case]) -> Result<Vec<Evidence>, StudyError> {
    let ground = |sd: f64| -> Result<Ground, PosteriorError> {
        let mut priors = judge.ground.priors.clone();
        priors.discrepancy.sd = sd;
        Ground::new(&judge.ground.body, &judge.ground.model, &priors)
    };
    let grounds = DISCREPANCIES.into_iter().map(ground).collect::<Result<Vec<_>, _>>()?;
    let logs = parallel::map(all, |case| -> Result<Vec<f64>, PosteriorError> {
        let seen = Seen::of(&case.matched);
        let mut usual = Density::new(&judge.ground, seen.clone())?;
        let near = Mode::find(&mut usual)?;
        let (mut densities, mut modes) = (Vec::new(), Vec::new());
        for ground in &grounds {
            let mut density = Density::new(ground, seen.clone())?;
            modes.push(Mode::find_near(&mut density, &near)?);
            densities.push(density);
        }
        let pairs = Pairs::about(&usual, &modes, judge.seed)?;
        Ok(densities.iter().map(|density| pairs.evidence(density).0).collect())
    });
    let logs = logs.into_iter().collect::<Result<Vec<_>, _>>()?;
    let sum = |i: usize| logs.iter().map(|case| case[i]).sum();
    let each = DISCREPANCIES.into_iter().enumerate();
    Ok(each.map(|(i, sd)| Evidence { sd, log_evidence: sum(i) }).collect())
}
