//! The methods by name, and the choice of their step.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use crate::suggest;

use super::backward_euler::BackwardEuler;
use super::rk4::Rk4;
use super::symplectic_euler::SymplecticEuler;
use super::tr_bdf2::TrBdf2;
use super::velocity_verlet::VelocityVerlet;
use super::{Integrator, Motion, SHORTEST_STEP, Spectrum, step_limit};

/// A method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// TR-BDF2.
    TrBdf2,
    /// Backward Euler.
    BackwardEuler,
    /// Velocity Verlet, the thesis's.
    Verlet,
    /// The classical Runge-Kutta method.
    Rk4,
    /// Symplectic Euler.
    SymplecticEuler,
}

/// How the step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Always this step, s.
    Fixed(f64),
    /// As long as keeps the estimated error of each step below this, m.
    Adaptive(f64),
}

/// A step or a tolerance that a method cannot work with.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// A step that is not finite, or too short.
    #[error("the step is {dt} s; it must be finite and at least {SHORTEST_STEP:e} s")]
    Step {
        /// The step given, s.
        dt: f64,
    },
    /// A tolerance that is not positive and finite.
    #[error("the tolerance is {} mm; it must be positive and finite", tolerance * 1e3)]
    Tolerance {
        /// The tolerance given, m.
        tolerance: f64,
    },
    /// A tolerance for a method without error control.
    #[error(
        "{method} has no error control, so it takes a step, not a tolerance: give a step, or use tr-bdf2"
    )]
    NotAdaptive {
        /// The method.
        method: Method,
    },
    /// A step beyond the stability limit.
    #[error(
        "a step of {dt:.3e} s is beyond the stability limit of {method}, {limit:.3e} s \
         ({body}: stiffest mode {frequency:.3e} rad/s, strongest damping {damping:.3e} /s): the run would blow up. \
         Take a step below the limit, or tr-bdf2, which has none"
    )]
    Unstable {
        /// The method.
        method: Method,
        /// The step asked for, s.
        dt: f64,
        /// The longest stable step, s.
        limit: f64,
        /// The state that has this limit: the body at rest, or as its tensions load it.
        body: &'static str,
        /// Largest angular frequency of the body, rad/s.
        frequency: f64,
        /// Largest damping rate of the body, 1/s.
        damping: f64,
    },
}

/// A name that no method has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown method \"{name}\"; {}", suggest::hint(name, Method::ALL.map(Method::name)))]
pub struct UnknownMethod {
    /// What was given.
    pub name: String,
}

impl Method {
    /// All methods.
    pub const ALL: [Method; 5] =
        [Method::TrBdf2, Method::BackwardEuler, Method::Verlet, Method::Rk4, Method::SymplecticEuler];

    /// The name, as on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Method::TrBdf2 => "tr-bdf2",
            Method::BackwardEuler => "backward-euler",
            Method::Verlet => "verlet",
            Method::Rk4 => "rk4",
            Method::SymplecticEuler => "symplectic-euler",
        }
    }

    /// Order of convergence for smooth motion.
    pub const fn order(self) -> u32 {
        match self {
            Method::BackwardEuler | Method::SymplecticEuler => 1,
            Method::TrBdf2 | Method::Verlet => 2,
            Method::Rk4 => 4,
        }
    }

    /// Whether it can choose its own steps.
    pub const fn is_adaptive(self) -> bool {
        matches!(self, Method::TrBdf2)
    }

    /// Whether its steps are limited by stability.
    pub const fn is_explicit(self) -> bool {
        matches!(self, Method::Verlet | Method::Rk4 | Method::SymplecticEuler)
    }

    /// Makes the integrator without checking the stability of its step; see [`Method::checked`].
    ///
    /// # Errors
    /// [`MethodError`] for a step or tolerance that is not positive and finite or a step below a
    /// femtosecond, or a tolerance for a method without error control.
    pub fn integrator<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, MethodError> {
        (motion.system().entries().integrator)(self, motion, control)
    }

    /// As [`Method::integrator`], compiled where it is called; see [`crate::compiled`].
    pub(crate) fn integrator_here<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, MethodError> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        match control {
            Control::Fixed(dt) if !(positive(dt) && dt >= SHORTEST_STEP) => {
                return Err(MethodError::Step { dt });
            }
            Control::Adaptive(tolerance) if !positive(tolerance) => {
                return Err(MethodError::Tolerance { tolerance });
            }
            _ => {}
        }
        Ok(match (self, control) {
            (Method::TrBdf2, _) => Box::new(TrBdf2::new(motion, control)),
            (method, Control::Adaptive(_)) => return Err(MethodError::NotAdaptive { method }),
            (Method::BackwardEuler, Control::Fixed(dt)) => Box::new(BackwardEuler::new(motion, dt)),
            (Method::Verlet, Control::Fixed(dt)) => Box::new(VelocityVerlet::new(motion, dt)),
            (Method::Rk4, Control::Fixed(dt)) => Box::new(Rk4::new(motion, dt)),
            (Method::SymplecticEuler, Control::Fixed(dt)) => Box::new(SymplecticEuler::new(motion, dt)),
        })
    }

    /// Makes the integrator and refuses a step beyond the stability limit of the body at rest or as its
    /// tensions load it.
    ///
    /// # Errors
    /// As [`Method::integrator`], and [`MethodError::Unstable`] naming the limit.
    pub fn checked<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, MethodError> {
        (motion.system().entries().checked_integrator)(self, motion, control)
    }

    /// As [`Method::checked`], compiled where it is called; see [`crate::compiled`].
    pub(crate) fn checked_here<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, MethodError> {
        let integrator = self.integrator(motion, control)?;
        if let (Control::Fixed(dt), Some((limit, spectrum, body))) =
            (control, limit(integrator.as_ref(), motion))
            && dt > limit
        {
            let (frequency, damping) = (spectrum.stiffness.sqrt(), spectrum.damping);
            return Err(MethodError::Unstable { method: self, dt, limit, body, frequency, damping });
        }
        Ok(integrator)
    }

    /// The longest stable step, s, of the body at rest and as its tensions load it, whichever is shorter;
    /// none for methods that are stable at every step.
    pub fn step_limit<const D: usize>(self, motion: &Motion<'_, D>) -> Option<f64> {
        let integrator = self.integrator(motion, Control::Fixed(1.0)).ok()?;
        limit(integrator.as_ref(), motion).map(|(limit, ..)| limit)
    }
}

/// The longest stable step of an explicit method, s, the spectrum that it follows from, and the state that
/// has this spectrum.
fn limit<const D: usize>(
    integrator: &dyn Integrator<D>,
    motion: &Motion<'_, D>,
) -> Option<(f64, Spectrum, &'static str)> {
    integrator.explicit_step()?;
    let bodies = [(Some(motion.at_rest()), "at rest"), (motion.at_equilibrium(), "as its tensions load it")];
    let limits = bodies.into_iter().filter_map(|(state, body)| {
        let spectrum = Spectrum::of(motion, &state?);
        Some((step_limit(integrator, &spectrum)?, spectrum, body))
    });
    limits.min_by(|a, b| a.0.total_cmp(&b.0))
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Method::ALL
            .into_iter()
            .find(|m| m.name().eq_ignore_ascii_case(name.trim()))
            .ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}
