//! A complete fit: searches from several starts, and the assessment of the best answer.

use nalgebra::SVector;

use tongue_core::body::largest_distance;
use tongue_core::parallel;
use tongue_core::statics::{self, FromRest, Trace};
use tongue_core::statistics::least_by;

use super::forward::Forward;
use super::identifiability::{self, Identifiability};
use super::problem::LeastSquaresProblem;
use super::projection::{ON_BOUND, ON_TARGET, nearest_to_others, onto_target};
use super::solution_curve::SolutionCurve;
use super::start::{SearchCounts, Start};
use super::{AT_BOUND, FitError, FitSettings, FitStatus, Method, gauss_newton, nelder_mead};

/// The answer solved again from rest along its load path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Replay {
    /// The solution, and how the tensions lead from rest to it.
    pub trace: Trace,
    /// Largest distance of a node from the search's shape, m.
    pub largest_difference: f64,
    /// Smallest ratio of a cell's area or volume to that at rest.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
}

/// The values of the unknowns with the best fit of the observations, and their assessment.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer<const D: usize> {
    pub status: FitStatus,
    /// The unknowns, in their units and order.
    pub x: Vec<f64>,
    /// Tensions of all muscles of the body, N (2D: per metre of thickness).
    pub tensions: Vec<f64>,
    /// Lengths of all muscles of the body, m.
    pub lengths: Vec<f64>,
    /// Root mean square residual of the observations.
    pub misfit: f64,
    /// Sums over all starts and the assessment of the answer.
    pub counts: SearchCounts,
    pub starts: Vec<Start>,
    pub identifiability: Option<Identifiability>,
    pub replay: Replay,
    pub positions: Vec<SVector<f64, D>>,
}

impl<const D: usize> Answer<D> {
    /// Whether the target is met by a shape on the branch from rest, without the barrier, at a regular equilibrium.
    pub fn is_trustworthy(&self) -> bool {
        let Trace { solution, from_rest, .. } = &self.replay.trace;
        self.status == FitStatus::Converged
            && solution.guarded == 0
            && *from_rest == FromRest::Branch
            && self.identifiability.is_some()
    }

    /// Number of directions in which the unknowns can change without a worse fit; `None` for a singular answer, or none.
    pub fn undetermined(&self) -> Option<usize> {
        self.identifiability.as_ref().map(|i| i.null_directions.len())
    }

    /// The curves of all values that fit as well, one for each direction that is undetermined.
    pub fn solution_curves(&self) -> impl Iterator<Item = &SolutionCurve> {
        self.identifiability.iter().flat_map(|i| &i.null_directions).filter_map(|n| n.curve.as_ref())
    }

    /// The curve of all values that fit as well, if exactly one direction is undetermined.
    pub fn solution_curve(&self) -> Option<&SolutionCurve> {
        self.solution_curves().next().filter(|_| self.undetermined() == Some(1))
    }
}

impl<const D: usize> LeastSquaresProblem<'_, D> {
    /// Searches for the best fit of the observations. The result is bitwise the same for any number of threads.
    ///
    /// # Errors
    /// [`FitError`] if the fit cannot begin; later failures are a [`FitStatus`].
    pub fn solve(&self, settings: &FitSettings) -> Result<Answer<D>, FitError> {
        settings.check()?;
        self.check()?;
        let numbers: Vec<_> = (0..settings.starts).collect();
        let searched = parallel::map(&numbers, |&number| {
            let mut forward = Forward::new(self, settings);
            let start = match settings.method {
                Method::NelderMead => nelder_mead::run(&mut forward, number)?,
                Method::GaussNewton => gauss_newton::run(&mut forward, number),
            };
            Ok::<_, FitError>((forward.kept_shape(&start.x), start))
        });
        let (shapes, starts): (Vec<_>, Vec<Start>) =
            searched.into_iter().collect::<Result<Vec<_>, FitError>>()?.into_iter().unzip();
        // The first of equally good starts is taken, so that the order in which they finish does not matter.
        let (best, shape) = least_by(starts.iter().zip(&shapes), |(start, _)| start.cost)
            .ok_or_else(|| FitError::Search("no start was made".into()))?;

        let mut forward = Forward::new(self, settings);
        if let Some(shape) = shape {
            forward.begin_at(&best.x, shape);
        }
        let mut x = snap_to_lower_bound(&mut forward, best);
        let (mut followed, mut converged) = (None, best.converged);
        if self.is_undetermined() && best.solved {
            (x, followed) = select_solution(&mut forward, &x);
        }
        for (x, unknown) in x.iter_mut().zip(&self.unknowns) {
            // Otherwise the tension of a slack muscle would be a rounding error.
            if unknown.is_tension() && *x < unknown.lower + ON_BOUND {
                *x = unknown.lower;
            }
        }
        let mut counts = SearchCounts::default();
        starts.iter().for_each(|s| counts += s.counts);
        let (mut trace, mut again) = forward.follow_load_path(&x);
        counts.factorisations += trace.factorisations;
        if !trace.same_by_newton {
            // The load path ends at another shape than Newton's method finds, so the search goes on among ends of load paths.
            let mut on_path = Forward::new(self, settings).on_load_path();
            if let Some(other) = search_on_load_path(&mut on_path, &starts, &x) {
                counts += std::mem::replace(&mut forward, on_path).counts;
                (x, converged) = other;
                followed = None;
                (trace, again) = forward.follow_load_path(&x);
                counts.factorisations += trace.factorisations;
            }
        }
        let residuals = forward.residuals(&x);
        let misfit = forward.misfit(residuals.as_ref());
        let largest_difference = match residuals {
            Some(_) => largest_distance(forward.positions(), again.positions()),
            None => f64::INFINITY,
        };
        let followed = followed.filter(|_| forward.is_expensive());
        let identifiability = identifiability::analyse(&mut forward, &x, followed);
        counts += forward.counts;

        let (min_area_ratio, max_area_ratio) = again.system().tissue_ratios(again.positions());
        let solution = trace.solution;
        let replay = Replay { trace, largest_difference, min_area_ratio, max_area_ratio };
        let status = if solution.status != statics::SolveStatus::Converged {
            FitStatus::NoEquilibrium
        } else if largest_difference > statics::SAME_SHAPE_M {
            FitStatus::ReplayDiffers
        } else if self.unknowns.iter().zip(&x).any(|(u, x)| *x > u.upper - AT_BOUND) {
            FitStatus::AtUpperBound
        } else if misfit > settings.misfit_tolerance {
            FitStatus::TargetNotMet
        } else if !converged {
            FitStatus::IterationLimit
        } else {
            FitStatus::Converged
        };
        Ok(Answer {
            status,
            tensions: self.tensions_of(&x),
            lengths: again.lengths(),
            misfit,
            counts,
            identifiability,
            replay,
            positions: again.positions().to_vec(),
            starts,
            x,
        })
    }
}

