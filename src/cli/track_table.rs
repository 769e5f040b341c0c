//! Tracking as text for a terminal of 100 columns.

use std::fmt::Write as _;
use std::path::PathBuf;

use tongue_fit::report::TrackRecord;

use super::table;

/// A run of `tongue-fit track`.
pub fn track(record: &TrackRecord, written: &[PathBuf]) -> String {
    let mut text = format!("{} frames of {} recordings", record.frames.len(), record.recordings.len());
    let ended: Vec<String> =
        record.statuses.iter().map(|(s, n)| format!("{n} {}", s.replace('_', " "))).collect();
    let _ = writeln!(text, ": {}", ended.join(", "));
    if let Some(rms) = record.median_rms_mm {
        let _ = writeln!(text, "contour and sensors met to {rms:.2} mm (RMS, median over the frames)");
    }
    let mut t = table::table(&[
        "muscle",
        "tension N/m",
        "95 % interval",
        "prior left",
        "odd/even r",
        "level",
        "course",
    ]);
    let number = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    for (i, course) in record.courses.iter().enumerate() {
        let median = |of: &dyn Fn(usize) -> f64| {
            let mut all: Vec<f64> = (0..record.frames.len()).map(of).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let frame = |t: usize| &record.frames[t];
        t.add_row([
            course.muscle.clone(),
            format!("{:.1}", median(&|t| frame(t).tensions_n.0[i].1)),
            format!("{:.1} to {:.1}", median(&|t| frame(t).low.0[i].1), median(&|t| frame(t).high.0[i].1)),
            format!("{:.0} %", 100.0 * course.unknown_part.min(1.0)),
            number(course.odd_even_correlation),
            course.odd_even_level_n.map_or_else(|| "-".to_owned(), |v| format!("±{v:.0}")),
            if course.known { "known" } else { "NOT KNOWN" }.to_owned(),
        ]);
    }
    let _ = writeln!(
        text,
        "\n{t}\nmedians over the frames; prior left: part of the prior's standard deviation that the data left"
    );
    let resolved = {
        let mut all: Vec<usize> = record.frames.iter().map(|f| f.resolved).collect();
        all.sort_unstable();
        all.get(all.len() / 2).copied().unwrap_or(0)
    };
    let _ = writeln!(
        text,
        "{resolved} of {} directions of tension are resolved in the median frame; the rest is the prior",
        record.courses.len()
    );
    if let Some(held) = &record.held_out {
        let mut t = table::table(&["hidden points told by", "points", "median mm", "pooled mm"]);
        for o in &held.opponents {
            t.add_row([
                o.name.clone(),
                o.points.to_string(),
                format!("{:.2}", o.median_mm),
                format!("{:.2}", o.pooled_mm),
            ]);
        }
        let _ = writeln!(text, "\n{} kept back; learned on {}\n{t}", held.points.join(", "), held.trained_on);
        let model = held.opponents.iter().find(|o| o.name == "the model");
        if let Some(model) = model {
            let better: Vec<&str> = held
                .opponents
                .iter()
                .filter(|o| o.median_mm < model.median_mm)
                .map(|o| o.name.as_str())
                .collect();
            if !better.is_empty() {
                let _ = writeln!(
                    text,
                    "better than the model: {}; the model is there for the tensions, not for interpolation",
                    better.join("; ")
                );
            }
        }
    }
    text + "\n" + &table::files(written)
}
