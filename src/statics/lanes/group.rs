//! Four equilibria at once: Newton's method as [`crate::statics::solve`] has it, with a line search and a status in each lane.

use nalgebra::SVector;
use pulp::NullaryFnOnce;

use crate::geometry::simplex;
use crate::statics::newton::{
    ENERGY_NOISE, FAST_ENOUGH, NEGLIGIBLE, PATIENCE, ROUNDING, SUFFICIENT_DECREASE,
};
use crate::statics::solve::{FOLLOWED, MOST_PARTS};
use crate::statics::{Settings, Solution, Stability, Status};
use crate::system::System;

use super::factor::{Block, Factor, Factorise, Lower, Solve, vectors};
use super::local::{Assemble, Evaluate, Local};
use super::plan::{Numbers, Plan};
use super::wide::{LANES, NO_PAIR, Pair, Wide, way};

/// A lane that must go a shorter part of a step than this is left to the solver for one.
const SHORTEST_STEP: f64 = 1e-4;
/// A part of a bone's way that is not worth going.
const LEAST_PART: f64 = 1e-6;
/// A cell may lose at most this part of its measure when bones are carried.
const LARGEST_LOSS: f64 = 0.9;
/// Larger and larger shifts of a convex stiffness that is singular.
const MOST_SHIFTS: usize = 8;

/// Where a lane is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    Running,
    Converged,
    /// Only the solver for one can tell what becomes of it.
    GivenUp,
}

/// What a lane has done, and how it stands.
#[derive(Debug, Clone, Copy)]
struct Lane {
    phase: Phase,
    /// Whether it holds a load.
    is_set: bool,
    done: Solution,
    residual: f64,
    tolerance: f64,
    /// Largest tension, N.
    pull: f64,
    extent: f64,
    safeguarded_in_a_row: usize,
    /// Whether its last factor was that of the exact stiffness.
    exact: bool,
}

/// All that four solves write to.
#[derive(Debug)]
pub(super) struct Work {
    arch: pulp::Arch,
    numbers: Numbers,
    /// Tension of every edge, N.
    tension: Vec<Wide>,
    positions: Vec<Pair>,
    trial: Vec<Pair>,
    force: Vec<Pair>,
    step: Vec<Pair>,
    /// Of every triangle, where it was last evaluated, and zero of none.
    h: Vec<Wide>,
    blocks: Vec<Block>,
    diagonal: Vec<Lower>,
    factor: Factor,
    factor_ready: bool,
    /// Where bone nodes are to be.
    targets: Vec<Pair>,
    lanes: [Lane; LANES],
}

impl Work {
    pub fn new(plan: &Plan) -> Self {
        let nodes = plan.node.len();
        let lane = Lane {
            phase: Phase::GivenUp,
            is_set: false,
            done: Solution::NONE,
            residual: f64::INFINITY,
            tolerance: 0.0,
            pull: 0.0,
            extent: 0.0,
            safeguarded_in_a_row: 0,
            exact: false,
        };
        Self {
            arch: pulp::Arch::new(),
            numbers: plan.numbers(),
            tension: vec![Wide::ZERO; plan.edges.len()],
            positions: vec![NO_PAIR; nodes],
            trial: vec![NO_PAIR; nodes],
            force: vec![NO_PAIR; nodes],
            step: vectors(&plan.factor),
            h: vec![Wide::ZERO; plan.cells.len() + 1],
            blocks: vec![[Wide::ZERO; 4]; plan.edges.len()],
            diagonal: vec![[Wide::ZERO; 3]; nodes],
            factor: plan.factor.factor(),
            factor_ready: false,
            targets: vec![NO_PAIR; nodes - plan.unknowns],
            lanes: [lane; LANES],
        }
    }

    /// Puts a body into a lane; false where it is not one of this plan.
    pub fn set_body<const D: usize>(&mut self, plan: &Plan, lane: usize, system: &System<D>) -> bool {
        plan.fill(system, lane, &mut self.numbers)
    }

