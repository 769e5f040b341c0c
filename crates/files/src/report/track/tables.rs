//! Tables of tracking: CSV with a row for each value, and OpenSim's. Rows are made while they are written.

use std::collections::BTreeMap;
use std::io::Write;
use std::iter;

use serde_json::json;

use super::{ENDS, RecordingResult, TrackRecord, TrackResults, status_name};
use crate::report::column::{NamedColumn, columns, table};
use crate::report::{Export, Provenance, StoTable, Table, csv};
use tongue_infer::posterior::{Contrast, OverSpeakers};
use tongue_infer::track::Comparison;

pub fn track_csv(record: &TrackRecord) -> impl Export {
    move |out: &mut dyn Write, by: &Provenance| {
        let columns = "recording,time_s,muscle,tension_n_per_m,low_n_per_m,high_n_per_m,course_n_per_m,\
                       course_low_n_per_m,course_high_n_per_m,course_known,status,resolved,rms_mm";
        let TrackRecord { courses, results, .. } = record;
        let rows = results.frames().flat_map(|(recording, frame)| {
            let status = status_name(&frame.status);
            let rms_mm = frame.rms_m.map_or_else(String::new, |r| (r * 1e3).to_string());
            courses.iter().enumerate().map(move |(i, course)| {
                let numbers = [&frame.tensions[i], &frame.courses[i]].map(|r| [r.median, r.low, r.high]);
                let begin = [recording.seen.name.clone(), frame.time_s.to_string(), course.muscle.clone()];
                let known = course.known.to_string();
                let end = [known, status.clone(), frame.resolved.to_string(), rms_mm.clone()];
                begin.into_iter().chain(numbers.into_iter().flatten().map(|v| v.to_string())).chain(end)
            })
        });
        csv::write(out, by, columns.split(','), rows, false)
    }
}

/// Differences between labels: a row for each muscle and two labels of a tier.
pub fn contrasts(comparisons: &[Comparison]) -> Table {
    let rows: Vec<(&str, &Contrast)> =
        comparisons.iter().flat_map(|c| c.contrasts.iter().map(|one| (c.tier.as_str(), one))).collect();
    let columns = columns::<(&str, &Contrast), _>([
        ("tier", "", "", |(tier, _)| json!(tier)),
        ("muscle", "", "", |(_, c)| json!(c.muscle)),
        ("a", "", "", |(_, c)| json!(c.a)),
        ("b", "", "", |(_, c)| json!(c.b)),
        ("difference_n_per_m", "N/m", "", |(_, c)| c.median.into()),
        ("low_n_per_m", "N/m", "", |(_, c)| c.interval_95[0].into()),
        ("high_n_per_m", "N/m", "", |(_, c)| c.interval_95[1].into()),
        ("p_harder", "", "", |(_, c)| c.probability_more.into()),
        ("word", "", "", |(_, c)| c.certainty.text().into()),
        ("repetitions_a", "", "", |(_, c)| json!(c.repetitions.map(|n| n[0]))),
        ("repetitions_b", "", "", |(_, c)| json!(c.repetitions.map(|n| n[1]))),
    ]);
    table(&columns, &rows)
}

/// The columns of `over_speakers.csv`.
pub(in crate::report) const OVER_SPEAKERS: [NamedColumn<OverSpeakers>; 12] = [
    ("tier", "", "tier of the labels; of a batch, the baseline of the vowels", |c| json!(c.tier)),
    ("muscle", "", "muscle", |c| json!(c.muscle)),
    ("a", "", "vowel or label", |c| json!(c.a)),
    ("b", "", "another one", |c| json!(c.b)),
    ("speakers", "", "speakers with both", |c| c.speakers.into()),
    ("surely_harder_in_a", "", "those in whom the muscle surely pulls harder in a", |c| {
        c.surely_harder_in_a.into()
    }),
    ("harder_in_a", "", "those in whom it does so surely or probably", |c| c.harder_in_a.into()),
    ("surely_harder_in_b", "", "those in whom it surely pulls harder in b", |c| c.surely_harder_in_b.into()),
    ("harder_in_b", "", "those in whom it does so surely or probably", |c| c.harder_in_b.into()),
    ("mean_difference_n_per_m", "N/m", "mean of the tension in a less that in b", |c| c.mean_n.into()),
    ("low_n_per_m", "N/m", "lower end of its 95 % interval", |c| json!(c.interval_95.map(|ends| ends[0]))),
    ("high_n_per_m", "N/m", "upper end", |c| json!(c.interval_95.map(|ends| ends[1]))),
];

