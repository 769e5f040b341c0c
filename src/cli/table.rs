//! Results as text for a terminal of 100 columns.

use std::fmt::Write as _;
use std::path::PathBuf;

use comfy_table::{CellAlignment, Table, presets};
use miette::IntoDiagnostic;
use tongue_fit::inverse::alarms::Alarm;
use tongue_fit::report::batch::BatchJournal;
use tongue_fit::report::batch::contrasts::SubjectContrast;
use tongue_fit::report::batch::journal::Entry;
use tongue_fit::report::batch::{Batch, MOST_FITS_ON_PAGE};
use tongue_fit::report::{OperationRecord, SimulationRecord, TrajectoryRecord};
use tongue_fit::statics::{self, Connection, CriticalKind};
use tongue_fit::validate::ValidationStudy;

pub(super) fn table(header: &[&str]) -> Table {
    let mut t = Table::new();
    t.load_style(presets::ASCII_MARKDOWN).set_header(header.iter().copied());
    for column in 1..header.len() {
        if let Some(c) = t.column_mut(column) {
            c.set_cell_alignment(CellAlignment::Right);
        }
    }
    t
}

pub(super) fn files(written: &[PathBuf]) -> String {
    let mut text = String::new();
    for (i, path) in written.iter().enumerate() {
        let _ = writeln!(text, "{:<8}{}", if i == 0 { "written" } else { "" }, path.display());
    }
    text
}

pub fn simulation(record: &SimulationRecord, written: &[PathBuf]) -> String {
    let ratio = match record.ratios.0.iter().find(|(_, ratio)| *ratio == 1.0) {
        Some((reference, _)) => format!("ratio to {reference}"),
        None => "ratio".to_owned(),
    };
    let mut t = table(&["muscle", "tension N/m", "length mm", &ratio, "stretch"]);
    for (i, (muscle, tension)) in record.tensions_n.0.iter().enumerate() {
        t.add_row([
            muscle.clone(),
            newtons(*tension),
            format!("{:.2}", record.lengths_mm.0[i].1),
            format!("{:.3}", record.ratios.0[i].1),
            format!("{:.3}", record.stretches.0[i].1),
        ]);
    }
    let mut text = format!("{t}\n");
    let _ = writeln!(
        text,
        "{:?} in {} iterations; largest residual force {:.1e} N; areas at {:.1} % to {:.1} % of rest",
        record.status,
        record.iterations,
        record.max_residual_force_n,
        100.0 * record.min_area_ratio,
        100.0 * record.max_area_ratio
    );
    if record.status == statics::SolveStatus::Inverted {
        text += "A CELL IS INVERTED: no effect in this model prevents that\n";
    }
    text += &way(record.branch.as_ref(), record.connection);
    text + &alarms(&record.alarms) + &files(written)
}

/// The connection of an equilibrium to rest.
pub(super) fn way(branch: Option<&statics::Trace>, connection: Connection) -> String {
    let Some(branch) = branch else { return way_from_rest(connection).to_owned() };
    let mut text = match (branch.critical, branch.stopped) {
        (None, None) => {
            "followed from rest: the answer lies on the branch of equilibria that begins there".to_owned()
        }
        (None, Some(load)) => format!(
            "the branch of equilibria from rest was followed to {load:.2e} of the tensions, where the solves allowed for it were \
                 used up: whether the answer lies on it is not known"
        ),
        (Some(c), _) => format!(
            "the branch of equilibria from rest ends at {:.6} of the tensions ({}); the body falls from there to this answer",
            c.load,
            match c.kind {
                CriticalKind::LimitPoint => "limit point",
                CriticalKind::Bifurcation => "bifurcation",
            }
        ),
    };
    text += if branch.another { "; there is another equilibrium\n" } else { "; no other was met\n" };
    text
}

/// The connection to rest of an equilibrium whose branch was not followed.
pub(super) fn way_from_rest(connection: Connection) -> &'static str {
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
    alarms.iter().map(|alarm| format!("but {}\n", alarm.text())).collect()
}

