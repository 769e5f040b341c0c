//! Axis 4: finer meshes, each with every tissue of axis 5.

use nalgebra::SVector;
use serde::Serialize;

use crate::measure::{Effort, measure, observed_order};
use crate::pulled::largest_difference;
use crate::{Error, Pulled, tell};
use tongue_core::body::{Body, Mesh};
use tongue_core::effect::{Configuration, Tangent};
use tongue_core::sparse::BlockMatrix;
use tongue_core::sparse::cholesky::Factor;
use tongue_core::statics::Workspace;

use super::ladder::Ended;
use super::tissue::{PatchRun, SCENES, TISSUES, model, patch};

const FORCE_TOLERANCE: f64 = 1e-9;

/// One scene on one mesh with one tissue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshRun {
    pub scene: &'static str,
    pub tissue: &'static str,
    pub h_mm: f64,
    pub unknown_nodes: usize,
    pub triangles: usize,
    /// Ratio of every muscle to GGa.
    #[serde(skip)]
    pub ratios: Vec<f64>,
    /// Largest change of a ratio from the next coarser mesh.
    pub change_from_next_coarser: Option<f64>,
    /// Largest difference of a ratio from finite elements on the finest mesh.
    pub difference_from_finest_fe: f64,
    /// Median time to build the mesh, s; the same mesh serves every tissue and scene.
    pub mesh_s: f64,
    /// Median time to make the system, with its ordering, s.
    pub setup_s: f64,
    /// Median time of one equilibrium from rest, s.
    pub solve_s: f64,
    /// Median time of one evaluation of energy and force, s.
    pub force_s: f64,
    /// Median time of one stiffness, assembled and factorised, s.
    pub factor_s: f64,
    pub iterations: usize,
    pub factorisations: usize,
    pub matrix_bytes: usize,
    pub ended: Ended,
}

pub fn ladder(effort: &Effort) -> Result<(Vec<MeshRun>, Vec<PatchRun>), Error> {
    let (mut runs, mut patches) = (Vec::new(), Vec::new());
    for &h in effort.spacings {
        tell(&format!("mesh of {:.2} mm", h * 1e3));
        let meshed = measure(effort, || Body::tongue(h));
        let mesh = meshed.result?.mesh;
        for tissue in TISSUES {
            for (name, pull) in SCENES {
                runs.push(one(&mesh, (name, pull), tissue, (h, meshed.seconds), effort)?);
            }
            patches.push(PatchRun { tissue, h_mm: h * 1e3, error_mm: patch(&mesh, h, tissue)? });
        }
    }
    compare(&mut runs);
    Ok((runs, patches))
}

fn one(
    mesh: &Mesh<2>,
    (name, pull): (&'static str, &[(&str, f64)]),
    tissue: &'static str,
    (h, mesh_s): (f64, f64),
    effort: &Effort,
) -> Result<MeshRun, Error> {
    let made = measure(effort, || Pulled::new(mesh, &model(tissue), pull));
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
    let mut matrix = BlockMatrix::zeros(system.pattern());
    let mut factor = Factor::new(system.pattern());
    let factored = measure(effort, || {
        matrix.clear();
        system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut matrix));
        factor.factorise(system.pattern(), &matrix)
    });
    let solution = solved.result;
    Ok(MeshRun {
        scene: name,
        tissue,
        h_mm: h * 1e3,
        unknown_nodes: system.pattern().unknowns(),
        triangles: mesh.cells.len(),
        ratios: scene.ratios(workspace.positions()),
        change_from_next_coarser: None,
        difference_from_finest_fe: 0.0,
        mesh_s,
        setup_s: made.seconds,
        solve_s: solved.seconds,
        force_s: forced.seconds,
        factor_s: factored.seconds,
        iterations: solution.iterations,
        factorisations: solution.factorisations,
        matrix_bytes: 2 * (system.pattern().blocks() + 1) * size_of::<[[f64; 2]; 2]>(),
        ended: solution.status.into(),
    })
}

fn compare(runs: &mut [MeshRun]) {
    let known = runs.to_vec();
    for run in runs {
        let same = known.iter().filter(|r| r.scene == run.scene);
        let coarser = same.clone().rev().find(|r| r.tissue == run.tissue && r.h_mm > run.h_mm);
        run.change_from_next_coarser = coarser.map(|c| largest_difference(&c.ratios, &run.ratios));
        let finest = same.rev().find(|r| r.tissue == TISSUES[1]);
        run.difference_from_finest_fe = finest.map_or(0.0, |f| largest_difference(&f.ratios, &run.ratios));
    }
}

/// Order in h of the convergence of a scene's ratios, from their changes between neighbouring meshes; near
/// zero or below, they do not converge.
pub fn order(runs: &[MeshRun], scene: &str, tissue: &str) -> Option<f64> {
    let changes = runs.iter().filter(|r| r.scene == scene && r.tissue == tissue);
    observed_order(&changes.filter_map(|r| Some((r.h_mm, r.change_from_next_coarser?))).collect::<Vec<_>>())
}
