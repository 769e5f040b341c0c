//! Results as text for a terminal of 100 columns.

use std::fmt::Write as _;
use std::path::PathBuf;

use comfy_table::{Cell, CellAlignment, Table, presets};
use tongue_fit::inner::choice::name_of;
use tongue_fit::inner::dynamics::{MotionOutcome, MotionStatus};
use tongue_fit::inner::inverse::alarms::{self, Alarm};
use tongue_fit::inner::posterior::{Contrast, OverSpeakers};
use tongue_fit::inner::report::column::{self, Column};
use tongue_fit::inner::report::{self, OfBody, SimulationRecord, TrajectoryRecord, joined};
use tongue_fit::inner::run::Equilibrium;
use tongue_fit::inner::surgery::OperationRecord;
use tongue_fit::inner::validate::{self, ValidationStudy};
use tongue_fit::statics::{self, Connection, FromRest};

pub(super) fn align_left(t: &mut Table, columns: impl IntoIterator<Item = usize>) {
    for column in columns {
        if let Some(column) = t.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Left);
        }
    }
}

/// A table in which all columns but the first are aligned to the right.
pub(super) fn rows<T, R: IntoIterator<Item: Into<Cell>>>(
    header: &[impl ToString],
    items: impl IntoIterator<Item = T>,
    row: impl Fn(T) -> R,
) -> Table {
    let mut t = Table::new();
    t.load_style(presets::ASCII_MARKDOWN).set_header(header.iter().map(ToString::to_string));
    for column in t.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    t.add_rows(items.into_iter().map(row));
    t
}

/// Letters in a line of a heading.
const HEADING: usize = 12;

