//! The search for the most probable states of all frames: the Gauss-Newton method with a separate damping for every frame (Levenberg
//! 1944, Marquardt 1963). A frame that responds nonlinearly takes a part of its step or none; this does not shorten the steps of other
//! frames.

use nalgebra::DVector;

use tongue_core::geometry::Point;
use tongue_core::parallel;

use super::consider::by_shape;
use super::frame::Solver;
use super::mode::{CHUNK, Course, Eliminated, Here, Mode};
use super::shape::RestShape;

/// A round is quiet if it changes the cost by less than this part. The search ends after a quiet round in which no frame was held back, and
/// after two quiet rounds in any case.
const WON: f64 = 5e-4;
/// In recordings with more frames than this, a few frames may be held back in a quiet round; some always are.
const MANY_FRAMES: usize = 150;
/// Parts of the step that a frame tries.
const PARTS: [f64; 3] = [1.0, 0.4, 0.1];
/// A frame's step is too long if its cost exceeds both the previous and the expected cost by this factor plus this amount.
const TOO_FAR: (f64, f64) = (1.1, 1.0);
/// Damping: in the first round, at least for a frame that was held back, and the value from which on a frame stays where it is; in units
/// of the precision of a course.
const DAMPING: (f64, f64, f64) = (0.3, 0.3, 1e4);

/// A frame after a step.
struct Tried {
    here: Here,
    cost: f64,
    damping: f64,
}

/// A step of the states of a recording.
pub(super) struct Step {
    states: Vec<DVector<f64>>,
    /// The cost of each frame if it responded linearly.
    expected: Vec<f64>,
}

/// Minimises the cost in at most this number of rounds and returns the cost at the end; `progress` is called with the number of every
/// round.
pub(super) fn descend(
    mode: &mut Mode<'_, '_>,
    courses: &mut [Course],
    rounds: usize,
    progress: &dyn Fn(usize),
) -> f64 {
    for course in courses.iter_mut() {
        course.here = begun(mode, course);
    }
    let mut damping: Vec<Vec<f64>> = courses.iter().map(|c| vec![DAMPING.0; c.frames.len()]).collect();
    let frames: usize = courses.iter().map(|c| c.frames.len()).sum();
    let won = WON * (frames as f64 / MANY_FRAMES as f64).clamp(1.0, 4.0);
    let mut quiet = 0;
    for round in 0..rounds {
        let Some((step, steps)) = stepped(mode, courses, &damping, None) else { break };
        let shared = &mode.shared + step;
        let all = courses.iter().zip(&steps).zip(&damping);
        let tried: Vec<Vec<Tried>> =
            all.map(|((course, step), damping)| solved(mode, course, &shared, step, damping)).collect();
        let before = prior(mode, courses, &mode.shared, |nth, t| &courses[nth].here[t].z);
        let after = prior(mode, courses, &shared, |nth, t| &tried[nth][t].here.z);
        let (mut cost, mut gain, mut held_back) = (before, before - after, 0);
        for (course, (tried, damping)) in courses.iter().zip(tried.iter().zip(&mut damping)) {
            for (t, (tried, damping)) in tried.iter().zip(damping).enumerate() {
                let was = own_cost(mode, course, t, &course.here[t], &mode.shared);
                cost += was.unwrap_or(0.0);
                // A frame that had no equilibrium before has no earlier cost to compare with.
                gain += was.map_or(0.0, |was| was - tried.cost);
                held_back += usize::from(tried.damping > *damping && *damping < DAMPING.2);
                *damping = tried.damping;
            }
        }
        progress(round + 1);
        quiet = if gain.abs() <= won * cost { quiet + 1 } else { 0 };
        if gain > 0.0 {
            mode.shared = shared;
            for (course, tried) in courses.iter_mut().zip(tried) {
                course.here = tried.into_iter().map(|t| t.here).collect();
            }
            if quiet > 1 || quiet == 1 && held_back * MANY_FRAMES < frames.max(MANY_FRAMES) {
                break;
            }
        } else {
            damping.iter_mut().flatten().for_each(|d| *d = (*d * 5.0).max(DAMPING.1));
            if damping.iter().flatten().all(|d| *d > DAMPING.2) {
                break;
            }
        }
    }
    costs(mode, courses)
}

