//! The page of a tracked recording: one HTML file without a network.

use std::io::{self, Write};

use maud::{Markup, PreEscaped, html};

use super::export::{Export, Provenance};
use super::page;
use super::svg::Svg;
use super::track::{TrackRecord, status_name};

/// Pictures of one recording.
#[derive(Debug, Clone)]
pub struct TrackPicture {
    pub recording: String,
    pub courses: Svg,
    /// Its animation with the name of the file and its length, s, if there is one.
    pub animation: Option<(String, Svg, f64)>,
}

#[derive(Debug)]
pub struct TrackPage<'a> {
    pub record: &'a TrackRecord,
    pub pictures: Vec<TrackPicture>,
    /// How well courses repeat, where labels do.
    pub repeats: Option<Svg>,
}

impl Export for TrackPage<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let body = html! {
                            (top(self.record, by))
                            (courses(self.record))
                            @for p in &self.pictures {
                                section {
                                    h2 { (p.recording) }
                                    div.figure.wide { (PreEscaped(p.courses.to_string())) }
                                    @if let Some((file, svg, span_s)) = &p.animation { (player(file, svg, *span_s)) }
                                }
                            }
                            @if let Some(repeats) = &self.repeats {
                                section {
                                    h2 { "What repeats" }
                                    p { "Intraclass correlation of every course over the repetitions of labels, each brought to the same length, beside that of labels that are shifted by a random time in each recording." }
                                    div.figure.wide { (PreEscaped(repeats.to_string())) }
                                }
                            }
                            (held_out(self.record))
                            @if self.pictures.iter().any(|p| p.animation.is_some()) { script { (PreEscaped(PLAYER)) } }
                            (doubts(self.record))
        };
        out.write_all(page::document("tongue-fit track", &body).as_bytes())
    }
}

/// Moves the pictures of every player to the time of its slider, and plays them.
const PLAYER: &str = "document.querySelectorAll('.player').forEach(p => {\n\
    const [svg, bar, button] = ['svg', 'input', 'button'].map(n => p.querySelector(n)), end = Number(bar.max);\n\
    const show = () => svg.setCurrentTime(Math.min(Number(bar.value), end - 1e-4));\n\
    let begun = 0;\n\
    const step = now => { if (!begun) return; bar.value = (now - begun) / 1000 % end; show(); requestAnimationFrame(step); };\n\
    const stop = () => { begun = 0; button.textContent = 'Play'; };\n\
    svg.pauseAnimations(); show();\n\
    bar.addEventListener('input', () => { stop(); show(); });\n\
    button.addEventListener('click', () => { if (begun) return stop();\n\
        begun = performance.now() - 1000 * Number(bar.value); button.textContent = 'Pause'; requestAnimationFrame(step); });\n\
});\n";

/// The animation of a recording, so long in seconds, with a slider.
fn player(file: &str, svg: &Svg, span_s: f64) -> Markup {
    html! {
        div.figure.wide.player {
            (PreEscaped(svg.to_string()))
            p {
                button type="button" { "Play" } " "
                input type="range" min="0" max=(format!("{span_s:.4}")) step="any" value="0" aria-label="Time" style="width: 60%";
                " measured (dots) and simulated; " a href=(file) { (file) }
            }
        }
    }
}

fn top(record: &TrackRecord, by: &Provenance) -> Markup {
    html! {
        header {
            h1 { "Tongue muscle tensions over time" }
            p { "tongue-fit " (by.version) " · " code { (by.command) } }
            p {
                (record.frames.len()) " frames of " (record.recordings.len()) " recordings: "
                @for (i, (status, n)) in record.statuses.iter().enumerate() { @if i > 0 { ", " } (n) " " (status.replace('_', " ")) }
                ". Body: " (record.body) @if let Some(placement) = &record.placement { ", " (placement.said()) } "."
                @if let Some(rms) = record.median_rms_mm { " What was seen is met to " (format!("{rms:.2}")) " mm (RMS, median over the frames)." }
            }
            p {
                "Tensions are newtons per metre of thickness, at a Young's modulus of 6.9 kPa, with 95 % intervals. A level is a tension; its interval begins at 0 if it cannot exclude a slack muscle. "
                "A course is a tension less its mean over the recording, which cancels the effect of the unknown shape of the tongue at rest on all frames. "
                "Without data a tension is " (format!("{:.1} ({:.1} to {:.1})", record.prior.median_n, record.prior.interval_n[0], record.prior.interval_n[1]))
                " N/m, with a correlation time of " (record.prior.memory_s) " s. "
                "A contour or a few coils do not determine eight tensions: the rest comes from the prior. Intervals of courses that are not known are hatched; unreliable frames are shaded."
            }
            @for note in record.untrusted.iter().chain(&record.notes) { p.alarms { (note) } }
        }
    }
}

