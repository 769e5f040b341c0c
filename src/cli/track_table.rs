//! Tracking as text for a terminal of 100 columns.

use std::fmt::Write as _;
use std::path::PathBuf;

use tongue_fit::report::{FrameRecord, TrackRecord};
use tongue_fit::statistics::upper_median;
use tongue_fit::track::FrameStatus;

use super::table;

/// A run of `tongue-fit track`.
pub fn track(record: &TrackRecord, written: &[PathBuf]) -> String {
    let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut text = format!(
        "{} of {}",
        counted(record.frames.len(), "frame"),
        counted(record.recordings.len(), "recording")
    );
    let ended: Vec<String> =
        record.statuses.iter().map(|(s, n)| format!("{n} {}", s.replace('_', " "))).collect();
    let _ = writeln!(text, ": {}", ended.join(", "));
    if let Some(rms) = record.median_rms_mm {
        let _ = writeln!(text, "contour and sensors met to {rms:.2} mm (RMS, median over the frames)");
    }
    if let Some(placement) = &record.placement {
        let _ = writeln!(text, "{}", placement.said());
    }
    let mut t =
        table::table(&["muscle", "level N/m", "95 % interval", "course width N/m", "reliability", "course"]);
    for (i, course) in record.courses.iter().enumerate() {
        let of = |value: &dyn Fn(&FrameRecord) -> f64| median(record.frames.iter().map(value));
        t.add_row([
            course.muscle.clone(),
            format!("{:.1}", of(&|f| f.tensions_n.0[i].1)),
            format!("{:.1} to {:.1}", of(&|f| f.level_low.0[i].1), of(&|f| f.level_high.0[i].1)),
            format!("{:.1}", course.course_width_n),
            format!("{:.2}", course.reliability),
            if course.known { "known" } else { "NOT KNOWN" }.to_owned(),
        ]);
    }
    let [low, high] = record.prior.interval_n;
    let _ = writeln!(
        text,
        "\n{t}\nmedians over the frames, at a Young's modulus of 6.9 kPa; without data a level is {:.1} ({low:.1} to {high:.1}) N/m.\n\
         An interval from 0 cannot exclude a slack muscle. A course is a level less its mean over the recording; it is\n\
         known if it varies by more than its uncertainty (reliability above 0.5) and single frames are narrower than {:.0} N/m.\n{}",
        record.prior.median_n,
        1.2 * record.prior.scale_n,
        tongue_fit::report::limit_of_plane()
    );
    let resolved = upper_median(record.frames.iter().map(|f| f.resolved as f64)).unwrap_or(0.0);
    let _ = writeln!(
        text,
        "{resolved} of {} directions of tension are resolved in the median frame; the others come from the prior",
        record.courses.len()
    );
    text += &ways(record);
    if let Some(repeats) = &record.repeats {
        let mut t = table::table(&["muscle", "ICC of its course", "by chance", "95 % of chance"]);
        for (muscle, r) in &repeats.muscles.0 {
            t.add_row([
                muscle.clone(),
                format!("{:.2}", r.icc),
                format!("{:.2}", r.by_chance),
                format!("{:.2}", r.chance_95),
            ]);
        }
        let _ = writeln!(text, "\n{}\n{t}", repeats.said());
    }
    if let Some(formants) = &record.formants {
        let _ = writeln!(text, "{}", formants.said(record.frames.len()));
    }
    for (bone, end) in freed(record) {
        let _ = writeln!(
            text,
            "{bone}, not seen: displaced by {end} mm (medians over the frames, 95 % intervals)"
        );
    }
    if let Some(held) = &record.held_out {
        let mut t = table::table(&["hidden points predicted by", "points", "median mm", "pooled mm"]);
        for o in &held.opponents {
            t.add_row([
                o.name.clone(),
                o.points.to_string(),
                format!("{:.2}", o.median_mm),
                format!("{:.2}", o.pooled_mm),
            ]);
        }
        let _ = writeln!(text, "\n{} held out; trained on {}\n{t}", held.points.join(", "), held.trained_on);
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
                    "better than the model at predicting these points: {}; the model is built to find tensions",
                    better.join("; ")
                );
            }
        }
    }
    text + "\n" + &table::files(written)
}

/// How shapes are reached that pulling all muscles together does not lead to.
fn ways(record: &TrackRecord) -> String {
    let mut text = String::new();
    let other = record.frames.iter().filter(|f| f.other_way).count();
    if other > 0 {
        let _ = writeln!(
            text,
            "{other} shapes are reached from the posture before or after them, or where one muscle pulls before the others"
        );
    }
    let (off, as_well): (Vec<&FrameRecord>, Vec<_>) = record
        .frames
        .iter()
        .filter(|f| f.reached_rms_mm.is_some())
        .partition(|f| f.status == FrameStatus::OffBranch);
    if !as_well.is_empty() {
        let _ = writeln!(
            text,
            "{} shapes cannot be reached and are replaced by near ones that can, which meet the points as well",
            as_well.len()
        );
    }
    for f in off.iter().take(10) {
        let _ = writeln!(
            text,
            "{}, {:.3} s: no way to its shape was found; the nearest that is reached meets the points to {:.2} mm",
            f.recording,
            f.time_s,
            f.reached_rms_mm.unwrap_or(f64::NAN)
        );
    }
    if off.len() > 10 {
        let _ = writeln!(text, "... and {} more; the status of every frame is in track.csv", off.len() - 10);
    }
    text
}

/// Free bones and their displacements.
fn freed(record: &TrackRecord) -> Vec<(String, String)> {
    let mut names: Vec<&String> =
        record.frames.iter().flat_map(|f| f.bones.0.iter().map(|(name, _)| name)).collect();
    names.sort();
    names.dedup();
    let one = |name: &String| {
        let all: Vec<_> = record.frames.iter().filter_map(|f| f.bones.of(name)).collect();
        let axis = |a: usize| {
            let [x, low, high] = [
                median(all.iter().map(|b| b.shift_mm[a])),
                median(all.iter().map(|b| b.interval_mm[a][0])),
                median(all.iter().map(|b| b.interval_mm[a][1])),
            ];
            format!("{x:.1} ({low:.1} to {high:.1})")
        };
        (name.replace('_', " "), format!("{}, {}", axis(0), axis(1)))
    };
    names.into_iter().map(one).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    upper_median(values).unwrap_or(f64::NAN)
}
