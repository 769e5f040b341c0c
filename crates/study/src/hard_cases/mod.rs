//! Hard cases: the solvers at extreme loads, materials, meshes and targets, with a row for each run.
//!
//! They test this promise: for any valid mesh, finite tensions and materials in range, a solve ends in a stable equilibrium or in a status
//! that says what happened and at which load. It never ends in NaN, a panic, an endless loop or an inverted cell that is not reported. A
//! solve that did not converge can still keep the promise.

#[path = "../../../../tests/fixtures/bodies.rs"]
mod bodies;
mod invariance;
mod loads;
mod materials;
mod motion;
mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::Serialize;
use serde_json::{Value, json};

use crate::measure::timed;
use crate::test_tensions::{TestTensions, tongue};
use crate::{Error, table, tell};
use tongue_core::statics::{
    SAME_SHAPE_M, Solution, SolveSettings, SolveStatus, Stability, Workspace, smallest_eigenvalue, solve,
};
use tongue_core::statistics::distinct;
use tongue_core::system::System;
use tongue_files::report::column::{self, Column};
use tongue_files::report::{ReportError, Series, Svg, parts, status_name};

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct HardCase {
    pub case: u8,
    pub variant: String,
    /// `equilibrium`, `trace`, `fit`, `system`, or the name of an integrator.
    pub solver: &'static str,
    pub status: String,
    /// Whether the solver found a stable equilibrium, met the target, or reached the end time.
    pub converged: bool,
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
    ("Two equilibria", |_| loads::two_equilibria()),
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
    equilibrium_row(variant, &body.system, &body.tensions).0
}

/// Solves from rest and checks the stability of the answer, which is in the workspace.
fn equilibrium_row(variant: String, system: &System<2>, tensions: &[f64]) -> (HardCase, Workspace<2>) {
    let mut workspace = Workspace::new(system);
    workspace.start_from_rest(system);
    let settings = SolveSettings { certify: true, ..SolveSettings::default() };
    let (solution, wall_s) = timed(|| solve(system, &mut workspace, tensions, &settings));
    let found = matches!(solution.status, SolveStatus::Converged | SolveStatus::Unstable);
    let smallest_eigenvalue = if found { smallest_eigenvalue(system, &mut workspace) } else { None };
    let (smallest, _) = system.cell_ratios(workspace.positions());
    let finite = workspace.positions().iter().all(|p| p.iter().all(|c| c.is_finite()));
    let stable = matches!(solution.stability, Stability::Stable | Stability::Neutral);
    let converged = solution.status == SolveStatus::Converged && stable;
    let row = HardCase {
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
    };
    (row, workspace)
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

fn title(case: u8) -> &'static str {
    CASES[usize::from(case) - 1].0
}

/// Columns of the CSV that the page does not have.
const IN_CSV_ALONE: [&str; 6] =
    ["case", "converged", "load_reached", "guarded", "branch_ends_at", "apart_from_branch_m"];

const LONG: [u8; 2] = [2, 11];

/// A summary of all cases, and their rows; of cases with a thousand rows only those that are exceptional.
pub fn markdown(rows: &[HardCase], made: &str) -> Result<String, serde_json::Error> {
    let mut out = String::from("# Hard cases\n\n");
    let _ = writeln!(
        out,
        "{made} A promise is kept when the run ended in a stable equilibrium or in a status\n\
         that says what happened, and contains neither NaN nor an unreported inverted cell.\n\
         Answers are found directly; in cases 2 and 11 (there up to 100 N) the equilibria were also followed from rest, there and back, as the load grows, and \
         an\nanswer counts as on that branch when it reaches the whole load and ends within {SAME_SHAPE_M:e} m of the answer.\n",
    );
    let mut cases: BTreeMap<u8, Vec<&HardCase>> = BTreeMap::new();
    rows.iter().for_each(|r| cases.entry(r.case).or_default().push(r));
    out += &column::markdown(&summary(), &cases.iter().collect::<Vec<_>>());
    if LONG.iter().any(|case| cases.contains_key(case)) {
        out.push_str("\n![What becomes of subsets of muscles at each load](stability.svg)\n");
    }
    for (case, rows) in &cases {
        let _ = writeln!(out, "\n## {case}. {}\n", title(*case));
        out += &branches(rows)?;
        let ordinary =
            |r: &HardCase| r.kept && r.converged && (r.branch_ends_at.is_none() || r.is_on_branch());
        let shown: Vec<&&HardCase> = rows.iter().filter(|r| !LONG.contains(case) || !ordinary(r)).collect();
        if shown.len() < rows.len() {
            let _ = writeln!(
                out,
                "{} of {} rows, those that did not converge or are not on the branch from rest; the rest is in the CSV.\n",
                shown.len(),
                rows.len()
            );
        }
        if !shown.is_empty() {
            out += table::markdown(shown.into_iter().copied(), &IN_CSV_ALONE)?.trim_end_matches('\n');
            out.push('\n');
        }
    }
    Ok(out)
}

