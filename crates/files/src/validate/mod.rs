//! Validation: predictions of muscles that were not fitted, compared with predictors without mechanics.
//!
//! The thesis's fit and the most probable points of the posterior's model see the muscles that are shorter than in the baseline and predict
//! the others. They are compared with no change, and with one constant that is learned from the other subjects (leave one subject out). The
//! error of a fit is the root mean square over its passive muscles, that of a predictor the root mean square over fits. Results are the
//! same to the last bit for any number of threads.

mod cases;
mod outputs;
mod posterior;
mod scored;
mod statistics;

use std::sync::atomic::{AtomicUsize, Ordering};

use tongue_core::body::{Body, HYOID};
use tongue_core::parallel;
use tongue_core::system::Model;
use tongue_infer::posterior::PosteriorError;
use tongue_input::measured::{Dataset, Lengths, Vowel};

use crate::report::ByMuscle;
use crate::simulation::SimulationError;
use cases::{Case, subjects};
use statistics::{bootstraps, constant, correlation, middle, root_mean};

pub use outputs::{Prediction, ScoredOpponent, ValidationStudy, files, opponents, page, scores};
pub use posterior::{PosteriorStudy, ScoredBaseline};
pub use scored::{Scored, ScoredPrediction};

const DRAWS: usize = 2000;

#[derive(Debug, Clone, PartialEq)]
pub struct ValidationPlan {
    pub baseline: Vowel,
    pub permutations: u64,
    pub seed: u64,
    /// Whether to validate the posterior, which takes longer than all other opponents together.
    pub posterior: bool,
}

/// What a predictor says: stretches of all muscles of every case, and how many numbers were tuned.
struct OpponentResult {
    name: &'static str,
    what: &'static str,
    tuned_parameters: usize,
    predicted: Vec<Vec<f64>>,
}

/// Runs the validation; `tell` gets the units of work done, their total, and the name of the current part.
pub fn run(
    data: &Dataset,
    body: &Body<2>,
    model: &Model,
    plan: &ValidationPlan,
    tell: &(dyn Fn(usize, usize, &str) + Sync),
) -> Result<ValidationStudy, SimulationError> {
    let (mesh, baseline) = (&body.mesh, &plan.baseline);
    let all = cases::cases(data, mesh, baseline, Lengths::clone);
    let names: Vec<String> = subjects(&all).into_iter().map(str::to_owned).collect();
    if names.len() < 2 {
        let [subjects, have] = if names.len() == 1 { ["1 subject", "has"] } else { ["0 subjects", "have"] };
        return Err(SimulationError::Refused(format!(
            "{subjects} of {} {have} a row for /{baseline}/ and another vowel with passive muscles; two or more are needed to predict one from \
             the others (--baseline names another vowel)",
            data.origin
        )));
    }
    if plan.posterior && body.bone(HYOID).is_empty() {
        let why =
            "this body names no bone \"hyoid\", which the posterior moves: name it, or leave --posterior out";
        return Err(SimulationError::Refused(why.to_owned()));
    }
    // At least as many units as the reports below count; the last report completes them.
    let total = all.len() + data.rows.len() * 8;
    let done = AtomicUsize::new(0);
    let progress = |units: usize, what: &str| {
        let done = done.fetch_add(units, Ordering::Relaxed) + units;
        tell(done.min(total), total, what);
    };

    let mut entries = statistical(&all);
    entries.push(OpponentResult {
        name: "thesis",
        what: "the thesis's model: the baseline is rest, bones are fixed",
        tuned_parameters: 0,
        predicted: parallel::map(&all, |case| cases::of_thesis(mesh, model, case)),
    });
    let posterior_model = cases::posterior_model(body, model, std::iter::empty())?;
    entries.push(OpponentResult {
        name: "most_probable",
        what: "the most probable point of the posterior's model: every muscle may pull, the baseline has tensions, the hyoid moves",
        tuned_parameters: 0,
        predicted: parallel::map(&all, |case| {
            let predicted = cases::most_probable(&posterior_model, case);
            progress(1, "most probable points");
            predicted
        }),
    });
    let passive = parallel::map(&all, |case| {
        let posterior_model = cases::posterior_model(body, model, case.passive())?;
        Ok::<_, PosteriorError>(cases::most_probable(&posterior_model, case))
    });
    entries.push(OpponentResult {
        name: "most_probable_passive",
        what: "the same, but muscles that are longer than in the baseline do not pull in the vowel, as in the thesis's model",
        tuned_parameters: 0,
        predicted: passive.into_iter().collect::<Result<_, _>>()?,
    });
    let posterior =
        plan.posterior.then(|| posterior::study(body, model, data, plan, &progress)).transpose()?;
    progress(total, "done");
    Ok(ValidationStudy {
        data: data.origin.clone(),
        baseline: baseline.clone(),
        poisson_ratio: model.poisson_ratio,
        subjects: names,
        fits: all.len(),
        seed: plan.seed,
        predictions: predictions(&all, &entries),
        opponents: summary(&all, &entries, plan.seed),
        posterior,
    })
}

