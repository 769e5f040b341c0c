//! From an anatomy to a mesh of any spacing, whose triangles keep given edges (spade's constrained Delaunay triangulation).

use super::anatomy::Anatomy;
use super::frame::{OutlineFrame, Site};
use super::smooth::{fill, smooth};
use crate::body::{BodyError, Cells, Mesh, MuscleChain};
use crate::geometry;
use crate::geometry::plane::{self, Point};
use crate::limits::PLANE_NODES;

/// The spacing of the published mesh, m.
pub const DEFAULT_SPACING_M: f64 = 5.5e-3;

/// The finest and the coarsest spacing over the square root of the tissue's area: 0.22 and 15 mm for the reference. Finer meshes have more
/// than [`PLANE_NODES`]; coarser ones have no room for the muscles.
const FINEST: f64 = 1.0 / 226.0;
const COARSEST: f64 = 1.0 / 3.3;

/// Meshes an anatomy with connections about `h` long, m.
///
/// Nodes of the outline come first, then those of muscles in the tissue, then free ones, then those of muscles outside it. The number of
/// triangles is that of equilateral ones of side `h` on the same area, and the number of nodes follows by Euler's formula; for the
/// reference at 5.5 mm they are the published 188 and 111.
///
/// # Example
/// ```
/// use tongue_core::body::{self, Anatomy, Quality};
///
/// let mesh = body::build(&Anatomy::reference()?, 5.5e-3)?; // Anatomy::from_toml reads other anatomies
/// let quality = Quality::of(&mesh);
/// assert_eq!((quality.nodes, quality.cells), (123, 188)); // as in the thesis
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn build(anatomy: &Anatomy, h: f64) -> Result<Mesh<2>, BodyError> {
    let size = anatomy.outline().area().sqrt();
    let (least, most) = (size * FINEST, size * COARSEST);
    if !(least..=most).contains(&h) {
        let [h_mm, extent_mm] = [h, geometry::extent(&anatomy.outline().points)].map(|m| m * 1e3);
        // Both limits are rounded into the range.
        let (least_mm, most_mm) = ((1e5 * least).ceil() / 100.0, (1e4 * most).floor() / 10.0);
        return Err(BodyError(format!(
            "the mesh spacing {h_mm} mm is not usable; for this anatomy, whose outline is {extent_mm:.1} mm across, give \
             {least_mm:.2} to {most_mm:.1} mm (is it in millimetres? finer meshes need over 1 GB of memory)"
        )));
    }
    let mut frame = OutlineFrame::new(anatomy, h);
    let outline: Vec<Point> = frame.nodes[..frame.boundary].iter().map(|n| n.at).collect();
    let equilateral = 0.75_f64.sqrt() / 2.0 * h * h;
    // A triangulation of V nodes, B of them on the outline, has 2 V - 2 - B triangles.
    let triangles = plane::polygon_area(&outline) / equilateral;
    let wanted = ((triangles + 2.0 + frame.boundary as f64) / 2.0).round() as usize;
    PLANE_NODES.check(wanted as f64).map_err(|e| BodyError(e.to_string()))?;
    let free = wanted.saturating_sub(frame.nodes.len());
    fill(&mut frame, free, h)?;
    let triangles = smooth(&mut frame.nodes, &frame.segments, h)?;
    let mesh = assemble(anatomy, &frame, &triangles);
    mesh.check().map_err(|fault| BodyError(format!("the mesh is faulty ({fault}); try another spacing")))?;
    Ok(mesh)
}

fn assemble(anatomy: &Anatomy, frame: &OutlineFrame, triangles: &[[usize; 3]]) -> Mesh<2> {
    let tissue = frame.nodes.len();
    let number = |site: &Site| match site {
        Site::Tissue(i) => *i,
        Site::Outside(i) => tissue + i,
    };
    let muscles: Vec<MuscleChain> =
        Vec::from_iter(anatomy.muscles().iter().zip(&frame.chains).map(|(line, sites)| MuscleChain {
            name: line.name.clone(),
            nodes: sites.iter().map(number).collect(),
        }));

    let mut cells = Cells::new();
    // Triangles begin with their lowest node and are sorted, so that their order does not depend on the triangulator.
    let mut triangles: Vec<[usize; 3]> = triangles.to_vec();
    for triangle in &mut triangles {
        let lowest = (0..3).min_by_key(|i| triangle[*i]).unwrap_or(0);
        triangle.rotate_left(lowest);
    }
    triangles.sort_unstable();
    for triangle in triangles {
        cells.push(&triangle);
    }

    let mut fixed: Vec<usize> = frame.fixed.iter().map(number).collect();
    fixed.sort_unstable();
    fixed.dedup();
    let nodes = frame.nodes.iter().map(|n| n.at).chain(frame.outside.iter().copied()).collect();
    let mut mesh = Mesh { nodes, cells, muscles, fixed, ..Mesh::default() };
    mesh.connect();
    mesh
}
