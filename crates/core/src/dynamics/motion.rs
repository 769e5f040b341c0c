//! The equations of motion of a system under given tensions.

use std::ops::Range;

use nalgebra::SVector;

use super::{State, StepCounts, Tensions};
use crate::body::largest_distance;
use crate::effect::{Configuration, Internal, Tangent};
use crate::sparse::BlockMatrix;
use crate::statics::{self, SolveSettings, SolveStatus, Workspace};
use crate::system::{System, SystemError};

/// Step over which contractile elements reach their equilibrium, s.
const UNTIL_EQUILIBRIUM: f64 = 1e30;
/// A motion that starts nearer to its equilibrium than this, m, has no part of a way.
const AT_EQUILIBRIUM: f64 = 1e-9;

/// A system, and the tensions of its muscles over time.
#[derive(Debug)]
pub struct Motion<'a, const D: usize> {
    pub system: &'a System<D>,
    pub tensions: Tensions,
    /// Mass of every unknown node, kg.
    pub mass: f64,
    slack: Vec<f64>,
    /// The range of the internal states of each effect in [`State::internal`].
    ranges: Vec<Range<usize>>,
}

#[derive(Debug, Clone)]
pub struct StateRates<const D: usize> {
    /// Acceleration of every node, m/s²; zero at nodes that are no unknowns.
    pub acceleration: Vec<SVector<f64, D>>,
    /// Rates of the internal states, m/s for contractile elements.
    pub internal: Vec<f64>,
    tensions: Vec<f64>,
    force: Vec<SVector<f64, D>>,
}

impl<'a, const D: usize> Motion<'a, D> {
    pub fn new(system: &'a System<D>, tensions: Tensions) -> Result<Self, SystemError> {
        Self::with_mass(system, tensions, system.coefficients().node_mass)
    }

    /// A motion in which every unknown node has the mass `mass`, kg.
    pub fn with_mass(system: &'a System<D>, tensions: Tensions, mass: f64) -> Result<Self, SystemError> {
        let (given, muscles) = (tensions.muscle_count(), system.muscle_count());
        if given != muscles {
            return Err(SystemError::Invalid(format!(
                "tensions are given for {given} muscles, but the mesh has {muscles}; give one for each"
            )));
        }
        let c = system.coefficients();
        positive("mass of a node (kg)", mass)?;
        if !system.contracting().is_empty() {
            positive("series stiffness k2 of a muscle (N/m)", c.muscle_series_stiffness)?;
            positive("contractile damping b_cc of a muscle (N s/m)", c.contractile_damping)?;
        }
        let mut end = 0;
        let ranges = system.effects().iter().map(|e| {
            let start = end;
            end += e.internal().map_or(0, |i| i.count());
            start..end
        });
        Ok(Self { system, tensions, slack: vec![0.0; muscles], mass, ranges: ranges.collect() })
    }

    /// The state at time zero, at rest and without contraction.
    pub fn at_rest(&self) -> State<D> {
        State {
            time: 0.0,
            positions: self.system.rest().to_vec(),
            velocities: vec![SVector::zeros(); self.system.rest().len()],
            internal: vec![0.0; self.ranges.last().map_or(0, |r| r.end)],
        }
    }

    /// The equilibrium under the strongest tensions of the motion, found from rest. `None` if all tensions are zero or no equilibrium is
    /// found.
    #[inline(never)]
    pub fn at_equilibrium(&self) -> Option<State<D>> {
        let tensions = self.tensions.strongest();
        if tensions.iter().all(|t| *t == 0.0) {
            return None;
        }
        let positions = self.equilibrium_from(self.system.rest(), tensions)?;
        let mut state = State { positions, ..self.at_rest() };
        self.update_internal_state(tensions, UNTIL_EQUILIBRIUM, &mut state);
        Some(state)
    }

    /// The part of the way from `start` (positions of all nodes, m) to equilibrium that a body has gone: one minus the largest remaining
    /// distance of a node over the largest distance of a node at the start. The equilibrium is that of the tensions at the state's time,
    /// found from its shape. `None` if it is not found, or if the body began there.
    pub fn part_of_way(&self, start: &[SVector<f64, D>], state: &State<D>) -> Option<f64> {
        let mut tensions = self.slack.clone();
        self.tensions.write_at(state.time, &mut tensions);
        let goal = self.equilibrium_from(&state.positions, &tensions)?;
        let whole = largest_distance(start, &goal);
        (whole > AT_EQUILIBRIUM).then(|| 1.0 - largest_distance(&state.positions, &goal) / whole)
    }

