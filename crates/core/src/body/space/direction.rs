//! The direction of a muscle's fibres between the fibres that are given.

use nalgebra::{Matrix3, SVector, SymmetricEigen, Vector3};

use super::Segment;
use crate::geometry::hexahedron::in_space;

/// Nearer to the middle of a segment than this part of its length a place takes no more from it than there.
const NEAREST: f64 = 0.05;

/// The direction at a place: the eigenvector of the largest eigenvalue of `sum L d dᵀ / r⁴` over the segments
/// in the tissue, each with its length `L`, its direction `d` and the distance `r` of its middle from the
/// place. `None` where no segment has one.
pub fn at<const D: usize>(
    nodes: &[SVector<f64, D>],
    segments: &[Segment],
    place: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut sum = Matrix3::zeros();
    let mut mean = Vector3::zeros();
    for segment in segments.iter().filter(|s| !s.outside) {
        let [a, b] = segment.nodes.map(|n| in_space(&nodes[n]));
        let way = b - a;
        let length = way.norm();
        let d = way.try_normalize(0.0)?;
        let r = (place - (a + b) * 0.5).norm().max(NEAREST * length);
        let weight = length / r.powi(4);
        sum += d * d.transpose() * weight;
        mean += d * weight;
    }
    let eigen = SymmetricEigen::new(sum);
    let largest = eigen.eigenvalues.imax();
    let axis: Vector3<f64> = eigen.eigenvectors.column(largest).into();
    (eigen.eigenvalues[largest] > 0.0).then(|| if axis.dot(&mean) < 0.0 { -axis } else { axis })
}
