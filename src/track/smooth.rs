//! All frames of a recording: each from the one before, then the smoother over all, then what cannot be believed.

use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

use crate::measured::recording::{Fault, FaultKind};
use crate::parallel;
use crate::system::System;

use super::chain::{Chain, Prior};
use super::frame::{self, Followed, Frame, Linear, Solver};
use super::{marginal, scores};

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
/// A direction of tensions is resolved whose standard deviation is below this part of the prior's scale.
const RESOLVED: f64 = 0.25;
/// A residual of more standard deviations than this is no noise.
const MOST_SD: f64 = 4.0;
/// A frame whose points are farther from the surface than this many standard deviations (root mean square) was not reached.
const REACH_SD: f64 = 3.0;
/// A frame with fewer observations than this says nothing by itself.
const FEWEST: usize = 3;

/// How the scores of a recording are found.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// What is assumed of the tensions.
    pub prior: Prior,
    /// Upper bound of every tension, N per metre of thickness: more than this is told as a bound.
    pub upper_n: f64,
    /// Whether every frame is checked to lie on the branch of equilibria that begins at rest.
    pub branch: bool,
    /// Most rounds of the smoother.
    pub rounds: usize,
}

impl Settings {
    /// With this prior, and everything else as is usual.
    pub fn new(prior: Prior) -> Self {
        let upper_n = prior.scale_n * scores::tension(scores::HIGHEST).0 * 0.9;
        Self { prior, upper_n, branch: true, rounds: 12 }
    }
}

/// How a frame ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    /// Found, and nothing speaks against it.
    Converged,
    /// A tension is at its upper bound.
    AtBound,
    /// The frame and its neighbours resolve no direction of the tensions: all is prior.
    Unresolved,
    /// Nothing was seen: the tensions are those of the frames around it and of the prior.
    Gap,
    /// What was seen cannot be reached by this body, or cannot be right.
    OutOfReach,
    /// The equilibrium does not lie on the branch that begins at rest.
    OffBranch,
}

/// What was found of a frame.
#[derive(Debug, Clone)]
pub struct Tracked {
    /// Time, s.
    pub time_s: f64,
    /// How it ended.
    pub status: FrameStatus,
    /// Scores of the contracting muscles.
    pub scores: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Tensions of the contracting muscles, N per metre of thickness: those of the most probable scores.
    pub tensions_n: Vec<f64>,
    /// Lower ends of the 95 % intervals.
    pub low_n: Vec<f64>,
    /// Upper ends.
    pub high_n: Vec<f64>,
    /// Root mean square residual of what was fitted, m; `None` where nothing was.
    pub rms_m: Option<f64>,
    /// Signed distances of the points that were kept back, m.
    pub hidden: Vec<(String, f64)>,
    /// Directions of the tensions whose standard deviation is below a quarter of the prior's scale.
    pub resolved: usize,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, 2>>,
    /// What the fit found wrong with the frame.
    pub faults: Vec<Fault>,
}

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

/// Finds the tensions of all frames of a recording. `progress` is told how many frames of how many passes are done.
pub fn track(
    system: &System<2>,
    followed: &[Followed],
    mut frames: Vec<Frame>,
    settings: &Settings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Tracked> {
    let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
    let chain = Chain::new(&settings.prior, &times);
    let solver = || Solver::new(system, followed, settings.prior.scale_n);
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
                let found =
                    Found { frame: &frames[t], here: &here[t], covariance: &covariances[t], lost: lost[t] };
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
        descend(solver, frame, &mut here, prior, &precision);
        if here.linear.is_none() && positions.is_some() {
            here = Here { x: prior.mean.clone(), linear: None, positions: None };
            descend(solver, frame, &mut here, prior, &precision);
        }
        if let Some(linear) = &here.linear {
            x.clone_from(&here.x);
            positions = Some(linear.positions.clone());
        }
        out.push(here);
    }
    out
}

/// The way down from where a frame is.
fn descend(solver: &mut Solver<'_>, frame: &Frame, here: &mut Here, prior: &Prior, precision: &DMatrix<f64>) {
    let found =
        solver.settle(frame, &here.x, here.positions.as_deref(), prior, precision, (MOST_STEPS, NEARLY));
    if let Some((x, linear, _)) = found {
        *here = Here { x, positions: Some(linear.positions.clone()), linear: Some(linear) };
    }
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
    let mut all: Vec<f64> = here
        .iter()
        .filter_map(|h| h.linear.as_ref())
        .flat_map(|l| l.residuals.iter().map(|r| r.abs()))
        .collect();
    all.sort_by(f64::total_cmp);
    1.4826 * all.get(all.len() / 2).copied().unwrap_or(0.0)
}

struct Found<'a> {
    frame: &'a Frame,
    here: &'a Here,
    covariance: &'a DMatrix<f64>,
    lost: bool,
}

fn tracked(
    solver: &mut Solver<'_>,
    relaxed: &mut Option<Vec<SVector<f64, 2>>>,
    found: &Found<'_>,
    settings: &Settings,
    faults: Vec<Fault>,
) -> Tracked {
    let Found { frame, here, covariance, lost } = found;
    let scale = settings.prior.scale_n;
    let x = &here.x;
    let at = |g: f64| scale * scores::tension(g).0;
    let (low, high) = marginal::intervals(x, covariance, here.linear.as_ref());
    let all = |scores: &[f64]| scores.iter().map(|g| at(*g)).collect::<Vec<f64>>();
    let tensions_n: Vec<f64> = x.iter().map(|g| at(*g)).collect();
    // In tensions, because there a slack muscle is known to be slack.
    let slopes = DVector::from_iterator(x.len(), x.iter().map(|g| scores::tension(*g).1));
    let in_tensions = DMatrix::from_fn(x.len(), x.len(), |i, j| slopes[i] * covariance[(i, j)] * slopes[j]);
    let variances = in_tensions.symmetric_eigenvalues();
    let resolved = variances.iter().filter(|v| **v < RESOLVED * RESOLVED).count();
    let solved = here.linear.is_some() || solver.solve(frame, x, here.positions.as_deref()).is_some();
    let positions = match &here.linear {
        Some(linear) => linear.positions.clone(),
        None => solver.solve(frame, x, here.positions.as_deref()).unwrap_or(&[]).to_vec(),
    };
    let positions = if positions.is_empty() { solver.system.rest().to_vec() } else { positions };
    let residuals = frame::residuals(frame, &positions);
    let squares: f64 = residuals.iter().zip(&frame.observations).map(|(r, o)| (r / o.weight).powi(2)).sum();
    let rms_m = (!frame.observations.is_empty()).then(|| (squares / residuals.len() as f64).sqrt());
    let rms_sd = (residuals.norm_squared() / residuals.len().max(1) as f64).sqrt();
    let status = if *lost || !solved || rms_sd > REACH_SD {
        FrameStatus::OutOfReach
    } else if here.linear.is_none() {
        FrameStatus::Gap
    } else if settings.branch && !solver.is_on_branch(frame, x, &positions, relaxed) {
        FrameStatus::OffBranch
    } else if tensions_n.iter().any(|f| *f >= settings.upper_n) {
        FrameStatus::AtBound
    } else if resolved == 0 {
        FrameStatus::Unresolved
    } else {
        FrameStatus::Converged
    };
    Tracked {
        time_s: frame.time_s,
        status,
        scores: x.clone(),
        covariance: (*covariance).clone(),
        low_n: all(&low),
        high_n: all(&high),
        tensions_n,
        rms_m,
        hidden: frame::hidden(frame, &positions),
        resolved,
        positions,
        faults,
    }
}
