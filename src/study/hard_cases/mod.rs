//! Hard cases: what the solvers do at loads, materials, meshes and targets far from the ordinary, one row for each.
//!
//! The promise under test: for any valid mesh, finite tensions and materials in range, a solve ends in a stable equilibrium
//! or in a status that says what happened and at which load; never in a NaN, a panic, a hang, or an inverted cell that is not
//! reported. A row's [`Row::kept`] says whether the promise was kept there; a solve that did not converge can still keep it.

pub mod bodies;
mod branches;
mod invariance;
mod loads;
mod materials;
mod meshes;
mod motion;
mod search;
mod table;

use std::time::Instant;

use serde::Serialize;

use crate::statics::{Settings, Solution, Stability, Status, Workspace, smallest_eigenvalue, solve};
use crate::system::System;

pub use table::{markdown, table};

/// Which of the cases' variants are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// A sample that takes seconds.
    Sample,
    /// All: every subset of muscles, the mesh of 50 000 nodes.
    Full,
}

/// What one solver did in one variant of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Number of the case.
    pub case: u8,
    /// Which variant.
    pub variant: String,
    /// What was run: `equilibrium`, `trace`, `fit`, `system`, or a method of integration.
    pub solver: &'static str,
    /// How it ended.
    pub status: String,
    /// Whether it converged to a stable equilibrium (or a fit ended as it should).
    pub converged: bool,
    /// Whether the promise was kept.
    pub kept: bool,
    /// Newton iterations; of fits the equilibria solved, of motions the steps.
    pub iterations: usize,
    /// Part of the load at which the state left behind is an equilibrium.
    pub load_reached: f64,
    /// Smallest ratio of a cell's measure to that at rest.
    pub min_area_ratio: Option<f64>,
    /// Smallest eigenvalue of the stiffness, N/m.
    pub smallest_eigenvalue: Option<f64>,
    /// Elements in which the barrier against inversion acts.
    pub guarded: usize,
    /// How the answer lies to the branch of equilibria that begins at rest, where that was followed.
    pub branch: Option<Beside>,
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// What else there is to say.
    pub note: String,
}

/// An answer beside the branch that begins at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Beside {
    /// Part of the load at which the branch ends; 1 where it reaches all of it.
    pub ends_at: f64,
    /// Largest distance of a node between the answer, found directly, and the one that the body comes to along the branch
    /// (and, where that ends, beyond it), m.
    pub apart_m: f64,
}

impl Beside {
    /// Whether the branch reaches the whole load and the answer lies on it, to 1e-9 m.
    pub fn is_on_it(&self) -> bool {
        self.ends_at == 1.0 && self.is_same()
    }

    /// Whether the answer is the one that the body comes to along the branch, to 1e-9 m.
    pub fn is_same(&self) -> bool {
        self.apart_m <= invariance::SAME
    }
}

/// The numbers of the cases that can be run.
pub const CASES: [u8; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];

/// Runs one case; no rows for a number that is not in [`CASES`].
///
/// # Errors
/// [`StabilityError`] when the reference body cannot be built.
pub fn run(case: u8, extent: Extent) -> Result<Vec<Row>, StabilityError> {
    match case {
        1 => motion::printed_table(),
        2 => loads::subsets(extent),
        3 => materials::extremes(),
        4 => loads::folding_chains(),
        5 => meshes::broken_and_large(extent),
        6 => search::targets(),
        7 => search::simplices(),
        8 => motion::steps(extent),
        9 => branches::two_equilibria(),
        10 => invariance::same_answers(),
        _ => Ok(Vec::new()),
    }
}