fn courses(record: &TrackRecord) -> Markup {
    html! {
        section {
            h2 { "What is known of each muscle" }
            table {
                thead { tr { @for h in ["muscle", "course", "reliability", "width of courses, N/m", "width of levels, N/m"] { th { (h) } } } }
                tbody { @for c in &record.courses { tr {
                    td { (c.muscle) }
                    td { @if c.known { "known" } @else { "not known" } }
                    td { (format!("{:.2}", c.reliability)) }
                    td { (format!("{:.1}", c.course_width_n)) }
                    td { (format!("{:.1} ({:.0} % of the prior)", c.level_width_n, 100.0 * c.unknown_part)) }
                } } }
            }
            p { "Widths are those of 95 % intervals, means over the frames. A course is known if it varies by more than its uncertainty (reliability above 0.5) and its intervals are narrower than " (format!("{:.0}", 1.2 * record.prior.scale_n)) " N/m." }
        }
        section {
            h2 { "Gestures" }
            p { "Means over a tenth of a second less those over the recording, N/m, with 95 % intervals; bold where the interval is all above or all below zero." }
            table {
                thead { tr {
                    th { "recording" } th { "s" }
                    @if let Some(g) = record.gestures.first() { @for (m, _) in &g.change.0 { th { (m) } } }
                } }
                tbody { @for g in record.gestures.iter().take(MOST_GESTURES) { tr {
                    td { (g.recording) }
                    td { (format!("{:.2} to {:.2}", g.from_s, g.to_s)) }
                    @for (i, (_, change)) in g.change.0.iter().enumerate() {
                        @let (low, high) = (g.low.0[i].1, g.high.0[i].1);
                        @let text = format!("{change:+.0} ({low:+.0} to {high:+.0})");
                        td { @if low > 0.0 || high < 0.0 { b { (text) } } @else { (text) } }
                    }
                } } }
            }
            @if record.gestures.len() > MOST_GESTURES { p { "The first " (MOST_GESTURES) "; all are in track.json." } }
        }
    }
}

/// Most gestures in the page's table.
const MOST_GESTURES: usize = 60;

fn held_out(record: &TrackRecord) -> Markup {
    html! {
        @if let Some(held) = &record.held_out {
            section {
                h2 { "Points that were held out" }
                p { (held.points.join(", ")) "; learned on " (held.trained_on) "." }
                table {
                    thead { tr { @for h in ["predicted by", "points", "median, mm", "pooled, mm"] { th { (h) } } } }
                    tbody { @for o in &held.opponents { tr {
                        td { (o.name) } td { (o.points) } td { (format!("{:.2}", o.median_mm)) } td { (format!("{:.2}", o.pooled_mm)) }
                    } } }
                }
                p { "The model is made for tensions, not for interpolation: opponents trained on this speaker may predict points better." }
            }
        }
    }
}

fn doubts(record: &TrackRecord) -> Markup {
    const MOST: usize = 200;
    let doubtful = || {
        record
            .frames
            .iter()
            .filter(|f| f.status != tongue_infer::track::FrameStatus::Converged || !f.faults.is_empty())
    };
    html! {
        section {
            h2 { "Frames with a fault" }
            @if doubtful().next().is_none() { p { "None." } } @else {
                table {
                    thead { tr { @for h in ["recording", "time, s", "status", "RMS, mm", "what"] { th { (h) } } } }
                    tbody { @for f in doubtful().take(MOST) { tr {
                        td { (f.recording) }
                        td { (format!("{:.3}", f.time_s)) }
                        td { (status_name(f.status).replace('_', " ")) }
                        td { @if let Some(r) = f.rms_mm { (format!("{r:.2}")) } }
                        td { @for (i, fault) in f.faults.iter().enumerate() { @if i > 0 { "; " } (fault.kind.said()) ": " (fault.points.join(", ")) } }
                    } } }
                }
                @if doubtful().count() > MOST { p { "The first " (MOST) "; all are in track.json." } }
            }
        }
    }
}
