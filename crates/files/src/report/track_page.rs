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
    /// Name of the recording.
    pub recording: String,
    /// Figure of its courses.
    pub courses: Svg,
    /// The name of the file with its animation, if there is one.
    pub animation: Option<String>,
}

/// The page.
#[derive(Debug)]
pub struct TrackPage<'a> {
    /// The results.
    pub record: &'a TrackRecord,
    /// One for each recording.
    pub pictures: Vec<TrackPicture>,
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
                                    @if let Some(file) = &p.animation { p { "Seen (dots) and simulated: " a href=(file) { (file) } } }
                                }
                            }
                            (held_out(self.record))
                            (doubts(self.record))
        };
        out.write_all(page::document("tongue-fit track", &body).as_bytes())
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
                ". Body: " (record.body) "."
                @if let Some(rms) = record.median_rms_mm { " What was seen is met to " (format!("{rms:.2}")) " mm (RMS, median over the frames)." }
            }
            p {
                "Tensions are newtons per metre of thickness, with 95 % intervals under a half-normal prior of scale " (record.prior.scale_n)
                " N/m that remembers " (record.prior.memory_s) " s"
                @if record.prior.learned { ", its mean and covariance learned from these recordings" }
                ". A contour or a few coils do not determine eight tensions: the rest comes from the prior. Unreliable courses are grey; unreliable frames are shaded."
            }
            @for note in &record.notes { p.alarms { (note) } }
        }
    }
}

fn courses(record: &TrackRecord) -> Markup {
    let number =
        |v: Option<f64>, digits: usize| v.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    html! {
        section {
            h2 { "What is known of each muscle" }
            table {
                thead { tr { @for h in ["muscle", "course", "part of the prior left", "odd against even frames, r", "level between them, N/m"] { th { (h) } } } }
                tbody { @for c in &record.courses { tr {
                    td { (c.muscle) }
                    td { @if c.known { "known" } @else { "not known" } }
                    td { (format!("{:.0} %", 100.0 * c.unknown_part.min(1.0))) }
                    td { (number(c.odd_even_correlation, 2)) }
                    td { (number(c.odd_even_level_n, 1)) }
                } } }
            }
            p { "Levels depend on the rest shape: the last column is their difference between rest shapes made from odd and from even frames. Changes within a recording are more reliable." }
        }
    }
}

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
