//! Effects, the forces on the body: a trait by which each adds its energy, force and stiffness.
//!
//! | effect | energy at constant tension | source |
//! |---|---|---|
//! | [`Connections`] | `1/2 k (l - l0)²` per connection of tissue | Kato 2014, 3.2.2 (Kelvin-Voigt; the damper acts only in motion) |
//! | | `1/2 k1 (l - l0)² + F (l - l0)` per connection of a muscle | 3.2.1 (Q2 and the contractile damper act only in motion) |
//! | [`Incompressibility`] | `1/2 kappa ((S - S0)/S0)²` per cell | 3.3.2 (volume), 3.3.3 (area) |
//! | [`QuadraticElements`] | `μ/2 (tr FᵀF - D) - μ ln J + λ/2 (ln J)²` per measure, for tissue and cells | Bonet and Wood 2008, 6.27 |
//! | [`Hexahedra`] | `C10 (Ī1 - 3) + C20 (Ī1 - 3)²` per measure, `K/2 V0 (V/V0 - 1)²` per element | Buchaillard 2009; Simo 1985 |
//! | [`OrientationBarrier`] | `λ V b(m/M)` per part of a quadratic element below a tenth of its measure | Li et al. 2020, eq. 6 |
//! | [`Fibres`] | `F ∫ w (|F f0| - 1) ds` per muscle of finite width | tension that does not depend on the stretch |
//! | [`SymmetryPlane`] | `1/2 k (x - x0)²` per node on the symmetry plane of a half body | |
//! | [`Attachment`] | `1/2 ∫ κ |u - v|² ds` between surface and bone | chosen, not measured |
//! | [`Gravity`] | `-m g·(x - X)` per node | |
//! | [`Contact`] | `-κ (d - d̂)² ln(d/d̂)` per node nearer than `d̂` to the palate | Li et al. 2020, eq. 6 |
//!
//! Bones and straight paths, which hold nodes, are constraints of the [system](crate::system).

mod attachment;
pub mod barrier;
pub mod barrier_simplices;
mod connections;
mod contact;
mod fibres;
mod gravity;
mod hexahedra;
mod incompressibility;
mod orientation_barrier;
mod quadratic_element;
pub mod spring;

use std::fmt::Debug;

use nalgebra::SVector;

use crate::material::Stress;
use crate::sparse::{BlockMatrix, Pattern};

pub use attachment::{Attachment, SymmetryPlane};
pub use connections::Connections;
pub use contact::Contact;
pub use fibres::Fibres;
pub use gravity::{Gravity, lumped_masses};
pub use hexahedra::{Hexahedra, Stiffening};
pub use incompressibility::Incompressibility;
pub use orientation_barrier::OrientationBarrier;
pub use quadratic_element::QuadraticElements;

/// The state at which an effect is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Configuration<'a, const D: usize> {
    /// Positions of all nodes, m.
    pub positions: &'a [SVector<f64, D>],
    /// Contractile tension of every muscle of the mesh, N (2D: per metre of thickness).
    pub tensions: &'a [f64],
}

/// An element of an effect that consists of springs and terms of area or volume only.
#[derive(Debug, Clone, Copy)]
pub enum PrimitiveElement<'a> {
    /// A spring, and the muscle whose tension it has too.
    Line { spring: &'a spring::Spring, muscle: Option<usize> },
    /// A cell of energy `1/2 kappa ((S - S0)/S0)²`.
    Cell {
        nodes: &'a [usize],
        /// Area, m², or volume, m³, at rest.
        rest: f64,
        /// kappa_s or kappa_v, J.
        kappa: f64,
    },
}

/// The kind of a second derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tangent {
    /// The exact one, which may be indefinite away from equilibrium.
    Exact,
    /// A positive semidefinite one close to it, element by element.
    Convex,
}

/// A force on the body. Its energy is in J (2D: per metre of thickness).
///
/// Force and stiffness are the negative first and the second derivatives of the energy.
/// `tests/library/effects_are_derivatives_of_their_energy.rs` checks this for every effect, and fails for an effect that is missing there.
/// A new effect is a file in this folder that implements the parts of the trait that are not zero, and a line where
/// [`crate::system::Additions`] adds it to a system.
pub trait Effect<const D: usize>: Debug + Send + Sync {
    /// Short name in plans and reports.
    fn name(&self) -> &'static str;

