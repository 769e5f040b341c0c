//! Axis 5: springs or finite elements. Thesis 2.3 calls finite elements "more accurate and slower".

use nalgebra::Matrix2;
use serde::Serialize;

use crate::{Error, PUBLISHED_A};
use tongue_core::body::Mesh;
use tongue_core::statics::{self, SolveSettings, Workspace};
use tongue_core::system::{Model, System, TissueModel};

/// Tissues in the order of the tables.
pub const TISSUES: [&str; 2] = ["springs, per connection", "finite elements"];
/// Scenes of axis 5: /a/ as published, and a muscle of the back and one of the tip alone.
pub const SCENES: [(&str, &[(&str, f64)]); 3] =
    [("/a/", &PUBLISHED_A), ("GGp 10 N", &[("GGp", 10.0)]), ("SGp 10 N", &[("SGp", 10.0)])];

/// Patch test: a homogeneous deformation of the outline, which the inner nodes should follow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PatchRun {
    pub tissue: &'static str,
    pub h_mm: f64,
    /// Largest distance of an inner node from the homogeneous deformation, mm.
    pub error_mm: f64,
}

pub fn model(tissue: &str) -> Model {
    match tissue {
        "finite elements" => Model { tissue: TissueModel::FiniteElement, ..Model::default() },
        _ => Model::default(),
    }
}

/// Moves the outline and the nodes outside it by a homogeneous deformation and solves for the inner nodes;
/// `h` is the spacing, m.
pub fn patch(mesh: &Mesh<2>, h: f64, tissue: &str) -> Result<f64, Error> {
    let deformation = Matrix2::new(1.1, 0.05, 0.0, 0.95);
    let mut inner = mesh.in_tissue();
    mesh.surface_nodes().into_iter().for_each(|n| inner[n] = false);
    let held: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| !inner[n]).collect();
    let held_mesh = Mesh { fixed: held, ..mesh.clone() };
    let system = System::new(&held_mesh, &model(tissue), &[])?;
    let moved: Vec<_> = mesh.nodes.iter().map(|p| deformation * p).collect();
    // Inner nodes start away from the solution, so that the solver has to find it.
    let mut start = moved.clone();
    for (i, p) in start.iter_mut().enumerate().filter(|(i, _)| inner[*i]) {
        p.x += 0.05 * h * (1.7 * i as f64).sin();
    }
    let mut workspace = Workspace::new(&system);
    workspace.start_from(&start);
    let slack = vec![0.0; system.muscle_count()];
    statics::solve(&system, &mut workspace, &slack, &SolveSettings::default());
    let off = workspace.positions().iter().zip(&moved).map(|(a, b)| (a - b).norm());
    Ok(1e3 * off.fold(0.0, f64::max))
}