/// Total cost of states and shared unknowns.
fn costs(mode: &Mode<'_, '_>, courses: &[Course]) -> f64 {
    let frames = courses.iter().flat_map(|course| {
        (0..course.frames.len()).filter_map(|t| own_cost(mode, course, t, &course.here[t], &mode.shared))
    });
    prior(mode, courses, &mode.shared, |nth, t| &courses[nth].here[t].z) + frames.sum::<f64>()
}

/// The step of the shared unknowns, those of the shape behind the others, and of every state. A shape comes with the weight of its
/// prior and with its damping in units of that prior's precision.
pub(super) fn stepped(
    mode: &Mode<'_, '_>,
    courses: &[Course],
    damping: &[Vec<f64>],
    shape: Option<(&RestShape, f64, f64)>,
) -> Option<(DVector<f64>, Vec<Step>)> {
    let (n, more) = (mode.sizes.shared(), shape.map_or(0, |(s, ..)| s.count()));
    let mut curvature = mode.shared_precision.clone().resize(n + more, n + more, 0.0);
    let mut gradient = (&mode.shared_precision * &mode.shared).resize_vertically(n + more, 0.0);
    if let Some((shape, weight, damping)) = shape {
        curvature
            .view_mut((n, n), (more, more))
            .copy_from(&(&shape.prior.precision * (weight * (1.0 + damping))));
        gradient.rows_mut(n, more).copy_from(&(&shape.prior.gradient * weight));
    }
    let mut all = Vec::with_capacity(courses.len());
    for (course, damping) in courses.iter().zip(damping) {
        let by_shape = by_shape(mode, course, shape.map(|(shape, ..)| shape));
        let of_shape = |t: usize| by_shape[t].as_ref().map(|b| b.seen.clone());
        let eliminated = mode.eliminate(course, damping, &of_shape, more)?;
        curvature += &eliminated.curvature;
        gradient += &eliminated.gradient;
        all.push(eliminated);
    }
    let step = -((&curvature + curvature.transpose()) * 0.5).cholesky()?.solve(&gradient);
    let of = |e: &Eliminated| {
        let states: Vec<DVector<f64>> =
            e.answers.iter().zip(&e.steps).map(|(a, s)| -(a * &step) - s.column(0)).collect();
        let expected = e.rows.iter().zip(&states).map(|(rows, state)| {
            let rows = rows.as_ref()?;
            Some((&rows.residuals + &rows.by_state * state + &rows.by_shared * &step).norm_squared())
        });
        let expected = expected.map(|e| e.unwrap_or(f64::INFINITY)).collect();
        Step { states, expected }
    };
    let steps = all.iter().map(of).collect();
    Some((step, steps))
}

/// Moves the states of recordings by a step to which the unknowns `shared` belong, each frame as far as it can.
pub(super) fn follow(mode: &Mode<'_, '_>, courses: &mut [Course], shared: &DVector<f64>, steps: &[Step]) {
    for (course, step) in courses.iter_mut().zip(steps) {
        let tried = solved(mode, course, shared, step, &vec![0.0; course.frames.len()]);
        course.here = tried.into_iter().map(|t| t.here).collect();
    }
}

/// Cost of states and shared unknowns in the prior.
fn prior<'z>(
    mode: &Mode<'_, '_>,
    courses: &[Course],
    shared: &DVector<f64>,
    state: impl Fn(usize, usize) -> &'z DVector<f64>,
) -> f64 {
    let mut sum = shared.dot(&(&mode.shared_precision * shared));
    for (nth, course) in courses.iter().enumerate() {
        let z: Vec<DVector<f64>> = (0..course.frames.len()).map(|t| state(nth, t).clone()).collect();
        sum += z.iter().zip(course.chain.image(&z)).map(|(z, q)| z.dot(&q)).sum::<f64>();
    }
    sum
}

/// Cost of the errors of a frame.
fn own_cost(
    mode: &Mode<'_, '_>,
    course: &Course,
    t: usize,
    here: &Here,
    shared: &DVector<f64>,
) -> Option<f64> {
    let residuals = mode.residuals_mm(course, t, here, shared)?;
    let whitened = course.errors[t].as_ref()?.whitened(nalgebra::DMatrix::from_columns(&[residuals]));
    Some(whitened.norm_squared())
}

