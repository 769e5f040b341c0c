//! The path from rest to a load: up to which load it stays on one stable branch, how it leaves it, and where it ends.

use nalgebra::SVector;
use serde::Serialize;

use crate::system::System;

use super::{Settings, Solution, Stability, Status, Workspace, smallest_eigenvalue, solve};

/// How a branch of stable equilibria ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CriticalKind {
    /// The path turns back in load: beyond, the body jumps to a state elsewhere (snap-through).
    LimitPoint,
    /// The path goes on, unstable, and other ones branch off: the load does no work on the critical mode (buckling).
    Bifurcation,
}

/// Where the branch that begins at rest stops being stable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Critical {
    /// Part of the tensions.
    pub load: f64,
    /// How the branch ends there.
    pub kind: CriticalKind,
}

/// What lies between rest and the load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trace {
    /// The solve that ended at the whole load; its positions are in the workspace.
    pub solution: Solution,
    /// Where the branch from rest ends; `None` when it reaches the whole load, so that the solution lies on it.
    pub critical: Option<Critical>,
    /// Whether another equilibrium at this same load was met: the branch left behind or its mirror image, or the state in which
    /// the body stays when it is loaded twice as far and let back.
    pub another: bool,
}

/// Shapes that differ by less than this part of the body's size are the same.
const SAME: f64 = 1e-6;
/// The critical load is found to this part of the load.
const RESOLUTION: f64 = 1e-9;
/// A critical mode on which the load does less than this part of its greatest possible work is orthogonal to it.
const ORTHOGONAL: f64 = 1e-4;

/// Follows the equilibria from rest as the tensions grow to `tensions` in `steps` equal steps, finds the load at which their
/// branch ends (by bisection) and goes on from there to the equilibrium that the body falls into.
///
/// A step continues the branch if it needed no way downhill from an unstable equilibrium and if letting the load back leads
/// back to where it started. Costs a few solves a step.
pub fn trace<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &Settings,
    steps: usize,
) -> Trace {
    let settings = Settings { certify: true, ..*settings };
    let mut path = Path { system, w: workspace, tensions, settings: &settings };
    let mut low = (0.0, system.rest().to_vec());
    let mut critical = None;
    let steps = steps.max(1);
    for i in 1..=steps {
        let load = i as f64 / steps as f64;
        match path.continued(&low.1, low.0, load) {
            Some(next) => low = (load, next),
            None => {
                critical = Some(path.bisect(&mut low, load));
                break;
            }
        }
    }
    let solution = path.at(&low.1, 1.0);
    let end = path.w.positions.clone();
    let another = match &critical {
        // At the critical load the branches part; which of them still exist at the whole load, letting go of it tells: a body
        // that was brought there the other way and stays elsewhere.
        Some(c) => c.kind == CriticalKind::Bifurcation || path.stays_elsewhere(&end, 0.0),
        None => path.stays_elsewhere(&end, 2.0),
    };
    path.w.positions.copy_from_slice(&end);
    path.w.factor_ready = false;
    path.w.tensions.copy_from_slice(tensions);
    Trace { solution, critical, another }
}

struct Path<'a, const D: usize> {
    system: &'a System<D>,
    w: &'a mut Workspace<D>,
    tensions: &'a [f64],
    settings: &'a Settings,
}

impl<const D: usize> Path<'_, D> {
    /// Solves at a part of the load from given positions.
    fn at(&mut self, from: &[SVector<f64, D>], load: f64) -> Solution {
        let part: Vec<f64> = self.tensions.iter().map(|t| t * load).collect();
        self.w.positions.copy_from_slice(from);
        self.w.factor_ready = false;
        self.w.factor_is_exact = false;
        solve(self.system, self.w, &part, self.settings)
    }

    /// The shape at `load` if it continues the branch on which `from` lies at `start`.
    fn continued(&mut self, from: &[SVector<f64, D>], start: f64, load: f64) -> Option<Vec<SVector<f64, D>>> {
        let up = self.at(from, load);
        if up.status != Status::Converged || up.escapes + up.ridges > 0 || up.stability == Stability::Unstable
        {
            return None;
        }
        let there = self.w.positions.clone();
        let back = self.at(&there, start);
        (back.status == Status::Converged && self.is_same(from)).then_some(there)
    }

    /// Narrows the end of the branch down between `low`, which is moved up to it, and `high`.
    fn bisect(&mut self, low: &mut (f64, Vec<SVector<f64, D>>), mut high: f64) -> Critical {
        while high - low.0 > RESOLUTION * high {
            let middle = 0.5 * (low.0 + high);
            match self.continued(&low.1, low.0, middle) {
                Some(next) => *low = (middle, next),
                None => high = middle,
            }
        }
        self.at(&low.1, low.0);
        // Leaves the critical mode in the unknowns.
        smallest_eigenvalue(self.system, self.w);
        let work = self.work_on_mode();
        let kind = if work < ORTHOGONAL { CriticalKind::Bifurcation } else { CriticalKind::LimitPoint };
        Critical { load: 0.5 * (low.0 + high), kind }
    }

    /// Work of the load on the mode in the workspace's unknowns, as part of the greatest that any mode could get.
    fn work_on_mode(&mut self) -> f64 {
        let w = &mut *self.w;
        w.step.fill(SVector::zeros());
        for &muscle in self.system.contracting() {
            let mut rate = vec![SVector::zeros(); w.step.len()];
            let at = super::Configuration { positions: &w.positions, tensions: &w.tensions };
            self.system.effects().iter().for_each(|e| e.add_force_per_tension(at, muscle, &mut rate));
            w.step.iter_mut().zip(rate).for_each(|(s, r)| *s += r * self.tensions[muscle]);
        }
        let nodes = self.system.pattern().nodes();
        let (mut work, mut load, mut mode) = (0.0, 0.0, 0.0);
        for (v, &node) in w.unknowns.iter().zip(nodes) {
            work += v.dot(&w.step[node]);
            load += w.step[node].norm_squared();
            mode += v.norm_squared();
        }
        if load * mode > 0.0 { work.abs() / (load * mode).sqrt() } else { 0.0 }
    }

    /// Whether the body, brought from `end` to another part of the load and back to all of it, rests elsewhere.
    fn stays_elsewhere(&mut self, end: &[SVector<f64, D>], via: f64) -> bool {
        let away = self.at(end, via);
        let there = self.w.positions.clone();
        let back = self.at(&there, 1.0);
        let settled = [away, back].iter().all(|s| s.status == Status::Converged);
        settled && !self.is_same(end)
    }

    fn is_same(&self, shape: &[SVector<f64, D>]) -> bool {
        let size = super::stability::extent(self.system.rest());
        self.w.positions.iter().zip(shape).all(|(p, q)| (p - q).norm() < SAME * size)
    }
}
