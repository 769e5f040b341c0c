//! Hard cases: the solvers at extreme loads, materials, meshes and targets, with a row for each run.
//!
//! They test this promise: for any valid mesh, finite tensions and materials in range, a solve ends in a stable equilibrium or in a status
//! that says what happened and at which load. It never ends in NaN, a panic, an endless loop or an inverted cell that is not reported. A
//! solve that did not converge can still keep the promise.

#[path = "../../../../tests/fixtures/bodies.rs"]
mod bodies;
mod branches;
mod invariance;
mod loads;
mod materials;
mod motion;
mod search;
mod table;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::measure::timed;
use crate::test_tensions::{TestTensions, tongue};
use crate::{Error, tell};
use tongue_core::statics::{
    SAME_SHAPE_M, Solution, SolveSettings, SolveStatus, Stability, Workspace, smallest_eigenvalue, solve,
};
use tongue_core::system::System;
use tongue_files::report::status_name;

pub use table::{markdown, picture};

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct HardCase {
    pub case: u8,
    pub variant: String,
    /// `equilibrium`, `trace`, `fit`, `system`, or the name of an integrator.
    pub solver: &'static str,
    pub status: String,
    /// Whether the solver found a stable equilibrium, met the target, or reached the end time.
    pub converged: bool,
    /// Whether the promise was kept.
    pub kept: bool,
    /// Newton iterations; for fits the number of equilibria, for motions the number of steps.
    pub iterations: usize,
    /// Part of the load at which the last state is an equilibrium.
    pub load_reached: f64,
    /// Smallest ratio of a cell's area to that at rest.
    pub min_area_ratio: Option<f64>,
    pub smallest_eigenvalue_n_per_m: Option<f64>,
    /// Number of elements in which the barrier against inversion acts.
    pub guarded: usize,
    /// Part of the load at which the branch from rest ends; 1 if it does not, `None` if it was not followed.
    pub branch_ends_at: Option<f64>,
    /// Largest distance of a node between the answer and the equilibrium to which the load path leads from rest, m.
    pub apart_from_branch_m: Option<f64>,
    /// Wall-clock time, s.
    pub wall_s: f64,
    pub note: String,
}

impl HardCase {
    fn new(variant: impl Into<String>, solver: &'static str, status: impl Into<String>) -> Self {
        let (variant, status) = (variant.into(), status.into());
        Self { variant, solver, status, load_reached: 1.0, ..Self::default() }
    }

    /// A row for input that should be refused: the promise is kept if there is a message.
    fn refusal(variant: &str, solver: &'static str, message: Option<String>) -> Self {
        let kept = message.is_some();
        let status = if kept { "refused" } else { "accepted" };
        let note = message.unwrap_or_else(|| "should have been refused".to_owned());
        Self { kept, load_reached: 0.0, note, ..Self::new(variant, solver, status) }
    }

    fn with_note(mut self, text: &str) -> Self {
        self.note += if self.note.is_empty() { "" } else { "; " };
        self.note += text;
        self
    }

    /// Whether the branch from rest reaches the whole load at the answer.
    pub fn is_on_branch(&self) -> bool {
        self.branch_ends_at == Some(1.0) && self.is_where_branch_leads()
    }

    /// Whether the answer has the same shape ([`SAME_SHAPE_M`]) as the equilibrium to which the load path leads.
    pub fn is_where_branch_leads(&self) -> bool {
        self.apart_from_branch_m.is_some_and(|apart| apart <= SAME_SHAPE_M)
    }
}