pub fn trajectory(record: &TrajectoryRecord, written: &[PathBuf]) -> String {
    let mut t = table(&["muscle", "length mm"]);
    for (muscle, length) in &record.lengths_mm.0 {
        t.add_row([muscle.clone(), format!("{length:.3}")]);
    }
    let mut text = format!("{t}\n");
    let counts = &record.counts;
    let _ = writeln!(
        text,
        "{:?} at t = {:.4} s of {} s; {} in {:.0} ms: {} steps, {} rejected, {} forces, {} factorisations",
        record.status,
        record.time_s,
        record.t_end_s,
        record.method,
        1e3 * record.wall_s,
        counts.steps,
        counts.rejected,
        counts.force_evaluations,
        counts.factorisations
    );
    if record.status == tongue_fit::dynamics::MotionStatus::Unstable {
        text += "the steps grow there: take a shorter one (--dt), or --method tr-bdf2, which has no limit\n";
    }
    text += &way_gone(record.time_s, record.part_of_way_to_equilibrium);
    text += &alarms(tongue_fit::inverse::alarms::barrier(record.guarded).as_slice());
    let _ = writeln!(
        text,
        "areas at {:.1} % to {:.1} % of rest",
        100.0 * record.min_area_ratio,
        100.0 * record.max_area_ratio
    );
    text + &files(written)
}

/// Part of the way to equilibrium that a body in motion has moved, in one line; empty if it is not known.
pub fn way_gone(time_s: f64, part: Option<f64>) -> String {
    let Some(percent) = part.map(|p| 100.0 * p) else { return String::new() };
    let digits = usize::from(percent > 99.0);
    format!("at {time_s} s the body has gone {percent:.digits$} % of the way to its equilibrium\n")
}

/// Numbers above this are written with an exponent, so that columns keep their width.
pub(super) const LARGE: f64 = 1e5;

pub(super) fn newtons(tension: f64) -> String {
    if tension < LARGE { format!("{tension:.2}") } else { format!("{tension:.2e}") }
}

pub(super) fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

pub fn validation(study: &ValidationStudy, written: &[PathBuf], wall_s: f64) -> String {
    let mut text = format!(
        "passive stretches of {} of {}, from /{}/; each subject predicted from the other ones\n\n",
        counted(study.fits, "fit"),
        counted(study.subjects.len(), "subject"),
        study.baseline
    );
    let mut t = table(&[
        "opponent",
        "tuned",
        "RMS",
        "95 %",
        "worse than\nno change",
        "better than\nthe constant",
        "r",
    ]);
    for o in &study.opponents {
        t.add_row([
            o.name.replace('_', " "),
            o.tuned_parameters.to_string(),
            format!("{:.3}", o.rms),
            format!("{:.3}–{:.3}", o.low, o.high),
            o.worse_than_no_change.to_string(),
            format!("{:.1} %", 100.0 * o.better_than_constant),
            o.correlation.map_or("–".to_owned(), |r| format!("{r:.2}")),
        ]);
    }
    let _ = writeln!(text, "{t}\n");
    if let Some(posterior) = &study.posterior {
        let mut t = table(&[
            "one muscle left out, as a distribution",
            "RMS",
            "CRPS",
            "log score",
            "in 50 %",
            "in 95 %",
        ]);
        for s in &posterior.scores {
            t.add_row([
                s.name.replace('_', " "),
                format!("{:.3}", s.rms),
                format!("{:.3}", s.crps),
                format!("{:.2}", s.log_score),
                format!("{:.0} %", 100.0 * s.coverage_50),
                format!("{:.0} %", 100.0 * s.coverage_95),
            ]);
        }
        let _ = writeln!(text, "\n{t}\n{}\n", posterior.verdict);
    }
    let _ = writeln!(text, "{wall_s:.0} s\n");
    text + &files(written)
}

const MOST_LISTED: usize = 60;

