//! Which muscles contract: the rule of thesis section 4.3.2 and how sure it is.

use serde::Serialize;

use crate::muscle::{Muscle, PerMuscle};

/// Lengths are printed to 1 mm, so each may be off by this much, mm.
pub const ROUNDING_MM: f64 = 0.5;

/// Floating-point slack in mm, so that 43.1 - 42.1 still counts as a change of exactly 1 mm.
const SLACK_MM: f64 = 1e-9;

/// How one muscle's length changed against the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Activation {
    /// Measured minus baseline length, mm; negative when shorter.
    pub change_mm: f64,
    /// Whether the muscle is shorter than in the baseline, which is taken as contraction (thesis 4.3.2).
    pub contracting: bool,
    /// Whether rounding may have made or hidden the sign of the change. Two lengths, each rounded by up to
    /// [`ROUNDING_MM`], put up to 1 mm on their difference.
    pub uncertain: bool,
}

/// Compares the measured lengths with the baseline's, both in mm (thesis 4.3.2).
pub fn activation(measured_mm: &PerMuscle<f64>, baseline_mm: &PerMuscle<f64>) -> PerMuscle<Activation> {
    Muscle::ALL.map(|m| {
        let change_mm = measured_mm[m.index()] - baseline_mm[m.index()];
        Activation {
            change_mm,
            contracting: change_mm < 0.0,
            uncertain: change_mm.abs() <= 2.0 * ROUNDING_MM + SLACK_MM,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_millimetre_is_within_rounding_and_more_is_not() {
        let baseline = [43.1; 8];
        let measured = [40.0, 42.1, 42.099, 43.1, 43.2, 44.1, 44.101, 50.0];
        let result = activation(&measured, &baseline);
        let got = result.map(|a| (a.contracting, a.uncertain));
        assert_eq!(
            got,
            [
                (true, false),
                (true, true),
                (true, false),
                (false, true),
                (false, true),
                (false, true),
                (false, false),
                (false, false),
            ]
        );
        assert_eq!(result[0].change_mm, 40.0 - 43.1);
    }
}
