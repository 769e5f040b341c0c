//! The curve of tensions that meet a target as well as the answer, followed in both directions with step control.

use nalgebra::DVector;

use super::FitSettings;
use super::forward::Forward;
use super::problem::Unknown;
use super::projection::{ON_BOUND, correct, decompose, room};

/// First and longest step, in units of the unknowns (N).
const STRIDE: f64 = 2.0;
/// Shortest step, which is the accuracy of an end.
const SHORTEST_STRIDE: f64 = 0.01;
/// Maximum number of steps to either side.
const MOST_STRIDES: usize = 400;
/// Maximum number of corrections that bring a step back onto the target.
const MOST_CORRECTIONS: usize = 6;
/// Tolerance of every point, as a part of the misfit tolerance; the misfit of the answer is accepted too.
const PART_OF_TOLERANCE: f64 = 1e-3;
/// Smallest relative change of a length per unit of arc length that counts as a jump; at rest the reference
/// tongue's muscles change by a hundredth per newton.
const JUMP_PER_UNIT: f64 = 0.05;

/// Why a curve ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// An unknown is at its lower bound: a muscle is slack.
    Zero {
        unknown: usize,
    },
    /// An unknown is at its upper bound; beyond it others may fit as well.
    UpperBound {
        unknown: usize,
    },
    /// The equilibrium stops being stable: a fold of the shapes.
    Fold,
    /// Beyond this point the tensions lead from rest to a distant shape.
    Jump,
    /// No neighbouring point that meets the target was found.
    TargetLost,
    StepLimit,
}

