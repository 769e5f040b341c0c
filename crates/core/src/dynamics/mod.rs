//! Motion of the body: the equations of the thesis over time.
//!
//! ```text
//! m dv/dt = f(x, c) + d(x, v)      every unknown node; m the mass of a node, the same for all (thesis eq. 4.1)
//!   dx/dt = v
//!   dc/dt = (k2 (e - c) - F(t)) / b_cc      every contracting connection, e = l - l0; c(0) = 0
//! ```
//!
//! `f` is the force of the effects at zero tension, plus the pull `k2 (e - c)` of every contractile branch (eqs. 3.4-3.8); `d` are the
//! Kelvin-Voigt dampers `b dl/dt` of the tissue (eq. 3.9). Every unknown node of the [`System`] has the mass
//! [`Coefficients::node_mass`](crate::material::Coefficients::node_mass): the nodes of the tissue, and those outside it where muscles
//! meet. The nodes inside a straight path are no unknowns and have no mass; they lie on the line between the path's ends.
//!
//! With the constants of the tongue this is overdamped and very stiff: time scales are from microseconds (mass against damper) to a second
//! (spring against damper). Explicit methods need steps of microseconds throughout; implicit ones only during motions that are as fast.
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

use nalgebra::SVector;
use serde::Serialize;

pub use method::IntegrationMethod;
pub use motion::{Motion, StateRates};
pub use run::{MotionOutcome, MotionStatus, Observer, run, sample_times};
pub use step_limit::{Spectrum, cost_per_step};
pub use tensions::Tensions;

#[cfg(doc)]
use crate::system::System;

/// How the step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// A constant step, s.
    Fixed(f64),
    /// Steps whose estimated error is below this, m.
    Adaptive(f64),
}

#[derive(Debug, Clone, PartialEq)]
pub struct State<const D: usize> {
    /// Time, s.
    pub time: f64,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Velocities of all nodes, m/s; zero at nodes that are no unknowns.
    pub velocities: Vec<SVector<f64, D>>,
    /// Internal states of all effects, in the order of the effects: length changes of the contractile elements, m.
    pub internal: Vec<f64>,
}

/// Cost of a trajectory, in counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct StepCounts {
    pub steps: u64,
    /// Number of steps rejected for their error, or because Newton's method did not converge.
    pub rejected: u64,
    /// Number of steps of TR-BDF2 that were made by backward Euler, because their stages could not be solved at the fixed step.
    pub damped: u64,
    pub force_evaluations: u64,
    /// Number of factorisations, failed ones included.
    pub factorisations: u64,
}

/// A method of time integration.
///
/// An integrator keeps forces and factors from step to step, so that each trajectory needs its own, as does a state that was changed by
/// hand.
pub trait Integrator<const D: usize>: Debug + Send {
    /// Takes one step, or the part of it that ends at `until` (s, later than the state's time), and counts its cost.
    ///
    /// # Errors
    /// [`MotionStatus::StepTooSmall`] or [`MotionStatus::NotSolved`]; the state is then as before.
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), MotionStatus>;

    /// The fixed step of an explicit method, s; `None` for methods that are stable with every step.
    fn explicit_step(&self) -> Option<f64> {
        None
    }
}

/// Shortest time that inputs may give, s, which is shorter than any event in a tongue.
pub const SHORTEST_S: f64 = 1e-9;
/// Shortest step, s. A shorter rest of a run, or before a kink of the tensions, is skipped.
const SHORTEST_STEP: f64 = 1e-15;

/// The step from `time` to at most `until`, chosen so that no very short step remains, and its end: exactly `until` if it reaches that.
fn cut(dt: f64, time: f64, until: f64) -> (f64, f64) {
    let left = until - time;
    let step = if left <= dt * (1.0 + 1e-9) { left } else { dt };
    (step, if step >= left { until } else { time + step })
}
