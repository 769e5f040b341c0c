//! The integration methods, and the limits of their steps.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::step_limit::step_limit;
use super::tr_bdf2::TrBdf2;
use super::velocity_verlet::VelocityVerlet;
use super::{Control, Integrator, Motion, SHORTEST_STEP, Spectrum, State};
use crate::choice;
use crate::system::SystemError;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegrationMethod {
    TrBdf2,
    /// Velocity Verlet, the method of the thesis.
    Verlet,
}

impl IntegrationMethod {
    pub const ALL: [IntegrationMethod; 2] = [IntegrationMethod::TrBdf2, IntegrationMethod::Verlet];

    pub fn name(self) -> &'static str {
        choice::name_of(&self)
    }

    /// Whether stability limits the step, so that the method cannot choose steps by their error.
    pub const fn is_explicit(self) -> bool {
        matches!(self, IntegrationMethod::Verlet)
    }

    /// The integrator, without a check of the stability of its step; see [`IntegrationMethod::checked_integrator`].
    #[inline(never)]
    pub fn integrator<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, SystemError> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        Err(SystemError::Invalid(match (self, control) {
            (_, Control::Fixed(dt)) if !(positive(dt) && dt >= SHORTEST_STEP) => {
                format!("the step is {dt} s; it must be finite and at least {SHORTEST_STEP:e} s")
            }
            (_, Control::Adaptive(tolerance)) if !positive(tolerance) => {
                format!("the tolerance is {} mm; it must be positive and finite", tolerance * 1e3)
            }
            (IntegrationMethod::TrBdf2, _) => return Ok(Box::new(TrBdf2::new(motion, control))),
            (IntegrationMethod::Verlet, Control::Fixed(dt)) => {
                return Ok(Box::new(VelocityVerlet::new(motion, dt)));
            }
            (method, Control::Adaptive(_)) => {
                format!(
                    "{method} has no error control, so it takes a step, not a tolerance: give a step, or use tr-bdf2"
                )
            }
        }))
    }

    /// The integrator; a step beyond the stability limit at rest or at the equilibrium of the strongest tensions is an error.
    #[inline(never)]
    pub fn checked_integrator<const D: usize>(
        self,
        motion: &Motion<'_, D>,
        control: Control,
    ) -> Result<Box<dyn Integrator<D>>, SystemError> {
        let integrator = self.integrator(motion, control)?;
        if let Control::Fixed(dt) = control
            && self.is_explicit()
            && let (limit, spectrum, body) = limit(motion)
            && dt > limit
        {
            let (frequency, damping) = (spectrum.stiffness.sqrt(), spectrum.damping);
            return Err(SystemError::Invalid(format!(
                "a step of {dt:.3e} s is beyond the stability limit of {self}, {limit:.3e} s \
                 ({body}: stiffest mode {frequency:.3e} rad/s, strongest damping {damping:.3e} /s), so the motion would diverge. \
                 Take a step below the limit, or tr-bdf2, which has none"
            )));
        }
        Ok(integrator)
    }

    /// The longest stable step, s, at rest and at the equilibrium of the strongest tensions; `None` for methods that are stable with every
    /// step.
    #[inline(never)]
    pub fn step_limit<const D: usize>(self, motion: &Motion<'_, D>) -> Option<f64> {
        self.is_explicit().then(|| limit(motion).0)
    }
}

/// The longest stable step of Verlet, s, with the spectrum that determines it and the state that has this spectrum.
fn limit<const D: usize>(motion: &Motion<'_, D>) -> (f64, Spectrum, &'static str) {
    let of = |state: State<D>, body| {
        let spectrum = Spectrum::of(motion, &state);
        (step_limit(&spectrum), spectrum, body)
    };
    let at_rest = of(motion.at_rest(), "at rest");
    let loaded = motion.at_equilibrium().map(|state| of(state, "as its tensions load it"));
    loaded.filter(|loaded| loaded.0 < at_rest.0).unwrap_or(at_rest)
}

impl fmt::Display for IntegrationMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