    fn equilibrium_from(&self, start: &[SVector<f64, D>], tensions: &[f64]) -> Option<Vec<SVector<f64, D>>> {
        let mut workspace = Workspace::new(self.system);
        workspace.start_from(start);
        let solution = statics::solve(self.system, &mut workspace, tensions, &SolveSettings::default());
        (solution.status == SolveStatus::Converged).then(|| workspace.positions().to_vec())
    }

    pub fn rates(&self) -> StateRates<D> {
        let zeros = vec![SVector::zeros(); self.system.rest().len()];
        StateRates {
            acceleration: zeros.clone(),
            internal: vec![0.0; self.ranges.last().map_or(0, |r| r.end)],
            tensions: self.slack.clone(),
            force: zeros,
        }
    }

    /// Computes the rates of a state, with one evaluation of the force.
    pub fn evaluate(&self, state: &State<D>, rates: &mut StateRates<D>, counts: &mut StepCounts) {
        counts.force_evaluations += 1;
        let StateRates { acceleration, internal, tensions, force } = rates;
        self.force(state, force);
        for &node in self.system.pattern().nodes() {
            acceleration[node] = force[node] / self.mass;
        }
        self.tensions.write_at(state.time, tensions);
        let at = Configuration { positions: &state.positions, tensions };
        for (i, range) in self.internal() {
            i.rates(at, &state.internal[range.clone()], &mut internal[range]);
        }
    }

    /// The effects with internal states, each with the range of its states in [`State::internal`].
    fn internal(&self) -> impl Iterator<Item = (&dyn Internal<D>, Range<usize>)> {
        let effects = self.system.effects().iter().zip(&self.ranges);
        effects.filter_map(|(effect, range)| Some((effect.internal()?, range.clone())))
    }

    /// The force on every node, N, with those of dampers and contractile branches.
    pub(super) fn force(&self, state: &State<D>, force: &mut [SVector<f64, D>]) {
        let slack = Configuration { positions: &state.positions, tensions: &self.slack };
        force.fill(SVector::zeros());
        for (effect, range) in self.system.effects().iter().zip(&self.ranges) {
            effect.add_force(slack, force);
            effect.add_viscous_force(slack, &state.velocities, force);
            if let Some(i) = effect.internal() {
                i.add_force(slack, &state.internal[range.clone()], force);
            }
        }
    }

    /// Solves `s = known + step rate` for the internal states at the state's positions; `state` holds `known`.
    pub(super) fn update_internal_state(&self, tensions: &[f64], step: f64, state: &mut State<D>) {
        let at = Configuration { positions: &state.positions, tensions };
        for (i, range) in self.internal() {
            i.update_internal_state(at, step, &mut state.internal[range]);
        }
    }

    /// The stiffness, N/m, with the internal states solved over `step`, s (constant if it is zero).
    pub(super) fn add_stiffness(
        &self,
        state: &State<D>,
        step: f64,
        tangent: Tangent,
        matrix: &mut BlockMatrix<D>,
    ) {
        let slack = Configuration { positions: &state.positions, tensions: &self.slack };
        for (effect, range) in self.system.effects().iter().zip(&self.ranges) {
            effect.add_stiffness(slack, tangent, matrix);
            if let Some(i) = effect.internal() {
                i.add_stiffness(slack, step, &state.internal[range.clone()], tangent, matrix);
            }
        }
    }

    pub(super) fn add_damping(&self, state: &State<D>, weight: f64, matrix: &mut BlockMatrix<D>) {
        let slack = Configuration { positions: &state.positions, tensions: &self.slack };
        self.system.effects().iter().for_each(|e| e.add_damping(slack, weight, matrix));
    }

    /// Kinetic energy, and the energy of all springs (Q2 too) and cells, J. Without tensions it does not increase.
    pub fn energy(&self, state: &State<D>) -> f64 {
        let slack = Configuration { positions: &state.positions, tensions: &self.slack };
        let kinetic: f64 = state.velocities.iter().map(|v| 0.5 * self.mass * v.norm_squared()).sum();
        let stored: f64 =
            self.internal().map(|(i, range)| i.energy(&state.positions, &state.internal[range])).sum();
        kinetic + self.system.energy(slack) + stored
    }
}

fn positive(name: &str, value: f64) -> Result<(), SystemError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(SystemError::Invalid(format!(
            "the {name} is {value}; for a trajectory it must be positive and finite"
        )))
    }
}
