//! Whatever the text, reading a mesh ends in a mesh that passes its checks or in an error, making a system of it in a system or
//! in an error, and its equilibrium in finite positions without a cell turned over, or in a status.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::statics::{Settings, Status, Workspace, solve};
use tongue_fit::body::json;
use tongue_fit::system::{Model, System};

fuzz_target!(|text: &str| {
    let Ok(mesh) = json::read(text, "fuzz.json") else { return };
    mesh.check().expect("a mesh that was read passes its checks");
    let all: Vec<usize> = (0..mesh.muscles.len()).collect();
    let Ok(system) = System::new(&mesh, &Model::default(), &all) else { return };
    let mut workspace = Workspace::new(&system);
    let settings = Settings { max_iterations: 30, load_steps: 4, ..Settings::default() };
    let solution = solve(&system, &mut workspace, &vec![1.0; all.len()], &settings);
    assert!(workspace.positions().iter().flatten().all(|x| x.is_finite()), "{solution:?}");
    if solution.status == Status::Converged {
        assert!(solution.max_residual_force.is_finite(), "{solution:?}");
        assert!(system.cell_ratios(workspace.positions()).0 > 0.0, "{solution:?}");
    }
});
