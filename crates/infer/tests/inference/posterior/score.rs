//! Scores of predictions.

use tongue_infer::posterior::{MixtureComponent, PredictionMethod, left_out};

#[test]
fn scores_of_a_normal_distribution_are_the_exact_ones() {
    let parts = vec![MixtureComponent { mean: 1.0, weight: 1.0 }; 40_000];
    let found = left_out(&parts, 0.2, 1.1, (PredictionMethod::Together, 40_000.0), 1);
    let z: f64 = 0.5;
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    assert!((found.log_score - (density / 0.2).ln()).abs() < 1e-12);
    // sd (z (2 Phi(z) - 1) + 2 phi(z) - 1/sqrt(pi)), Gneiting and Raftery 2007; Phi(0.5) = 0.69146.
    let exact = 0.2 * (z * (2.0 * 0.691_462_5 - 1.0) + 2.0 * density - std::f64::consts::PI.sqrt().recip());
    assert!((found.crps / exact - 1.0).abs() < 0.02, "{} {exact}", found.crps);
    assert!((found.spread.interval_95[1] - (1.0 + 0.2 * 1.96)).abs() < 0.01);
}