type NamedCase = (&'static str, fn(bool) -> Result<Vec<HardCase>, Error>);

/// Case 1 is the first. With `true` a case has all variants (every subset of muscles, the mesh of 50 000 nodes), otherwise a sample of them.
const CASES: [NamedCase; 11] = [
    ("Table 4.2 as printed, and its misprints one by one", |_| motion::printed_table()),
    ("Subsets of the muscles at 1, 10, 100 and 1000 N", |full| {
        loads::subsets(&tongue()?, f64::INFINITY, full)
    }),
    ("Extreme materials", |_| materials::extremes()),
    ("Folding chains", |_| loads::folding_chains()),
    ("Slivers, broken meshes, large meshes", materials::broken_and_large),
    ("Targets", |_| search::targets()),
    ("Nelder-Mead", search::simplices),
    ("Steps of time", motion::steps),
    ("Two equilibria", |_| branches::two_equilibria()),
    ("Threads, numbering, position", |_| invariance::same_answers()),
    ("Subsets of the muscles of a continuum (8 mm) at 1, 10, 100 and 1000 N", |full| {
        loads::subsets(&loads::continuum()?, loads::FOLLOWED_N, full)
    }),
];
pub const LAST: i64 = CASES.len() as i64;

/// Runs the given cases, or all if none is given.
pub fn run_all(cases: &[u8], full: bool) -> Result<Vec<HardCase>, Error> {
    let mut rows = Vec::new();
    for (case, (_, run)) in (1..).zip(CASES).filter(|(c, _)| cases.is_empty() || cases.contains(c)) {
        let of_case = run(full)?;
        let kept = of_case.iter().filter(|r| r.kept).count();
        tell(&format!("case {case:2}: promise kept in {kept} of {} rows", of_case.len()));
        rows.extend(of_case.into_iter().map(|row| HardCase { case, ..row }));
    }
    Ok(rows)
}

fn row_of(variant: String, body: &TestTensions) -> HardCase {
    equilibrium_row(variant, &body.system, &mut Workspace::new(&body.system), &body.tensions)
}

/// Solves from rest and checks the stability of the answer.
fn equilibrium_row<const D: usize>(
    variant: impl Into<String>,
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
) -> HardCase {
    workspace.start_from_rest(system);
    let settings = SolveSettings { certify: true, ..SolveSettings::default() };
    let (solution, wall_s) = timed(|| solve(system, workspace, tensions, &settings));
    let found = matches!(solution.status, SolveStatus::Converged | SolveStatus::Unstable);
    let smallest_eigenvalue = if found { smallest_eigenvalue(system, workspace) } else { None };
    let (smallest, _) = system.cell_ratios(workspace.positions());
    let finite = workspace.positions().iter().all(|p| p.iter().all(|c| c.is_finite()));
    let stable = matches!(solution.stability, Stability::Stable | Stability::Neutral);
    let converged = solution.status == SolveStatus::Converged && stable;
    HardCase {
        converged,
        // Only the status `Inverted` may have inverted cells.
        kept: finite
            && (smallest > 0.0) != (solution.status == SolveStatus::Inverted)
            && (converged || solution.status != SolveStatus::Converged),
        iterations: solution.iterations,
        load_reached: solution.load_reached,
        min_area_ratio: smallest.is_finite().then_some(smallest),
        smallest_eigenvalue_n_per_m: smallest_eigenvalue,
        guarded: solution.guarded,
        wall_s,
        note: note_of(&solution),
        ..HardCase::new(variant, "equilibrium", status_name(&solution.status))
    }
}

fn note_of(solution: &Solution) -> String {
    let mut notes = Vec::new();
    if solution.stability == Stability::Neutral {
        notes.push("neutral: some part can move without work".to_owned());
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
    if solution.max_residual_force > SolveSettings::default().tolerance {
        notes.push(format!("residual {:.1e} N", solution.max_residual_force));
    }
    if solution.status == SolveStatus::Inverted {
        notes.push("no area term: springs alone let cells invert".to_owned());
    } else if solution.status != SolveStatus::Converged {
        notes.push(format!("{:.3} of the load reached", solution.load_reached));
        notes.push(format!("rounding alone makes {:.1e} N", solution.rounding_force));
    }
    notes.join("; ")
}
