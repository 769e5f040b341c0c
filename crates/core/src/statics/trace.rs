//! The path of equilibria from rest to a load: how far it is one stable branch, how that branch ends, and
//! where the body goes then.

use nalgebra::SVector;
use serde::Serialize;

use crate::effect::Configuration;
use crate::geometry;
use crate::system::System;

use super::{
    Connection, Solution, SolveSettings, SolveStatus, Stability, Workspace, smallest_eigenvalue, solve,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CriticalKind {
    /// The path turns back in load: beyond, the body jumps to a state elsewhere (snap-through).
    LimitPoint,
    /// The path goes on, unstable, and other ones branch off: the load does no work on the critical mode
    /// (buckling).
    Bifurcation,
}

/// Where the branch that begins at rest stops being stable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Critical {
    /// Part of the tensions.
    pub load: f64,
    pub kind: CriticalKind,
}

/// How loads that grow together lead from rest to a shape.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FromRest {
    /// Along one branch of stable equilibria, which was followed there and back.
    Branch,
    /// The branch ends at this part of the loads, and the body falls from there to the shape.
    Fell { load: f64 },
    /// Not known: the solves that are allowed were used up, or no equilibrium was found at the whole loads.
    #[default]
    NotKnown,
}

/// Result of following the equilibria from rest to the load.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Trace {
    /// The solve that ended at the whole load; its positions are in the workspace.
    #[serde(skip)]
    pub solution: Solution,
    /// How the load leads from rest to the solution.
    #[serde(skip)]
    pub from_rest: FromRest,
    /// Where the branch from rest ends; `None` when it reaches the whole load, so that the solution lies on
    /// it.
    pub critical: Option<Critical>,
    /// Whether another equilibrium at this same load was met: the branch left behind or its mirror image, or
    /// the state in which the body stays when it is loaded twice as far and let back.
    pub another: bool,
    /// Whether Newton's method from where the workspace was gives the same shape; not asked by [`trace`] alone.
    #[serde(skip)]
    pub same_by_newton: bool,
    /// Number of factorisations of a stiffness that following the branch took; of [`super::solve_and_trace`] the direct solve's too.
    #[serde(skip)]
    pub factorisations: usize,
    /// Part of the tensions up to which the branch was followed when [`SolveSettings::most_solves`] were used up,
    /// so that the solution may lie on another one; `None` when the branch was followed to its end or to the
    /// whole load.
    pub stopped: Option<f64>,
}

/// Least number of steps along a branch.
const STEPS: usize = 10;
/// The same of a continuum. A solve costs twenty times as much as of springs, and a step that is too long is
/// halved.
const STEPS_OF_A_CONTINUUM: usize = 4;

/// A body is back where a step began if its nodes differ by less than this part of its size; they are solved less closely there than
/// shapes that are compared with [`super::SAME_SHAPE_M`].
const BACK: f64 = 1e-6;
/// Residual force below which it is clear which shape a body goes back to, N.
const SHOWN: f64 = 1e-6;
/// Newton iterations after which a step along the branch is too long.
const MOST_ITERATIONS: usize = 40;
/// The critical load is found to this part of the load.
const RESOLUTION: f64 = 1e-9;
/// The same where it is not asked how the branch ends.
pub(super) const SHORTEST: f64 = 1e-4;
/// A critical mode on which the load does less than this part of its greatest possible work is orthogonal to
/// it.
const ORTHOGONAL: f64 = 1e-4;

/// Follows the equilibria from rest as the tensions grow to `tensions`, finds the load at which their branch ends
/// and goes on from there to the equilibrium that the body falls into. It takes ten steps, of a continuum four.
///
/// A step continues the branch if it needed no way downhill from an unstable equilibrium and if letting the
/// load back leads back to where it started; one that does not is halved, until it is shorter than the resolution.
/// Costs two solves a step.
#[inline(never)]
pub fn trace<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Trace {
    let settings = SolveSettings { certify: true, ..*settings };
    let mut path = Path::new(system, workspace, tensions, &settings);
    let (mut shape, end, there_and_back) = path.lead(RESOLUTION);
    let (critical, stopped) = match end {
        PathEnd::Whole => (None, None),
        PathEnd::Stopped { reached } => (None, Some(reached)),
        PathEnd::Critical { reached, load } => {
            (Some(Critical { load, kind: path.end_of_branch(&shape, reached) }), None)
        }
    };
    let (solution, another) = there_and_back.unwrap_or_else(|| {
        let solution = path.at(&shape, 1.0);
        shape.clone_from(&path.w.positions);
        let another = match &critical {
            // Branches meet at the critical load. Whether another one still exists at the whole load shows when
            // the body is brought there from a larger load and stays in another shape.
            Some(c) => c.kind == CriticalKind::Bifurcation || path.stays_elsewhere(&shape, 0.0),
            None => settings.beyond && stopped.is_none() && path.stays_elsewhere(&shape, 2.0),
        };
        (solution, another)
    });
    path.w.positions.copy_from_slice(&shape);
    path.w.forget_factor();
    path.w.tensions.copy_from_slice(tensions);
    let factorisations = path.spent.factorisations;
    let from_rest = match (critical, stopped) {
        (None, None) if solution.status == SolveStatus::Converged => FromRest::Branch,
        (Some(c), _) if solution.status == SolveStatus::Converged => FromRest::Fell { load: c.load },
        _ => FromRest::NotKnown,
    };
    let connection = if from_rest == FromRest::Branch { Connection::Traced } else { solution.connection };
    let solution = Solution { connection, ..solution.with_cost(&path.spent) };
    Trace { solution, from_rest, critical, another, same_by_newton: false, factorisations, stopped }
}

