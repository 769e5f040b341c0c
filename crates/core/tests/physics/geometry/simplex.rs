//! Triangles and tetrahedra: measures and steps that invert nothing.

use nalgebra::SVector;
use tongue_core::geometry::simplex::{MAX_CORNERS, safe_part};

#[test]
fn a_step_stops_before_the_cell_turns_over_even_if_it_would_turn_back() {
    let mut x = [SVector::<f64, 2>::zeros(); MAX_CORNERS];
    (x[1][0], x[2][1], x[2][0]) = (1.0, 1.1, 0.1);
    // Corner C passes through the opposite edge, so that the triangle is inverted from about half the path on.
    let mut p = [SVector::zeros(); MAX_CORNERS];
    p[2][1] = -2.0 * x[2][1];
    let t = safe_part(&x, &p);
    assert!(t > 0.3 && t <= 0.45, "{t}");
    // Each corner moves straight to its place after half a turn, so that the area is positive at both ends and zero in the middle.
    let mut spin = [SVector::zeros(); MAX_CORNERS];
    let centre = (x[0] + x[1] + x[2]) / 3.0;
    for a in 0..3 {
        spin[a] = (centre - x[a]) * 2.0;
    }
    // At `t` the area is `(1 - 2 t)²` of that at rest, which is a tenth at 0.3419; the result is at most 1/64 less.
    let t = safe_part(&x, &spin);
    assert!(t > 0.342 - 1.0 / 64.0 && t < 0.342, "{t}");
    assert_eq!(safe_part(&x, &[SVector::zeros(); MAX_CORNERS]), 1.0);
}
