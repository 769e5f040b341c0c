//! The jaw of tracked formants.

use tongue_core::geometry::Point;
use tongue_infer::track::opened_deg;

#[test]
fn the_angle_of_a_jaw_is_found_from_the_shift_of_its_mark() {
    let mark = Point::new(-0.07, -0.085);
    let angle: f64 = 3.0_f64.to_radians();
    let turned =
        Point::new(angle.cos() * mark.x - angle.sin() * mark.y, angle.sin() * mark.x + angle.cos() * mark.y);
    assert!((opened_deg(mark, turned - mark) - 3.0).abs() < 0.01);
    // A shift along the line to the joint is no rotation.
    assert!(opened_deg(mark, mark * 0.1).abs() < 1e-12);
}
