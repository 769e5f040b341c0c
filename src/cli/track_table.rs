//! Tracking as text for a terminal of 100 columns.

use std::collections::BTreeSet;

use tongue_fit::inner::report::{
    TrackRecord, courses_columns, held_out_columns, placement_sentence, prior_interval_n, repeats_columns,
    repetitions_sentence, status_counts, with_decimals,
};
use tongue_fit::inner::statistics::median;
use tongue_fit::inner::track::{Comparison, Displacement, FrameStatus, NARROW};

use super::table::{self, count_of, difference, join_first};

pub fn track(record: &TrackRecord) -> String {
    let frames = || record.results.frames().map(|(_, frame)| frame);
    let mut text = format!(
        "{} of {}: {}\n",
        count_of(frames().count(), "frame"),
        count_of(record.recordings.len(), "recording"),
        status_counts(&record.statuses)
    );
    if let Some(rms) = record.median_rms_mm {
        text += &format!("contour and sensors met to {rms:.2} mm (RMS, median over the frames)\n");
    }
    if let Some(placement) = &record.placement {
        text += &format!("{}\n", placement_sentence(placement));
    }
    let compared = record.comparisons.first();
    text += &compared.map(contrasts).unwrap_or_default();
    let t = table::from_columns(&courses_columns(record), &record.courses);
    let ([low, high], link) = (prior_interval_n(&record.settings), &record.settings.link);
    text += &format!(
        "\n{t}\nmedians over the frames, at a Young's modulus of 6.9 kPa; without data a tension is {:.1} ({low:.1} to {high:.1}) N/m.\n\
         An interval from 0 cannot exclude a slack muscle. A course is a tension less its mean over the recording; it is\n\
         known if it varies by more than its uncertainty (reliability above 0.5) and single frames are narrower than {:.0} N/m.\n{}{}\n",
        link.prior_quantile(0.0),
        NARROW * link.scale_n(),
        compared.map_or("", |_| "Labels are known if the same is true of the means over them.\n"),
        tongue_fit::inner::report::limit_of_plane()
    );
    let resolved = median(frames().map(|f| f.resolved as f64)).unwrap_or(0.0);
    text += &format!(
        "a frame resolves {resolved} of {} directions of tension (median over the frames); the others come from the prior\n",
        record.courses.len()
    );
    text += &other_ways(record);
    if let Some(repeats) = &record.repeats {
        let t = table::from_columns(&repeats_columns(repeats), &repeats.muscles.0);
        text += &format!("\n{}\n{t}\n", repetitions_sentence(repeats));
    }
    if let Some(formants) = &record.formants {
        text += &format!("{}\n", formants.sentence(frames().count()));
    }
    for (bone, end) in displacements_of_free_bones(record) {
        text += &format!(
            "{bone}, not seen: displaced by {end} mm (medians over the frames, ranges of 95 % of the draws)\n"
        );
    }
    if let Some(held) = &record.held_out {
        let all = &held.opponents;
        let t = table::from_columns(&held_out_columns(), all);
        text += &format!("\n{} held out; trained on {}\n{t}\n", held.points.join(", "), held.trained_on);
        let model = all.iter().find(|o| o.name == "the model").map_or(0.0, |model| model.median_mm);
        let better: Vec<&str> = all.iter().filter(|o| o.median_mm < model).map(|o| o.name.as_str()).collect();
        if !better.is_empty() {
            text += &format!(
                "better than the model at predicting these points: {}; the model is built to find tensions\n",
                better.join("; ")
            );
        }
    }
    text + "\n"
}

fn contrasts(compared: &Comparison) -> String {
    const MOST: usize = 20;
    let decided = compared.decided().into_iter().map(difference);
    format!("\n{}\n{}", compared.sentence(), lines(join_first(decided, MOST, "\n")))
}

fn lines(text: String) -> String {
    if text.is_empty() { text } else { text + "\n" }
}

/// How shapes are reached to which pulling all muscles together does not lead.
fn other_ways(record: &TrackRecord) -> String {
    let mut text = String::new();
    let other = record.results.frames().filter(|(_, f)| f.other_way).count();
    if other > 0 {
        text += &format!(
            "{other} shapes are reached from the posture before or after them, or where one muscle pulls before the others\n"
        );
    }
    let replaced = record.results.frames().filter(|(_, f)| f.reached_rms_m.is_some());
    let (off, as_well): (Vec<_>, Vec<_>) = replaced.partition(|(_, f)| f.status == FrameStatus::NotReached);
    if !as_well.is_empty() {
        text += &format!(
            "{} shapes cannot be reached and are replaced by near ones that can, which meet the points as well\n",
            as_well.len()
        );
    }
    let off = off.iter().map(|(recording, f)| {
        format!(
            "{}, {:.3} s: no way to its shape was found; the nearest that is reached meets the points to {:.2} mm",
            recording.seen.name,
            f.time_s,
            1e3 * f.reached_rms_m.unwrap_or(f64::NAN)
        )
    });
    text + &lines(join_first(off, 10, "\n"))
}

fn displacements_of_free_bones(record: &TrackRecord) -> Vec<(String, String)> {
    let recordings = &record.results.recordings;
    let names: BTreeSet<&String> = recordings.iter().flat_map(|r| &r.freed).collect();
    Vec::from_iter(names.into_iter().map(|name| {
        let own = recordings.iter().filter_map(|r| Some((r, r.freed.iter().position(|n| n == name)?)));
        let all: Vec<&Displacement> =
            own.flat_map(|(r, i)| r.tracked.frames.iter().filter_map(move |f| f.bones.get(i))).collect();
        let axes = [0, 1].map(|a| {
            let of = |end: &dyn Fn(&Displacement) -> f64| {
                with_decimals(1e3 * median(all.iter().map(|b| end(b))).unwrap_or(f64::NAN), 1)
            };
            format!("{} ({} to {})", of(&|b| b.shift_m[a]), of(&|b| b.low_m[a]), of(&|b| b.high_m[a]))
        });
        (name.replace('_', " "), axes.join(", "))
    }))
}
