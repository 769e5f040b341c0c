//! All frames of a recording: each from the one before, then the smoother over all, then what cannot be believed.

use nalgebra::{DMatrix, DVector, SVector};

use crate::inverse::FreedBone;
use tongue_core::parallel;
use tongue_core::statistics::upper_median;
use tongue_core::system::System;
use tongue_input::measured::recording::{Fault, FaultKind};

use super::chain::{Chain, Prior};
use super::found::{Found, Tracked, tracked};
use super::frame::{Followed, Frame, Linear, Solver};
use super::scores;
use super::settings::Settings;

/// Frames that are followed one from the other; where a new chunk begins the body starts at rest. Results do not depend on threads,
/// because chunks do not.
const CHUNK: usize = 32;
/// Most steps of Gauss-Newton in a frame.
const MOST_STEPS: usize = 15;
/// Longest step of a score: the tensions answer in straight lines only so far.
const LONGEST_STEP: f64 = 1.2;
/// A step of the scores that is shorter has arrived; a hundredth of a standard deviation of the prior.
pub(crate) const ARRIVED: f64 = 1e-2;
/// The same for frames by themselves, which the smoother moves once more.
const NEARLY: f64 = 0.1;
/// A round of the smoother that gains less than this part of the cost is the last.
const WON: f64 = 1e-5;
/// A residual of more standard deviations than this is no noise.
const MOST_SD: f64 = 4.0;
/// A frame whose residuals are larger than so many standard deviations (root mean square) is tried from other places of unseen bones,
const POOR: f64 = 1.15;
/// so many standard deviations from where they are at rest.
const ELSEWHERE: f64 = 1.5;
/// A frame with fewer observations than this says nothing by itself.
pub const FEWEST: usize = 3;

/// Where a frame is.
#[derive(Debug, Clone)]
struct Here {
    x: DVector<f64>,
    /// `None` where there is no equilibrium, or no data.
    linear: Option<Linear>,
    positions: Option<Vec<SVector<f64, 2>>>,
}

impl Here {
    fn cost(&self) -> f64 {
        self.linear.as_ref().map_or(0.0, |l| l.residuals.norm_squared())
    }
}