    /// Calls `couple` with every set of nodes that the stiffness of this effect couples; with none for a constant force.
    fn stencils(&self, _couple: &mut dyn FnMut(&[usize])) {}

    /// Number of elements in an evaluation, as a measure of its cost.
    fn elements(&self) -> usize {
        let mut count = 0;
        self.stencils(&mut |_| count += 1);
        count
    }

    /// Calls `visit` with every element and returns true, if all are [`PrimitiveElement`]s; returns false otherwise.
    fn parts(&self, _visit: &mut dyn FnMut(PrimitiveElement<'_>)) -> bool {
        false
    }

    /// Looks up the slots of its stiffness blocks; called once, before any [`Effect::add_stiffness`].
    fn bind(&mut self, _pattern: &Pattern) {}

    /// Potential energy, J.
    fn energy(&self, at: Configuration<'_, D>) -> f64;

    /// Adds the force on every node, N: minus the derivative of the energy.
    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]);

    /// Adds the second derivative of the energy, N/m; none for a constant force.
    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, _stiffness: &mut BlockMatrix<D>) {}

    /// Adds the derivative of the force by the tension of muscle `muscle`, N/N.
    fn add_force_per_tension(
        &self,
        _at: Configuration<'_, D>,
        _muscle: usize,
        _rate: &mut [SVector<f64, D>],
    ) {
    }

    /// Largest part (0 to 1) of `step` along which no cell is inverted.
    fn step_limit(&self, _at: Configuration<'_, D>, _step: &[SVector<f64, D>]) -> f64 {
        1.0
    }

    /// Whether this effect's [`Effect::step_limit`] prevents every cell from being inverted.
    fn keeps_cells_upright(&self) -> bool {
        false
    }

    /// Number of elements in which the barrier ([`barrier::barrier()`]) acts, so that their law is not the published one.
    fn barrier_active(&self, _at: Configuration<'_, D>) -> usize {
        0
    }

    /// Adds the force of the effect's dampers on every node, N, at these velocities, m/s, in which it is linear. Only motions use it.
    fn add_viscous_force(
        &self,
        _at: Configuration<'_, D>,
        _velocities: &[SVector<f64, D>],
        _force: &mut [SVector<f64, D>],
    ) {
    }

    /// Adds `weight` times the damping matrix, minus the derivative of the viscous force by the velocities, N s/m; it is symmetric and
    /// positive semidefinite.
    fn add_damping(&self, _at: Configuration<'_, D>, _weight: f64, _damping: &mut BlockMatrix<D>) {}

    /// Strain and stress of every cell that is a continuum by this effect, in the order of the cells.
    fn stresses(&self, _at: Configuration<'_, D>) -> Vec<Stress<D>> {
        Vec::new()
    }

    /// The internal states of the effect, which change in motion.
    fn internal(&self) -> Option<&dyn Internal<D>> {
        None
    }
}

/// The part of an effect with internal states `s`, `ds/dt = rate(x, s)`. Each equation is linear in its own state and coupled to others
/// only through the positions, so that an implicit step can eliminate the states one by one, and the stiffness keeps its pattern. Only
/// motions use it.
///
/// In motion this replaces the tension terms of the effect: its other methods are called with zero tensions, and the tensions enter here.
pub trait Internal<const D: usize>: Debug {
    fn count(&self) -> usize;

    /// Stored energy, J.
    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64;

    /// Adds the force on every node, N: minus the derivative of the energy.
    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]);

    /// The rates of the states, per second.
    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]);

    /// Solves `s = known + step rate(x, s)`; `states` holds `known` before and `s` after. `step` in s.
    fn update_internal_state(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]);

    /// Adds minus the derivative of the force by the positions, N/m, with states that follow the positions as in
    /// [`Internal::update_internal_state`], or are constant if `step` is zero.
    fn add_stiffness(
        &self,
        at: Configuration<'_, D>,
        step: f64,
        states: &[f64],
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    );
}