pub fn batch(
    batch: &Batch<'_>,
    journal: &BatchJournal,
    written: &[PathBuf],
    wall_s: f64,
) -> miette::Result<String> {
    let s = batch.summary;
    let mut text = String::new();
    if batch.jobs.len() <= MOST_LISTED {
        text += &listed(batch, journal)?;
    }
    let mut t = table(&["passive stretches, RMS", "fits", "model", "no change", ""]);
    for g in &s.passive {
        let vowel = g.vowel.as_ref().map_or("all".to_owned(), |v| format!("/{v}/"));
        let mark = if g.substitute_baseline { " (against a substitute baseline)" } else { "" };
        t.add_row([
            format!("{} {vowel}{mark}", g.target_kind),
            g.fits.to_string(),
            format!("{:.3}", g.rms_stretch),
            format!("{:.3}", g.no_change_rms_stretch),
            g.verdict(),
        ]);
    }
    let _ = writeln!(text, "{t}\n");
    let statuses: Vec<String> =
        s.statuses.iter().map(|(k, n)| format!("{n} {}", k.replace('_', " "))).collect();
    let _ = writeln!(text, "{} in {wall_s:.1} s: {}", counted(s.fits, "fit"), statuses.join(", "));
    let _ = writeln!(
        text,
        "{}, {} not fitted, {} unreadable",
        counted(s.baselines, "baseline"),
        s.not_fitted,
        s.unreadable_rows
    );
    if !batch.contrasts.is_empty() {
        text += &decided(batch.contrasts);
    }
    if s.posteriors_untold > 0 {
        let _ = writeln!(
            text,
            "{} without results; the alarms of their fits in batch.json say why, and more draws usually help",
            counted(s.posteriors_untold, "posterior")
        );
    }
    if let Some(n) = &s.nearest_row_to_rest {
        let _ = writeln!(
            text,
            "the model at rest is nearest to {} /{}/ by {:.3} ({})",
            n.subject, n.vowel, n.distance.rms_ratio, s.rest_shape_measure
        );
    }
    if s.fits > MOST_FITS_ON_PAGE {
        let _ = writeln!(
            text,
            "batch.html and tensions.svg show the first {MOST_FITS_ON_PAGE} fits; the other files have all"
        );
    }
    Ok(text + &files(written))
}

/// The contrasts between vowels whose sign is sure, a line for each subject and pair of vowels.
fn decided(all: &[SubjectContrast]) -> String {
    let mut lines: Vec<(String, Vec<String>)> = Vec::new();
    let sure: Vec<&SubjectContrast> = all.iter().filter(|c| c.contrast.is_decided()).collect();
    for SubjectContrast { subject, contrast: c, .. } in &sure {
        let pair = format!("{subject} /{}/ against /{}/", c.posture, c.other);
        let mark = if c.sign_depends_on_prior { "‡" } else { "" };
        let word = format!("{} {}{mark}", c.muscle, if c.probability_more > 0.5 { "harder" } else { "less" });
        match lines.last_mut().filter(|(name, _)| *name == pair) {
            Some((_, words)) => words.push(word),
            None => lines.push((pair, vec![word])),
        }
    }
    let mut text =
        format!("contrasts between vowels that are sure to 95 %: {} of {}\n", sure.len(), all.len());
    for (pair, words) in lines {
        let _ = writeln!(text, "  {pair}: {}", words.join(", "));
    }
    text
}

fn listed(batch: &Batch<'_>, journal: &BatchJournal) -> miette::Result<String> {
    let mut t = table(&["fit", "tensions, N/m", "misfit", "passive", "alarms"]);
    if let Some(c) = t.column_mut(1) {
        c.set_cell_alignment(CellAlignment::Left);
    }
    for number in 0..batch.jobs.len() {
        if let Some(Entry { result: Ok(fit), .. }) = journal.read(number).into_diagnostic()? {
            t.add_row(fit.line);
        }
    }
    Ok(format!("{t}\n\n"))
}

pub fn operation(o: &OperationRecord) -> String {
    let way = |[x, y, z]: [f64; 3]| format!("{x:.2} {y:.2} {z:.2}");
    let mut text = format!(
        "surgery: {} elements, {:.2} cm³, {}; the tip moved {} mm (back, right, up) before and {} after: it reaches {:.2} mm less to the \
         front and deviates {:.2} mm to the {}\n",
        o.elements,
        o.volume_cm3,
        o.filling.word(),
        way(o.tip_before_mm),
        way(o.tip_after_mm),
        o.reach_lost_mm,
        o.deviation_mm.abs(),
        if o.deviation_mm < 0.0 { "left" } else { "right" }
    );
    if let (Some(by), Some(to)) = (&o.made_up_by, o.made_up_to_mm) {
        let active = by.0.iter().filter(|(_, a)| *a >= 0.005);
        let active: Vec<String> = active.map(|(name, a)| format!("{name} {a:.2}")).collect();
        let _ = writeln!(text, "the tip comes back to {to:.2} mm (RMS) with {}", active.join(", "));
    }
    text
}