/// Results for all frames of a recording; the frames of a chunk are computed one after another.
fn in_chunks<T: Send>(
    mode: &Mode<'_, '_>,
    course: &Course,
    work: impl Fn(&mut Solver<'_>, &mut Option<Vec<Point>>, usize) -> T + Sync,
) -> Vec<T> {
    let numbers: Vec<usize> = (0..course.frames.len()).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let one = |chunk: &&[usize]| -> Vec<T> {
        let (mut solver, mut last) = ((mode.solver)(), None);
        chunk.iter().map(|&t| work(&mut solver, &mut last, t)).collect()
    };
    parallel::map(&chunks, one).into_iter().flatten().collect()
}

/// The frames of a recording at the states where the search begins.
fn begun(mode: &Mode<'_, '_>, course: &Course) -> Vec<Here> {
    in_chunks(mode, course, |solver, last, t| {
        let here = &course.here[t];
        if course.errors[t].is_none() {
            return Here { linear: None, ..here.clone() };
        }
        let x = mode.unknowns(&here.z, &mode.shared);
        let from = here.positions.as_ref().or(last.as_ref());
        let linear = solver.linearise(&course.frames[t], &x, from.map(Vec::as_slice));
        let positions = linear.as_ref().map(|l| l.positions.clone()).or_else(|| here.positions.clone());
        *last = positions.clone().or_else(|| last.take());
        Here { z: here.z.clone(), linear, positions }
    })
}

/// The frames of a recording after a step, each as far as it can move.
fn solved(
    mode: &Mode<'_, '_>,
    course: &Course,
    shared: &DVector<f64>,
    step: &Step,
    damping: &[f64],
) -> Vec<Tried> {
    in_chunks(mode, course, |solver, last, t| {
        let (before, damping) = (&course.here[t], damping[t]);
        let z = &before.z + &step.states[t];
        if course.errors[t].is_none() {
            let here = Here { z, linear: None, positions: before.positions.clone() };
            return Tried { here, cost: 0.0, damping };
        }
        let (was, whole) = (mode.unknowns(&before.z, &mode.shared), mode.unknowns(&z, shared));
        let from = before.positions.as_ref().or(last.as_ref()).map(Vec::as_slice);
        let cost = own_cost(mode, course, t, before, &mode.shared);
        let most = cost.map_or(f64::INFINITY, |c| c.max(step.expected[t]) * TOO_FAR.0 + TOO_FAR.1);
        // A shorter step applies to tensions and displacements only, because the residuals are linear in the errors.
        let state = |part: f64| {
            let mut z = z.clone();
            let mut x = z.rows_mut(0, was.len());
            x -= (&whole - &was) * (1.0 - part);
            z
        };
        let tried = PARTS.iter().find_map(|&part| {
            let x = &was + (&whole - &was) * part;
            let linear = solver.linearise(&course.frames[t], &x, from)?;
            let positions = Some(linear.positions.clone());
            let here = Here { z: state(part), linear: Some(linear), positions };
            let there = own_cost(mode, course, t, &here, shared)?;
            let off = (there - step.expected[t]).abs();
            let expected = cost.map_or(0.0, |c| (c - step.expected[t]).abs());
            let damping = match part {
                1.0 if off <= 0.25 * expected + 0.01 => damping * 0.2,
                1.0 if off <= 0.75 * expected + 0.1 => damping,
                _ => (damping * 4.0).max(DAMPING.1),
            };
            (there <= most).then_some(Tried { here, cost: there, damping })
        });
        let tried = tried.unwrap_or_else(|| {
            let (linear, positions) = (before.linear.clone(), before.positions.clone());
            let here = Here { z: state(0.0), linear, positions };
            let cost = own_cost(mode, course, t, &here, shared).unwrap_or(0.0);
            Tried { here, cost, damping: (damping * 10.0).max(DAMPING.1) }
        });
        *last = tried.here.positions.clone().or_else(|| last.take());
        tried
    })
}