fn statistical(all: &[Case]) -> Vec<OpponentResult> {
    let flat = |name, what, tuned_parameters, stretch: &dyn Fn(&Case) -> f64| OpponentResult {
        name,
        what,
        tuned_parameters,
        predicted: all.iter().map(|case| vec![stretch(case); case.target().muscles.len()]).collect(),
    };
    vec![
        flat("no_change", "no muscle changes its length", 0, &|_| 1.0),
        flat("constant", "the mean passive stretch of the other subjects", 1, &|case: &Case| {
            constant(all.iter().filter(|c| c.target().subject != case.target().subject))
        }),
    ]
}

fn summary(all: &[Case], entries: &[OpponentResult], seed: u64) -> Vec<ScoredOpponent> {
    let errors: Vec<Vec<f64>> = entries
        .iter()
        .map(|e| all.iter().zip(&e.predicted).map(|(case, predicted)| case.error(predicted)).collect())
        .collect();
    let draws = bootstraps(all.len(), DRAWS, seed);
    let drawn: Vec<Vec<f64>> = errors
        .iter()
        .map(|e| draws.iter().map(|d| root_mean(&d.iter().map(|&i| e[i]).collect::<Vec<_>>())).collect())
        .collect();
    let [none, constant] =
        ["no_change", "constant"].map(|name| entries.iter().position(|e| e.name == name).unwrap_or(0));
    Vec::from_iter(entries.iter().enumerate().map(|(i, e)| {
        let [low, high] = middle(drawn[i].clone());
        let better = drawn[i].iter().zip(&drawn[constant]).filter(|(a, b)| a < b).count();
        let pairs: Vec<(f64, f64)> = all
            .iter()
            .zip(&e.predicted)
            .flat_map(|(case, p)| case.unseen.iter().map(|&m| (p[m], case.target().values[m])))
            .collect();
        ScoredOpponent {
            name: e.name.to_owned(),
            what: e.what.to_owned(),
            tuned_parameters: e.tuned_parameters,
            rms: root_mean(&errors[i]),
            low,
            high,
            worse_than_no_change: errors[i].iter().zip(&errors[none]).filter(|(a, b)| a > b).count(),
            better_than_constant: better as f64 / DRAWS as f64,
            correlation: correlation(&pairs),
        }
    }))
}

fn predictions(all: &[Case], entries: &[OpponentResult]) -> Vec<Prediction> {
    let mut out = Vec::new();
    for (row, case) in all.iter().enumerate() {
        for &m in &case.unseen {
            let predicted = entries.iter().map(|e| (e.name.to_owned(), e.predicted[row][m])).collect();
            out.push(Prediction {
                subject: case.target().subject.clone(),
                vowel: case.target().vowel.clone(),
                muscle: case.target().muscles[m].clone(),
                measured: case.target().values[m],
                predicted: ByMuscle(predicted),
            });
        }
    }
    out
}
