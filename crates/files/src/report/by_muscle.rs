//! Values of muscles by name, from lists in the order of the muscles.

use tongue_input::measured::ByMuscle;

/// Lengths in metres as millimetres.
pub fn mm(names: &[String], lengths_m: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, lengths_m.iter().map(|l| l * 1e3))
}

/// The values without a change of unit.
pub fn by(names: &[String], values: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, values.iter().copied())
}
