//! One fit from beginning to end: searches from several starts, and what is to be said of the best answer.

use nalgebra::SVector;
use serde::Serialize;

use crate::parallel;
use crate::statics::{self, Solution};

use super::forward::{Forward, Inverse};
use super::identifiability::{self, Identifiability};
use super::problem::Problem;
use super::start::Start;
use super::{AT_BOUND, FitError, Method, Settings, Status, gauss_newton, nelder_mead};

/// A replay from rest must give the same lengths within this, m.
const SAME_LENGTH: f64 = 1e-8;

/// The answer solved once more from rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Replay {
    /// What the solver did.
    pub solution: Solution,
    /// Largest difference of a muscle's length to the search's, m.
    pub largest_difference: f64,
    /// Smallest ratio of a cell's area or volume to that at rest.
    pub min_area_ratio: f64,
    /// Largest such ratio.
    pub max_area_ratio: f64,
}

/// Values of the unknowns that meet the observations best, and all that is known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer<const D: usize> {
    /// How the fit ended.
    pub status: Status,
    /// The unknowns, in their units and order.
    pub x: Vec<f64>,
    /// Tensions of all muscles of the body, N (2D: per metre of thickness).
    pub tensions: Vec<f64>,
    /// Lengths of all muscles of the body, m.
    pub lengths: Vec<f64>,
    /// Root mean square residual of the observations.
    pub misfit: f64,
    /// Equilibria solved during the search.
    pub evaluations: usize,
    /// Where each start ended, in order.
    pub starts: Vec<Start>,
    /// What the data determine.
    pub identifiability: Option<Identifiability>,
    /// The answer solved once more from rest.
    pub replay: Replay,
    /// Positions of all nodes at the answer, m.
    pub positions: Vec<SVector<f64, D>>,
}

/// Searches the unknowns that meet the observations best. The same bits for any number of threads.
///
/// # Errors
/// [`FitError`] when it cannot begin; whatever happens later is a [`Status`].
pub fn solve<const D: usize>(inverse: &Inverse<'_, D>, settings: &Settings) -> Result<Answer<D>, FitError> {
    settings.check()?;
    inverse.check()?;
    let numbers: Vec<_> = (0..settings.starts).collect();
    let starts: Vec<Start> = parallel::map(&numbers, |&number| {
        let mut forward = Forward::new(inverse, settings);
        match settings.method {
            Method::NelderMead => nelder_mead::run(&mut forward, settings, number),
            Method::GaussNewton => Ok(gauss_newton::run(&mut forward, settings, number)),
        }
    })
    .into_iter()
    .collect::<Result<_, _>>()?;
    // The first of equals, whatever the order in which they finished.
    let best = starts
        .iter()
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or_else(|| FitError::Search("no start was made".into()))?;

    let mut forward = Forward::new(inverse, settings);
    let mut x = snap_to_lower_bound(&mut forward, best);
    if inverse.is_undetermined() && best.solved {
        x = identifiability::onto_target(&mut forward, &x);
    }
    let residuals = forward.residuals(&x);
    let misfit = forward.misfit(residuals.as_ref());
    // What the search found; where the answer was moved after it, what that came to from its neighbours.
    let moved = x != best.x;
    let found = if moved { residuals.map(|_| forward.lengths()) } else { None };
    let identifiability = identifiability::analyse(&mut forward, settings, &x);
    let evaluations = starts.iter().map(|s| s.evaluations).sum::<usize>() + forward.counts().evaluations;

    let again = forward.replay(&x);
    let lengths = again.lengths;
    let largest_difference = match found {
        Some(found) => found.iter().zip(&lengths).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
        // The search ends from rest too.
        None if !moved && best.solved => 0.0,
        None => f64::INFINITY,
    };
    let (min_area_ratio, max_area_ratio) = again.cell_ratios;
    let replay = Replay { solution: again.solution, largest_difference, min_area_ratio, max_area_ratio };
    let at_upper_bound = |(u, x): (&super::Unknown, &f64)| *x > u.upper - AT_BOUND;
    let status = if again.solution.status != statics::Status::Converged {
        Status::NoEquilibrium
    } else if largest_difference > SAME_LENGTH {
        Status::ReplayDiffers
    } else if inverse.unknowns.iter().zip(&x).any(at_upper_bound) {
        Status::AtUpperBound
    } else if misfit > settings.misfit_tolerance {
        Status::TargetNotMet
    } else if !best.converged {
        Status::IterationLimit
    } else {
        Status::Converged
    };
    Ok(Answer {
        status,
        tensions: forward.tensions_of(&x),
        lengths,
        misfit,
        evaluations,
        identifiability,
        replay,
        positions: again.positions,
        starts,
        x,
    })
}

/// Values that the search left within a hair of a lower bound are on it, unless the fit would be worse for it.
fn snap_to_lower_bound<const D: usize>(forward: &mut Forward<'_, D>, best: &Start) -> Vec<f64> {
    let near = |(x, u): (&f64, &super::Unknown)| if *x < u.lower + AT_BOUND { u.lower } else { *x };
    let snapped: Vec<f64> = best.x.iter().zip(forward.unknowns()).map(near).collect();
    let residuals = forward.residuals(&snapped);
    if forward.cost(&snapped, residuals.as_ref()) <= best.cost + f64::EPSILON {
        snapped
    } else {
        best.x.clone()
    }
}