/// Whether a force larger than `tolerance`, N, acts on the body at rest without tensions.
fn is_loaded<const D: usize>(system: &System<D>, tolerance: f64) -> bool {
    let rest = system.rest();
    let mut force = vec![SVector::zeros(); rest.len()];
    let tensions = vec![0.0; system.muscle_count()];
    system.force(Configuration { positions: rest, tensions: &tensions }, &mut force);
    force.iter().any(|f| f.norm() > tolerance)
}

pub(super) struct Path<'a, const D: usize> {
    system: &'a System<D>,
    pub w: &'a mut Workspace<D>,
    tensions: &'a [f64],
    settings: &'a SolveSettings,
    solves: usize,
    spent: Solution,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PathEnd {
    /// At the whole load.
    Whole,
    /// Where it cannot be continued: the part of the load reached, and the next one that is not.
    Critical { reached: f64, load: f64 },
    /// At a part of the load, when the solves were used up.
    Stopped { reached: f64 },
}

impl<'a, const D: usize> Path<'a, D> {
    pub fn new(
        system: &'a System<D>,
        w: &'a mut Workspace<D>,
        tensions: &'a [f64],
        settings: &'a SolveSettings,
    ) -> Self {
        Self { system, w, tensions, settings, solves: 0, spent: Solution::NONE }
    }

    /// The shape at which the branch begins: with displaced bones, or under a load such as weight, the equilibrium without tensions.
    fn begin(&mut self) -> Vec<SVector<f64, D>> {
        let rest = self.system.rest().to_vec();
        if self.w.carried.is_empty() && !is_loaded(self.system, self.settings.tolerance) {
            return rest;
        }
        self.at(&rest, 0.0);
        self.w.positions.clone()
    }

    /// Follows the branch from rest. Returns the last shape on it, where that is, and, where it was followed by [`Path::there_and_back`],
    /// what that returned.
    pub fn lead(&mut self, shortest: f64) -> (Vec<SVector<f64, D>>, PathEnd, Option<(Solution, bool)>) {
        let mut shape = self.begin();
        let found = self.there_and_back(&shape);
        if found.is_some() {
            return (self.w.positions.clone(), PathEnd::Whole, found);
        }
        let end = self.follow(&mut shape, shortest);
        (shape, end, None)
    }

    fn steps(&self) -> usize {
        if self.system.tissue().is_expensive() { STEPS_OF_A_CONTINUUM } else { STEPS }
    }

    /// Follows the branch from `shape` without tensions; `shape` is then the last one on it. A step that does not continue the branch
    /// is halved until it is shorter than the part `shortest` of the load.
    fn follow(&mut self, shape: &mut Vec<SVector<f64, D>>, shortest: f64) -> PathEnd {
        let longest = 1.0 / self.steps() as f64;
        let (mut reached, mut step) = (0.0, longest);
        while reached < 1.0 {
            if self.solves >= self.settings.most_solves {
                return PathEnd::Stopped { reached };
            }
            let load = f64::min(reached + step, 1.0);
            if let Some(next) = self.continued(shape, reached, load) {
                (reached, *shape) = (load, next);
                step = f64::min(2.0 * step, longest);
            } else {
                step *= 0.5;
                if step < shortest * load {
                    return PathEnd::Critical { reached, load: reached + step };
                }
            }
        }
        PathEnd::Whole
    }

    /// Solves at a part of the load from given positions.
    pub fn at(&mut self, from: &[SVector<f64, D>], load: f64) -> Solution {
        self.solve(from, load, self.settings)
    }

    /// As [`Path::at`], but with few iterations and without load steps from rest, because a shorter step
    /// along the branch is cheaper.
    fn attempt(&mut self, from: &[SVector<f64, D>], load: f64) -> Solution {
        let max_iterations = self.settings.max_iterations.min(MOST_ITERATIONS);
        self.solve(from, load, &SolveSettings { max_iterations, load_steps: 0, ..*self.settings })
    }

    fn solve(&mut self, from: &[SVector<f64, D>], load: f64, settings: &SolveSettings) -> Solution {
        self.w.forget_factor();
        self.go_on(from, load, settings)
    }

    /// The same with the factor at hand, where that is one of the stiffness at `from`: the first step is
    /// then the linear answer to the change of the load.
    fn go_on(&mut self, from: &[SVector<f64, D>], load: f64, settings: &SolveSettings) -> Solution {
        let part: Vec<f64> = self.tensions.iter().map(|t| t * load).collect();
        self.w.positions.copy_from_slice(from);
        let solution = solve(self.system, self.w, &part, settings);
        self.solves += 1;
        self.spent.add_cost(&solution);
        solution
    }

