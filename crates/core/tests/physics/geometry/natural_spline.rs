//! Natural splines.

use tongue_core::geometry::{NaturalSpline, Point};

#[test]
fn approaches_an_arc_and_goes_through_its_points() {
    let worst = |n: usize| {
        let curve = NaturalSpline::through(&arc(n)).unwrap();
        // The ends are left out, because the spline has no curvature there.
        let inner = curve.polygon().iter().filter(|p| (0.8..2.2).contains(&p.y.atan2(p.x)));
        inner.map(|p| (p.norm() - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(worst(24) < worst(12) / 8.0, "{} {}", worst(24), worst(12));
    let points = arc(7);
    let curve = NaturalSpline::through(&points).unwrap();
    assert!(points.iter().all(|p| curve.distance(*p) < 1e-12));
    let line = NaturalSpline::through(&[Point::new(0.0, 0.0), Point::new(2.0, 0.0)]).unwrap();
    assert!((line.distance(Point::new(1.0, 0.5)) - 0.5).abs() < 1e-15);
    assert!((line.distance(Point::new(3.0, 0.5)) - 1.25_f64.sqrt()).abs() < 1e-15);
    assert!((line.extended(2.0).distance(Point::new(3.0, 0.5)) - 0.5).abs() < 1e-15);
    assert!(NaturalSpline::through(&[Point::zeros(), Point::zeros()]).is_none());
}

fn arc(n: usize) -> Vec<Point> {
    (0..=n).map(|i| 3.0 * i as f64 / n as f64).map(|t| Point::new(t.cos(), t.sin())).collect()
}
