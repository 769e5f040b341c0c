//! Predictions of held-out points.

use nalgebra::DMatrix;
use tongue_infer::track::prediction::{ContourPoint, MEAN, Process, Split};

#[test]
fn a_prediction_is_the_conditional_normal_distribution() {
    let process = Process { weight: 0.4, length_mm: 12.0, noise: 0.1 };
    let points = [[0.0, 1.0, 0.5], [10.0, 2.0, 0.1], [31.0, -1.0, 0.3], [18.0, 0.7, 0.2]];
    let mut fitted = points.map(|[at, at_rest, pulled]| ContourPoint { at, at_rest, pulled }).into();
    let hidden = Vec::split_off(&mut fitted, 3);
    let split = Split { fitted, hidden };
    let (error, variance) = process.errors(&split).unwrap()[0];
    let places = [0.0, 10.0, 31.0, 18.0];
    let joint = DMatrix::from_fn(4, 4, |i, j| {
        let apart: f64 = places[i] - places[j];
        MEAN + (-apart * apart / 288.0).exp() + if i == j { 0.01 } else { 0.0 }
    });
    // The last row of the precision gives the conditional distribution of the last value.
    let precision = joint.try_inverse().unwrap();
    let values = [0.8, 1.24, -0.48];
    let expected: f64 = -(0..3).map(|i| precision[(3, i)] * values[i]).sum::<f64>() / precision[(3, 3)];
    assert!((variance - 1.0 / precision[(3, 3)]).abs() < 1e-9, "{variance}");
    assert!((error - (0.5 - expected)).abs() < 1e-9, "{error}");
}
