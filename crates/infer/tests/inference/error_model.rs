//! Errors of points and frames.

use nalgebra::DMatrix;
use tongue_infer::error_model::Knots;
use tongue_infer::track::{Along, ErrorModel};

fn along(places: &[f64]) -> Vec<Along> {
    places.iter().map(|&at_mm| Along { channel: 0, at_mm, sd_mm: 0.93 }).collect()
}

#[test]
fn knots_and_own_errors_are_the_covariance_that_is_meant() {
    let errors = ErrorModel::default();
    let places = along(&[0.0, 5.0, 9.0, 31.0, 44.0, 70.0, 88.0]);
    let knots = Knots::new(errors, &places);
    let frame = knots.frame(&places, 0.00625).unwrap();
    let shared = knots.precision(errors.slow_mm).try_inverse().unwrap()
        + knots.precision(errors.static_mm).try_inverse().unwrap();
    let own = DMatrix::from_diagonal(&frame.sds.map(|sd| sd * sd));
    let found = own + &frame.basis * shared * frame.basis.transpose();
    // Frames are half as far apart as independent ones; the first three points are 5, 4.5 and 13 mm from their neighbours on average.
    let crowded = [1.8, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate() {
            let own = if i == j { 2.0 * 0.93_f64.powi(2) * crowded[i] } else { 0.0 };
            let meant = errors.of_body(a, b, true) + own;
            assert!((found[(i, j)] - meant).abs() < 0.02, "{i} {j}: {} {meant}", found[(i, j)]);
        }
    }
}

#[test]
fn points_and_frames_that_are_closer_carry_no_more() {
    for (wave_mm, least) in [(1e9, 0.88), (60.0, 0.75), (30.0, 0.5)] {
        let usual = information(11, 80.0, wave_mm);
        for (count, rate_hz) in [(42, 80.0), (100, 80.0), (11, 200.0), (100, 400.0)] {
            let ratio = information(count, rate_hz, wave_mm) / usual;
            assert!((least..1.05).contains(&ratio), "{count} points, {rate_hz} Hz, {wave_mm} mm: {ratio}");
        }
    }
}

#[test]
fn points_in_one_place_carry_what_one_carries() {
    let own = |places: &[f64]| ErrorModel::default().own(&along(places), f64::INFINITY);
    assert!(own(&[4.0; 3]).iter().all(|variance| (variance / own(&[4.0])[0] - 3.0).abs() < 1e-12));
}

/// The information of a tenth of a second about a shift and about waves of the contour.
fn information(count: usize, rate_hz: f64, wave_mm: f64) -> f64 {
    let places = along(&(0..count).map(|i| 90.0 * i as f64 / (count - 1) as f64).collect::<Vec<_>>());
    let frame = Knots::new(ErrorModel::default(), &[]).frame(&places, 1.0 / rate_hz).unwrap();
    let shift = DMatrix::from_fn(count, 1, |i, _| (std::f64::consts::TAU * places[i].at_mm / wave_mm).cos());
    frame.whitened(shift).norm_squared() * 0.1 * rate_hz
}
