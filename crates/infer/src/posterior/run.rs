//! From measured stretches to draws.

use nalgebra::SVector;
use serde::Serialize;

use super::PosteriorError;
use super::branch::SAME_M;
use super::density::{Density, Meaning, Seen};
use super::diagnostics::{Mixing, mixing};
use super::evaluator::Evaluator;
use super::ground::Ground;
use super::hmc;
use super::map::Mode;

/// Chains, two groups of four.
const CHAINS: usize = 8;
/// Draws of each chain in each half of the warm-up.
const WARM_UP: usize = 60;
/// Of so many trajectories one is kept, so that nearly every draw counts; R-hat is told by all of them.
const THIN: usize = 4;
/// Fewest and most draws.
const FEWEST: usize = 100;
const MOST: usize = 1_000_000;
/// Rank-normalised R-hat below which chains have mixed, and the effective draws that this takes (Vehtari and others 2021).
const MOST_R_HAT: f64 = 1.01;
const FEWEST_EFFECTIVE: f64 = 400.0;

/// How much is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Draws that are kept.
    pub draws: usize,
    /// Seed.
    pub seed: u64,
}

impl Settings {
    /// Checks the number of draws.
    ///
    /// # Errors
    /// [`PosteriorError::Draws`].
    pub fn check(&self) -> Result<(), PosteriorError> {
        let possible = (FEWEST..=MOST).contains(&self.draws);
        if possible { Ok(()) } else { Err(PosteriorError::Draws(self.draws, FEWEST, MOST)) }
    }
}

/// Whether what was sampled can be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The chains have mixed.
    Mixed,
    /// They have not, or there are too few draws to tell: no interval is to be trusted.
    NotMixed,
}

/// A draw. Lists run over all muscles of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// Number of its chain.
    pub chain: usize,
    /// Its number in the chain.
    pub number: usize,
    /// Tensions and displacement of the hyoid.
    pub meaning: Meaning,
    /// Lengths in the vowel, m.
    pub lengths: Vec<f64>,
    /// Lengths in the baseline, m.
    pub baseline_lengths: Vec<f64>,
    /// Logarithm of its density, up to a constant.
    pub log: f64,
}

impl Draw {
    /// The stretch of a muscle of the body.
    pub fn stretch(&self, muscle: usize) -> f64 {
        self.lengths[muscle] / self.baseline_lengths[muscle]
    }

    /// By how much more a muscle pulls than in the baseline, N per metre of thickness.
    pub fn change(&self, muscle: usize) -> f64 {
        self.meaning.tensions[muscle] - self.meaning.tones[muscle]
    }
}

/// A posterior.
#[derive(Debug)]
pub struct Posterior<'a> {
    /// Its density, with the covariance of geometry at the mode.
    pub density: Density<'a>,
    /// The most probable point.
    pub mode: Mode,
    /// The draws, chain by chain.
    pub draws: Vec<Draw>,
    /// Whether to believe them.
    pub status: Status,
    /// Why not, in words; empty where they mixed.
    pub why: String,
    /// Of all that is told, the largest R-hat and the smallest effective sample sizes.
    pub mixing: Mixing,
    /// The same of every number that is sampled and of every change.
    pub by_quantity: Vec<(String, Mixing)>,
    /// Trajectories whose energy went wrong.
    pub divergences: usize,
    /// Trajectories that ended where there is no stable equilibrium.
    pub folds: usize,
    /// Trajectories that ended in a shape to which tensions do not lead from rest, and were refused.
    pub off_branch: usize,
    /// Mean probability of acceptance.
    pub acceptance: f64,
    /// Equilibria that were solved, two an evaluation.
    pub equilibria: usize,
}

impl Posterior<'_> {
    /// Positions of all nodes, m, of so many draws, evenly taken from all.
    pub fn shapes(&self, count: usize) -> Vec<Vec<SVector<f64, 2>>> {
        let step = self.draws.len().div_ceil(count.max(1)).max(1);
        let taken: Vec<&Draw> = self.draws.iter().step_by(step).collect();
        let start = Some(self.mode.place.posture.as_slice());
        let load = |i: usize| self.density.posture(&taken[i].meaning, start);
        let shapes = self.density.lanes().map(taken.len(), self.density.settings(), load, |i, shape| {
            let lengths = self.density.ground.system.lengths(&shape.positions);
            let same = lengths.iter().zip(&taken[i].lengths).all(|(a, b)| (a - b).abs() < SAME_M);
            same.then(|| shape.positions.clone())
        });
        shapes.into_iter().flatten().collect()
    }
}

/// Samples the posterior of what was seen in a body.
///
/// # Errors
/// [`PosteriorError`] where it cannot begin.
pub fn sample<'a>(
    ground: &'a Ground,
    seen: Seen,
    settings: &Settings,
) -> Result<Posterior<'a>, PosteriorError> {
    let mut density = Density::new(ground, seen)?;
    let mode = Mode::find(&mut density)?;
    sample_at(density, mode, settings)
}

