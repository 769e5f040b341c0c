//! Picture of a body in space: its surface at rest and deformed, seen from the side and a little from above.

use std::collections::BTreeSet;

use nalgebra::SVector;

use super::ReportError;
use super::picture::{Words, draw};
use crate::body::{Cells, Mesh};

/// Turn about the vertical and tilt towards the viewer, rad.
const TURN: f64 = 0.5;
const TILT: f64 = 0.3;

/// Draws the edges of the surface at rest (light grey) and deformed (dark) in parallel projection, as SVG text.
///
/// `positions` holds the position of every node, m.
///
/// # Errors
/// As [`super::tongue`].
pub fn solid(mesh: &Mesh<3>, positions: &[SVector<f64, 3>], title: &str) -> Result<String, ReportError> {
    let mut edges = BTreeSet::new();
    for face in mesh.surface() {
        for (i, &a) in face.iter().enumerate() {
            edges.extend(face.iter().skip(i + 1).map(|&b| [a, b]));
        }
    }
    let flat = Mesh::<2> {
        nodes: mesh.nodes.iter().map(projected).collect(),
        cells: Cells::new(),
        connections: edges.into_iter().collect(),
        muscles: Vec::new(),
        fixed: Vec::new(),
    };
    let deformed: Vec<_> = positions.iter().map(projected).collect();
    let words = Words {
        axes: ["across (mm)", "up, tilted (mm)"],
        shown: "A solid seen from the side and a little from above",
    };
    draw(&flat, &deformed, &[], &[], title, &words)
}

fn projected(p: &SVector<f64, 3>) -> SVector<f64, 2> {
    let (across, deep) = (p.x * TURN.cos() - p.y * TURN.sin(), p.x * TURN.sin() + p.y * TURN.cos());
    SVector::from([across, p.z * TILT.cos() + deep * TILT.sin()])
}
