//! Equilibria of mass-spring bodies in the plane, one or several in lanes: Newton's method on flat lists of elements, with a line search
//! and a status in each lane. Loads that it cannot solve are left to the solver for any body.

mod newton;
mod rates;
mod start;

use nalgebra::SVector;

use crate::geometry::simplex;
use crate::sparse::flat::{FlatFactor, Lower, MatrixBlock};
use crate::sparse::simd::{Simd, SimdPair};
use crate::statics::solution::{BONE_STEP_TOLERANCE, MOST_BONE_STEPS, SHORTEST_BONE_STEP};
use crate::statics::{Solution, SolveSettings, SolveStatus};
use crate::system::elements::{ElementNumbers, Elements};

pub(super) use start::at_rest;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Phase {
    Running,
    Converged,
    /// The load is left to the solver for any body; a lane without a load has this phase too.
    #[default]
    GivenUp,
}

#[derive(Debug, Clone, Copy, Default)]
struct Lane {
    phase: Phase,
    is_set: bool,
    done: Solution,
    tolerance: f64,
    /// Largest tension, N.
    pull: f64,
    extent: f64,
    safeguarded_in_a_row: usize,
    /// Whether the last factor was that of the exact stiffness.
    exact: bool,
    /// Energy at rest, J, of a lane that starts from the linear response.
    energy_at_rest: Option<f64>,
}

#[derive(Debug)]
pub(crate) struct SimdNewton<const L: usize> {
    pub numbers: ElementNumbers<L>,
    tension: Vec<Simd<L>>,
    /// Positions of all nodes, m.
    pub positions: Vec<SimdPair<L>>,
    trial: Vec<SimdPair<L>>,
    /// Forces on all nodes, N.
    pub force: Vec<SimdPair<L>>,
    step: Vec<SimdPair<L>>,
    /// `h` of every triangle at the last evaluation ([`local`](crate::system::elements::local)), then a zero for edges without a second
    /// triangle.
    h: Vec<Simd<L>>,
    /// `h` of every triangle as the linear response to the last step has it; the stiffness uses this one.
    linear_h: Vec<Simd<L>>,
    blocks: Vec<MatrixBlock<L>>,
    diagonal: Vec<Lower<L>>,
    factor: FlatFactor<L>,
    factor_ready: bool,
    targets: Vec<SimdPair<L>>,
    lanes: [Lane; L],
}

impl<const L: usize> SimdNewton<L> {
    pub fn new(elements: &Elements) -> Self {
        let nodes = elements.node.len();
        Self {
            numbers: elements.numbers(),
            tension: vec![Simd::ZERO; elements.edges.len()],
            positions: vec![[Simd::ZERO; 2]; nodes],
            trial: vec![[Simd::ZERO; 2]; nodes],
            force: vec![[Simd::ZERO; 2]; nodes],
            step: vec![[Simd::ZERO; 2]; elements.unknowns],
            h: vec![Simd::ZERO; elements.cells.len() + 1],
            linear_h: vec![Simd::ZERO; elements.cells.len() + 1],
            blocks: vec![[Simd::ZERO; 4]; elements.edges.len()],
            diagonal: vec![[Simd::ZERO; 3]; nodes],
            factor: elements.factor.factor(),
            factor_ready: false,
            targets: vec![[Simd::ZERO; 2]; nodes - elements.unknowns],
            lanes: [Lane::default(); L],
        }
    }

    /// Puts tensions, the start and the places of the bones into a lane that is to be solved.
    pub fn set_load<const D: usize>(
        &mut self,
        elements: &Elements,
        lane: usize,
        tensions: &[f64],
        start: &[SVector<f64, D>],
        bone: impl Fn(usize) -> SVector<f64, D>,
    ) {
        elements.put_into_lane(lane, start, &mut self.positions);
        let extent = elements.node.iter().map(|&n| start[n].amax()).fold(0.0, f64::max);
        for (to, &node) in self.targets.iter_mut().zip(&elements.node[elements.unknowns..]) {
            let held = bone(node);
            (0..2).for_each(|axis| to[axis].0[lane] = held[axis]);
        }
        self.tension.iter_mut().for_each(|t| t.0[lane] = 0.0);
        for &(edge, muscle) in &elements.pulls {
            self.tension[edge as usize].0[lane] += tensions[muscle as usize];
        }
        let pull = tensions.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        let exact = self.lanes[lane].exact;
        self.lanes[lane] =
            Lane { phase: Phase::Running, is_set: true, pull, extent, exact, ..Lane::default() };
    }

    /// Whether a lane holds a load of the last solve, even one that was given up.
    pub fn is_set(&self, lane: usize) -> bool {
        self.lanes[lane].is_set
    }

