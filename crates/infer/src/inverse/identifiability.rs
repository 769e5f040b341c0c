//! Identifiability: which directions of the unknowns the data determine, by the singular values of the Jacobian.

use super::forward::{Forward, Linearised};
use super::projection::{UNDETERMINED, decompose};
use super::solution_curve::{self, SolutionCurve};

#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Singular values of d(fitted ratio or stretch)/d(tension), 1/N, largest first, one for each unknown (zero with fewer equations).
    pub singular_values: Vec<f64>,
    pub null_directions: Vec<NullDirection>,
}

/// A direction in the space of unknowns along which the fit remains as good.
#[derive(Debug, Clone, PartialEq)]
pub struct NullDirection {
    /// Unit vector over the unknowns; its largest entry is positive.
    pub direction: Vec<f64>,
    /// The curve along it through the answer; `None` if the answer itself does not meet the target.
    pub curve: Option<SolutionCurve>,
}

/// Singular values and undetermined directions at the unknowns `x`, each direction followed while the target is met. `followed` is a curve
/// from an earlier analysis, used again if `x` is on it. `None` if there is no equilibrium or it is singular.
pub(super) fn analyse<const D: usize>(
    forward: &mut Forward<'_, D>,
    x: &[f64],
    followed: Option<SolutionCurve>,
) -> Option<Identifiability> {
    let Linearised { jacobian, residuals, .. } = forward.linearise(x)?;
    let on_target = forward.misfit(Some(&residuals)) <= forward.settings.misfit_tolerance;
    let (singular_values, directions) = decompose(&jacobian)?;
    let open = singular_values.iter().map(|s| *s < UNDETERMINED * singular_values[0]);
    let open: Vec<_> = directions.iter().zip(open).filter(|(_, open)| *open).map(|(d, _)| d).collect();
    let mut followed = followed.filter(|_| open.len() == 1);
    let mut null_directions = Vec::new();
    for direction in open {
        let curve = on_target.then(|| {
            let again = followed.take().and_then(|curve| curve.through(forward, x, direction));
            again.unwrap_or_else(|| solution_curve::follow(forward, x, direction))
        });
        null_directions.push(NullDirection { direction: direction.iter().copied().collect(), curve });
    }
    Some(Identifiability { singular_values, null_directions })
}
