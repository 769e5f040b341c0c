//! What was found of a frame: tensions with their intervals, displacements of bones, and how far to believe them.

use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

use crate::inverse::BONE_SD_M;
use tongue_input::measured::recording::Fault;

use super::frame::{self, Frame, Linear, Solver};
use super::settings::Settings;
use super::{marginal, scores};

/// A frame whose points are farther from the surface than this many standard deviations (root mean square) was not reached.
const REACH_SD: f64 = 3.0;
/// A direction of tensions is resolved whose standard deviation is below this part of the prior's scale.
const RESOLVED: f64 = 0.25;
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

/// Where a bone was found that was not seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// From where it is at rest, m.
    pub shift_m: [f64; 2],
    /// Lower ends of the 95 % intervals, m.
    pub low_m: [f64; 2],
    /// Upper ends.
    pub high_m: [f64; 2],
}

/// What was found of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tracked {
    /// Time, s.
    pub time_s: f64,
    /// How it ended.
    pub status: FrameStatus,
    /// Scores of the contracting muscles, then two of every freed bone.
    pub scores: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Tensions of the contracting muscles, N per metre of thickness: those of the most probable scores.
    pub tensions_n: Vec<f64>,
    /// Lower ends of the 95 % intervals.
    pub low_n: Vec<f64>,
    /// Upper ends.
    pub high_n: Vec<f64>,
    /// Displacements of the freed bones, m.
    pub bones: Vec<Displacement>,
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

/// A frame where the smoother left it.
pub(super) struct Found<'a> {
    pub frame: &'a Frame,
    pub x: &'a DVector<f64>,
    /// `None` where there is no equilibrium, or no data.
    pub linear: Option<&'a Linear>,
    /// Positions of all nodes of the last equilibrium, m.
    pub positions: Option<&'a [SVector<f64, 2>]>,
    pub covariance: &'a DMatrix<f64>,
    /// Whether what was seen cannot be right.
    pub lost: bool,
}

/// What is to be said of it. `relaxed` is where the body rests with the bones of the frame before, and then with those of this one.
pub(super) fn tracked(
    solver: &mut Solver<'_>,
    relaxed: &mut Option<Vec<SVector<f64, 2>>>,
    found: &Found<'_>,
    settings: &Settings,
    faults: Vec<Fault>,
) -> Tracked {
    let Found { frame, x, linear, covariance, lost, .. } = *found;
    let scale = settings.prior.scale_n;
    let muscles = solver.system.contracting().len();
    let (low, high) = marginal::intervals(x, covariance, linear, muscles);
    let tensions =
        |of: &[f64]| of[..muscles].iter().map(|g| scale * scores::tension(*g).0).collect::<Vec<f64>>();
    let displacements = |of: &[f64]| {
        let pairs = of[muscles..].chunks_exact(2).map(|g| [g[0] * BONE_SD_M, g[1] * BONE_SD_M]);
        pairs.collect::<Vec<_>>()
    };
    let tensions_n = tensions(x.as_slice());
    let ends = displacements(&low).into_iter().zip(displacements(&high));
    let bones = displacements(x.as_slice()).into_iter().zip(ends);
    let bones = bones.map(|(shift_m, (low_m, high_m))| Displacement { shift_m, low_m, high_m }).collect();
    // In tensions, because there a slack muscle is known to be slack.
    let slopes: Vec<f64> = x.iter().map(|g| scores::tension(*g).1).collect();
    let in_tensions = DMatrix::from_fn(muscles, muscles, |i, j| slopes[i] * covariance[(i, j)] * slopes[j]);
    let variances = in_tensions.symmetric_eigenvalues();
    let resolved = variances.iter().filter(|v| **v < RESOLVED * RESOLVED).count();
    let solved = linear.is_some() || solver.solve(frame, x, found.positions).is_some();
    let positions = match linear {
        Some(linear) => linear.positions.clone(),
        None => solver.solve(frame, x, found.positions).unwrap_or(&[]).to_vec(),
    };
    let positions = if positions.is_empty() { solver.system.rest().to_vec() } else { positions };
    let residuals = frame::residuals(frame, &positions);
    let squares: f64 = residuals.iter().zip(&frame.observations).map(|(r, o)| (r / o.weight).powi(2)).sum();
    let rms_m = (!frame.observations.is_empty()).then(|| (squares / residuals.len() as f64).sqrt());
    let rms_sd = (residuals.norm_squared() / residuals.len().max(1) as f64).sqrt();
    let status = if lost || !solved || rms_sd > REACH_SD {
        FrameStatus::OutOfReach
    } else if linear.is_none() {
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
        covariance: covariance.clone(),
        low_n: tensions(&low),
        high_n: tensions(&high),
        tensions_n,
        bones,
        rms_m,
        hidden: frame::hidden(frame, &positions),
        resolved,
        positions,
        faults,
    }
}
