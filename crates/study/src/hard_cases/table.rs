//! The rows as a page of Markdown.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::Value;
use tongue_core::statics::SAME_SHAPE_M;
use tongue_core::statistics::distinct;
use tongue_files::report::column::{self, Column};
use tongue_files::report::{ReportError, Series, Svg, parts};

use super::{CASES, HardCase};
use crate::table;

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
        out.push_str(&branches(rows));
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

fn by_load<'a>() -> Vec<Column<'a, (&'a str, Vec<&'a HardCase>)>> {
    type Of<'a> = Column<'a, (&'a str, Vec<&'a HardCase>)>;
    let falls =
        |rows: &[&HardCase]| count(rows, |r| r.branch_ends_at < Some(1.0) && r.is_where_branch_leads());
    vec![
        Of::of_page("load", |(load, _)| (*load).into()),
        Of::of_page("rows", |(_, rows)| rows.len().into()),
        Of::of_page("the branch from rest reaches it, and the answer lies there", move |(_, rows)| {
            count(rows, HardCase::is_on_branch).into()
        }),
        Of::of_page("it ends before, and the answer is where the body then falls", move |(_, rows)| {
            falls(rows).into()
        }),
        Of::of_page("the answer lies elsewhere", move |(_, rows)| {
            (rows.len() - count(rows, HardCase::is_on_branch) - falls(rows)).into()
        }),
    ]
}

/// The table of answers on the branch from rest, by load; empty if no branch was followed.
fn branches(rows: &[&HardCase]) -> String {
    let followed: Vec<&HardCase> = rows.iter().copied().filter(|r| r.branch_ends_at.is_some()).collect();
    let groups = rows_of_loads(&followed);
    if groups.is_empty() { String::new() } else { column::markdown(&by_load(), &groups) + "\n" }
}

/// The loads of subsets of muscles, each with its rows.
fn rows_of_loads<'r>(rows: &[&'r HardCase]) -> Vec<(&'r str, Vec<&'r HardCase>)> {
    let load = |r: &'r HardCase| Some(r.variant.rsplit_once(" at ")?.1);
    let loads = distinct(rows.iter().filter_map(|r| load(r))).into_iter();
    loads.map(|at| (at, rows.iter().copied().filter(|r| load(r) == Some(at)).collect())).collect()
}
