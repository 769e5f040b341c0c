//! Other answers: where the other starts ended, and other choices of contracting muscles that meet the same target.

use crate::body::Mesh;
use crate::measured::Target;
use crate::muscle::{COUNT, Muscle, PerMuscle};
use crate::system::{Model, System};

use super::fit::inverse;
use super::forward::Forward;
use super::gauss_newton::refit;
use super::problem::Problem;
use super::uncertainty::rounding_range;
use super::{Fit, FitError, Settings, muscle_numbers};

/// Answers whose tensions all agree within this are one answer, N.
const SAME_ANSWER: f64 = 0.5;
/// Tension from which the search for another subset begins, N, beside the answer's own tensions.
const FROM: f64 = 5.0;

/// A local optimum that is not the answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// Tensions of the active muscles, N.
    pub tensions: Vec<f64>,
    /// Objective there; the answer's is smaller.
    pub cost: f64,
    /// How many of the starts ended there.
    pub starts: usize,
}

/// Where converged starts ended that did not end at the answer, best first.
pub fn optima<const D: usize>(fit: &Fit<D>) -> Vec<Optimum> {
    let answer: Vec<f64> = fit.target.active.iter().map(|m| fit.tensions[m.index()]).collect();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_ANSWER);
    let mut found: Vec<Optimum> = Vec::new();
    for start in fit.starts.iter().filter(|s| s.converged && !same(&s.x, &answer)) {
        match found.iter_mut().find(|o| same(&o.tensions, &start.x)) {
            Some(o) => o.starts += 1,
            None => {
                found.push(Optimum { tensions: start.x.clone(), cost: start.cost, starts: 1 });
            }
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}

/// Another choice of contracting muscles, fitted to the same equations.
#[derive(Debug, Clone, PartialEq)]
pub struct Subset {
    /// The contracting muscles.
    pub muscles: Vec<Muscle>,
    /// Their tensions, N.
    pub tensions: Vec<f64>,
    /// Root mean square residual of the values that the fit itself has to meet.
    pub misfit: f64,
    /// Root mean square residual of all muscles of the row.
    pub row_rms: f64,
    /// Whether every fitted value lies within what the rounding of the data allows.
    pub within_rounding: bool,
}

/// Fits every choice of contracting muscles that differs from the answer's in at most `changes` muscles (8 tries all 255) to
/// the values that the answer was fitted to. Ranked: those within rounding before the others; among them those with fewer
/// muscles first, then by the residual of the whole row; the others by misfit. Subsets in which a muscle ends without
/// tension are left out: a smaller one is listed that says the same.
///
/// # Errors
/// [`FitError`] when a system cannot be made.
pub fn subsets<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    fit: &Fit<D>,
    settings: &Settings,
    changes: u32,
) -> Result<Vec<Subset>, FitError> {
    let numbers = muscle_numbers(mesh)?;
    let bits = |muscles: &[Muscle]| muscles.iter().fold(0u32, |all, m| all | 1 << m.index());
    let own = bits(&fit.target.active);
    let mut found = Vec::new();
    for choice in (1u32..1 << COUNT).filter(|c| (1..=changes).contains(&(c ^ own).count_ones())) {
        let active: Vec<Muscle> = Muscle::ALL.into_iter().filter(|m| choice & 1 << m.index() != 0).collect();
        let target = Target { active, ..fit.target.clone() };
        if let Some(subset) = one(mesh, model, numbers, &target, fit, settings)?
            && subset.tensions.iter().all(|t| *t > super::AT_BOUND)
        {
            found.push(subset);
        }
    }
    found.sort_by(|a, b| {
        let group = b.within_rounding.cmp(&a.within_rounding);
        let inside = || a.muscles.len().cmp(&b.muscles.len()).then(a.row_rms.total_cmp(&b.row_rms));
        group.then_with(|| if a.within_rounding { inside() } else { a.misfit.total_cmp(&b.misfit) })
    });
    Ok(found)
}

fn one<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    numbers: PerMuscle<usize>,
    target: &Target,
    fit: &Fit<D>,
    settings: &Settings,
) -> Result<Option<Subset>, FitError> {
    let contracting: Vec<usize> = target.active.iter().map(|m| numbers[m.index()]).collect();
    let system = System::new(mesh, model, &contracting)?;
    let inverse = inverse(&system, numbers, target, settings);
    let mut forward = Forward::new(&inverse, settings);
    let near: Vec<f64> = target.active.iter().map(|m| fit.tensions[m.index()]).collect();
    let mut best: Option<(f64, Subset)> = None;
    for start in [near, vec![FROM; target.active.len()]] {
        let Some((tensions, residuals)) = refit(&mut forward, settings, &start) else { continue };
        let cost = forward.cost(&tensions, Some(&residuals));
        if best.as_ref().is_some_and(|(least, _)| *least <= cost) {
            continue;
        }
        let lengths = forward.lengths();
        let simulated = target.simulated(&numbers.map(|n| lengths[n]), &fit.rest_lengths);
        let within = |m: &Muscle| {
            let (low, high) = rounding_range(target, *m);
            (low..=high).contains(&simulated[m.index()])
        };
        let constrained: Vec<Muscle> =
            Muscle::ALL.into_iter().filter(|m| target.kind.constrains(*m)).collect();
        let squares: f64 =
            constrained.iter().map(|m| (simulated[m.index()] - target.values[m.index()]).powi(2)).sum();
        let subset = Subset {
            muscles: target.active.clone(),
            tensions,
            misfit: forward.misfit(Some(&residuals)),
            row_rms: (squares / constrained.len() as f64).sqrt(),
            within_rounding: target.fitted.iter().all(within),
        };
        best = Some((cost, subset));
    }
    Ok(best.map(|(_, subset)| subset))
}