/// Finds the tensions of all frames of a recording. `followed` are the bones that are carried to where they were seen, `freed` those whose
/// displacement is unknown ([`BONE_SD_M`](crate::inverse::BONE_SD_M), remembered like tensions). `progress` is told how many frames of how many passes are done.
pub fn track(
    system: &System<2>,
    followed: &[Followed],
    freed: &[FreedBone<2>],
    mut frames: Vec<Frame>,
    settings: &Settings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Tracked> {
    let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
    let prior = settings.prior.with_displacements(2 * freed.len());
    let settings = &Settings { prior, ..settings.clone() };
    let chain = Chain::new(&settings.prior, &times);
    let solver = || Solver::new(system, followed, settings.prior.scale_n).with_freed(freed);
    let passes = settings.rounds + 2;
    let total = passes * frames.len();
    let chunks: Vec<&[Frame]> = frames.chunks(CHUNK).collect();
    let followed_one = |chunk: &&[Frame]| follow(&mut solver(), chunk, &settings.prior);
    let mut here: Vec<Here> = parallel::map(&chunks, followed_one).into_iter().flatten().collect();
    progress(frames.len(), total);
    let mut covariances = smooth(&chain, &solver, &frames, &mut here, settings, &|n| progress(n, total));

    // What is much farther from the surface than its noise and than everything else is no point of this tongue.
    let mut faults: Vec<Vec<Fault>> = vec![Vec::new(); frames.len()];
    let mut lost = vec![false; frames.len()];
    let usual = typical(&here);
    let mut again = false;
    for (t, frame) in frames.iter_mut().enumerate() {
        let Some(linear) = &here[t].linear else {
            lost[t] = frame.observations.len() >= FEWEST;
            continue;
        };
        let far: Vec<usize> = (0..frame.names.len())
            .filter(|&i| linear.residuals[i].abs() > MOST_SD * usual.max(1.0))
            .collect();
        if far.is_empty() {
            continue;
        }
        let mut points: Vec<String> = far.iter().map(|&i| frame.names[i].clone()).collect();
        points.dedup();
        let all = points.len() * 3 > frame.names.len();
        faults[t].push(Fault { kind: FaultKind::FarFromFit, points: points.clone() });
        let kept: Vec<usize> =
            (0..frame.names.len()).filter(|&i| !all && !points.contains(&frame.names[i])).collect();
        frame.observations = kept.iter().map(|&i| frame.observations[i].clone()).collect();
        frame.names = kept.iter().map(|&i| frame.names[i].clone()).collect();
        lost[t] |= all;
        again = true;
    }
    if again {
        covariances = smooth(&chain, &solver, &frames, &mut here, settings, &|n| progress(n, total));
    }
    let numbers: Vec<usize> = (0..frames.len()).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let finish = |chunk: &&[usize]| -> Vec<Tracked> {
        let (mut solver, mut relaxed) = (solver(), None);
        chunk
            .iter()
            .map(|&t| {
                let found = Found {
                    frame: &frames[t],
                    x: &here[t].x,
                    linear: here[t].linear.as_ref(),
                    positions: here[t].positions.as_deref(),
                    covariance: &covariances[t],
                    lost: lost[t],
                };
                tracked(&mut solver, &mut relaxed, &found, settings, faults[t].clone())
            })
            .collect()
    };
    let out = parallel::map(&chunks, finish).into_iter().flatten().collect();
    progress(total, total);
    out
}

/// Frames one from the other, each by itself.
fn follow(solver: &mut Solver<'_>, frames: &[Frame], prior: &Prior) -> Vec<Here> {
    let precision = prior.precision();
    let mut x = prior.mean.clone();
    let mut positions: Option<Vec<SVector<f64, 2>>> = None;
    let mut out = Vec::with_capacity(frames.len());
    for frame in frames {
        let mut here = Here { x: x.clone(), linear: None, positions: positions.clone() };
        if frame.observations.len() < FEWEST {
            out.push(here);
            continue;
        }
        let mut cost = descend(solver, frame, &mut here, prior, &precision);
        if here.linear.is_none() && positions.is_some() {
            here = Here { x: prior.mean.clone(), linear: None, positions: None };
            cost = descend(solver, frame, &mut here, prior, &precision);
        }
        // Which way a bone went that was not seen is no question of going downhill.
        if here.cost() > (POOR * POOR) * frame.observations.len() as f64 || here.linear.is_none() {
            for score in solver.system.contracting().len()..x.len() {
                for side in [ELSEWHERE, -ELSEWHERE] {
                    let mut other = Here { x: prior.mean.clone(), linear: None, positions: None };
                    other.x[score] = side;
                    let found = descend(solver, frame, &mut other, prior, &precision);
                    if found < cost {
                        (here, cost) = (other, found);
                    }
                }
            }
        }
        if let Some(linear) = &here.linear {
            x.clone_from(&here.x);
            positions = Some(linear.positions.clone());
        }
        out.push(here);
    }
    out
}

/// The way down from where a frame is, and what it costs there; without end where it has no equilibrium.
fn descend(
    solver: &mut Solver<'_>,
    frame: &Frame,
    here: &mut Here,
    prior: &Prior,
    precision: &DMatrix<f64>,
) -> f64 {
    let found =
        solver.settle(frame, &here.x, here.positions.as_deref(), prior, precision, (MOST_STEPS, NEARLY));
    let Some((x, linear, cost)) = found else { return f64::INFINITY };
    *here = Here { x, positions: Some(linear.positions.clone()), linear: Some(linear) };
    cost
}

impl Solver<'_> {
    /// The scores at which a frame by itself, with the prior, costs least: by Levenberg's and Marquardt's method, from given scores and
    /// positions. With them the frame there and the cost. `None` where there is no equilibrium to begin with.
    pub(crate) fn settle(
        &mut self,
        frame: &Frame,
        x: &DVector<f64>,
        from: Option<&[SVector<f64, 2>]>,
        prior: &Prior,
        precision: &DMatrix<f64>,
        (steps, arrived): (usize, f64),
    ) -> Option<(DVector<f64>, Linear, f64)> {
        let away = |x: &DVector<f64>| x - &prior.mean;
        let priced = |linear: &Linear, x: &DVector<f64>| {
            let d = away(x);
            linear.residuals.norm_squared() + d.dot(&(precision * &d))
        };
        if frame.observations.len() < FEWEST {
            return None;
        }
        let mut x = x.clone();
        let mut linear = self.linearise(frame, &x, from)?;
        let mut cost = priced(&linear, &x);
        let mut damping = 0.0;
        for _ in 0..steps {
            let mut curvature = linear.jacobian.tr_mul(&linear.jacobian) + precision;
            (0..x.len()).for_each(|i| curvature[(i, i)] += damping);
            let pull = linear.jacobian.tr_mul(&linear.residuals) + precision * away(&x);
            let Some(factors) = curvature.cholesky() else { break };
            let next = stepped(&x, &-factors.solve(&pull));
            let step = (&next - &x).amax();
            match self.linearise(frame, &next, Some(&linear.positions)) {
                Some(there) if priced(&there, &next) < cost => {
                    cost = priced(&there, &next);
                    (x, linear) = (next, there);
                    damping *= 0.2;
                }
                _ => damping = (damping * 6.0).max(1.0),
            }
            if step < arrived || damping > 1e6 {
                break;
            }
        }
        Some((x, linear, cost))
    }
}