/// Why the cases cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The reference anatomy.
    #[error(transparent)]
    Anatomy(#[from] crate::body::AnatomyError),
    /// The reference mesh.
    #[error(transparent)]
    Mesh(#[from] crate::body::MeshError),
    /// A body that should be good.
    #[error(transparent)]
    System(#[from] crate::system::SystemError),
    /// The measured lengths.
    #[error(transparent)]
    Target(#[from] crate::measured::TargetError),
    /// The table of lengths.
    #[error(transparent)]
    Lengths(#[from] crate::measured::lengths::Error),
    /// A vowel.
    #[error(transparent)]
    Vowel(#[from] crate::measured::lengths::BadLabel),
    /// A fit that cannot begin.
    #[error(transparent)]
    Fit(#[from] crate::inverse::FitError),
    /// The equations of motion.
    #[error(transparent)]
    Motion(#[from] crate::dynamics::MotionError),
    /// A step or a tolerance.
    #[error(transparent)]
    Method(#[from] crate::dynamics::MethodError),
    /// Threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
}

/// Solves from rest with the stability certified, and reports it.
fn equilibrium_row<const D: usize>(
    case: u8,
    variant: String,
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
) -> (Solution, Row) {
    workspace.start_from_rest(system);
    let clock = Instant::now();
    let solution = solve(system, workspace, tensions, &Settings { certify: true, ..Settings::default() });
    let wall_s = clock.elapsed().as_secs_f64();
    let found = matches!(solution.status, Status::Converged | Status::Unstable);
    let smallest_eigenvalue = if found { smallest_eigenvalue(system, workspace) } else { None };
    let (smallest, _) = system.cell_ratios(workspace.positions());
    let finite = workspace.positions().iter().all(|p| p.iter().all(|c| c.is_finite()));
    let stable = matches!(solution.stability, Stability::Stable | Stability::Neutral);
    let converged = solution.status == Status::Converged && stable;
    let row = Row {
        case,
        variant,
        solver: "equilibrium",
        status: name_of(&solution.status),
        converged,
        // A cell turned over is reported as such or not at all.
        kept: finite
            && (smallest > 0.0) != (solution.status == Status::Inverted)
            && (converged || solution.status != Status::Converged),
        iterations: solution.iterations,
        load_reached: solution.load_reached,
        min_area_ratio: smallest.is_finite().then_some(smallest),
        smallest_eigenvalue,
        guarded: solution.guarded,
        branch: None,
        wall_s,
        note: note_of(&solution),
    };
    (solution, row)
}

fn note_of(solution: &Solution) -> String {
    let mut notes = Vec::new();
    if solution.stability == Stability::Neutral {
        notes.push("neutral: some part moves without work".to_owned());
    }
    if solution.load_steps > 0 {
        notes.push(format!("{} load steps", solution.load_steps));
    }
    if solution.escapes > 0 {
        notes.push(format!("left {} unstable equilibria: another branch exists", solution.escapes));
    }
    if solution.guarded > 0 {
        notes.push("barrier active: not the published law".to_owned());
    }
    if solution.max_residual_force > Settings::default().tolerance {
        notes.push(format!("residual {:.1e} N", solution.max_residual_force));
    }
    if solution.status == Status::Inverted {
        notes.push("no area term: springs alone let cells turn over".to_owned());
    } else if solution.status != Status::Converged {
        notes.push(format!("{:.3} of the load reached", solution.load_reached));
        notes.push(format!("rounding alone makes {:.1e} N", solution.rounding_force));
    }
    notes.join("; ")
}

/// A status as it stands in JSON.
fn name_of<T: Serialize>(status: &T) -> String {
    match serde_json::to_value(status) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::from("unnamed"),
    }
}

/// A row about something that was refused: the promise is kept when there was a message.
fn refusal(case: u8, variant: &str, solver: &'static str, message: Option<String>) -> Row {
    Row {
        case,
        variant: variant.to_owned(),
        solver,
        status: if message.is_some() { "refused" } else { "accepted" }.to_owned(),
        converged: false,
        kept: message.is_some(),
        iterations: 0,
        load_reached: 0.0,
        min_area_ratio: None,
        smallest_eigenvalue: None,
        guarded: 0,
        branch: None,
        wall_s: 0.0,
        note: message.unwrap_or_else(|| "should have been refused".to_owned()),
    }
}