pub(super) fn from_columns<'a, R: 'a>(columns: &[Column<'a, R>], items: &[R]) -> Table {
    let (headings, shown) = column::columns_with_heading(columns);
    let headings: Vec<String> = headings.iter().map(|h| report::wrap_text(h, HEADING).join("\n")).collect();
    let mut t = rows(&headings, items, |item| shown.iter().map(|c| c.page_text(item)));
    align_left(&mut t, (0..shown.len()).filter(|&number| !shown[number].is_to_the_right(items)));
    t
}

pub(super) fn files(written: &[PathBuf]) -> String {
    let lines = written
        .iter()
        .enumerate()
        .map(|(i, path)| format!("{:<8}{}\n", if i == 0 { "written" } else { "" }, path.display()));
    lines.collect()
}

pub fn simulation(record: &SimulationRecord) -> String {
    let (solution, pulls) = (&record.equilibrium.solution, &record.pulls.values().0);
    let ended = format!("{:?} in {} iterations", solution.status, solution.iterations);
    let (ratios, summary) = match &record.of_body {
        OfBody::Pulled { ratios, min_area_ratio, max_area_ratio, .. } => {
            let areas = of_rest("areas", *min_area_ratio, *max_area_ratio);
            let force = solution.max_residual_force;
            (Some(&ratios.0), format!("{ended}; largest residual force {force:.1e} N/m; {areas}"))
        }
        OfBody::Hexahedra(of) => {
            let moved = of.foremost_moved_mm.map(|[back, right, up]| {
                displacement([(back, ["back", "forward"]), (right, ["right", "left"]), (up, ["up", "down"])])
            });
            let summary = format!(
                "the tip{}: {}; all nodes: {:.2} mm (RMS)\n{ended} and {} factorisations of {} unknowns{}; {}{}",
                of.tip_node.map_or_else(String::new, |node| format!(" (node {node})")),
                moved.unwrap_or_else(|| "removed".to_owned()),
                of.rms_displacement_mm,
                solution.factorisations,
                of.unknowns,
                if of.half { " (one half: both sides are alike)" } else { "" },
                of_rest("volumes", of.min_volume_ratio, of.max_volume_ratio),
                of.operation.as_ref().map_or_else(String::new, operation),
            );
            (None, summary)
        }
    };
    let reference = ratios.into_iter().flatten().find(|(_, ratio)| *ratio == 1.0);
    let ratio = reference.map_or("ratio".to_owned(), |(reference, _)| format!("ratio to {reference}"));
    let header = match ratios {
        Some(_) => &["muscle", "tension N/m", "length mm", &ratio, "stretch"][..],
        None => &["muscle", "activation", "fibre mm", "stretch"],
    };
    let t = rows(header, pulls.iter().enumerate(), |(i, (muscle, pull))| {
        let pull = if ratios.is_some() { newtons(*pull) } else { pull.to_string() };
        let ratio = ratios.map(|all| format!("{:.3}", all[i].1));
        let begin = [muscle.clone(), pull, format!("{:.2}", record.lengths_mm.0[i].1)];
        begin.into_iter().chain(ratio).chain([format!("{:.3}", record.stretches.0[i].1)])
    });
    let text = format!("{t}\n{summary}");
    let inverted = match solution.status {
        statics::SolveStatus::Inverted => "A CELL IS INVERTED: no effect in this model prevents that\n",
        _ => "",
    };
    text + inverted + &branch(&record.equilibrium)
}

/// Text such as `3.1 mm forward, 0.4 up`: each distance, mm, with the first of its directions, or with the second if it is negative.
fn displacement<const N: usize>(moved: [(f64, [&str; 2]); N]) -> String {
    let parts = moved.iter().filter(|(mm, _)| mm.abs() >= 0.05).enumerate().map(|(i, (mm, names))| {
        let unit = if i == 0 { " mm" } else { "" };
        format!("{:.1}{unit} {}", mm.abs(), names[usize::from(*mm < 0.0)])
    });
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() { "stays".to_owned() } else { parts.join(", ") }
}

pub fn forward_up([forward, up]: [f64; 2]) -> String {
    displacement([(forward, ["forward", "back"]), (up, ["up", "down"])])
}

fn of_rest(what: &str, least: f64, most: f64) -> String {
    format!("{what} at {:.1} % to {:.1} % of rest\n", 100.0 * least, 100.0 * most)
}

/// The connection of an equilibrium to rest, and its alarms.
fn branch(found: &Equilibrium) -> String {
    let doubts = alarms(&found.alarms);
    let Some(trace) = found.trace else {
        return connection_to_rest(found.solution.connection).to_owned() + &doubts;
    };
    let end = trace.from_rest.critical().map_or_else(String::new, |c| {
        let kind = report::status_in_words(&c.kind);
        format!("the branch of equilibria from rest ends at {:.6} of the tensions ({kind}); ", c.load)
    });
    let followed = match trace.from_rest {
        FromRest::Branch => {
            "followed from rest: the answer lies on the branch of equilibria that begins there".to_owned()
        }
        FromRest::Jumped(_) => end + "the body falls from there to this answer",
        FromRest::Lost(_) => end + "where the body falls from there was not found",
        FromRest::NotKnown { reached: 0.0 } => {
            "the branch of equilibria from rest could not be begun: whether the answer lies on it is not known".to_owned()
        }
        FromRest::NotKnown { reached } => format!(
            "the branch of equilibria from rest was followed to {reached:.2e} of the tensions, where the solves allowed for it were \
             used up: whether the answer lies on it is not known"
        ),
    };
    let another = if trace.another { "; there is another equilibrium\n" } else { "; no other was met\n" };
    followed + another + &doubts
}

/// The connection to rest of an equilibrium whose branch was not followed.
pub(super) fn connection_to_rest(connection: Connection) -> &'static str {
    match connection {
        Connection::Traced => "",
        Connection::Direct => {
            "solved directly: it was not checked whether it lies on the branch of equilibria from rest\n"
        }
        Connection::LoadSteps => {
            "reached from rest in load steps; the branch of equilibria from rest was not followed\n"
        }
        Connection::Downhill => {
            "an unstable equilibrium was left on the way: this may be another branch than that from rest\n"
        }
    }
}

pub(super) fn alarms(alarms: &[Alarm]) -> String {
    alarms.iter().map(|alarm| format!("but {alarm}\n")).collect()
}

pub fn trajectory(record: &TrajectoryRecord) -> String {
    let lengths = &record.lengths_mm.0;
    let t = rows(&["muscle", "length mm"], lengths, |(muscle, mm)| [muscle.clone(), format!("{mm:.3}")]);
    let MotionOutcome { status, time_s, counts } = record.outcome;
    let mut text = format!(
        "{t}\n{:?} at t = {:.4} s of {} s; {} in {:.0} ms: {} steps, {} rejected, {} forces, {} factorisations\n",
        status,
        time_s,
        record.t_end_s,
        record.method,
        1e3 * record.wall_s,
        counts.steps,
        counts.rejected,
        counts.force_evaluations,
        counts.factorisations
    );
    if status == MotionStatus::Unstable {
        text += "the steps grow there: take a shorter one (--dt), or --method tr-bdf2, which has no limit\n";
    }
    text += &way_gone(time_s, record.part_of_way_to_equilibrium);
    text += &alarms(alarms::barrier(record.guarded).as_slice());
    text + &of_rest("areas", record.min_area_ratio, record.max_area_ratio)
}

/// The part of the way to its equilibrium that a body in motion has moved, in one line; empty if it is not known.
pub fn way_gone(time_s: f64, part: Option<f64>) -> String {
    let Some(percent) = part.map(|p| 100.0 * p) else { return String::new() };
    let digits = usize::from(percent > 99.0);
    format!("at {time_s} s the body has gone {percent:.digits$} % of the way to its equilibrium\n")
}

