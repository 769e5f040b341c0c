//! The curve of tensions that meet a target as well as the answer does, followed in both directions with step control.

use nalgebra::DVector;

use super::forward::Forward;
use super::problem::Unknown;
use super::projection::{ON_BOUND, correct, decompose, largest_step};

/// Longest step, and the first one unless load paths are followed, in units of the unknowns (N).
const LONGEST_STEP: f64 = 2.0;
/// Shortest step, which is the accuracy of the ends.
const SHORTEST_STEP: f64 = 0.01;
const MOST_STEPS: usize = 400;
const MOST_CORRECTIONS: usize = 6;
/// Tolerance of every point, as a part of the misfit tolerance; a point that misses as much as the answer is accepted too.
const PART_OF_TOLERANCE: f64 = 1e-3;
/// Relative change of a length for each unit of arc length above which the shape has jumped; at rest it is a hundredth per newton.
const JUMP_PER_UNIT: f64 = 0.05;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// An unknown is at its lower bound: a muscle is slack.
    Zero { unknown: usize },
    /// An unknown is at its upper bound; beyond it others may fit as well.
    UpperBound { unknown: usize },
    /// The equilibrium stops being stable at a fold.
    Fold,
    /// Tensions beyond this point lead from rest to a distant shape.
    Jump,
    /// No neighbouring point that meets the target was found.
    TargetLost,
    /// The curve has as many points as are followed at most.
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
    /// Points in order; each meets the target.
    pub points: Vec<CurvePoint>,
    pub answer: usize,
    /// Why the curve ends before the first point and after the last.
    pub ends: [Termination; 2],
}

