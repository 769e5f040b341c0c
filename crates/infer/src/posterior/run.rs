//! Sampling of a posterior.

use serde::Serialize;

use super::PosteriorError;
use super::diagnostics::{Mixing, mixing, most_r_hat};
use super::hmc::{self, CHAINS, Whitened};
use super::map::MapEstimate;
use super::measurements::Measurements;
use super::model::PosteriorModel;
use super::parameters::Draw;
use super::problem::PosteriorProblem;
use super::surrogate::{ResidualLikelihood, Surrogate, SurrogateDensity};

/// Trajectories of each chain in each half of the warm-up: the least number, and a number for each parameter.
const WARM_UP: usize = 80;
const WARM_UP_EACH: usize = 2;
/// Numbers of tried ends for each kept draw, of one posture and of several together. The smallest effective sample size of 1000 draws is
/// then 559 to 820 for one posture and 547 to 640 for four. Chains that have not mixed run again, this many times longer.
const THIN: usize = 3;
const THIN_TOGETHER: usize = 4;
const LONGER: usize = 3;
/// The short run, which gives a verdict.
const SHORT: hmc::Settings = hmc::Settings { warm_up: 40, draws: 30, thin: 1, seed: 7 };
/// Required effective draws (Vehtari and others 2021).
const FEWEST_EFFECTIVE: f64 = 400.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    pub draws: usize,
    pub seed: u64,
}

impl Sampling {
    pub fn check(&self) -> Result<(), PosteriorError> {
        Ok(tongue_core::limits::POSTERIOR_DRAWS.check(self.draws as f64)?)
    }
}

/// Whether the draws can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    Mixed,
    /// The chains have not mixed, or there are too few draws to tell, so no interval can be trusted.
    NotMixed,
}

/// Smallest effective sample sizes of all sampled and reported quantities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effective {
    pub bulk: f64,
    pub tail: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplerDiagnostics {
    pub status: Status,
    /// Why the chains have not mixed; empty where they have.
    pub why: String,
    pub draws: usize,
    /// Largest rank-normalised split R-hat of all sampled and reported quantities, from the kept draws.
    pub r_hat: f64,
    pub ess: Effective,
    pub divergences: usize,
    /// Tried draws whose tensions do not lead from rest to a stable equilibrium, so that the density is zero.
    pub folds: usize,
    /// Part of the tried draws of the quadratic model that the density accepted.
    pub accepted: f64,
    pub equilibria: usize,
}

/// A sampled posterior.
#[derive(Debug)]
pub struct Posterior<'a> {
    pub problem: PosteriorProblem<'a>,
    pub map_estimate: MapEstimate,
    pub draws: Vec<Draw>,
    pub diagnostics: SamplerDiagnostics,
}

impl Posterior<'_> {
    pub fn is_mixed(&self) -> bool {
        self.diagnostics.status == Status::Mixed
    }
}

impl PosteriorModel {
    /// Draws from the posterior given these measurements.
    pub fn posterior(
        &self,
        measurements: Measurements,
        settings: &Sampling,
    ) -> Result<Posterior<'_>, PosteriorError> {
        PosteriorProblem::new(self, measurements)?.posterior(settings)
    }
}

impl<'a> PosteriorProblem<'a> {
    /// Draws from the posterior.
    pub fn posterior(mut self, settings: &Sampling) -> Result<Posterior<'a>, PosteriorError> {
        let map_estimate = self.map()?;
        self.posterior_about(map_estimate, settings)
    }

    /// [`Self::posterior`] about a mode that is known.
    pub(super) fn posterior_about(
        self,
        map_estimate: MapEstimate,
        settings: &Sampling,
    ) -> Result<Posterior<'a>, PosteriorError> {
        settings.check()?;
        let whitened = map_estimate.whitened().ok_or(PosteriorError::Covariance)?;
        let surrogate = Surrogate::refined(&self, &self, &whitened)?;
        let thin = if self.postures() > 1 { THIN_TOGETHER } else { THIN };
        let run = |thin| {
            let chains = chains(&self, &self, &surrogate, &whitened, settings, thin);
            (diagnosed(&self, &chains, thin), chains)
        };
        let (mut diagnostics, mut chains) = run(thin);
        if diagnostics.status == Status::NotMixed && diagnostics.draws as f64 > FEWEST_EFFECTIVE {
            (diagnostics, chains) = run(LONGER * thin);
        }
        Ok(Posterior { problem: self, map_estimate, draws: numbered(chains), diagnostics })
    }
}

