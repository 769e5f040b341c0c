//! The rows as a table and as Markdown.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Beside, Row};
use crate::report::Table;

/// What each case is about.
fn title(case: u8) -> &'static str {
    match case {
        1 => "Table 4.2 as printed, and its slips one by one",
        2 => "Subsets of the eight muscles at 1, 10, 100 and 1000 N",
        3 => "Materials at the edges of their ranges",
        4 => "Folding chains",
        5 => "Slivers, broken meshes, large meshes",
        6 => "Targets",
        7 => "Nelder-Mead",
        8 => "Steps of time",
        9 => "Two equilibria",
        10 => "Threads, numbering, position",
        _ => "",
    }
}

/// All rows, units in the column names.
pub fn table(rows: &[Row]) -> Table {
    let columns = [
        "case",
        "variant",
        "solver",
        "status",
        "converged",
        "promise_kept",
        "iterations",
        "load_reached",
        "min_area_ratio",
        "smallest_eigenvalue_n_per_m",
        "elements_in_barrier",
        "branch_from_rest_ends_at",
        "apart_from_branch_m",
        "wall_s",
        "note",
    ];
    let row = |r: &Row| {
        vec![
            r.case.to_string(),
            r.variant.clone(),
            r.solver.to_owned(),
            r.status.clone(),
            r.converged.to_string(),
            r.kept.to_string(),
            r.iterations.to_string(),
            r.load_reached.to_string(),
            optional(r.min_area_ratio, |v| format!("{v:.6}")),
            optional(r.smallest_eigenvalue, |v| format!("{v:.6e}")),
            r.guarded.to_string(),
            optional(r.branch, |b| format!("{:.9}", b.ends_at)),
            optional(r.branch, |b| format!("{:.1e}", b.apart_m)),
            format!("{:.6}", r.wall_s),
            r.note.clone(),
        ]
    };
    Table { columns: columns.map(String::from).to_vec(), rows: rows.iter().map(row).collect() }
}

/// A summary of all cases, and under it every row; of case 2, which has a thousand, those that are not ordinary.
pub fn markdown(rows: &[Row], command: &str) -> String {
    let mut out = String::from("# Hard cases\n\n");
    let _ = writeln!(
        out,
        "Made by `{command}`. A promise is kept when the run ended in a stable equilibrium or in a status"
    );
    let _ = writeln!(
        out,
        "that says what happened, without a number that is not one or an inverted cell that is not reported."
    );
    out.push_str(
        "Answers are found directly; in case 2 the equilibria were also followed from rest, there and back, as the load grows, and \
         an\nanswer counts as on that branch when it reaches the whole load and ends within 1e-9 m of the answer.\n\n",
    );
    out.push_str("| case | | rows | converged | promise kept | with the barrier active | on the branch from rest | longest, s |\n|--|--|--|--|--|--|--|--|\n");
    let mut cases: BTreeMap<u8, Vec<&Row>> = BTreeMap::new();
    rows.iter().for_each(|r| cases.entry(r.case).or_default().push(r));
    for (case, rows) in &cases {
        let count = |f: fn(&&&Row) -> bool| rows.iter().filter(f).count();
        let longest = rows.iter().map(|r| r.wall_s).fold(0.0, f64::max);
        let _ = writeln!(
            out,
            "| {case} | {} | {} | {} | {} | {} | {} | {longest:.3} |",
            title(*case),
            rows.len(),
            count(|r| r.converged),
            count(|r| r.kept),
            count(|r| r.guarded > 0),
            match count(|r| r.branch.is_some()) {
                0 => String::new(),
                followed => format!("{} of {followed}", count(|r| r.branch.is_some_and(|b| b.is_on_it()))),
            },
        );
    }
    for (case, rows) in &cases {
        let _ = writeln!(out, "\n## {case}. {}\n", title(*case));
        out.push_str(&branches(rows));
        let ordinary = |r: &Row| r.kept && r.converged && r.branch.is_none_or(|b| b.is_on_it());
        let shown: Vec<&&Row> = rows.iter().filter(|r| *case != 2 || !ordinary(r)).collect();
        if shown.len() < rows.len() {
            let _ = writeln!(
                out,
                "{} of {} rows, those that did not converge or are not on the branch from rest; the rest is in the CSV.\n",
                shown.len(),
                rows.len()
            );
        }
        if shown.is_empty() {
            continue;
        }
        out.push_str("| variant | solver | status | kept | iterations | smallest area ratio | smallest eigenvalue, N/m | time, s | note |\n|--|--|--|--|--|--|--|--|--|\n");
        for r in shown {
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {} | {} | {:.4} | {} |",
                r.variant,
                r.solver,
                r.status,
                if r.kept { "yes" } else { "**no**" },
                r.iterations,
                optional(r.min_area_ratio, |v| format!("{v:.3}")),
                optional(r.smallest_eigenvalue, |v| format!("{v:.2e}")),
                r.wall_s,
                r.note.replace('|', "/"),
            );
        }
    }
    out
}

/// How many answers lie on the branch from rest, by load; empty where no branch was followed.
fn branches(rows: &[&Row]) -> String {
    let followed: Vec<(&str, Beside)> =
        rows.iter().filter_map(|r| Some((r.variant.rsplit_once(" at ")?.1, r.branch?))).collect();
    let mut loads: Vec<&str> = Vec::new();
    followed.iter().for_each(|(load, _)| {
        if !loads.contains(load) {
            loads.push(load);
        }
    });
    let mut out = String::new();
    if !loads.is_empty() {
        out.push_str(
            "| load | rows | the branch from rest reaches it, and the answer lies there | it ends before, and the answer is where \
             the body then falls | the answer lies elsewhere |\n|--|--|--|--|--|\n",
        );
    }
    for load in &loads {
        let all = || followed.iter().filter(|(l, _)| l == load).map(|(_, b)| b);
        let (on, falls) = (
            all().filter(|b| b.is_on_it()).count(),
            all().filter(|b| b.ends_at < 1.0 && b.is_same()).count(),
        );
        let _ = writeln!(
            out,
            "| {load} | {0} | {on} | {falls} | {1} |",
            all().count(),
            all().count() - on - falls
        );
    }
    if !loads.is_empty() {
        out.push('\n');
    }
    out
}

fn optional<T>(value: Option<T>, format: impl Fn(T) -> String) -> String {
    value.map(format).unwrap_or_default()
}