    /// The branch from rest in equal steps up to the whole load and back, for tissue whose solves are expensive.
    ///
    /// If both ways have the same shapes, it returns the solution at the whole load, which is left in the
    /// workspace, and whether the body has another shape after the load was doubled and reduced again.
    /// Otherwise, and for springs, it returns `None`. [`Path::continued`] and [`Path::stays_elsewhere`] ask the
    /// same; here each solve begins with the factor of the one before, at less than half the cost.
    fn there_and_back(&mut self, rest: &[SVector<f64, D>]) -> Option<(Solution, bool)> {
        if !self.system.tissue().is_expensive() {
            return None;
        }
        let steps = self.steps();
        let max_iterations = self.settings.max_iterations.min(MOST_ITERATIONS);
        let up = SolveSettings { max_iterations, load_steps: 0, ..*self.settings };
        // The shape is recognised long before its last digits are known.
        let back = SolveSettings { certify: false, tolerance: up.tolerance.max(SHOWN), ..up };
        let load = |step: usize| step as f64 / steps as f64;
        let mut shapes = vec![rest.to_vec()];
        let mut solution = Solution::NONE;
        self.w.forget_factor();
        for step in 1..=steps {
            solution = self.go_on(&shapes[step - 1], load(step), &up);
            if !is_simple(&solution) {
                return None;
            }
            shapes.push(self.w.positions.clone());
        }
        let (end, force) = (&shapes[steps], self.w.force.clone());
        let asked = self.settings.beyond;
        let over = asked && is_simple(&self.go_on(end, 2.0, &up)) && {
            let there = self.w.positions.clone();
            is_simple(&self.go_on(&there, 1.0, &back)) && self.is_same(end)
        };
        let stays_elsewhere = asked && !over && self.stays_elsewhere(end, 2.0);
        if asked && !over {
            self.w.forget_factor();
        }
        for step in (0..steps).rev() {
            if !is_simple(&self.go_on(&shapes[step + 1], load(step), &back)) || !self.is_same(&shapes[step]) {
                return None;
            }
        }
        self.w.positions.copy_from_slice(end);
        self.w.force.copy_from_slice(&force);
        self.w.tensions.copy_from_slice(self.tensions);
        self.w.forget_factor();
        Some((solution, stays_elsewhere))
    }

    /// The shape at `load` if it continues the branch on which `from` lies at `start`.
    fn continued(&mut self, from: &[SVector<f64, D>], start: f64, load: f64) -> Option<Vec<SVector<f64, D>>> {
        let up = self.attempt(from, load);
        if up.status != SolveStatus::Converged
            || up.escapes + up.ridges > 0
            || up.stability == Stability::Unstable
        {
            return None;
        }
        let there = self.w.positions.clone();
        let back = self.attempt(&there, start);
        (back.status == SolveStatus::Converged && self.is_same(from)).then_some(there)
    }

    /// How the branch ends whose last stable shape this is.
    fn end_of_branch(&mut self, shape: &[SVector<f64, D>], load: f64) -> CriticalKind {
        self.at(shape, load);
        // Leaves the critical mode in the unknowns.
        smallest_eigenvalue(self.system, self.w);
        let work = self.work_on_mode();
        if work < ORTHOGONAL { CriticalKind::Bifurcation } else { CriticalKind::LimitPoint }
    }

    /// Work of the load on the mode in the workspace's unknowns, as part of the greatest that any mode could
    /// get.
    fn work_on_mode(&mut self) -> f64 {
        let w = &mut *self.w;
        w.step.fill(SVector::zeros());
        for &muscle in self.system.contracting() {
            let mut rate = vec![SVector::zeros(); w.step.len()];
            let at = Configuration { positions: &w.positions, tensions: &w.tensions };
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
        // The step belongs to unknowns only; Newton's method relies on zeros elsewhere.
        w.step.fill(SVector::zeros());
        if load * mode > 0.0 { work.abs() / (load * mode).sqrt() } else { 0.0 }
    }

    /// Whether the body, brought from `end` to another part of the load and back to all of it, rests
    /// elsewhere.
    fn stays_elsewhere(&mut self, end: &[SVector<f64, D>], via: f64) -> bool {
        let away = self.at(end, via);
        let there = self.w.positions.clone();
        let back = self.at(&there, 1.0);
        let settled = [away, back].iter().all(|s| s.status == SolveStatus::Converged);
        settled && !self.is_same(end)
    }

    fn is_same(&self, shape: &[SVector<f64, D>]) -> bool {
        let size = geometry::extent(self.system.rest());
        self.w.positions.iter().zip(shape).all(|(p, q)| (p - q).norm() < BACK * size)
    }
}

/// A step past a fold crosses shapes whose stiffness is not positive definite, and may come back; shorter steps show whether it does.
fn is_simple(s: &Solution) -> bool {
    s.status == SolveStatus::Converged
        && s.safeguarded + s.escapes + s.ridges == 0
        && s.stability != Stability::Unstable
}
