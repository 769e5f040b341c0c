//! The path of equilibria from rest to a load: how far it is one stable branch, how that branch ends, and to which shape the body then
//! moves.

use nalgebra::SVector;
use serde::Serialize;

use super::{
    Connection, Solution, SolveSettings, SolveStatus, Stability, Workspace, smallest_eigenvalue, solve,
};
use crate::effect::Configuration;
use crate::geometry;
use crate::system::System;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CriticalKind {
    /// The path turns back in load, and beyond it the body jumps to another shape (snap-through).
    LimitPoint,
    /// The path continues but is unstable, and other paths branch off: the load does no work on the critical mode (buckling).
    Bifurcation,
}

/// The end of the stable branch that begins at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Critical {
    /// Part of the tensions.
    pub load: f64,
    pub kind: CriticalKind,
}

/// How loads that grow together lead from rest to a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FromRest {
    /// One branch of stable equilibria, which was followed there and back, leads to it.
    Branch,
    /// The branch ends, and the body jumps from there to the shape.
    Jumped(Critical),
    /// The branch ends, and it was not found where the body jumps from there.
    Lost(Critical),
    /// The branch was followed up to this part of the loads, where [`SolveSettings::most_solves`] were used up; 0 too if no equilibrium
    /// without tensions was found. The shape may lie on another branch.
    NotKnown { reached: f64 },
}

impl FromRest {
    /// Whether the body reaches the shape as the loads grow, jumps included.
    pub fn leads_here(&self) -> bool {
        matches!(self, Self::Branch | Self::Jumped(_))
    }

    /// The end of the branch from rest, if it was met.
    pub fn critical(&self) -> Option<Critical> {
        match self {
            Self::Jumped(critical) | Self::Lost(critical) => Some(*critical),
            Self::Branch | Self::NotKnown { .. } => None,
        }
    }

    /// Part of the loads at which the solves were used up.
    pub fn stopped(&self) -> Option<f64> {
        match self {
            Self::NotKnown { reached } => Some(*reached),
            _ => None,
        }
    }
}

impl Default for FromRest {
    fn default() -> Self {
        Self::NotKnown { reached: 0.0 }
    }
}

/// Result of following the equilibria from rest to the load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trace {
    /// The solve that ended at the whole load; its positions are in the workspace.
    pub solution: Solution,
    pub from_rest: FromRest,
    /// Whether a second equilibrium was found at this load: the one from whose branch the body jumped, its mirror image, the one in which
    /// the body stays after twice the load, or in [`super::solve_and_trace`] that of the direct solve. Without [`SolveSettings::beyond`]
    /// twice the load is not tried.
    pub another: bool,
    /// Whether Newton's method from the start in the workspace gives the same shape; [`trace`] does not check it.
    pub same_by_newton: bool,
    /// Number of factorisations of a stiffness, in [`super::solve_and_trace`] with those of the direct solve.
    pub factorisations: usize,
}

/// Smallest number of steps along the branch of a body of springs.
const STEPS: usize = 10;
/// Smallest number of steps along the branch of a continuum, whose solves cost twenty times as much as those of springs.
const CONTINUUM_STEPS: usize = 4;

/// Two shapes of a step and back are the same if no node differs by more than this part of the body's size. It is larger than
/// [`super::SAME_SHAPE_M`], because these solves are less accurate.
const RETURN_DISTANCE: f64 = 1e-6;
/// Residual force, N, at which a solve back along the branch is accurate enough to compare shapes.
const RETURN_TOLERANCE: f64 = 1e-6;
/// Number of Newton iterations above which a step along the branch is too long.
const MOST_ITERATIONS: usize = 40;
/// Part of the load to which the critical load is located.
const RESOLUTION: f64 = 1e-9;
/// The load counts as orthogonal to a critical mode if its work on it is below this part of the largest possible.
const ORTHOGONAL: f64 = 1e-4;