/// The same where the mode is known.
///
/// # Errors
/// [`PosteriorError::Draws`].
pub fn sample_at<'a>(
    density: Density<'a>,
    mode: Mode,
    settings: &Settings,
) -> Result<Posterior<'a>, PosteriorError> {
    settings.check()?;
    let whitened = mode.whitened().ok_or(PosteriorError::Covariance)?;
    let draws_each = settings.draws.div_ceil(CHAINS) * THIN;
    let how =
        hmc::Settings { chains: CHAINS, warm_up: WARM_UP, draws: draws_each, thin: 1, seed: settings.seed };
    let chains = hmc::sample(|| Evaluator::new(&density), &whitened, &mode.place, &how);
    let n = density.ground.muscles.len();
    let meaning = |row: &[f64]| Meaning {
        tensions: row[..n].to_vec(),
        tones: row[n..2 * n].to_vec(),
        hyoid: SVector::from([row[2 * n], row[2 * n + 1]]),
    };
    let rows: Vec<(usize, usize, &Vec<f64>)> = chains
        .iter()
        .enumerate()
        .flat_map(|(chain, c)| {
            let kept = c.draws.iter().skip(THIN - 1).step_by(THIN).enumerate();
            kept.map(move |(number, row)| (chain, number, row))
        })
        .collect();
    let lengths = 2 * n + 2;
    let draw = |&(chain, number, row): &(usize, usize, &Vec<f64>)| Draw {
        chain,
        number,
        meaning: meaning(row),
        lengths: row[lengths..lengths + n].to_vec(),
        baseline_lengths: row[lengths + n..lengths + 2 * n].to_vec(),
        log: row[lengths + 2 * n],
    };
    let by_quantity = if rows.is_empty() { Vec::new() } else { judged(&density, &chains) };
    let worst = by_quantity.iter().fold(
        Mixing { r_hat: 1.0, bulk: f64::INFINITY, tail: f64::INFINITY },
        |worst, (_, m)| Mixing {
            r_hat: m.r_hat.max(worst.r_hat),
            bulk: m.bulk.min(worst.bulk),
            tail: m.tail.min(worst.tail),
        },
    );
    let divergences: usize = chains.iter().map(|c| c.divergences).sum();
    let fewest = worst.bulk.min(worst.tail);
    let why = match () {
        () if rows.is_empty() => "no chain could begin".to_owned(),
        () if worst.r_hat.is_nan() || worst.r_hat >= MOST_R_HAT => {
            format!("the chains differ (R-hat {:.4}, at most {MOST_R_HAT}); ask for more draws", worst.r_hat)
        }
        () if fewest.is_nan() || fewest < FEWEST_EFFECTIVE => {
            format!("there are {fewest:.0} effective draws, fewer than {FEWEST_EFFECTIVE}; ask for more")
        }
        () if divergences > THIN * rows.len() / 100 => format!("{divergences} trajectories diverged"),
        () => String::new(),
    };
    let draws = rows.iter().map(draw).collect();
    let all = (draws_each * CHAINS) as f64;
    Ok(Posterior {
        status: if why.is_empty() { Status::Mixed } else { Status::NotMixed },
        why,
        draws,
        mixing: worst,
        by_quantity,
        divergences,
        folds: chains.iter().map(|c| c.zero).sum(),
        off_branch: chains.iter().map(|c| c.refused).sum(),
        acceptance: chains.iter().map(|c| c.acceptance * c.draws.len() as f64).sum::<f64>() / all,
        equilibria: 2 * chains.iter().map(|c| c.evaluations).sum::<usize>(),
        density,
        mode,
    })
}

/// Whether everything that is sampled or told has mixed.
fn judged(density: &Density<'_>, chains: &[hmc::Chain]) -> Vec<(String, Mixing)> {
    let muscles = &density.ground.muscles;
    let n = muscles.len();
    let of = |value: &dyn Fn(&[f64]) -> f64| -> Mixing {
        let taken = |step: usize| -> Vec<Vec<f64>> {
            let each =
                |c: &hmc::Chain| c.draws.iter().skip(step - 1).step_by(step).map(|row| value(row)).collect();
            chains.iter().map(each).collect()
        };
        Mixing { r_hat: mixing(&taken(1)).r_hat, ..mixing(&taken(THIN)) }
    };
    let mut out = Vec::new();
    for (m, name) in muscles.iter().enumerate() {
        out.push((format!("F {name}"), of(&|row| row[m])));
        out.push((format!("F0 {name}"), of(&|row| row[n + m])));
        out.push((format!("F - F0 {name}"), of(&|row| row[m] - row[n + m])));
    }
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        out.push((format!("hyoid {name}"), of(&|row| row[2 * n + axis])));
    }
    out.push(("log density".to_owned(), of(&|row| row[4 * n + 2])));
    out
}
