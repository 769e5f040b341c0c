//! The page of a run: one HTML file that needs no network. Its script draws the figure of a recording when it is opened.

use std::io::Write;

use maud::{Markup, PreEscaped, html};
use serde_json::Value;

use super::figure::{body_of_figures, figure};
use super::{
    TrackRecord, courses_columns, held_out_columns, placement_sentence, prior_interval_n, repeats_columns,
    repetitions_sentence, status_counts, status_in_words,
};
use crate::report::column::Column;
use crate::report::{Export, Provenance, probability, range, tongue_page, with_decimals};
use tongue_infer::track::{Comparison, CourseSummary, FrameStatus, NARROW};

const SCRIPT: &str = include_str!("page.js");

pub fn track_page(record: &TrackRecord) -> impl Export {
    move |out: &mut dyn Write, by: &Provenance| {
        let results = &record.results;
        let in_html = |value: Value| PreEscaped(value.to_string().replace('<', "\\u003c"));
        let body = html! {
            main {
                (top(record, by))
                @for compared in record.comparisons.iter().take(1) { (contrasts(compared)) }
                (muscle_summaries(record))
                section {
                    h2 { "Recordings" }
                    p { "Open a recording for its tensions over time, with labels above and the distance of the measured points below, and for its shapes." }
                    noscript { p { "The figures need a browser with JavaScript; " code { "--also svg" } " writes them as files." } }
                    @for (nth, one) in results.recordings.iter().enumerate() {
                        details.recording open[nth == 0] {
                            summary { (one.seen.name) }
                            script type="application/json" { (in_html(figure(results, one))) }
                        }
                    }
                }
                (repeatability(record))
                (held_out(record))
                (doubtful_frames(record))
            }
            script type="application/json" id="body" { (in_html(body_of_figures(record))) }
            script { (PreEscaped(SCRIPT)) }
        };
        out.write_all(tongue_page::document("tongue-fit track", &body).as_bytes())
    }
}

fn repeatability(record: &TrackRecord) -> Markup {
    html! {
        @if let Some(repeats) = &record.repeats {
            section {
                h2 { "What repeats" }
                p { "Intraclass correlation of every course over the repetitions of labels, each brought to the same length. 95 % of labels that are shifted by a random time in each recording, or exchanged at random between repetitions, stay below the numbers beside it. The ICC of the label is that of the course less its mean over all labels: what is common to all words is taken out. " (repetitions_sentence(repeats)) "." }
                (tongue_page::table_of_columns(&repeats_columns(repeats), &repeats.muscles.0))
            }
        }
    }
}

fn top(record: &TrackRecord, by: &Provenance) -> Markup {
    let ([low, high], median) =
        (prior_interval_n(&record.settings), record.settings.link.prior_quantile(0.0));
    html! {
        header {
            h1 { "Tongue muscle tensions over time" }
            p { "tongue-fit " (by.version) " · " code { (by.command) } }
            p {
                (record.results.frames().count()) " frames of " (record.recordings.len()) " recordings: "
                (status_counts(&record.statuses)) ". Body: " (record.body) @if let Some(placement) = &record.placement { ", " (placement_sentence(placement)) } "."
                @if let Some(rms) = record.median_rms_mm { " What was seen is met to " (format!("{rms:.2}")) " mm (RMS, median over the frames)." }
            }
            p {
                "Tensions are newtons per metre of thickness, at a Young's modulus of 6.9 kPa, with 95 % intervals. The interval of a tension begins at 0 if it cannot exclude a slack muscle. "
                "A course is a tension less its mean over the recording, which cancels the effect of the unknown shape of the tongue at rest on all frames. "
                "Without data a tension is " (format!("{median:.1} ({low:.1} to {high:.1})"))
                " N/m, with a correlation time of " (record.settings.memory_s) " s. "
                "A contour or a few coils do not determine eight tensions: the rest comes from the prior. Intervals of courses that are not known are hatched; frames that cannot be trusted are shaded."
            }
            @for note in record.untrusted.iter().chain(&record.notes) { p.alarms { (note) } }
        }
    }
}

