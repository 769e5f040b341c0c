//! Hexahedra with eight nodes.

use nalgebra::Vector3;
use tongue_core::geometry::hexahedron::{FACES, LOCAL, volume};

#[test]
fn the_volume_is_that_inside_the_faces() {
    assert!((volume(&LOCAL.map(Vector3::from)) - 8.0).abs() < 1e-14);
    // The top of the frustum is half as wide as its bottom.
    let frustum = LOCAL.map(|[x, y, z]| {
        let width = 0.75 - 0.25 * z;
        Vector3::new(width * x, width * y, z)
    });
    let exact = 2.0 * (4.0 + 1.0 + 2.0) / 3.0;
    assert!((volume(&frustum) - exact).abs() < 1e-14);
}

#[test]
fn faces_look_outwards() {
    let x = LOCAL.map(Vector3::from);
    for [a, b, c, d] in FACES {
        let normal = (x[b] - x[a]).cross(&(x[c] - x[b]));
        assert!(normal.dot(&(x[a] + x[b] + x[c] + x[d])) > 0.0);
    }
}
