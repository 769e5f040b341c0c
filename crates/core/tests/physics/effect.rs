//! The wall and the barriers against inverted cells.

use nalgebra::{SVector, Vector2};
use tongue_core::effect::barrier::{THRESHOLD, barrier};
use tongue_core::effect::barrier_simplices::{BarrierSimplices, halves, measures};
use tongue_core::effect::{Configuration, Contact, Effect};
use tongue_core::geometry::quadratic::MAX_NODES;
use tongue_core::geometry::{quadratic, simplex};

#[test]
fn the_barrier_and_its_two_derivatives_vanish_at_the_threshold_and_grow_without_bound() {
    let b = barrier(THRESHOLD * (1.0 - 1e-9));
    assert!(b.value < 1e-26 && b.slope.abs() < 1e-15 && b.curvature < 1e-5, "{b:?}");
    assert!(barrier(1e-300).value > 600.0 && barrier(1e-300).slope < -1e290);
    assert_eq!(barrier(0.0).value, f64::INFINITY);
    assert_eq!(barrier(-0.5).value, f64::INFINITY);
}

#[test]
fn every_guarded_simplex_has_its_share_of_the_measure_at_rest_and_is_upright() {
    fn shares<const D: usize>() {
        let mut x = [SVector::<f64, D>::zeros(); MAX_NODES];
        (0..D).for_each(|d| x[d + 1][d] = 1.0);
        for (n, [i, j]) in quadratic::edges::<D>().iter().enumerate() {
            x[D + 1 + n] = (x[*i] + x[*j]) * 0.5;
        }
        let measure = simplex::measure(&simplex::corners(&x, &[0, 1, 2, 3][..=D]));
        let guards = BarrierSimplices::<D>::default();
        for guarded in guards.of(measure, &x) {
            assert!((simplex::measure(&guarded.corners) / guarded.rest - 1.0).abs() < 1e-12, "{D}D");
        }
        // The fast measures of triangles are the same for a bent element.
        (D + 1..quadratic::nodes::<D>()).for_each(|n| x[n][n % D] += 0.1 * (n as f64).sin());
        for (guarded, fast) in guards.of(measure, &x).zip(measures(&halves(&x))).filter(|_| D == 2) {
            let slow = simplex::measure(&guarded.corners) * measure / guarded.rest;
            assert!((2.0 * slow - fast).abs() < 1e-12, "{slow} {fast}");
        }
    }
    shares::<2>();
    shares::<3>();
}

fn corner() -> Contact {
    // The wall has a straight joint, a corner that points away from the node's side (below) and two that point towards it.
    let at = [[-2.0, 1.0], [-1.0, 1.0], [0.0, 1.0], [0.5, 1.5], [1.0, 1.0], [2.0, 1.0]];
    Contact::new(at.map(Vector2::from).to_vec(), &[0], 1.0, 0.6)
}

/// The energy of a node by the wall.
fn energy(wall: &Contact, node: Vector2<f64>) -> f64 {
    wall.energy(Configuration { positions: &[node], tensions: &[] })
}

#[test]
fn beside_a_straight_run_one_wall_acts_however_many_segments_it_has() {
    let d: f64 = 0.3;
    let exact = -(d - 0.6) * (d - 0.6) * (d / 0.6).ln();
    for x in [-1.2, -1.0, -0.9, -0.75] {
        let energy = energy(&corner(), Vector2::new(x, 0.7));
        assert!((energy - exact).abs() < 1e-15, "{x}: {energy}");
    }
}

#[test]
fn the_energy_is_smooth_across_corners_and_positive_near_the_wall() {
    let wall = corner();
    let h = 1e-6;
    for i in 0..400 {
        let p = Vector2::new(-2.5 + 0.0125 * f64::from(i), 0.8);
        assert!(energy(&wall, p) >= 0.0, "{p}");
        let mut force = [Vector2::zeros()];
        wall.add_force(Configuration { positions: &[p], tensions: &[] }, &mut force);
        for (d, e) in [Vector2::x(), Vector2::y()].into_iter().enumerate() {
            let slope = (energy(&wall, p + e * h) - energy(&wall, p - e * h)) / (2.0 * h);
            // The second derivative jumps at a corner, so that the difference is of first order in its step.
            assert!((slope + force[0][d]).abs() < 1e-5, "{p}: {slope} {}", force[0][d]);
        }
    }
    assert!(energy(&wall, Vector2::new(0.2, 1.199)) > 1.0);
}

#[test]
fn a_step_stops_before_the_wall_and_along_it_is_free() {
    let wall = corner();
    let limit = |from: [f64; 2], to: [f64; 2]| {
        let x = [Vector2::from(from)];
        let step = [Vector2::from(to) - x[0]];
        let at = Configuration { positions: &x, tensions: &[] };
        wall.step_limit(at, &step)
    };
    assert!((limit([-1.5, 0.0], [-1.5, 2.0]) - 0.45).abs() < 1e-15);
    assert!((limit([-1.5, 2.0], [-1.5, 0.0]) - 0.45).abs() < 1e-15, "from the other side");
    assert!((limit([0.0, 0.0], [0.0, 2.0]) - 0.45).abs() < 1e-15, "through a corner");
    assert_eq!(limit([-1.5, 0.99], [1.5, 0.99]), 1.0);
    let near = limit([-1.5, 0.0], [-1.5, 0.99]);
    assert!((0.99 * near - 0.9).abs() < 1e-15, "short of the wall too, a tenth of the way is kept");
}
