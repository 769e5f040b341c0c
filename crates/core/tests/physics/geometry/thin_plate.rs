//! Thin-plate splines.

use tongue_core::geometry::{Point, ThinPlate};

#[test]
fn control_points_arrive_and_affine_ways_are_kept() {
    let controls = [[0.0, 0.0], [1.0, 0.1], [0.2, 1.0], [1.1, 0.9], [0.5, 0.4]].map(Point::from);
    let plate = ThinPlate::new(&controls).unwrap();
    let carried = |p: Point, d: &[Point]| -> Point {
        p + plate.weights(p).iter().zip(d).map(|(w, d)| d * *w).sum::<Point>()
    };
    let any = [[0.1, 0.0], [-0.2, 0.3], [0.0, 0.1], [0.3, 0.3], [0.0, -0.1]].map(Point::from);
    for (c, d) in controls.iter().zip(&any) {
        assert!((carried(*c, &any) - (c + d)).norm() < 1e-12);
    }
    let near = Point::new(1.0 + 1e-6, 0.1);
    assert!((carried(near, &any) - carried(controls[1], &any) - Point::new(1e-6, 0.0)).norm() < 1e-5);
    let affine = |p: Point| Point::new(0.2 * p.x - 0.1 * p.y + 0.05, 0.3 * p.y);
    let d = controls.map(affine);
    let p = Point::new(0.7, -0.4);
    assert!((carried(p, &d) - p - affine(p)).norm() < 1e-12);
    assert!(ThinPlate::new(&controls[..2]).is_none());
    assert!(ThinPlate::new(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]].map(Point::from)).is_none());
}
