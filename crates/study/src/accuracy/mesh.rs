//! Axis 4: the spacing of the mesh.

use nalgebra::SVector;
use serde::Serialize;

use crate::measure::{Effort, measure, observed_order};
use crate::test_tensions::largest_difference;
use crate::{Error, PUBLISHED_A, TestTensions, tell};
use tongue_core::body::{Body, Mesh};
use tongue_core::effect::Configuration;
use tongue_core::statics::{Response, Workspace};
use tongue_core::system::Model;

use super::methods::ending;

/// The posture /a/ as published, and one muscle of the back and one of the tip alone; tensions in N per metre of thickness.
pub const SCENES: [(&str, &[(&str, f64)]); 3] =
    [("/a/", &PUBLISHED_A), ("GGp 10 N", &[("GGp", 10.0)]), ("SGp 10 N", &[("SGp", 10.0)])];
const FORCE_TOLERANCE: f64 = 1e-9;

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct MeshRun {
    pub scene: &'static str,
    pub h_mm: f64,
    pub unknown_nodes: usize,
    pub triangles: usize,
    /// Ratio of every muscle's length to that of GGa.
    #[serde(skip)]
    pub ratios: Vec<f64>,
    /// Largest change of a ratio from the next coarser mesh.
    pub change_from_next_coarser: Option<f64>,
    /// Median time to build the mesh, s, the same for every scene.
    pub mesh_s: f64,
    /// Median time to make the system with its elimination order, s.
    pub setup_s: f64,
    /// Median time of one equilibrium from rest, s.
    pub solve_s: f64,
    /// Median time of one evaluation of energy and force, s.
    pub force_s: f64,
    /// Median time to assemble and factorise the stiffness, s.
    pub factor_s: f64,
    pub iterations: usize,
    pub factorisations: usize,
    pub matrix_bytes: usize,
    pub ended: String,
}

pub fn work_precision(effort: &Effort) -> Result<Vec<MeshRun>, Error> {
    let mut runs: Vec<MeshRun> = Vec::new();
    for &h in effort.spacings {
        tell(&format!("mesh of {:.2} mm", h * 1e3));
        let meshed = measure(effort, || Body::tongue(h));
        let mesh = meshed.result?.mesh;
        for scene in SCENES {
            let run = mesh_run(&mesh, scene, effort)?;
            let coarser = runs.iter().rev().find(|r| r.scene == run.scene);
            let change_from_next_coarser = coarser.map(|c| largest_difference(&c.ratios, &run.ratios));
            runs.push(MeshRun { h_mm: h * 1e3, mesh_s: meshed.seconds, change_from_next_coarser, ..run });
        }
    }
    Ok(runs)
}

fn mesh_run(
    mesh: &Mesh<2>,
    (name, pull): (&'static str, &[(&str, f64)]),
    effort: &Effort,
) -> Result<MeshRun, Error> {
    let made = measure(effort, || TestTensions::new(mesh, &Model::default(), pull));
    let scene = made.result?;
    let system = &scene.system;
    let mut workspace = Workspace::new(system);
    let solved = measure(effort, || scene.solve(&mut workspace, FORCE_TOLERANCE));
    let at = Configuration { positions: workspace.positions(), tensions: &scene.tensions };
    let mut force = vec![SVector::zeros(); at.positions.len()];
    let forced = measure(effort, || {
        system.force(at, &mut force);
        std::hint::black_box(system.energy(at))
    });
    let ratios = scene.ratios(workspace.positions());
    let factored = measure(effort, || Response::new(system, &mut workspace).is_some());
    let solution = solved.result;
    Ok(MeshRun {
        scene: name,
        unknown_nodes: system.pattern().unknowns(),
        triangles: mesh.cells.len(),
        ratios,
        setup_s: made.seconds,
        solve_s: solved.seconds,
        force_s: forced.seconds,
        factor_s: factored.seconds,
        iterations: solution.iterations,
        factorisations: solution.factorisations,
        matrix_bytes: 2 * (system.pattern().blocks() + 1) * size_of::<[[f64; 2]; 2]>(),
        ended: ending(solution.status),
        ..MeshRun::default()
    })
}

/// Order in h of the changes of a scene's ratios from mesh to mesh; near zero or below, ratios do not converge.
pub fn order(runs: &[MeshRun], scene: &str) -> Option<f64> {
    let changes = runs.iter().filter(|r| r.scene == scene);
    observed_order(&changes.filter_map(|r| Some((r.h_mm, r.change_from_next_coarser?))).collect::<Vec<_>>())
}