/// A tension; a large one has an exponent, so that columns keep their width.
pub(super) fn newtons(tension: f64) -> String {
    if tension < 1e5 { format!("{tension:.2}") } else { format!("{tension:.2e}") }
}

/// The first `most` parts, and the number of the others.
pub(super) fn join_first(parts: impl IntoIterator<Item = String>, most: usize, between: &str) -> String {
    let mut parts: Vec<String> = parts.into_iter().collect();
    let more = parts.len().saturating_sub(most);
    parts.truncate(most);
    parts.extend((more > 0).then(|| format!("and {more} more")));
    parts.join(between)
}

pub(super) fn count_of(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

pub fn validation(study: &ValidationStudy, wall_s: f64) -> String {
    let mut text = format!(
        "passive stretches of {} of {}, from /{}/; each subject predicted from the other ones\n\n",
        count_of(study.fits, "fit"),
        count_of(study.subjects.len(), "subject"),
        study.baseline
    );
    let _ = writeln!(text, "{}\n", from_columns(&validate::opponents(study), &study.opponents));
    if let Some(posterior) = &study.posterior {
        let scores = from_columns(&validate::scores(), &posterior.scores);
        let _ =
            writeln!(text, "\none muscle left out, as a distribution\n\n{scores}\n{}\n", posterior.verdict);
    }
    text + &format!("{wall_s:.0} s\n\n")
}

pub(super) fn difference(c: &Contrast) -> String {
    let [by, low, high] = c.size().map(|n| report::with_decimals(n, 1));
    let sure = report::probability(c.probability_more.max(1.0 - c.probability_more));
    format!("{}, by {by} ({low} to {high}) N/m, P {sure}", c.sentence().unwrap_or_default())
}

/// The differences between labels in which most speakers agree, one in each line.
pub fn most_agree(all: &[OverSpeakers]) -> String {
    const MOST: usize = 30;
    if all.is_empty() {
        return String::new();
    }
    let sentences: Vec<String> = all.iter().filter_map(OverSpeakers::sentence).collect();
    let title = "differences between labels in which most speakers agree";
    let intervals = "intervals are of the mean over speakers, without errors that all share";
    let count = format!("{} of {}", sentences.len(), all.len());
    format!("{title} ({count}; {intervals})\n{}\n", join_first(sentences, MOST, "\n"))
}

fn millimetres([x, y, z]: [f64; 3]) -> String {
    format!("{x:.2} {y:.2} {z:.2}")
}

pub fn operation(o: &OperationRecord) -> String {
    let after = match (o.tip_after_mm, o.reach_lost_mm, o.deviation_mm) {
        (Some(after), Some(lost), Some(right)) => format!(
            "{} after: it reaches {:.2} mm {} far forward and deviates {:.2} mm to the {}",
            millimetres(after),
            lost.abs(),
            if lost < 0.0 { "more" } else { "less" },
            right.abs(),
            if right < 0.0 { "left" } else { "right" }
        ),
        _ => "is removed".to_owned(),
    };
    let mut text = format!(
        "surgery: {} elements, {:.2} cm³, {}; the tip moved {} mm (back, right, up) before and {after}\n",
        o.elements,
        o.volume_cm3,
        name_of(&o.filling),
        millimetres(o.tip_before_mm),
    );
    if let (Some(by), Some(to)) = (&o.made_up_by, o.made_up_to_mm) {
        let active = by.0.iter().filter(|(_, a)| *a >= 0.005);
        let interval = |name: &str| {
            let all = o.made_up_interval_95.as_ref().and_then(|all| all.get(name));
            all.map_or_else(String::new, |[low, high]| format!(" ({low:.2} to {high:.2})"))
        };
        let active = active.map(|(name, a)| format!("{name} {a:.2}{}", interval(name)));
        let _ = writeln!(
            text,
            "the tip comes back to {to:.2} mm (RMS) with {}; other activations bring it there too, 95 % of them in these ranges",
            joined(active, ", ")
        );
        if let Some([here, starts]) = o.made_up_starts.filter(|[here, starts]| here < starts) {
            let _ = writeln!(
                text,
                "only {here} of the {starts} starts of this search ended at these activations, so another search may end at others"
            );
        }
    }
    text
}

/// Width of sentences on the terminal, in letters.
const COLUMNS: usize = 100;
const INDENT: &str = "  ";

/// A sentence in lines of the terminal's width.
pub fn wrap_sentence(sentence: &str) -> String {
    report::wrap_text(sentence, COLUMNS - INDENT.len()).join(&format!("\n{INDENT}")) + "\n"
}