/// Moves unknowns that the search left very near their lower bounds onto them, unless that makes the fit worse.
fn snap_to_lower_bound<const D: usize>(forward: &mut Forward<'_, D>, best: &Start) -> Vec<f64> {
    let all = best.x.iter().zip(&forward.problem.unknowns);
    let snapped: Vec<f64> = all.map(|(x, u)| if *x < u.lower + AT_BOUND { u.lower } else { *x }).collect();
    let residuals = forward.residuals(&snapped);
    if forward.cost(&snapped, residuals.as_ref()) <= best.cost + f64::EPSILON {
        snapped
    } else {
        best.x.clone()
    }
}

/// Selects the answer among all that meet an undetermined target: `x` moved onto the target, and along it to the best fit of the other
/// measurements. Returns the solution curve too if there is exactly one.
pub(super) fn select_solution<const D: usize>(
    forward: &mut Forward<'_, D>,
    x: &[f64],
) -> (Vec<f64>, Option<SolutionCurve>) {
    let mut x = onto_target(forward, x);
    let residuals = forward.residuals(&x);
    if forward.misfit(residuals.as_ref()) > ON_TARGET {
        // The smallest corrections did not reach the target; a search without effort does if the target can be met.
        let mut without = Forward::new(forward.problem, forward.settings);
        without.effort = 0.0;
        if let Some((better, residuals, _)) = gauss_newton::refit(&mut without, &x)
            && without.misfit(Some(&residuals)) <= forward.settings.misfit_tolerance
        {
            x = onto_target(forward, &better);
        }
    }
    if forward.problem.others.is_empty() {
        return (x, None);
    }
    // The least-squares search begins at the best point of the curves, so that it ends in their lowest minimum.
    let open = identifiability::analyse(forward, &x, None).map(|i| i.null_directions);
    let mut curves: Vec<SolutionCurve> = open.into_iter().flatten().filter_map(|n| n.curve).collect();
    let points = curves.iter().flat_map(|v| &v.points);
    let begin = least_by(points, |p| p.other_rms.unwrap_or(f64::INFINITY));
    let x = nearest_to_others(forward, begin.map_or(&x, |p| &p.x));
    (x, if curves.len() == 1 { curves.pop() } else { None })
}

/// The best answer among ends of load paths, searched from all starts and from `x`, and whether its search converged; `None` if there
/// is none.
fn search_on_load_path<const D: usize>(
    on_path: &mut Forward<'_, D>,
    starts: &[Start],
    x: &[f64],
) -> Option<(Vec<f64>, bool)> {
    let ends = starts.iter().map(|s| s.x.as_slice()).chain([x]).filter_map(|from| {
        let (found, residuals, converged) = gauss_newton::refit(on_path, from)?;
        Some((on_path.cost(&found, Some(&residuals)), found, converged))
    });
    let (_, mut found, converged) = ends.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if on_path.problem.is_undetermined() {
        found = select_solution(on_path, &found).0;
    }
    Some((found, converged))
}
