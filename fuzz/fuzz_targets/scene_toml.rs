//! Whatever the text, reading a scene ends in a scene or in an error, planning it in a plan or in an error, and its equilibrium
//! in finite positions without a cell turned over, or in a status.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::statics::{Settings, Status, Workspace, solve};
use tongue_fit::scene::Scene;
use tongue_fit::body::{AnyBody, Body as Built};
use tongue_fit::scene::body;
use tongue_fit::scene::file::{Body, Want};
use tongue_fit::scene::prepare::{Extent, prepare};

/// Bodies of at most a few hundred nodes, and none from other files: what is tried is the reader, not the disk.
fn is_small(body: &Body) -> bool {
    match body {
        Body::Tongue(t) => t.h_mm.is_nan() || t.h_mm >= 5.0 || t.h_mm < 0.1,
        Body::Mesh(_) => false,
        Body::Cylinder(c) => !(c.radius_mm.max(c.length_mm) / c.h_mm > 6.0),
        Body::Block(b) => !b.size_mm.iter().any(|s| s / b.h_mm > 6.0),
    }
}

fn solved<const D: usize>(scene: &Scene, built: Built<D>) {
    let Ok(prepared) = prepare(scene, built, Extent::Pruned) else { return };
    if scene.want == Want::Trajectory || prepared.target.is_some() {
        return;
    }
    let system = &prepared.system;
    let mut workspace = Workspace::new(system);
    let settings = Settings { max_iterations: 30, load_steps: 4, ..Settings::default() };
    let solution = solve(system, &mut workspace, &prepared.tensions, &settings);
    assert!(workspace.positions().iter().flatten().all(|x| x.is_finite()), "{solution:?}");
    if solution.status == Status::Converged {
        assert!(solution.max_residual_force.is_finite(), "{solution:?}");
        assert!(system.cell_ratios(workspace.positions()).0 > 0.0, "{solution:?}");
    }
}

fuzz_target!(|text: &str| {
    let Ok(scene) = Scene::from_toml(text, "fuzz.toml") else { return };
    if scene.check().is_err() || !is_small(&scene.body) {
        return;
    }
    match body::build(&scene.body) {
        Ok(AnyBody::Flat(built)) => solved(&scene, built),
        Ok(AnyBody::Solid(built)) => solved(&scene, built),
        Err(_) => {}
    }
});
