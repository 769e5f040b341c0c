//! The body in motion: the full system of the thesis over time.
//!
//! ```text
//! m dv/dt = f(x, c) + d(x, v)      every unknown node; m the lumped mass (thesis eq. 4.1)
//!   dx/dt = v
//!   dc/dt = (k2 (e - c) - F(t)) / b_cc      every contracting connection, e = l - l0; c(0) = 0
//! ```
//!
//! `f` is the force of the effects at zero tension, plus the pull `k2 (e - c)` of every contractile branch
//! (eqs. 3.4-3.8); `d` are the Kelvin-Voigt dampers `b dl/dt` of the tissue (eq. 3.9). Every node that is an
//! unknown of the [`System`] has the same mass
//! [`Coefficients::node_mass`](crate::material::Coefficients::node_mass): the nodes of the tissue and those on
//! bone or where muscles meet outside it. The nodes inside a straight path are no unknowns, so their mass is
//! left out; they are placed on the line between the path's ends.
//!
//! With the constants of the tongue this is overdamped and very stiff: time scales from microseconds (mass
//! against damper) to a second (spring against damper). Explicit methods need steps of microseconds
//! throughout; implicit ones only while something moves that fast.
//!
//! | method | order | step | source |
//! |---|---|---|---|
//! | [`velocity_verlet`] | 2 | fixed, explicit | thesis eqs. 4.2-4.3 |
//! | [`tr_bdf2`] | 2 | fixed or adaptive, implicit | Bank et al. 1985, Hosea and Shampine 1996 |

mod method;
mod motion;
mod run;
mod stage;
mod step_limit;
mod tensions;
pub mod tr_bdf2;
pub mod velocity_verlet;

use std::fmt::Debug;

use nalgebra::{DMatrix, SVector};
use serde::Serialize;

pub use method::IntegrationMethod;
pub use motion::{Motion, StateRates};
pub use run::{MotionOutcome, MotionStatus, Observer, run, sample_times};
pub use step_limit::{Spectrum, cost_per_step, step_limit};
pub use tensions::Tensions;

#[cfg(doc)]
use crate::system::System;

/// How the step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Always this step, s.
    Fixed(f64),
    /// As long as keeps the estimated error of each step below this, m.
    Adaptive(f64),
}

#[derive(Debug, Clone, PartialEq)]
pub struct State<const D: usize> {
    /// Time, s.
    pub time: f64,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Velocities of all nodes, m/s; zero where the node is no unknown.
    pub velocities: Vec<SVector<f64, D>>,
    /// Internal states of all effects, in the order of the effects: length changes of the contractile
    /// elements, m.
    pub internal: Vec<f64>,
}

/// Cost of a trajectory, in counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StepCounts {
    pub steps: u64,
    /// Steps rejected for their error, or because Newton's method did not converge.
    pub rejected: u64,
    /// Steps of TR-BDF2 that were made by backward Euler, because its own stages could not be solved at the
    /// fixed step.
    pub damped: u64,
    pub force_evaluations: u64,
    /// Factorisations of a matrix, failed ones included.
    pub factorisations: u64,
}

/// Why a step could not be taken; the state is then the last good one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Even the shortest step had too large an error, or could not be solved.
    StepTooSmall,
    /// Newton's method did not converge at the fixed step.
    NotSolved,
}

/// A method of time integration.
///
/// An integrator keeps forces and factors from step to step, so it belongs to one trajectory. Make a new one
/// to start again, or after changing the state by hand.
pub trait Integrator<const D: usize>: Debug + Send {
    /// Takes one step, or the part of it that ends at `until` (s, later than the state's time), and counts
    /// its cost.
    ///
    /// # Errors
    /// [`Failure`]; the state is then as before.
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), Failure>;

    /// The fixed step of an explicit method, s; none for methods that are stable at every step.
    fn explicit_step(&self) -> Option<f64> {
        None
    }

    /// For explicit methods the matrix that a step multiplies the state of `x'' = -k x - c x'` by, from
    /// which the largest stable step follows; none for methods without such a limit. `stiffness` is `k dt²`
    /// and `damping` is `c dt`; the state is position, velocity times `dt` and so on, so that all numbers
    /// are of one size.
    fn amplification(&self, _stiffness: f64, _damping: f64) -> Option<DMatrix<f64>> {
        None
    }
}

/// The shortest time that inputs may name, s: nothing in a tongue happens faster.
pub const SHORTEST_S: f64 = 1e-9;
/// Shortest step, s. If less than this is left of a run, or to a kink of the tensions, it is skipped.
const SHORTEST_STEP: f64 = 1e-15;

/// The step from `time` to at most `until`, chosen so that no very short step is left at the end.
fn cut(dt: f64, time: f64, until: f64) -> f64 {
    let left = until - time;
    if left <= dt * (1.0 + 1e-9) { left } else { dt }
}

/// The time after a step of `dt` (as [`cut`] gave it): exactly `until` when the step reaches it.
fn after(dt: f64, time: f64, until: f64) -> f64 {
    if dt >= until - time { until } else { time + dt }
}