/// Whether chains have mixed, with `thin` tried ends for each draw.
fn diagnosed(problem: &PosteriorProblem<'_>, chains: &[hmc::Chain<Draw>], thin: usize) -> SamplerDiagnostics {
    let count: usize = chains.iter().map(|c| c.draws.len()).sum();
    let by_quantity = if count == 0 { Vec::new() } else { judged(problem, chains) };
    let r_hat = by_quantity.iter().map(|m| m.r_hat).fold(1.0, f64::max);
    let [bulk, tail] = [|m: &Mixing| m.bulk, |m: &Mixing| m.tail]
        .map(|size| by_quantity.iter().map(size).fold(f64::INFINITY, f64::min));
    let divergences: usize = chains.iter().map(|c| c.divergences).sum();
    let fewest = bulk.min(tail);
    let most = most_r_hat(CHAINS, count / CHAINS, by_quantity.len().max(1));
    let why = if count == 0 {
        "no chain could begin".to_owned()
    } else if r_hat.is_nan() || r_hat >= most {
        format!("the chains differ (R-hat {r_hat:.4}, at most {most:.4}); ask for more draws")
    } else if fewest.is_nan() || fewest < FEWEST_EFFECTIVE {
        format!("there are {fewest:.0} effective draws, fewer than {FEWEST_EFFECTIVE}; ask for more")
    } else if divergences > thin * count / 100 {
        format!("{divergences} trajectories diverged; ask for more draws")
    } else {
        String::new()
    };
    SamplerDiagnostics {
        status: if why.is_empty() { Status::Mixed } else { Status::NotMixed },
        why,
        draws: count,
        r_hat,
        ess: Effective { bulk, tail },
        divergences,
        folds: chains.iter().map(|c| c.zero).sum(),
        accepted: chains.iter().map(|c| c.accepted).sum::<f64>() / chains.len() as f64,
        equilibria: (problem.postures() + 1) * chains.iter().map(|c| c.evaluations).sum::<usize>(),
    }
}

pub(super) fn chains(
    problem: &PosteriorProblem<'_>,
    errors: &dyn ResidualLikelihood,
    surrogate: &Surrogate<'_>,
    whitened: &Whitened,
    settings: &Sampling,
    thin: usize,
) -> Vec<hmc::Chain<Draw>> {
    let settings = hmc::Settings {
        warm_up: WARM_UP.max(WARM_UP_EACH * problem.parameters.len()),
        draws: settings.draws.div_ceil(CHAINS),
        thin,
        seed: settings.seed,
    };
    hmc::sample(|| SurrogateDensity::new(problem, errors, surrogate), whitened, &settings)
}

/// Draws of a short run about a mode: enough for probabilities to about 0.05, too few to tell whether the chains have mixed. `only` selects
/// one group of chains. None if the chains could not begin.
pub fn short_run(
    problem: &PosteriorProblem<'_>,
    map_estimate: &MapEstimate,
    only: Option<usize>,
) -> Result<Vec<Draw>, PosteriorError> {
    let whitened = map_estimate.whitened().ok_or(PosteriorError::Covariance)?;
    let surrogate = Surrogate::about(problem, &whitened)?;
    let target = || SurrogateDensity::new(problem, problem, &surrogate);
    Ok(numbered(hmc::sample_briefly(target, &whitened, &SHORT, only)))
}

pub(super) fn numbered(chains: Vec<hmc::Chain<Draw>>) -> Vec<Draw> {
    Vec::from_iter(chains.into_iter().enumerate().flat_map(|(chain, c)| {
        c.draws.into_iter().enumerate().map(move |(number, draw)| Draw { chain, number, ..draw })
    }))
}

/// Convergence diagnostics of every sampled or reported quantity.
fn judged(problem: &PosteriorProblem<'_>, chains: &[hmc::Chain<Draw>]) -> Vec<Mixing> {
    let of = |value: &dyn Fn(&Draw) -> f64| -> Mixing {
        mixing(&chains.iter().map(|c| c.draws.iter().map(value).collect()).collect::<Vec<Vec<f64>>>())
    };
    let muscles = 0..problem.posterior_model.muscles.len();
    let mut out: Vec<Mixing> = muscles.clone().map(|m| of(&|d| d.values.tones()[m])).collect();
    for posture in 0..problem.postures() {
        out.extend(muscles.clone().map(|m| of(&|d| d.tension(posture, m))));
        out.extend(muscles.clone().map(|m| of(&|d| d.change(posture, m))));
    }
    let moved = problem.postures() + usize::from(problem.moves_hyoid_in_baseline());
    for posture in 0..moved {
        out.extend((0..2).map(|axis| of(&|d| d.values.postures[posture].hyoid[axis])));
    }
    out.extend([of(&|d| d.values.tilt), of(&|d| d.log)]);
    out
}
