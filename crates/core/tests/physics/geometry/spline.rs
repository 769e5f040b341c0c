//! Closed splines.

use std::f64::consts::TAU;

use tongue_core::geometry::{ClosedSpline, Point};

fn circle(count: usize) -> ClosedSpline {
    let angles = (0..count as u32).map(|i| TAU * f64::from(i) / count as f64);
    ClosedSpline::through(angles.map(|at| Point::new(-at.sin(), at.cos())).rev().collect()).unwrap()
}

#[test]
fn a_spline_through_a_circle_approaches_it_with_the_fourth_power() {
    let order = ((circle(12).area() - TAU / 2.0).abs() / (circle(24).area() - TAU / 2.0).abs()).log2();
    assert!((3.7..4.3).contains(&order), "order {order}");
    assert!((circle(48).perimeter() - TAU).abs() < 1e-4);
}

#[test]
fn goes_through_its_points_and_finds_them_again() {
    let curve = circle(9);
    for p in curve.points() {
        let (along, away) = curve.nearest(*p);
        assert!(away < 1e-12);
        assert!((curve.point(along) - p).norm() < 1e-12);
    }
    assert!((curve.point(curve.perimeter() * 1.25) - curve.point(curve.perimeter() * 0.25)).norm() < 1e-12);
}

#[test]
fn a_line_through_the_middle_crosses_twice() {
    let found = circle(24).crossings([Point::new(-2.0, 0.1), Point::new(2.0, 0.1)]);
    let expected = (1.0_f64 - 0.01).sqrt();
    assert_eq!(found.len(), 2);
    assert!((found[0] * 4.0 - 2.0 + expected).abs() < 1e-3 && (found[1] * 4.0 - 2.0 - expected).abs() < 1e-3);
}

#[test]
fn repeated_points_have_no_curve() {
    let p = Point::new(0.0, 0.0);
    assert_eq!(ClosedSpline::through(vec![p, p, Point::new(1.0, 0.0)]), None);
}
