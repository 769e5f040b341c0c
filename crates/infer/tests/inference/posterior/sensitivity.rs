//! Sensitivity to the powers of prior and likelihood.

use tongue_core::random::normal;
use tongue_infer::posterior::SENSITIVE;
use tongue_infer::posterior::sensitivity::{moved, weights};

/// Sensitivity of a quantity with prior N(0, 1) and one measurement, both of which are known exactly.
fn of_measurement(measured: f64, sd: f64) -> [f64; 2] {
    let mut random = fastrand::Rng::with_seed(3);
    let precision = 1.0 + 1.0 / (sd * sd);
    let mean = measured / (sd * sd) / precision;
    let values: Vec<f64> = (0..8000).map(|_| mean + normal(&mut random) / precision.sqrt()).collect();
    let prior: Vec<f64> = values.iter().map(|v| -0.5 * v * v).collect();
    let likelihood: Vec<f64> = values.iter().map(|v| -0.5 * ((v - measured) / sd).powi(2)).collect();
    [prior, likelihood].map(|logs| moved(&values, &weights(&logs)))
}

#[test]
fn what_a_measurement_decides_depends_on_it_and_what_it_does_not_on_the_prior() {
    let [prior, likelihood] = of_measurement(0.0, 0.2);
    assert!(prior < SENSITIVE && likelihood > 3.0 * prior, "{prior} {likelihood}");
    let [prior, likelihood] = of_measurement(0.0, 5.0);
    assert!(prior > SENSITIVE && likelihood < SENSITIVE, "{prior} {likelihood}");
    // A measurement far from the prior is sensitive to both.
    let [prior, likelihood] = of_measurement(6.0, 1.0);
    assert!(prior > SENSITIVE && likelihood > SENSITIVE, "{prior} {likelihood}");
}
