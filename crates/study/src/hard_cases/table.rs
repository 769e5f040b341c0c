//! The rows as a page of Markdown.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::HardCase;
use crate::table;

fn title(case: u8) -> &'static str {
    match case {
        1 => "Table 4.2 as printed, and its misprints one by one",
        2 => "Subsets of the muscles at 1, 10, 100 and 1000 N",
        3 => "Extreme materials",
        4 => "Folding chains",
        5 => "Slivers, broken meshes, large meshes",
        6 => "Targets",
        7 => "Nelder-Mead",
        8 => "Steps of time",
        9 => "Two equilibria",
        10 => "Threads, numbering, position",
        11 => "Subsets of the muscles of a continuum (8 mm) at 1, 10, 100 and 1000 N",
        _ => "",
    }
}

/// Columns that are in the CSV but not on the page.
const IN_CSV_ALONE: [&str; 6] =
    ["case", "converged", "load_reached", "guarded", "branch_ends_at", "apart_from_branch_m"];

/// Cases with a thousand rows.
const LONG: [u8; 2] = [2, 11];

/// A summary of all cases, and all rows; of the `LONG` cases only the exceptional rows.
pub fn markdown(rows: &[HardCase], command: &str) -> Result<String, csv::Error> {
    let mut out = String::from("# Hard cases\n\n");
    let _ = writeln!(
        out,
        "Made by `{command}`. A promise is kept when the run ended in a stable equilibrium or in a status"
    );
    let _ =
        writeln!(out, "that says what happened, and contains neither NaN nor an unreported inverted cell.");
    out.push_str(
        "Answers are found directly; in cases 2 and 11 (there up to 100 N) the equilibria were also followed from rest, there and back, as the load grows, and \
         an\nanswer counts as on that branch when it reaches the whole load and ends within 1e-9 m of the answer.\n\n",
    );
    out.push_str("| case | | rows | converged | promise kept | with the barrier active | on the branch from rest | longest, s |\n|--|--|--|--|--|--|--|--|\n");
    let mut cases: BTreeMap<u8, Vec<&HardCase>> = BTreeMap::new();
    rows.iter().for_each(|r| cases.entry(r.case).or_default().push(r));
    for (case, rows) in &cases {
        let count = |f: fn(&&&HardCase) -> bool| rows.iter().filter(f).count();
        let longest = rows.iter().map(|r| r.wall_s).fold(0.0, f64::max);
        let _ = writeln!(
            out,
            "| {case} | {} | {} | {} | {} | {} | {} | {longest:.3} |",
            title(*case),
            rows.len(),
            count(|r| r.converged),
            count(|r| r.kept),
            count(|r| r.guarded > 0),
            match count(|r| r.branch_ends_at.is_some()) {
                0 => String::new(),
                followed => format!("{} of {followed}", count(|r| r.is_on_branch())),
            },
        );
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

/// Number of answers on the branch from rest, by load; empty if no branch was followed.
fn branches(rows: &[&HardCase]) -> String {
    let mut loads: Vec<(&str, Vec<&HardCase>)> = Vec::new();
    for row in rows.iter().filter(|r| r.branch_ends_at.is_some()) {
        let Some((_, load)) = row.variant.rsplit_once(" at ") else { continue };
        match loads.iter_mut().find(|(l, _)| *l == load) {
            Some((_, same)) => same.push(row),
            None => loads.push((load, vec![row])),
        }
    }
    if loads.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "| load | rows | the branch from rest reaches it, and the answer lies there | it ends before, and the answer is where \
         the body then falls | the answer lies elsewhere |\n|--|--|--|--|--|\n",
    );
    for (load, rows) in loads {
        let on = rows.iter().filter(|r| r.is_on_branch()).count();
        let falls = rows.iter().filter(|r| r.branch_ends_at < Some(1.0) && r.is_where_branch_leads()).count();
        let _ = writeln!(out, "| {load} | {} | {on} | {falls} | {} |", rows.len(), rows.len() - on - falls);
    }
    out.push('\n');
    out
}