/// Results of the subsets of muscles at each load; `None` if their case was not run.
pub fn picture(rows: &[HardCase]) -> Option<Result<Svg, ReportError>> {
    let case = LONG.into_iter().find(|case| rows.iter().any(|r| r.case == *case))?;
    let rows: Vec<&HardCase> = rows.iter().filter(|r| r.case == case).collect();
    let groups = rows_of_loads(&rows);
    let loads: Vec<String> = groups.iter().map(|(load, _)| (*load).to_owned()).collect();
    let series = |name: &str, holds: fn(&HardCase) -> bool| Series {
        name: name.to_owned(),
        values: groups.iter().map(|(_, own)| count(own, holds) as f64 / own.len() as f64).collect(),
    };
    let series = [
        series("stable equilibrium found", |r| r.converged),
        series("on the branch from rest", HardCase::is_on_branch),
        series("without the barrier against inversion", |r| r.guarded == 0),
    ];
    Some(parts(&loads, &series, "part of the subsets of muscles", title(case)))
}

fn count(rows: &[&HardCase], holds: impl Fn(&HardCase) -> bool) -> usize {
    rows.iter().filter(|r| holds(r)).count()
}

fn summary<'a>() -> Vec<Column<'a, (&'a u8, &'a Vec<&'a HardCase>)>> {
    type Of<'a> = Column<'a, (&'a u8, &'a Vec<&'a HardCase>)>;
    vec![
        Of::of_page("case", |(case, _)| (**case).into()),
        Of::of_page("", |(case, _)| title(**case).into()),
        Of::of_page("rows", |(_, rows)| rows.len().into()),
        Of::of_page("converged", |(_, rows)| count(rows, |r| r.converged).into()),
        Of::of_page("promise kept", |(_, rows)| count(rows, |r| r.kept).into()),
        Of::of_page("with the barrier active", |(_, rows)| count(rows, |r| r.guarded > 0).into()),
        Of::of_page("on the branch from rest", |_| Value::Null).with_text_on_the_left(move |(_, rows)| {
            match count(rows, |r| r.branch_ends_at.is_some()) {
                0 => String::new(),
                followed => format!("{} of {followed}", count(rows, HardCase::is_on_branch)),
            }
        }),
        Of::of_page("longest, s", move |(_, rows)| rows.iter().map(|r| r.wall_s).fold(0.0, f64::max).into())
            .decimals(3),
    ]
}

/// The table of answers on the branch from rest, by load; empty if no branch was followed.
fn branches(rows: &[&HardCase]) -> Result<String, serde_json::Error> {
    let followed: Vec<&HardCase> = rows.iter().copied().filter(|r| r.branch_ends_at.is_some()).collect();
    let of_loads = Vec::from_iter(rows_of_loads(&followed).into_iter().map(|(load, rows)| {
        let on_branch = count(&rows, HardCase::is_on_branch);
        let falls = count(&rows, |r| r.branch_ends_at < Some(1.0) && r.is_where_branch_leads());
        json!({
            "load": load,
            "rows": rows.len(),
            "the branch from rest reaches it, and the answer lies there": on_branch,
            "it ends before, and the answer is where the body then falls": falls,
            "the answer lies elsewhere": rows.len() - on_branch - falls,
        })
    }));
    if of_loads.is_empty() { Ok(String::new()) } else { table::markdown(&of_loads, &[]) }
}

/// The loads of subsets of muscles, each with its rows.
fn rows_of_loads<'r>(rows: &[&'r HardCase]) -> Vec<(&'r str, Vec<&'r HardCase>)> {
    let load = |r: &'r HardCase| Some(r.variant.rsplit_once(" at ")?.1);
    let loads = distinct(rows.iter().filter_map(|r| load(r))).into_iter();
    loads.map(|at| (at, rows.iter().copied().filter(|r| load(r) == Some(at)).collect())).collect()
}