/// Follows the equilibria from rest as the tensions grow to `tensions`, locates the load at which their branch ends, and solves from there
/// for the equilibrium to which the body jumps. It takes at least ten steps, in a continuum at least four.
///
/// A step continues the branch if its solve descended from no unstable equilibrium, and if a solve at the former load leads back to the
/// former shape. Other steps are halved until they are shorter than the resolution. Each step costs two solves, and locating the end of a
/// branch about 120.
#[inline(never)]
pub fn trace<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Trace {
    let settings = SolveSettings { certify: true, ..*settings };
    let mut path = Path {
        system,
        w: workspace,
        tensions,
        settings: &settings,
        solves: 0,
        cost: Solution::NONE,
        reached: 0.0,
        ends_at: None,
    };
    let (mut shape, follow_and_return) = path.follow_from_rest();
    let critical = path.ends_at.map(|load| Critical { load, kind: path.critical_kind(&shape) });
    let (solution, another) = follow_and_return.unwrap_or_else(|| {
        let solution = path.solve_at(&shape, 1.0);
        shape.clone_from(&path.w.positions);
        let another = match &critical {
            // Branches meet at the critical load. If the body reaches another shape when it is brought back from rest, another branch
            // still exists at the whole load.
            Some(c) => c.kind == CriticalKind::Bifurcation || path.finds_another_shape(&shape, 0.0),
            None => settings.beyond && path.reached == 1.0 && path.finds_another_shape(&shape, 2.0),
        };
        (solution, another)
    });
    path.w.positions.copy_from_slice(&shape);
    path.w.discard_factor();
    path.w.tensions.copy_from_slice(tensions);
    let Solution { iterations, factorisations, energy_evaluations, .. } = path.cost;
    let from_rest = match (critical, solution.status == SolveStatus::Converged) {
        (Some(critical), true) => FromRest::Jumped(critical),
        (Some(critical), false) => FromRest::Lost(critical),
        (None, true) if path.reached == 1.0 => FromRest::Branch,
        (None, _) => FromRest::NotKnown { reached: path.reached },
    };
    let connection = if from_rest == FromRest::Branch { Connection::Traced } else { solution.connection };
    let solution = Solution { connection, iterations, factorisations, energy_evaluations, ..solution };
    Trace { solution, from_rest, another, same_by_newton: false, factorisations }
}

/// Whether a force larger than `tolerance`, N, acts on the body at rest without tensions.
fn is_loaded<const D: usize>(system: &System<D>, tolerance: f64) -> bool {
    let rest = system.rest();
    let mut force = vec![SVector::zeros(); rest.len()];
    let tensions = vec![0.0; system.muscle_count()];
    system.force(Configuration { positions: rest, tensions: &tensions }, &mut force);
    force.iter().any(|f| f.norm() > tolerance)
}

struct Path<'a, const D: usize> {
    system: &'a System<D>,
    w: &'a mut Workspace<D>,
    tensions: &'a [f64],
    settings: &'a SolveSettings,
    solves: usize,
    cost: Solution,
    /// Part of the load up to which the branch was followed.
    reached: f64,
    /// The part to which the branch cannot be continued; `None` at the whole load, or if the solves were used up.
    ends_at: Option<f64>,
}

