//! Hexahedra with eight nodes.

use nalgebra::Vector3;
use tongue_core::geometry::hexahedron::{FACES, LOCAL, gradients, points, values, volume};

#[test]
fn shape_functions_add_up_to_one_and_their_gradients_give_back_a_linear_field() {
    let x = LOCAL.map(|[x, y, z]| Vector3::new(x + 0.1 * y * z, y - 0.2 * x, 1.5 * z + 0.15 * x * y));
    for at in points() {
        assert!((values(at).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let (gradients, _) = gradients(&x, at).unwrap();
        let slope = Vector3::new(0.3, -1.0, 2.0);
        let sum: Vector3<f64> = gradients.iter().zip(&x).map(|(g, x)| g * slope.dot(x)).sum();
        assert!((sum - slope).norm() < 1e-14);
    }
}

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
