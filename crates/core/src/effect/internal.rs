//! Internal states: variables of a motion other than positions and velocities.

use std::fmt::Debug;

use nalgebra::SVector;

use crate::sparse::BlockMatrix;

use super::{Configuration, Tangent};

/// The part of an effect that acts through internal states `s` with `ds/dt = rate(x, s)`, one equation a
/// state, each linear in its own state and coupled to others only through the positions. So an implicit step
/// can eliminate them one by one, and the stiffness keeps its pattern. Equilibria never ask for it.
///
/// In motion this replaces the tension terms of the effect: its other methods are then called with all
/// tensions zero, and the tensions enter here.
pub trait Internal<const D: usize>: Debug {
    fn count(&self) -> usize;

    /// Energy stored, J.
    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64;

    /// Adds the force on every node, N: minus the derivative of the energy.
    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]);

    /// The rates of the states, per second.
    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]);

    /// Solves `s = known + step rate(x, s)`; `states` holds `known` before and `s` after. `step` in s.
    fn settle(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]);

    /// Adds minus the derivative of the force with respect to the positions, N/m, with the states settled at
    /// each position as [`Internal::settle`] does; a step of zero holds them.
    fn add_stiffness(
        &self,
        at: Configuration<'_, D>,
        step: f64,
        states: &[f64],
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    );
}