/// The scores after a step, which is cut where it is too long.
fn stepped(x: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
    let cut = (LONGEST_STEP / step.amax().max(LONGEST_STEP)).min(1.0);
    (x + step * cut).map(|g| g.clamp(scores::LOWEST, scores::HIGHEST))
}

/// Moves all frames at once to the minimum; gives the covariance of every frame's scores there.
fn smooth<'s>(
    chain: &Chain,
    solver: &(dyn Fn() -> Solver<'s> + Sync),
    frames: &[Frame],
    here: &mut Vec<Here>,
    settings: &Settings,
    progress: &(dyn Fn(usize) + Sync),
) -> Vec<DMatrix<f64>> {
    let n = settings.prior.mean.len();
    for (h, f) in here.iter_mut().zip(frames) {
        let changed = h.linear.as_ref().is_some_and(|l| l.residuals.len() != f.observations.len());
        if changed {
            h.linear = None;
        }
    }
    *here = evaluated(solver, frames, &here.iter().map(|h| (h.x.clone(), h.clone())).collect::<Vec<_>>());
    let total = |here: &[Here]| {
        let x: Vec<DVector<f64>> = here.iter().map(|h| h.x.clone()).collect();
        here.iter().map(Here::cost).sum::<f64>() + chain.cost(&x)
    };
    let normal = |here: &[Here], damping: f64| {
        let x: Vec<DVector<f64>> = here.iter().map(|h| h.x.clone()).collect();
        let curvature: Vec<DMatrix<f64>> = here
            .iter()
            .map(|h| {
                h.linear.as_ref().map_or_else(|| DMatrix::zeros(n, n), |l| l.jacobian.tr_mul(&l.jacobian))
            })
            .collect();
        let gradient: Vec<DVector<f64>> = here
            .iter()
            .map(|h| h.linear.as_ref().map_or_else(|| DVector::zeros(n), |l| l.jacobian.tr_mul(&l.residuals)))
            .collect();
        chain.solve(&x, &curvature, &gradient, damping)
    };
    let (mut cost, mut damping) = (total(here), 0.0);
    for round in 0..settings.rounds {
        let Some((steps, _)) = normal(here, damping) else { break };
        let moved: Vec<(DVector<f64>, Here)> =
            here.iter().zip(&steps).map(|(h, s)| (stepped(&h.x, s), h.clone())).collect();
        let longest = moved.iter().map(|(x, h)| (x - &h.x).amax()).fold(0.0, f64::max);
        let there = evaluated(solver, frames, &moved);
        progress((round + 2) * frames.len());
        let priced = total(&there);
        // A frame that lost its equilibrium costs nothing and must not make the step a good one.
        let lost = here.iter().zip(&there).any(|(a, b)| a.linear.is_some() && b.linear.is_none());
        if priced < cost && !lost {
            let gain = cost - priced;
            (*here, cost) = (there, priced);
            damping *= 0.2;
            if longest < ARRIVED || gain < WON * cost {
                break;
            }
        } else if longest < ARRIVED || damping > 1e4 {
            break;
        } else {
            damping = (damping * 6.0).max(0.5);
        }
    }
    normal(here, 0.0).map_or_else(|| vec![settings.prior.covariance.clone(); here.len()], |(_, c)| c)
}

/// Frames at other scores, each from where it was. Those that were linearised there already are not done again.
fn evaluated<'s>(
    solver: &(dyn Fn() -> Solver<'s> + Sync),
    frames: &[Frame],
    moved: &[(DVector<f64>, Here)],
) -> Vec<Here> {
    let numbers: Vec<usize> = (0..frames.len()).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let work = |chunk: &&[usize]| -> Vec<Here> {
        let mut solver = solver();
        let one = |&t: &usize| {
            let (x, before) = &moved[t];
            if frames[t].observations.len() < FEWEST {
                return Here { x: x.clone(), linear: None, positions: before.positions.clone() };
            }
            if before.linear.is_some() && *x == before.x {
                return before.clone();
            }
            let linear = solver.linearise(&frames[t], x, before.positions.as_deref());
            let positions = linear.as_ref().map(|l| l.positions.clone()).or_else(|| before.positions.clone());
            Here { x: x.clone(), linear, positions }
        };
        chunk.iter().map(one).collect()
    };
    parallel::map(&chunks, work).into_iter().flatten().collect()
}

/// The usual size of a residual: 1.48 times the median, which is the standard deviation of normal ones.
fn typical(here: &[Here]) -> f64 {
    let linear = here.iter().filter_map(|h| h.linear.as_ref());
    1.4826 * upper_median(linear.flat_map(|l| l.residuals.iter().map(|r| r.abs()))).unwrap_or(0.0)
}
