//! Tracking as tables: tidy CSV, and OpenSim's. Rows are made while they are written.

use std::io::{self, Write};

use serde_json::json;

use super::{RecordingResult, TrackRecord, status_name};
use crate::report::cells;
use crate::report::column::{columns, table};
use crate::report::{Export, Provenance, StoTable, Table};
use tongue_infer::posterior::Contrast;
use tongue_infer::track::{Comparison, Ranged, Tracked};

/// Writes a table row by row, with the provenance behind every row.
pub(super) fn write(
    out: &mut dyn Write,
    by: &Provenance,
    columns: &str,
    rows: impl Iterator<Item = Vec<String>>,
) -> io::Result<()> {
    let (names, values): (Vec<_>, Vec<_>) = by.entries().unzip();
    let mut writer = cells::writer(out);
    writer.write_record(columns.split(',').chain(names))?;
    for row in rows {
        writer.write_record(row.iter().chain(&values))?;
    }
    writer.flush()
}

#[derive(Debug)]
pub struct TrackTable<'a>(pub &'a TrackRecord);

impl Export for TrackTable<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let columns = "recording,time_s,muscle,tension_n_per_m,low_n_per_m,high_n_per_m,course_n_per_m,\
                       course_low_n_per_m,course_high_n_per_m,course_known,status,resolved,rms_mm";
        let TrackRecord { courses, results, .. } = self.0;
        let rows = results.frames().flat_map(|(recording, frame)| {
            let status = status_name(&frame.status);
            courses.iter().enumerate().map(move |(i, course)| {
                let numbers = [&frame.levels[i], &frame.courses[i]].map(|r| [r.median, r.low, r.high]);
                let begin = [recording.name.clone(), frame.time_s.to_string(), course.muscle.clone()];
                let end = [
                    course.known.to_string(),
                    status.clone(),
                    frame.resolved.to_string(),
                    frame.rms_m.map_or_else(String::new, |r| (r * 1e3).to_string()),
                ];
                begin.into_iter().chain(numbers.concat().iter().map(f64::to_string)).chain(end).collect()
            })
        });
        write(out, by, columns, rows)
    }
}

/// The differences between labels: a row for each muscle and two labels of a tier.
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
        ("word", "", "", |(_, c)| c.word.text().into()),
        ("repetitions_a", "", "", |(_, c)| json!(c.repetitions.map(|n| n[0]))),
        ("repetitions_b", "", "", |(_, c)| json!(c.repetitions.map(|n| n[1]))),
    ]);
    table(&columns, &rows)
}

#[derive(Debug)]
pub struct SegmentsTable<'a>(pub &'a TrackRecord);

impl Export for SegmentsTable<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let columns =
            "recording,tier,label,from_s,to_s,frames,muscle,course_n_per_m,low_n_per_m,high_n_per_m";
        let rows = self.0.results.segments().flat_map(|s| {
            let row = |(i, (muscle, course)): (usize, &(String, f64))| {
                vec![
                    s.recording.to_owned(),
                    s.label.tier.clone(),
                    s.label.name.clone(),
                    s.label.from_s.to_string(),
                    s.label.to_s.to_string(),
                    s.frames.to_string(),
                    muscle.clone(),
                    course.to_string(),
                    s.low.0[i].1.to_string(),
                    s.high.0[i].1.to_string(),
                ]
            };
            s.course.0.iter().enumerate().map(row).collect::<Vec<_>>()
        });
        write(out, by, columns, rows)
    }
}

impl RecordingResult {
    /// The recording for OpenSim: tensions and courses with the ends of their intervals, displacements of freed bones, and the number of
    /// resolved directions over time.
    pub fn sto(&self, muscles: &[String]) -> StoTable {
        let of = |what: &str| muscles.iter().map(|m| format!("{m}_{what}")).collect::<Vec<_>>();
        let axes = |bone: &String| ["x", "y"].map(|axis| format!("{bone}_shift_{axis}_mm"));
        let labels = [
            vec!["time".to_owned()],
            of("tension_n_per_m"),
            of("low_n_per_m"),
            of("high_n_per_m"),
            of("course_n_per_m"),
            of("course_low_n_per_m"),
            of("course_high_n_per_m"),
            self.freed.iter().flat_map(axes).collect(),
            vec!["resolved".to_owned()],
        ];
        let row = |f: &Tracked| {
            let values = [&f.levels, &f.courses].into_iter().flat_map(|of| {
                let ends: [fn(&Ranged) -> f64; 3] = [|r| r.median, |r| r.low, |r| r.high];
                ends.into_iter().flat_map(move |end| of.iter().map(end))
            });
            let shifts = f.bones.iter().flat_map(|b| b.shift_m.map(|x| x * 1e3));
            std::iter::once(f.time_s).chain(values).chain(shifts).chain([f.resolved as f64]).collect()
        };
        StoTable {
            title: format!("tongue-fit: muscle tensions over time, {}", self.name),
            labels: labels.concat(),
            rows: self.frames.iter().map(row).collect(),
        }
    }
}
