//! Trilinear hexahedra with eight corners, which are numbered as in ANSYS, Gmsh and VTK: around the bottom, then around the top.

use nalgebra::{Matrix3, SVector, Vector3};

pub const CORNERS: usize = 8;
/// Number of points of Gauss's rule that integrates the volume exactly.
pub const POINTS: usize = 8;

pub type PerCorner<T> = [T; CORNERS];

pub const LOCAL: PerCorner<[f64; 3]> = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// The corners of the six faces, counter-clockwise as seen from outside.
pub const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

pub const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Values of the trilinear shape functions at local coordinates.
pub fn values(at: [f64; 3]) -> PerCorner<f64> {
    LOCAL.map(|[x, y, z]| 0.125 * (1.0 + x * at[0]) * (1.0 + y * at[1]) * (1.0 + z * at[2]))
}

pub fn local_gradients(at: [f64; 3]) -> PerCorner<Vector3<f64>> {
    LOCAL.map(|[x, y, z]| {
        let (a, b, c) = (1.0 + x * at[0], 1.0 + y * at[1], 1.0 + z * at[2]);
        Vector3::new(x * b * c, y * a * c, z * a * b) * 0.125
    })
}

/// The eight points of Gauss's rule, whose weights are 1.
pub fn points() -> [[f64; 3]; POINTS] {
    LOCAL.map(|corner| corner.map(|x| x / 3f64.sqrt()))
}

/// Derivatives of the position by the local coordinates, m.
pub fn jacobian(x: &PerCorner<Vector3<f64>>, at: [f64; 3]) -> Matrix3<f64> {
    let parts = x.iter().zip(local_gradients(at)).map(|(x, g)| x * g.transpose());
    parts.fold(Matrix3::zeros(), |sum, part| sum + part)
}

/// Gradients of the shape functions in space, 1/m, and the Jacobian determinant, m³; `None` if that is not positive.
pub fn gradients(x: &PerCorner<Vector3<f64>>, at: [f64; 3]) -> Option<(PerCorner<Vector3<f64>>, f64)> {
    let jacobian = jacobian(x, at);
    let determinant = jacobian.determinant();
    let turned = jacobian.try_inverse().filter(|_| determinant > 0.0)?.transpose();
    Some((local_gradients(at).map(|g| turned * g), determinant))
}

pub fn volume(x: &PerCorner<Vector3<f64>>) -> f64 {
    points().iter().map(|&at| jacobian(x, at).determinant()).sum()
}

/// Positions of the corners; the third coordinate is zero in the plane.
pub fn corners<const D: usize>(
    positions: &[SVector<f64, D>],
    nodes: &[usize; CORNERS],
) -> PerCorner<Vector3<f64>> {
    nodes.map(|n| in_space(&positions[n]))
}

/// A position in three coordinates, the third one zero in the plane.
pub fn in_space<const D: usize>(place: &SVector<f64, D>) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| place.get(axis).copied().unwrap_or(0.0))
}
