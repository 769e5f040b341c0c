//! Three dimensions: a block with two muscles, whose tensions are recovered from simulated lengths and from
//! points of its surface.
//!
//!     cargo run --example three_dimensions [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::env;
use std::error::Error;

use nalgebra::Vector3;
use tongue_fit::body::{MuscleChain, solid};
use tongue_fit::inverse::FitSettings;
use tongue_fit::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).unwrap_or_else(|| "target/three_dimensions".into());

    // A cube of 24 mm with its bottom on bone. A muscle is a chain of nodes, here along two edges of the upper face.
    let mut mesh = solid::block([24.0 * MM; 3], [3; 3]);
    let along = |direction: Vector3<f64>| -> Vec<usize> {
        let places =
            (0..=3).map(|i| Vector3::new(0.0, 0.0, 24.0 * MM) + direction * (8.0 * MM * f64::from(i)));
        places.filter_map(|p| mesh.nodes.iter().position(|n| (n - p).norm() < 1e-9)).collect()
    };
    let (lengthwise, across) = (along(Vector3::x()), along(Vector3::y()));
    mesh.muscles = vec![
        MuscleChain { name: "lengthwise".into(), nodes: lengthwise },
        MuscleChain { name: "across".into(), nodes: across },
    ];
    let body = Body::new("a block", mesh);

    // The tissue consists of springs on the edges of tetrahedra that keep their volume (thesis 3.3.2).
    let model = Assembly::new(&Model::default(), &body, ["lengthwise", "across"])?;
    let seen = model.solver().equilibrium(&[("lengthwise", 0.23), ("across", 0.11)])?;
    let settings = FitSettings { method: Method::GaussNewton, upper_bound: 1.0, ..FitSettings::default() };

    // Both lengths are taken as measurements.
    let mut lengths = Vec::new();
    for muscle in ["lengthwise", "across"] {
        lengths.push(Observation::new(model.stretch(muscle)?, seen.stretch(muscle)?));
    }
    let from_lengths = InverseProblem::new(&model, lengths).with_settings(settings).fit()?;

    // Points of the upper face as a scanner measures them: without names, not at nodes, with a standard deviation of 0.1 mm.
    let mut points = Vec::new();
    for face in body.mesh.outward_faces() {
        if face.iter().all(|&n| body.mesh.nodes[n].z > 23.9 * MM) {
            let point = face.iter().map(|&n| seen.positions()[n]).sum::<Vector3<f64>>() / 3.0;
            points.push(Observation::new(model.surface(point)?, 0.0).with_standard_deviation(0.1 * MM));
        }
    }
    let from_points = InverseProblem::new(&model, points).with_settings(settings).fit()?;

    for (what, fit) in [("lengths", &from_lengths), ("surface points", &from_points)] {
        let [a, b] = [fit.shape.tension("lengthwise")?, fit.shape.tension("across")?];
        println!(
            "from {} {what}: lengthwise {a:.6} N, across {b:.6} N, {:?}",
            fit.measured().len(),
            fit.answer.status
        );
    }
    let picture = from_points.shape.picture("A block and two muscles")?;
    let vtu = from_points.shape.vtu()?;
    report::write(&folder, "three_dimensions", &[("block.svg", &picture), ("block.vtu", &vtu)])?;
    Ok(())
}