/// Differences between labels over speakers: a row for each muscle and two labels of a tier.
pub fn over_speakers(all: &[OverSpeakers]) -> Table {
    table(&columns(OVER_SPEAKERS), all)
}

pub fn segments_csv(results: &TrackResults) -> impl Export {
    move |out: &mut dyn Write, by: &Provenance| {
        let columns =
            "recording,tier,label,from_s,to_s,frames,muscle,course_n_per_m,low_n_per_m,high_n_per_m";
        let rows = results.segments().flat_map(|(one, label, mean)| {
            results.muscles.iter().zip(&mean.changes).map(move |(muscle, course)| {
                let names = [&one.seen.name, &label.tier, &label.name].map(String::clone);
                let times = [label.from_s, label.to_s].map(|v| v.to_string());
                let own = [mean.frames.to_string(), muscle.clone()];
                let numbers = [course.median, course.low, course.high].map(|v| v.to_string());
                names.into_iter().chain(times).chain(own).chain(numbers)
            })
        });
        csv::write(out, by, columns.split(','), rows, false)
    }
}

/// Draws of the tensions over labels, for mixed models: a row for each label, part of it, muscle and draw. Draws of the same number belong
/// together in all recordings of a speaker that show the same bones.
pub fn draws_csv(results: &TrackResults) -> impl Export {
    move |out: &mut dyn Write, by: &Provenance| {
        let columns =
            "speaker,recording,tier,label,repetition,part,time_s,muscle,draw,tension_n_per_m,course_n_per_m";
        let mut repetitions: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        let rows =
            results.recordings.iter().flat_map(|one| one.tracked.label_courses.iter().map(move |c| (one, c)));
        let rows = rows.flat_map(|(one, course)| {
            let label = &one.seen.labels[course.label];
            let repetition = repetitions.entry((&label.tier, &label.name)).or_default();
            *repetition += 1;
            let speaker = one.seen.speaker.as_deref().unwrap_or_default();
            let names = [speaker, &one.seen.name, &label.tier, &label.name].map(str::to_owned);
            let begin: Vec<String> = names.into_iter().chain([repetition.to_string()]).collect();
            course.points.iter().flat_map(move |point| {
                let begin = begin.clone();
                let values = results.muscles.iter().zip(point.tensions.iter().zip(&point.courses));
                values.flat_map(move |(muscle, (tensions, courses))| {
                    let begin = begin.clone();
                    tensions.iter().zip(courses).enumerate().map(move |(draw, (tension, course))| {
                        let own = [format!("{:.3}", point.part), point.time_s.to_string(), muscle.clone()];
                        let numbers = [draw.to_string(), format!("{tension:.2}"), format!("{course:.2}")];
                        begin.clone().into_iter().chain(own).chain(numbers)
                    })
                })
            })
        });
        csv::write(out, by, columns.split(','), rows, true)
    }
}

impl RecordingResult {
    /// For OpenSim: tensions and courses with their intervals, displacements of free bones, and the number of resolved directions.
    pub fn sto(&self, muscles: &[String]) -> StoTable {
        let names = ["tension", "low", "high", "course", "course_low", "course_high"].into_iter();
        let of_muscles = names.flat_map(|name| muscles.iter().map(move |m| format!("{m}_{name}_n_per_m")));
        let axes =
            self.freed.iter().flat_map(|bone| ["x", "y"].map(|axis| format!("{bone}_shift_{axis}_mm")));
        let labels = iter::once("time".to_owned()).chain(of_muscles).chain(axes);
        let rows = self.tracked.frames.iter().map(|f| {
            let both = [&f.tensions, &f.courses].into_iter();
            let values = both.flat_map(|of| ENDS.into_iter().flat_map(move |end| of.iter().map(end)));
            let shifts = f.bones.iter().flat_map(|b| b.shift_m.map(|x| x * 1e3));
            iter::once(f.time_s).chain(values).chain(shifts).chain([f.resolved as f64]).collect()
        });
        StoTable {
            title: format!("tongue-fit: muscle tensions over time, {}", self.seen.name),
            labels: labels.chain(["resolved".to_owned()]).collect(),
            rows: rows.collect(),
        }
    }
}