    /// Puts tensions, the start and the places of the bones into a lane, and has it solved next.
    pub fn set_load<const D: usize>(
        &mut self,
        plan: &Plan,
        lane: usize,
        tensions: &[f64],
        start: &[SVector<f64, D>],
        bone: impl Fn(usize) -> SVector<f64, D>,
    ) {
        self.set_positions(plan, lane, start);
        let extent = plan.node.iter().map(|&n| start[n].amax()).fold(0.0, f64::max);
        for (to, &node) in self.targets.iter_mut().zip(&plan.node[plan.unknowns..]) {
            let held = bone(node);
            (0..2).for_each(|axis| to[axis].0[lane] = held[axis]);
        }
        self.tension.iter_mut().for_each(|t| t.0[lane] = 0.0);
        for &(edge, muscle) in &plan.pulls {
            self.tension[edge as usize].0[lane] += tensions[muscle as usize];
        }
        let pull = tensions.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        let before = self.lanes[lane];
        self.lanes[lane] = Lane {
            phase: Phase::Running,
            is_set: true,
            done: Solution::NONE,
            residual: f64::INFINITY,
            pull,
            extent,
            safeguarded_in_a_row: 0,
            ..before
        };
    }

    /// Whether a lane holds a load of the last solve, solved here or not.
    pub fn is_set(&self, lane: usize) -> bool {
        self.lanes[lane].is_set
    }

    /// Takes the loads out of all lanes.
    pub fn clear(&mut self) {
        self.lanes.iter_mut().for_each(|l| (l.phase, l.is_set) = (Phase::GivenUp, false));
    }

    /// Has a lane do as another one, so that it holds numbers.
    pub fn copy_lane(&mut self, from: usize, to: usize) {
        let n = &mut self.numbers;
        let wides = [&mut n.stiffness, &mut n.rest, &mut n.kappa, &mut n.inverse_area, &mut self.tension];
        wides.into_iter().flatten().for_each(|w| w.0[to] = w.0[from]);
        for x in self.positions.iter_mut().chain(&mut self.targets) {
            x.iter_mut().for_each(|w| w.0[to] = w.0[from]);
        }
        self.lanes[to] = Lane { phase: Phase::GivenUp, is_set: false, ..self.lanes[from] };
    }

    /// Has the next solve begin with a factor of its own.
    pub fn forget_factor(&mut self) {
        self.factor_ready = false;
        self.lanes.iter_mut().for_each(|l| l.exact = false);
    }

    /// Puts the positions of a shape solved elsewhere into a lane.
    pub fn set_positions<const D: usize>(&mut self, plan: &Plan, lane: usize, positions: &[SVector<f64, D>]) {
        for (x, &node) in self.positions.iter_mut().zip(&plan.node) {
            (0..2).for_each(|axis| x[axis].0[lane] = positions[node][axis]);
        }
    }

    /// What came out in a lane; `None` where it was given up.
    pub fn solution(&self, lane: usize) -> Option<Solution> {
        let lane = &self.lanes[lane];
        (lane.phase == Phase::Converged).then_some(lane.done)
    }

    /// Positions of a lane, m, into those of all nodes of the mesh; those of the inner nodes of paths stay.
    pub fn positions<const D: usize>(&self, plan: &Plan, lane: usize, positions: &mut [SVector<f64, D>]) {
        for (x, &node) in self.positions.iter().zip(&plan.node) {
            (0..2).for_each(|axis| positions[node][axis] = x[axis].0[lane]);
        }
    }

