//! Which muscles contract: the rule of thesis section 4.3.2 and its uncertainty.

use serde::Serialize;

use super::Lengths;

/// Floating-point tolerance, mm, so that 43.1 - 42.1 still counts as a change of exactly 1 mm.
const SLACK_MM: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Activation {
    /// Measured minus baseline length, mm; negative if shorter.
    pub change_mm: f64,
    /// Whether the muscle is shorter than in the baseline, which is taken as contraction (thesis 4.3.2).
    pub contracting: bool,
    /// Whether rounding may have changed the sign: the change is at most the sum of both half widths.
    pub uncertain: bool,
}

impl Lengths {
    /// Compares these lengths with `baseline`'s (thesis 4.3.2), a value for each muscle of this row; `None`
    /// if either was not measured. The two rows may come from tables with different muscles.
    pub fn activation(&self, baseline: &Self) -> Vec<Option<Activation>> {
        let of = |name: &String| {
            let change_mm = self.length_mm_of(name)? - baseline.length_mm_of(name)?;
            let rounding_mm = self.half_width_mm_of(name)? + baseline.half_width_mm_of(name)?;
            let uncertain = change_mm.abs() <= rounding_mm + SLACK_MM;
            Some(Activation { change_mm, contracting: change_mm < 0.0, uncertain })
        };
        self.muscles.iter().map(of).collect()
    }
}
