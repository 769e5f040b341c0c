//! Compares the time of an equilibrium of the continuum with scikit-fem's: `TONGUE_FIT_PYTHON=.venv/bin/python cargo bench --bench
//! scikit_fem`, with a Python that has scikit-fem 12.0.2. Prints a table, or a message if there is no such Python.
//!
//! Both solve the same quadratic triangles with the same integration points from rest to the same residual force, on one thread; the
//! muscles of /a/ pull along their directions at rest. Times are medians, without those of the mesh and of what is computed from it once.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a bench that cannot begin has failed")]

#[path = "../tests/fixtures/scikit_fem.rs"]
mod scikit_fem;

use std::time::Instant;

use tongue_fit::statics::{SolveSettings, SolveStatus, Workspace, solve};

const PUBLISHED: [f64; 8] = [12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];
const REPEATS: usize = 25;

fn main() {
    let Some(python) = std::env::var_os("TONGUE_FIT_PYTHON") else {
        println!("TONGUE_FIT_PYTHON does not name a Python with scikit-fem, so nothing is compared");
        return;
    };
    println!(
        "| h, mm | unknowns | ours, ms | iterations | scikit-fem, ms | iterations (steps) | times | difference, mm |"
    );
    println!("| --: | --: | --: | --: | --: | --: | --: | --: |");
    let settings = SolveSettings::default();
    for h in [5.5e-3, 4e-3] {
        let tongue = scikit_fem::Tongue::new(h, [0.0; 2], &PUBLISHED);
        let theirs = tongue.by_scikit_fem(&python, settings.tolerance, REPEATS);
        let mut workspace = Workspace::new(&tongue.system);
        let mut iterations = 0;
        let once = |_| {
            workspace.start_from_rest(&tongue.system);
            let clock = Instant::now();
            let solution = solve(&tongue.system, &mut workspace, &[], &settings);
            iterations = solution.iterations;
            assert_eq!(solution.status, SolveStatus::Converged);
            clock.elapsed().as_secs_f64()
        };
        let mut seconds: Vec<f64> = (0..REPEATS).map(once).collect();
        seconds.sort_by(f64::total_cmp);
        let ours = seconds[REPEATS / 2];
        let difference = tongue.largest_difference(workspace.positions(), &theirs);
        assert!(difference < 1e-11, "another shape: {difference:e} m");
        println!(
            "| {} | {} | {:.2} | {iterations} | {:.1} | {} ({}) | {:.1} | {:.0e} |",
            1e3 * h,
            2 * tongue.system.pattern().unknowns(),
            1e3 * ours,
            1e3 * theirs.seconds,
            theirs.iterations,
            theirs.steps,
            theirs.seconds / ours,
            1e3 * difference
        );
    }
}
