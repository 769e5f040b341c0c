//! The fields of quadratic elements are those of scikit-fem (Gustafsson and McBain 2020), a code of others, on the same mesh and with the
//! same integration points. Runs where `TONGUE_FIT_PYTHON` names a Python that has it.

use std::io::Write;
use std::process::{Command, Stdio};

use serde::Deserialize;
use tongue_fit::body::{Body, ContinuumSettings};
use tongue_fit::material::Constants;
use tongue_fit::statics::{self, Settings, Status, Workspace};
use tongue_fit::system::{Additions, Model, System, TissueModel};

#[derive(Deserialize)]
struct Solved {
    rows: Vec<[f64; 4]>,
    seconds: f64,
}

#[test]
fn a_pulled_tongue_has_the_displacements_that_scikit_fem_finds() {
    let Some(python) = std::env::var_os("TONGUE_FIT_PYTHON") else {
        let required = std::env::var_os("TONGUE_FIT_REQUIRE_PYTHON").is_some();
        assert!(!required, "TONGUE_FIT_PYTHON must name a Python with scikit-fem");
        return;
    };
    let mut base = Body::tongue(5.5e-3).unwrap().mesh;
    let surface = base.surface_nodes();
    let height = |n: usize| base.nodes[n][1];
    base.fixed = surface.into_iter().filter(|&n| height(n) < 5e-3 || height(n) > 40e-3).collect();
    base.muscles.clear();
    let body = Body::new("pulled", base.clone()).into_continuum(&ContinuumSettings::default()).unwrap();
    let mesh = &body.mesh;
    let shift = |n: usize| if mesh.nodes[n][1] > 20e-3 { [3e-3, -4e-3] } else { [0.0, 0.0] };
    let carried =
        mesh.fixed.iter().map(|&n| (n, mesh.nodes[n] + nalgebra::Vector2::from(shift(n)))).collect();
    let model = Model { tissue: TissueModel::Continuum, ..Model::default() };
    let system = System::with(mesh, &model, &[], Additions { carried, ..Additions::default() }).unwrap();
    let mut workspace = Workspace::new(&system);
    let solution = statics::solve(&system, &mut workspace, &[], &Settings::default());
    assert_eq!(solution.status, Status::Converged);

    let (lambda, mu) = Constants::TONGUE.lame();
    let elements = mesh.continuum.as_ref().unwrap();
    let corners = elements.elements().map(|e| e[..3].to_vec()).collect::<Vec<_>>();
    let count = corners.iter().flatten().max().unwrap() + 1;
    let held: Vec<[f64; 4]> =
        mesh.fixed.iter().map(|&n| [mesh.nodes[n][0], mesh.nodes[n][1], shift(n)[0], shift(n)[1]]).collect();
    let nodes: Vec<[f64; 2]> = mesh.nodes[..count].iter().map(|p| [p[0], p[1]]).collect();
    let problem = serde_json::json!({
        "nodes_m": nodes, "triangles": corners, "lambda": lambda, "mu": mu, "held": held
    });
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/skfem/solve.py");
    let mut child =
        Command::new(python).arg(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(problem.to_string().as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "is scikit-fem installed?");
    let theirs: Solved = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(theirs.rows.len(), mesh.nodes.len());
    let mut worst: f64 = 0.0;
    for (node, rest) in mesh.nodes.iter().enumerate() {
        let at = |row: &&[f64; 4]| (row[0] - rest[0]).abs() + (row[1] - rest[1]).abs() < 1e-10;
        let row = theirs.rows.iter().find(at).unwrap();
        let ours = workspace.positions()[node] - rest;
        worst = worst.max((ours[0] - row[2]).abs()).max((ours[1] - row[3]).abs());
    }
    println!("largest difference {:.1e} mm; scikit-fem took {:.3} s", 1e3 * worst, theirs.seconds);
    assert!(worst < 1e-11, "{worst:e} m");
}