    /// Solves all lanes that were set.
    pub fn solve(&mut self, plan: &Plan, settings: &Settings) {
        for part in 1..=MOST_PARTS {
            let mut all_there = true;
            for lane in 0..LANES {
                if self.lanes[lane].phase == Phase::GivenUp {
                    continue;
                }
                let there = self.carry(plan, lane);
                self.lanes[lane].tolerance =
                    if there { settings.tolerance } else { settings.tolerance.max(FOLLOWED) };
                if !there && part == MOST_PARTS {
                    self.lanes[lane].phase = Phase::GivenUp;
                }
                all_there &= there || self.lanes[lane].phase == Phase::GivenUp;
            }
            self.newton(plan, settings.max_iterations);
            if all_there {
                break;
            }
        }
        self.check_stability(plan, settings.certify);
        // A lane that was given up may hold no factor that the next solve could begin with.
        self.factor_ready &= self.lanes.iter().all(|l| l.phase == Phase::Converged);
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Converged) {
            lane.done.status = Status::Converged;
            lane.done.max_residual_force = lane.residual;
            lane.done.load_reached = 1.0;
        }
    }

    /// Moves the bones of a lane to their places, or a part of the way where cells are in it; whether they are there.
    fn carry(&mut self, plan: &Plan, lane: usize) -> bool {
        let at = |x: &Pair| of_lane(x, lane);
        let bones = &self.positions[plan.unknowns..];
        let ways: Vec<_> = self.targets.iter().zip(bones).map(|(to, x)| at(to) - at(x)).collect();
        if ways.iter().all(|w| w.amax() == 0.0) {
            return true;
        }
        let limit = step_limit(plan, |n| {
            let bone = n.checked_sub(plan.unknowns);
            (at(&self.positions[n]), bone.map_or(SVector::zeros(), |b| ways[b]))
        });
        if limit < LEAST_PART {
            self.lanes[lane].phase = Phase::GivenUp;
            return false;
        }
        let part = if limit < 1.0 { 0.5 * limit } else { 1.0 };
        for ((x, to), w) in self.positions[plan.unknowns..].iter_mut().zip(&self.targets).zip(&ways) {
            for axis in 0..2 {
                let here = x[axis].0[lane];
                x[axis].0[lane] = if part < 1.0 { here + w[axis] * part } else { to[axis].0[lane] };
            }
        }
        self.factor_ready = false;
        self.lanes[lane].phase = Phase::Running;
        part == 1.0
    }

    /// Goes on in all lanes until each has converged or is given up.
    fn newton(&mut self, plan: &Plan, max_iterations: usize) {
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Converged) {
            lane.phase = Phase::Running;
        }
        let here = self.evaluate(plan);
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
            lane.residual = here.residual_squared.0[i].sqrt();
            lane.done.energy = here.energy.0[i];
            lane.done.energy_evaluations += 1;
            if !here.upright[i] {
                lane.phase = Phase::GivenUp;
            }
        }
        let mut reuse = self.factor_ready;
        while self.begin_iteration(max_iterations) {
            if !reuse {
                self.factorise(plan);
            }
            let slope = self.find_step(plan);
            reuse = self.take_step(plan, slope, reuse);
        }
    }

    /// Which lanes go on; whether any does.
    fn begin_iteration(&mut self, max_iterations: usize) -> bool {
        let mut any = false;
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Running) {
            let (residual, floor) = (lane.residual, lane.done.rounding_force);
            if !(residual.is_finite() && lane.done.energy.is_finite()) {
                lane.phase = Phase::GivenUp;
            } else if residual <= lane.tolerance || residual <= floor.min(NEGLIGIBLE * lane.pull) {
                lane.phase = Phase::Converged;
            } else if lane.done.iterations == max_iterations {
                lane.phase = Phase::GivenUp;
            } else {
                lane.done.iterations += 1;
                any = true;
            }
        }
        any
    }

    /// Factorises the exact stiffness in all lanes; in those where it is not positive definite the convex one, with a growing multiple
    /// of the unit matrix.
    fn factorise(&mut self, plan: &Plan) {
        let mut convex = [false; LANES];
        let largest = self.assemble(plan, convex);
        for (i, lane) in self.lanes.iter_mut().enumerate() {
            lane.done.rounding_force = ROUNDING * largest.0[i] * lane.extent;
        }
        let mut safe = self.try_factor(plan);
        let mut shift = [0.0; LANES];
        for tries in 0..=MOST_SHIFTS {
            let mut all_safe = true;
            for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
                if tries == 0 {
                    lane.exact = safe[i];
                    lane.safeguarded_in_a_row = if safe[i] { 0 } else { lane.safeguarded_in_a_row + 1 };
                    lane.done.safeguarded += usize::from(!safe[i]);
                }
                if !safe[i] && (tries == MOST_SHIFTS || lane.safeguarded_in_a_row > PATIENCE) {
                    lane.phase = Phase::GivenUp;
                }
                if !safe[i] && lane.phase == Phase::Running {
                    (all_safe, convex[i]) = (false, true);
                }
            }
            if all_safe {
                break;
            }
            let largest = self.assemble(plan, convex);
            for lane in 0..LANES {
                if !safe[lane] {
                    shift[lane] = if tries == 0 { 1e-6 * largest.0[lane] } else { 10.0 * shift[lane] };
                }
            }
            for d in &mut self.diagonal[..plan.unknowns] {
                d[0] += Wide(shift);
                d[2] += Wide(shift);
            }
            safe = self.try_factor(plan);
        }
        self.factor_ready = true;
    }

    /// Looks at the stability of the equilibria of which the last factor does not tell it, or of all.
    fn check_stability(&mut self, plan: &Plan, certify: bool) {
        let is_open = |l: &Lane| l.phase == Phase::Converged && (certify || !l.exact);
        let open = self.lanes.each_ref().map(is_open);
        let stable = if open.contains(&true) { self.factorise_exactly(plan) } else { [true; LANES] };
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Converged) {
            lane.done.stability = if open[i] { Stability::Stable } else { Stability::Near };
            if open[i] && !stable[i] {
                lane.phase = Phase::GivenUp;
            }
        }
    }

    /// Factorises the exact stiffness at the present positions; in which lanes it is positive definite.
    pub fn factorise_exactly(&mut self, plan: &Plan) -> [bool; LANES] {
        self.evaluate(plan);
        self.assemble(plan, [false; LANES]);
        let safe = self.try_factor(plan);
        self.lanes.iter_mut().zip(safe).for_each(|(lane, safe)| lane.exact = safe);
        // A lane without a factor would spoil the next solve's first step.
        self.factor_ready = safe == [true; LANES];
        safe
    }

    fn try_factor(&mut self, plan: &Plan) -> [bool; LANES] {
        for lane in &mut self.lanes {
            lane.done.factorisations += usize::from(lane.phase != Phase::GivenUp);
        }
        let (edges, diagonal, factor) = (&self.blocks, &self.diagonal, &mut self.factor);
        self.arch.dispatch(Factorise { symbolic: &plan.factor, edges, diagonal, factor })
    }

    /// Assembles the stiffness; the largest entries on its diagonal.
    fn assemble(&mut self, plan: &Plan, convex: [bool; LANES]) -> Wide {
        let Self { numbers, tension, positions: x, h, blocks, diagonal, .. } = self;
        self.arch.dispatch(Assemble { plan, numbers, tension, x, h, convex, blocks, diagonal })
    }

    /// Energy and forces at the present positions.
    fn evaluate(&mut self, plan: &Plan) -> Local {
        let Self { numbers, tension, positions: x, h, force, .. } = self;
        self.arch.dispatch(Evaluate { plan, numbers, tension, x, h, force })
    }

    /// Solves for the step; the slope of the energy along it, J.
    fn find_step(&mut self, plan: &Plan) -> Wide {
        self.step.copy_from_slice(&self.force[..plan.unknowns]);
        let (factor, b) = (&self.factor, &mut self.step);
        self.arch.dispatch(Solve { symbolic: &plan.factor, factor, b });
        let along = self.step.iter().zip(&self.force);
        along.fold(Wide::ZERO, |slope, (s, f)| slope - (s[0] * f[0] + s[1] * f[1]))
    }

    /// Moves every lane along its step as far as its energy falls. Whether the factor serves once more: each lane has moved, and fast.
    fn take_step(&mut self, plan: &Plan, slope: Wide, reused: bool) -> bool {
        let mut part = Wide(self.lanes.map(|l| if l.phase == Phase::Running { 1.0 } else { 0.0 }));
        let mut taken = part.0.map(|p| p == 0.0);
        let before = self.lanes;
        std::mem::swap(&mut self.positions, &mut self.trial);
        self.positions[plan.unknowns..].copy_from_slice(&self.trial[plan.unknowns..]);
        loop {
            let Self { arch, positions, trial, step, .. } = &mut *self;
            arch.dispatch(Advance { x: positions, from: trial, step, part });
            let there = self.evaluate(plan);
            let mut again = false;
            for i in 0..LANES {
                let (lane, trial, step) = (&mut self.lanes[i], &self.trial, &self.step);
                if taken[i] {
                    continue;
                }
                lane.done.energy_evaluations += 1;
                let (old, energy) = (before[i].done.energy, there.energy.0[i]);
                let promised = SUFFICIENT_DECREASE * part.0[i] * slope.0[i];
                if part.0[i] == 1.0 && !there.upright[i] {
                    part.0[i] = step_limit(plan, |n| {
                        let step = step.get(n).map_or(SVector::zeros(), |s| of_lane(s, i));
                        (of_lane(&trial[n], i), step)
                    });
                    if part.0[i] == 1.0 {
                        // Only the barrier can tell.
                        (part.0[i], taken[i]) = (0.0, true);
                        lane.phase = Phase::GivenUp;
                    }
                    again = true;
                } else if there.upright[i] && energy <= old + promised + ENERGY_NOISE * old.abs() {
                    lane.done.energy = energy;
                    lane.residual = there.residual_squared.0[i].sqrt();
                    taken[i] = true;
                } else {
                    part.0[i] *= 0.5;
                    if part.0[i] < SHORTEST_STEP {
                        (part.0[i], taken[i]) = (0.0, true);
                    }
                    again = true;
                }
            }
            if !again {
                break;
            }
        }
        let mut reuse = true;
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
            let noise = ENERGY_NOISE * before[i].done.energy.abs();
            let moved =
                part.0[i] > 0.0 && (-slope.0[i] * part.0[i] > noise || lane.residual < before[i].residual);
            if !moved && !reused {
                lane.phase = Phase::GivenUp;
            } else {
                reuse &= moved && lane.residual < FAST_ENOUGH * before[i].residual;
            }
        }
        reuse
    }

    /// What [`super::Adjoint`] says of the function whose derivatives by the positions of all nodes are `gradient`, with the present
    /// factor; these are made its derivatives by forces on unknowns, and by the places of the others. Returns those by tensions, one
    /// for each of the plan's pulls.
    pub fn adjoint(&self, plan: &Plan, gradient: &mut [Pair]) -> Vec<Wide> {
        let (free, held) = gradient.split_at_mut(plan.unknowns);
        self.arch.dispatch(Solve { symbolic: &plan.factor, factor: &self.factor, b: free });
        for (edge, k) in plan.edges.iter().zip(&self.blocks) {
            let [a, b] = edge.nodes.map(|n| n as usize);
            if let Some(bone) = a.checked_sub(plan.unknowns)
                && b < plan.unknowns
            {
                let u = free[b];
                held[bone][0] -= k[0] * u[0] + k[1] * u[1];
                held[bone][1] -= k[2] * u[0] + k[3] * u[1];
            }
        }
        let motion = |n: u32| free.get(n as usize).copied().unwrap_or(NO_PAIR);
        let by_tension = plan.pulls.iter().map(|&(edge, _)| {
            let [a, b] = plan.edges[edge as usize].nodes;
            let d = way(self.positions[a as usize], self.positions[b as usize]);
            let nearer = way(motion(b), motion(a));
            (d[0] * nearer[0] + d[1] * nearer[1]) * (d[0] * d[0] + d[1] * d[1]).sqrt().inverse()
        });
        by_tension.collect()
    }
}