impl Termination {
    /// A description; `names` are those of the unknowns.
    pub fn text(&self, names: &[String]) -> String {
        let name = |unknown: &usize| names.get(*unknown).map_or("an unknown", String::as_str);
        match self {
            Self::Zero { unknown } => format!("{} is slack", name(unknown)),
            Self::UpperBound { unknown } => format!("{} is at the upper bound of the search", name(unknown)),
            Self::Fold => "the equilibrium stops being stable".to_owned(),
            Self::Jump => "tensions beyond lead from rest to a distant shape".to_owned(),
            Self::TargetLost => "no neighbouring tensions were found that meet the target".to_owned(),
            Self::StepLimit => "the limit of steps is reached".to_owned(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct CurvePoint {
    /// The unknowns: tensions of the active muscles, N.
    pub x: Vec<f64>,
    /// Lengths of all muscles of the body, m.
    pub lengths: Vec<f64>,
    pub misfit: f64,
    /// Root mean square residual of the other measurements, if there are any.
    pub other_rms: Option<f64>,
}

/// A curve through the answer, from one end to the other.
#[derive(Debug, Clone, PartialEq)]
pub struct SolutionCurve {
    /// Its points, in order; each meets the target.
    pub points: Vec<CurvePoint>,
    pub answer: usize,
    /// Why it ends before the first point and after the last.
    pub ends: [Termination; 2],
}

impl SolutionCurve {
    /// The same curve with `x` as its answer, in the order given by `direction`; `None` if `x` is not on it.
    pub(super) fn through<const D: usize>(
        mut self,
        problem: &mut Forward<'_, D>,
        x: &[f64],
        direction: &DVector<f64>,
    ) -> Option<Self> {
        let here = DVector::from_column_slice(x);
        let along = unknowns_at(self.points.last()?) - unknowns_at(self.points.first()?);
        if along.dot(direction) < 0.0 {
            self.points.reverse();
            self.ends.reverse();
        }
        let detour = |pair: &[CurvePoint]| {
            let (p, q) = (unknowns_at(&pair[0]), unknowns_at(&pair[1]));
            (&here - &p).norm() + (&here - &q).norm() - (&q - &p).norm()
        };
        let pairs = self.points.windows(2).map(detour).enumerate();
        let (before, detour) = pairs.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if detour > SHORTEST_STRIDE {
            return None;
        }
        let point = point(problem, x)?;
        match self.points.iter().position(|p| (unknowns_at(p) - &here).norm() < ON_BOUND) {
            Some(same) => (self.answer, self.points[same]) = (same, point),
            None => {
                self.answer = before + 1;
                self.points.insert(before + 1, point);
            }
        }
        Some(self)
    }
}

fn unknowns_at(p: &CurvePoint) -> DVector<f64> {
    DVector::from_column_slice(&p.x)
}

/// Follows the points that meet the target from `start` in both directions of `direction`.
pub(super) fn follow<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    start: &[f64],
    direction: &DVector<f64>,
) -> SolutionCurve {
    let (mut before, first_end) = one_way(problem, settings, start, &-direction);
    let (after, last_end) = one_way(problem, settings, start, direction);
    before.reverse();
    let answer = before.len();
    before.extend(point(problem, start));
    before.extend(after);
    SolutionCurve { points: before, answer, ends: [first_end, last_end] }
}

fn point<const D: usize>(problem: &mut Forward<'_, D>, x: &[f64]) -> Option<CurvePoint> {
    let residuals = problem.residuals(x)?;
    let others = problem.other_residuals();
    let other_rms = (!others.is_empty()).then(|| (others.norm_squared() / others.len() as f64).sqrt());
    Some(CurvePoint {
        x: x.to_vec(),
        lengths: problem.lengths(),
        misfit: problem.misfit(Some(&residuals)),
        other_rms,
    })
}

fn one_way<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    start: &[f64],
    direction: &DVector<f64>,
) -> (Vec<CurvePoint>, Termination) {
    let Some(first) = point(problem, start) else { return (Vec::new(), Termination::Fold) };
    let tolerance = (PART_OF_TOLERANCE * settings.misfit_tolerance).max(first.misfit * 1.01);
    let mut way = CurveTracer { along: direction.clone(), points: vec![first], tolerance, moves_on: false };
    let mut end = way.go_on(problem, STRIDE);
    if !matches!(end, Termination::Zero { .. } | Termination::UpperBound { .. } | Termination::StepLimit) {
        // Solved from the best neighbours or directly, tensions can lead to another shape than as they grow
        // together from rest, so that the curve would end too early.
        if !problem.is_on_load_path() {
            let mut on_path = Forward::new(problem.inverse, settings).on_load_path();
            if on_path.residuals_without_neighbours(&way.last().x).is_some() {
                way.moves_on = true;
                on_path.start_from_end_of_path();
                end = way.go_on(&mut on_path, SHORTEST_STRIDE);
            }
            problem.counts += on_path.counts;
        }
    }
    (way.points.split_off(1), end)
}

/// One side of a curve during the search.
struct CurveTracer {
    /// Unit vector along the curve at the last point.
    along: DVector<f64>,
    /// The start and the points that were found, at least one.
    points: Vec<CurvePoint>,
    tolerance: f64,
    /// Whether each step begins at the end of the last point's load path.
    moves_on: bool,
}

impl CurveTracer {
    fn last(&self) -> &CurvePoint {
        &self.points[self.points.len() - 1]
    }

    /// Follows the curve until it ends or cannot be followed; the first step has the length `stride`.
    fn go_on<const D: usize>(&mut self, problem: &mut Forward<'_, D>, mut stride: f64) -> Termination {
        let unknowns = &problem.inverse.unknowns;
        let mut why = Termination::TargetLost;
        while self.points.len() <= MOST_STRIDES {
            let here = unknowns_at(self.last());
            let left = room(&here, &self.along, unknowns);
            if left <= ON_BOUND {
                return at_bound(&here, &self.along, unknowns);
            }
            if stride < SHORTEST_STRIDE {
                return why;
            }
            match self.step(problem, &here, left.min(stride)) {
                Ok(()) => stride = (1.5 * stride).min(STRIDE),
                Err(end) => {
                    why = end;
                    stride *= 0.5;
                }
            }
        }
        Termination::StepLimit
    }

    /// Takes a step along the curve from the last point, or returns why there is none.
    fn step<const D: usize>(
        &mut self,
        problem: &mut Forward<'_, D>,
        here: &DVector<f64>,
        length: f64,
    ) -> Result<(), Termination> {
        let mut next = here + &self.along * length;
        let mut jacobian = None;
        for _ in 0..MOST_CORRECTIONS {
            jacobian = Some(correct(problem, &mut next).ok_or(Termination::Fold)?);
            // A correction from beyond a jump could lead to any shape.
            if self.has_jumped(&problem.lengths(), length) {
                return Err(Termination::Jump);
            }
            let residuals = problem.residuals(next.as_slice());
            if problem.misfit(residuals.as_ref()) <= self.tolerance {
                break;
            }
        }
        let found = point(problem, next.as_slice()).ok_or(Termination::Fold)?;
        if self.has_jumped(&found.lengths, length) {
            return Err(Termination::Jump);
        }
        let (gained, moved) = ((&next - here).dot(&self.along), (&next - here).norm());
        if found.misfit > self.tolerance || gained < 0.5 * length || moved > 2.0 * length {
            return Err(Termination::TargetLost);
        }
        // Newton's method from rest, or the load path, must lead to a point as good.
        let from_rest = problem.residuals_without_neighbours(next.as_slice());
        if problem.misfit(from_rest.as_ref()) > 2.0 * self.tolerance + 1e-9 {
            return Err(Termination::Jump);
        }
        if self.moves_on {
            problem.start_from_end_of_path();
        }
        let (_, directions) = decompose(&jacobian.ok_or(Termination::Fold)?).ok_or(Termination::Fold)?;
        let alike = |d: &DVector<f64>| d.dot(&self.along);
        let on = directions.iter().max_by(|a, b| alike(a).abs().total_cmp(&alike(b).abs()));
        let on = on.ok_or(Termination::Fold)?;
        self.along = on * alike(on).signum();
        self.points.push(found);
        Ok(())
    }

    /// Whether these lengths, of a point at a distance of about `length`, belong to another shape than the last ones.
    fn has_jumped(&self, lengths: &[f64], length: f64) -> bool {
        lengths
            .iter()
            .zip(&self.last().lengths)
            .any(|(new, old)| (new - old).abs() > JUMP_PER_UNIT * length * old)
    }
}

/// The bound that stops the curve.
fn at_bound(here: &DVector<f64>, along: &DVector<f64>, unknowns: &[Unknown]) -> Termination {
    let low = (0..here.len()).find(|&i| along[i] < 0.0 && here[i] - unknowns[i].lower <= ON_BOUND);
    let high = (0..here.len()).find(|&i| along[i] > 0.0 && unknowns[i].upper - here[i] <= ON_BOUND);
    match (low, high) {
        (Some(unknown), _) => Termination::Zero { unknown },
        (None, Some(unknown)) => Termination::UpperBound { unknown },
        (None, None) => Termination::StepLimit,
    }
}