impl<const D: usize> Path<'_, D> {
    /// Follows the branch from its beginning: rest, or with displaced bones, or under a load such as weight, the equilibrium without
    /// tensions. Returns its last shape, and the result of [`Path::follow_and_return`].
    fn follow_from_rest(&mut self) -> (Vec<SVector<f64, D>>, Option<(Solution, bool)>) {
        let mut shape = self.system.rest().to_vec();
        if !self.w.displaced.is_empty() || is_loaded(self.system, self.settings.tolerance) {
            let beginning = self.solve_at(&shape, 0.0);
            shape.clone_from(&self.w.positions);
            if beginning.status != SolveStatus::Converged {
                return (shape, None);
            }
        }
        let found = self.follow_and_return(&shape);
        if found.is_some() {
            self.reached = 1.0;
            return (self.w.positions.clone(), found);
        }
        self.follow(&mut shape);
        (shape, None)
    }

    fn steps(&self) -> usize {
        if self.system.tissue().is_expensive() { CONTINUUM_STEPS } else { STEPS }
    }

    /// Follows the branch from `shape`, which has no tensions, and leaves the last shape on the branch there. A step that does not
    /// continue the branch is halved until it is shorter than the resolution.
    fn follow(&mut self, shape: &mut Vec<SVector<f64, D>>) {
        let longest = 1.0 / self.steps() as f64;
        let mut step = longest;
        while self.reached < 1.0 && self.solves < self.settings.most_solves {
            let load = f64::min(self.reached + step, 1.0);
            if let Some(next) = self.continued(shape, self.reached, load) {
                (self.reached, *shape) = (load, next);
                step = f64::min(2.0 * step, longest);
            } else {
                step *= 0.5;
                if step < RESOLUTION * load {
                    self.ends_at = Some(self.reached + step);
                    return;
                }
            }
        }
    }

    /// Solves at a part of the load from these positions, m.
    fn solve_at(&mut self, from: &[SVector<f64, D>], load: f64) -> Solution {
        self.w.discard_factor();
        self.solve_with_factor(from, load, self.settings)
    }

    /// Settings with few iterations and no load steps, because shorter steps along the branch are cheaper.
    fn step_settings(&self) -> SolveSettings {
        let max_iterations = self.settings.max_iterations.min(MOST_ITERATIONS);
        SolveSettings { max_iterations, load_steps: 0, ..*self.settings }
    }

    /// Solves with the factor in the workspace, which must be one of the stiffness at `from`: the first step is then the linear response
    /// to the change of the load.
    fn solve_with_factor(
        &mut self,
        from: &[SVector<f64, D>],
        load: f64,
        settings: &SolveSettings,
    ) -> Solution {
        let part: Vec<f64> = self.tensions.iter().map(|t| t * load).collect();
        self.w.positions.copy_from_slice(from);
        let solution = solve(self.system, self.w, &part, settings);
        self.solves += 1;
        self.cost.add_cost(&solution);
        solution
    }

    /// Follows the branch from rest in equal steps up to the whole load and back, for tissue whose solves are expensive.
    ///
    /// If the shapes are the same in both directions, it leaves the solution at the whole load in the workspace, and returns it and
    /// whether the body has another shape after the load was doubled and reduced again. Otherwise, and for springs, it returns `None`.
    /// Each solve begins with the factor of the one before, so that this costs less than half of [`Path::continued`] and
    /// [`Path::finds_another_shape`].
    fn follow_and_return(&mut self, rest: &[SVector<f64, D>]) -> Option<(Solution, bool)> {
        if !self.system.tissue().is_expensive() {
            return None;
        }
        let steps = self.steps();
        let up = self.step_settings();
        // Shapes can be compared before their last digits are known.
        let back = SolveSettings { certify: false, tolerance: up.tolerance.max(RETURN_TOLERANCE), ..up };
        let load = |step: usize| step as f64 / steps as f64;
        let mut shapes = vec![rest.to_vec()];
        let mut solution = Solution::NONE;
        self.w.discard_factor();
        for step in 1..=steps {
            solution = self.solve_with_factor(&shapes[step - 1], load(step), &up);
            if !stays_definite(&solution) {
                return None;
            }
            shapes.push(self.w.positions.clone());
        }
        let (end, force) = (&shapes[steps], self.w.force.clone());
        let beyond = self.settings.beyond;
        let over = beyond && stays_definite(&self.solve_with_factor(end, 2.0, &up)) && {
            let there = self.w.positions.clone();
            stays_definite(&self.solve_with_factor(&there, 1.0, &back)) && self.is_same(end)
        };
        let finds_another_shape = beyond && !over && self.finds_another_shape(end, 2.0);
        if beyond && !over {
            self.w.discard_factor();
        }
        for step in (0..steps).rev() {
            if !stays_definite(&self.solve_with_factor(&shapes[step + 1], load(step), &back))
                || !self.is_same(&shapes[step])
            {
                return None;
            }
        }
        self.w.positions.copy_from_slice(end);
        self.w.force.copy_from_slice(&force);
        self.w.tensions.copy_from_slice(self.tensions);
        self.w.discard_factor();
        Some((solution, finds_another_shape))
    }

    /// The shape at `load` if it continues the branch on which `from` lies at `start`.
    fn continued(&mut self, from: &[SVector<f64, D>], start: f64, load: f64) -> Option<Vec<SVector<f64, D>>> {
        let settings = self.step_settings();
        self.w.discard_factor();
        let up = self.solve_with_factor(from, load, &settings);
        if !stays_stable(&up) {
            return None;
        }
        let there = self.w.positions.clone();
        self.w.discard_factor();
        let back = self.solve_with_factor(&there, start, &settings);
        (back.status == SolveStatus::Converged && self.is_same(from)).then_some(there)
    }

    /// The kind of the end of the branch whose last stable shape is `shape`.
    fn critical_kind(&mut self, shape: &[SVector<f64, D>]) -> CriticalKind {
        self.solve_at(shape, self.reached);
        // This leaves the critical mode in the workspace's unknowns.
        smallest_eigenvalue(self.system, self.w);
        let work = self.work_on_mode();
        if work < ORTHOGONAL { CriticalKind::Bifurcation } else { CriticalKind::LimitPoint }
    }

    /// Work of the load on the mode in the workspace's unknowns, over the largest work on any mode of this norm.
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
        // Newton's method relies on a step of zero at nodes that are no unknowns.
        w.step.fill(SVector::zeros());
        if load * mode > 0.0 { work.abs() / (load * mode).sqrt() } else { 0.0 }
    }

    /// Whether the body has another shape than `end` after a change of the load to the part `via` and back.
    fn finds_another_shape(&mut self, end: &[SVector<f64, D>], via: f64) -> bool {
        let away = self.solve_at(end, via);
        let there = self.w.positions.clone();
        let back = self.solve_at(&there, 1.0);
        let converged = [away, back].iter().all(|s| s.status == SolveStatus::Converged);
        converged && !self.is_same(end)
    }

    fn is_same(&self, shape: &[SVector<f64, D>]) -> bool {
        let size = geometry::extent(self.system.rest());
        self.w.positions.iter().zip(shape).all(|(p, q)| (p - q).norm() < RETURN_DISTANCE * size)
    }
}

/// Whether a solve met only positive definite stiffnesses. Beyond a fold it does not, and shorter steps show whether the branch continues.
fn stays_definite(s: &Solution) -> bool {
    s.safeguarded == 0 && stays_stable(s)
}

/// Whether a solve converged without a descent from an unstable state.
fn stays_stable(s: &Solution) -> bool {
    s.status == SolveStatus::Converged && s.escapes + s.ridges == 0 && s.stability != Stability::Unstable
}