fn of_lane(x: &Pair, lane: usize) -> SVector<f64, 2> {
    SVector::from([x[0].0[lane], x[1].0[lane]])
}

/// Largest part of a step up to which all cells keep a tenth of their measure, as the solver for one has it; `at` tells where a node is
/// and how far it is to go.
fn step_limit(plan: &Plan, at: impl Fn(usize) -> (SVector<f64, 2>, SVector<f64, 2>)) -> f64 {
    let mut limit: f64 = 1.0;
    for cell in &plan.cells {
        let mut x = [SVector::<f64, 2>::zeros(); simplex::MAX_CORNERS];
        let mut p = x;
        for (corner, &n) in cell.iter().enumerate() {
            let (here, step) = at(n as usize);
            (x[corner], p[corner]) = (here, step * limit);
        }
        limit *= simplex::way_above(&x, &p, (1.0 - LARGEST_LOSS) * simplex::measure(&x));
    }
    limit
}

/// `x = from + part step` of the unknowns, exactly `from` in lanes whose part is zero.
struct Advance<'a> {
    x: &'a mut [Pair],
    from: &'a [Pair],
    step: &'a [Pair],
    part: Wide,
}

impl NullaryFnOnce for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for ((x, from), step) in self.x.iter_mut().zip(self.from).zip(self.step) {
            for axis in 0..2 {
                let there = from[axis] + step[axis] * self.part;
                for lane in 0..LANES {
                    let stays = self.part.0[lane] == 0.0;
                    x[axis].0[lane] = if stays { from[axis].0[lane] } else { there.0[lane] };
                }
            }
        }
    }
}