    pub fn clear(&mut self) {
        self.lanes.iter_mut().for_each(|l| (l.phase, l.is_set) = (Phase::GivenUp, false));
    }

    /// Copies all numbers of a lane without a load from another one.
    pub fn copy_lane(&mut self, from: usize, to: usize) {
        let n = &mut self.numbers;
        let wides = [&mut n.stiffness, &mut n.rest, &mut n.kappa, &mut n.inverse_area, &mut self.tension];
        wides.into_iter().flatten().for_each(|w| w.0[to] = w.0[from]);
        for x in self.positions.iter_mut().chain(&mut self.targets) {
            x.iter_mut().for_each(|w| w.0[to] = w.0[from]);
        }
        self.lanes[to] = Lane { phase: Phase::GivenUp, is_set: false, ..self.lanes[from] };
    }

    pub fn discard_factor(&mut self) {
        self.factor_ready = false;
        self.lanes.iter_mut().for_each(|l| l.exact = false);
    }

    /// The solution of a lane; an error with its counts of work if it was given up.
    pub fn solution(&self, lane: usize) -> Result<Solution, Solution> {
        let lane = &self.lanes[lane];
        if lane.phase == Phase::Converged { Ok(lane.done) } else { Err(lane.done) }
    }

    #[inline(never)]
    pub fn solve(&mut self, elements: &Elements, settings: &SolveSettings) {
        for part in 1..=MOST_BONE_STEPS {
            let mut all_there = true;
            for lane in 0..L {
                if self.lanes[lane].phase == Phase::GivenUp {
                    continue;
                }
                let there = self.move_bones(elements, lane);
                self.lanes[lane].tolerance =
                    if there { settings.tolerance } else { settings.tolerance.max(BONE_STEP_TOLERANCE) };
                if !there && part == MOST_BONE_STEPS {
                    self.lanes[lane].phase = Phase::GivenUp;
                }
                all_there &= there || self.lanes[lane].phase == Phase::GivenUp;
            }
            self.newton(elements, settings.max_iterations);
            if all_there {
                break;
            }
        }
        self.check_stability(elements, settings.certify);
        // A lane that was given up may have no usable factor.
        self.factor_ready &= self.lanes.iter().all(|l| l.phase == Phase::Converged);
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Converged) {
            lane.done.status = SolveStatus::Converged;
            lane.done.load_reached = 1.0;
        }
    }

    /// Moves the bones of a lane to their places, or part of the path if cells would be inverted. Returns whether they are at their
    /// places.
    fn move_bones(&mut self, elements: &Elements, lane: usize) -> bool {
        let bones = &self.positions[elements.unknowns..];
        let ways: Vec<_> =
            self.targets.iter().zip(bones).map(|(to, x)| of_lane(to, lane) - of_lane(x, lane)).collect();
        if ways.iter().all(|w| w.amax() == 0.0) {
            return true;
        }
        let limit = step_limit(elements, |n| {
            let bone = n.checked_sub(elements.unknowns);
            (of_lane(&self.positions[n], lane), bone.map_or(SVector::zeros(), |b| ways[b]))
        });
        if limit < SHORTEST_BONE_STEP {
            self.lanes[lane].phase = Phase::GivenUp;
            return false;
        }
        let part = if limit < 1.0 { 0.5 * limit } else { 1.0 };
        for ((x, to), w) in self.positions[elements.unknowns..].iter_mut().zip(&self.targets).zip(&ways) {
            for axis in 0..2 {
                let here = x[axis].0[lane];
                x[axis].0[lane] = if part < 1.0 { here + w[axis] * part } else { to[axis].0[lane] };
            }
        }
        self.factor_ready = false;
        self.lanes[lane].phase = Phase::Running;
        part == 1.0
    }
}

fn of_lane<const L: usize>(x: &SimdPair<L>, lane: usize) -> SVector<f64, 2> {
    SVector::from([x[0].0[lane], x[1].0[lane]])
}

/// Largest part of a step for which all cells keep a tenth of their measure, as in the solver for any body; `at` gives the position and
/// the step of a node, m.
fn step_limit(elements: &Elements, at: impl Fn(usize) -> (SVector<f64, 2>, SVector<f64, 2>)) -> f64 {
    let mut limit: f64 = 1.0;
    for cell in &elements.cells {
        let mut x = [SVector::<f64, 2>::zeros(); simplex::MAX_CORNERS];
        let mut p = x;
        for (corner, &n) in cell.iter().enumerate() {
            let (here, step) = at(n as usize);
            (x[corner], p[corner]) = (here, step * limit);
        }
        limit *= simplex::safe_part(&x, &p);
    }
    limit
}