impl SolutionCurve {
    /// The curve with `x` as its answer, in the order given by `direction`; `None` if `x` is not on it.
    pub(super) fn through<const D: usize>(
        mut self,
        forward: &mut Forward<'_, D>,
        x: &[f64],
        direction: &DVector<f64>,
    ) -> Option<Self> {
        let here = DVector::from_column_slice(x);
        let along = unknowns_at(self.points.last()?) - unknowns_at(self.points.first()?);
        if along.dot(direction) < 0.0 {
            self.points.reverse();
            self.ends.reverse();
        }
        let excess_length = |pair: &[CurvePoint]| {
            let (p, q) = (unknowns_at(&pair[0]), unknowns_at(&pair[1]));
            (&here - &p).norm() + (&here - &q).norm() - (&q - &p).norm()
        };
        let pairs = self.points.windows(2).map(excess_length).enumerate();
        let (before, excess) = pairs.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if excess > SHORTEST_STEP {
            return None;
        }
        let point = point(forward, x)?;
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

/// Follows the points that meet the target from `start` along `direction` and against it.
pub(super) fn follow<const D: usize>(
    forward: &mut Forward<'_, D>,
    start: &[f64],
    direction: &DVector<f64>,
) -> SolutionCurve {
    let (mut before, first_end) = trace_side(forward, start, &-direction);
    let (after, last_end) = trace_side(forward, start, direction);
    before.reverse();
    let answer = before.len();
    before.extend(point(forward, start));
    before.extend(after);
    SolutionCurve { points: before, answer, ends: [first_end, last_end] }
}

fn point<const D: usize>(forward: &mut Forward<'_, D>, x: &[f64]) -> Option<CurvePoint> {
    let residuals = forward.residuals(x)?;
    let others = forward.other_residuals();
    let other_rms = (!others.is_empty()).then(|| (others.norm_squared() / others.len() as f64).sqrt());
    Some(CurvePoint {
        x: x.to_vec(),
        lengths: forward.lengths(),
        misfit: forward.misfit(Some(&residuals)),
        other_rms,
    })
}

fn trace_side<const D: usize>(
    forward: &mut Forward<'_, D>,
    start: &[f64],
    direction: &DVector<f64>,
) -> (Vec<CurvePoint>, Termination) {
    let Some(first) = point(forward, start) else { return (Vec::new(), Termination::Fold) };
    let tolerance = (PART_OF_TOLERANCE * forward.settings.misfit_tolerance).max(first.misfit * 1.01);
    let mut tracer =
        CurveTracer { along: direction.clone(), points: vec![first], tolerance, on_load_path: false };
    let mut end = tracer.trace(forward, LONGEST_STEP);
    let at_limit =
        matches!(end, Termination::Zero { .. } | Termination::UpperBound { .. } | Termination::StepLimit);
    if !at_limit && !forward.is_on_load_path() {
        // Solved from neighbours or from rest at once, tensions can have another shape than at the end of their load path.
        let mut on_path = Forward::new(forward.problem, forward.settings).on_load_path();
        if on_path.residuals_without_neighbours(&tracer.last().x).is_some() {
            tracer.on_load_path = true;
            on_path.start_from_end_of_path();
            end = tracer.trace(&mut on_path, SHORTEST_STEP);
        }
        forward.counts += on_path.counts;
    }
    (tracer.points.split_off(1), end)
}

/// One side of a curve while it is followed.
struct CurveTracer {
    /// Unit vector along the curve at the last point.
    along: DVector<f64>,
    /// The start and the points found, at least one.
    points: Vec<CurvePoint>,
    tolerance: f64,
    /// Whether each step begins at the end of the last point's load path.
    on_load_path: bool,
}

impl CurveTracer {
    fn last(&self) -> &CurvePoint {
        &self.points[self.points.len() - 1]
    }

    /// Follows the curve until it ends; the first step has the length `length`.
    fn trace<const D: usize>(&mut self, forward: &mut Forward<'_, D>, mut length: f64) -> Termination {
        let unknowns = &forward.problem.unknowns;
        let mut why = Termination::TargetLost;
        while self.points.len() <= MOST_STEPS {
            let here = unknowns_at(self.last());
            let left = largest_step(&here, &self.along, unknowns);
            if left <= ON_BOUND {
                return at_bound(&here, &self.along, unknowns);
            }
            if length < SHORTEST_STEP {
                return why;
            }
            match self.step(forward, &here, left.min(length)) {
                Ok(()) => length = (1.5 * length).min(LONGEST_STEP),
                Err(end) => {
                    why = end;
                    length *= 0.5;
                }
            }
        }
        Termination::StepLimit
    }

    /// Takes a step of this length along the curve, or returns why there is none.
    fn step<const D: usize>(
        &mut self,
        forward: &mut Forward<'_, D>,
        here: &DVector<f64>,
        length: f64,
    ) -> Result<(), Termination> {
        let mut next = here + &self.along * length;
        let mut jacobian = None;
        for _ in 0..MOST_CORRECTIONS {
            jacobian = Some(correct(forward, &mut next).ok_or(Termination::Fold)?);
            // A correction from a shape beyond a jump could lead anywhere.
            if self.has_jumped(&forward.lengths(), length) {
                return Err(Termination::Jump);
            }
            let residuals = forward.residuals(next.as_slice());
            if forward.misfit(residuals.as_ref()) <= self.tolerance {
                break;
            }
        }
        let found = point(forward, next.as_slice()).ok_or(Termination::Fold)?;
        if self.has_jumped(&found.lengths, length) {
            return Err(Termination::Jump);
        }
        let (gained, moved) = ((&next - here).dot(&self.along), (&next - here).norm());
        if found.misfit > self.tolerance || gained < 0.5 * length || moved > 2.0 * length {
            return Err(Termination::TargetLost);
        }
        // Solved from rest, the point must meet the target as well.
        let residuals = forward.residuals_without_neighbours(next.as_slice());
        if forward.misfit(residuals.as_ref()) > 2.0 * self.tolerance + 1e-9 {
            return Err(Termination::Jump);
        }
        if self.on_load_path {
            forward.start_from_end_of_path();
        }
        let (_, directions) = decompose(&jacobian.ok_or(Termination::Fold)?).ok_or(Termination::Fold)?;
        let cosine = |d: &DVector<f64>| d.dot(&self.along);
        let on = directions.iter().max_by(|a, b| cosine(a).abs().total_cmp(&cosine(b).abs()));
        let on = on.ok_or(Termination::Fold)?;
        self.along = on * cosine(on).signum();
        self.points.push(found);
        Ok(())
    }

    /// Whether lengths at a distance of about `length` from the last point belong to another shape.
    fn has_jumped(&self, lengths: &[f64], length: f64) -> bool {
        lengths
            .iter()
            .zip(&self.last().lengths)
            .any(|(new, old)| (new - old).abs() > JUMP_PER_UNIT * length * old)
    }
}

/// The bound that ends the curve.
fn at_bound(here: &DVector<f64>, along: &DVector<f64>, unknowns: &[Unknown]) -> Termination {
    let low = (0..here.len()).find(|&i| along[i] < 0.0 && here[i] - unknowns[i].lower <= ON_BOUND);
    let high = (0..here.len()).find(|&i| along[i] > 0.0 && unknowns[i].upper - here[i] <= ON_BOUND);
    match (low, high) {
        (Some(unknown), _) => Termination::Zero { unknown },
        (None, Some(unknown)) => Termination::UpperBound { unknown },
        (None, None) => Termination::StepLimit,
    }
}