fn contrasts(compared: &Comparison) -> Markup {
    const MOST: usize = 60;
    let decided = compared.decided();
    let labels: Vec<String> = compared.labels.iter().map(|l| l.label.clone()).collect();
    let muscles: Vec<String> = Vec::from_iter(
        compared.muscles.iter().map(|m| format!("{}{}", m.muscle, if m.known { "" } else { " (not known)" })),
    );
    // The longer of the two lists becomes the rows of the table.
    let is_turned = labels.len() < muscles.len();
    let (across, down) = if is_turned { (&labels, &muscles) } else { (&muscles, &labels) };
    let mean = |i: usize, j: usize| {
        let (label, muscle) = if is_turned { (j, i) } else { (i, j) };
        let tension = &compared.labels[label].tensions.0[muscle].1;
        with_interval([tension.median, tension.low, tension.high])
    };
    html! {
        section {
            h2 { "In which label a muscle pulls harder" }
            p { (compared.sentence()) ". What is unknown of the body and of the levels of a sitting cancels from a difference." }
            (tongue_page::table(["comparison", "difference, N/m", "P", "repetitions"], &html! {
                @for c in decided.iter().take(MOST) { tr {
                    td { (c.sentence().unwrap_or_default()) }
                    td { (with_interval(c.size())) }
                    td { (probability(c.probability_more.max(1.0 - c.probability_more))) }
                    td { @if let Some([a, b]) = c.repetitions { (c.a) " " (a) ", " (c.b) " " (b) } }
                } }
            }))
            @if decided.len() > MOST { p { "The first " (MOST) "; all are in contrasts.csv." } }
            p { "Means over all frames with a label that can be trusted, N/m, with 95 % intervals:" }
            (tongue_page::table(std::iter::once("mean").chain(across.iter().map(String::as_str)), &html! {
                @for (i, name) in down.iter().enumerate() { tr {
                    td { (name) }
                    @for j in 0..across.len() { td { (mean(i, j)) } }
                } }
            }))
        }
    }
}

fn with_interval([middle, low, high]: [f64; 3]) -> String {
    format!("{} ({})", with_decimals(middle, 1), range([low, high], 1))
}

fn muscle_summaries(record: &TrackRecord) -> Markup {
    let width = |c: &CourseSummary| {
        format!("{:.1} ({:.0} % of the prior)", c.level_width_n, 100.0 * c.unknown_part).into()
    };
    let mut columns = courses_columns(record);
    columns.push(Column::of_page("tension width, N/m", width));
    html! {
        section {
            h2 { "What is known of each muscle" }
            (tongue_page::table_of_columns(&columns, &record.courses))
            p { "Tensions are medians over the frames with their 95 % intervals; widths are means over the frames. A course is known if it varies by more than its uncertainty (reliability above 0.5) and its intervals are narrower than " (format!("{:.0}", NARROW * record.settings.link.scale_n())) " N/m." }
        }
    }
}

fn held_out(record: &TrackRecord) -> Markup {
    html! {
        @if let Some(held) = &record.held_out {
            section {
                h2 { "Points that were held out" }
                p { (held.points.join(", ")) "; learned on " (held.trained_on) "." }
                (tongue_page::table_of_columns(&held_out_columns(), &held.opponents))
                p { "The model is made for tensions, not for interpolation: opponents trained on this speaker may predict points better." }
            }
        }
    }
}

fn doubtful_frames(record: &TrackRecord) -> Markup {
    const MOST: usize = 200;
    let doubtful = || {
        let frames = record.results.frames();
        frames.filter(|(_, f)| f.status != FrameStatus::Converged || !f.faults.is_empty())
    };
    html! {
        section {
            h2 { "Frames with a fault" }
            @if doubtful().next().is_none() { p { "None." } } @else {
                (tongue_page::table(["recording", "time, s", "status", "RMS, mm", "what"], &html! {
                    @for (recording, f) in doubtful().take(MOST) { tr {
                        td { (recording.seen.name) }
                        td { (format!("{:.3}", f.time_s)) }
                        td { (status_in_words(&f.status)) }
                        td { @if let Some(r) = f.rms_m { (format!("{:.2}", 1e3 * r)) } }
                        td { @for (i, fault) in f.faults.iter().enumerate() { @if i > 0 { "; " } (fault.kind.label()) ": " (fault.points.join(", ")) } }
                    } }
                }))
                @if doubtful().count() > MOST { p { "The first " (MOST) "; all are in track.json." } }
            }
        }
    }
}
