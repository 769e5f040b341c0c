//! Tracking as tables: tidy CSV, and OpenSim's.

use super::{FrameRecord, TrackRecord, status_name};
use crate::report::{StoTable, Table};

impl TrackRecord {
    /// A row for each recording, frame and muscle.
    pub fn table(&self) -> Table {
        let columns = [
            "recording",
            "time_s",
            "muscle",
            "tension_n_per_m",
            "low_n_per_m",
            "high_n_per_m",
            "course_n_per_m",
            "course_low_n_per_m",
            "course_high_n_per_m",
            "course_known",
            "status",
            "resolved",
            "rms_mm",
        ];
        let mut rows = Vec::new();
        for f in &self.frames {
            for (i, (muscle, tension)) in f.tensions_n.0.iter().enumerate() {
                let known = self.courses.iter().any(|c| c.muscle == *muscle && c.known);
                rows.push(vec![
                    f.recording.clone(),
                    f.time_s.to_string(),
                    muscle.clone(),
                    tension.to_string(),
                    f.low.0[i].1.to_string(),
                    f.high.0[i].1.to_string(),
                    f.course.0[i].1.to_string(),
                    f.course_low.0[i].1.to_string(),
                    f.course_high.0[i].1.to_string(),
                    known.to_string(),
                    status_name(f.status),
                    f.resolved.to_string(),
                    f.rms_mm.map_or_else(String::new, |r| r.to_string()),
                ]);
            }
        }
        Table { columns: columns.map(str::to_owned).to_vec(), rows }
    }

    /// A row for each labelled stretch and muscle.
    pub fn segments_table(&self) -> Table {
        let columns = [
            "recording",
            "tier",
            "label",
            "from_s",
            "to_s",
            "frames",
            "muscle",
            "course_n_per_m",
            "low_n_per_m",
            "high_n_per_m",
        ];
        let mut rows = Vec::new();
        for s in &self.segments {
            for (i, (muscle, course)) in s.course.0.iter().enumerate() {
                rows.push(vec![
                    s.recording.clone(),
                    s.label.tier.clone(),
                    s.label.name.clone(),
                    s.label.from_s.to_string(),
                    s.label.to_s.to_string(),
                    s.frames.to_string(),
                    muscle.clone(),
                    course.to_string(),
                    s.low.0[i].1.to_string(),
                    s.high.0[i].1.to_string(),
                ]);
            }
        }
        Table { columns: columns.map(str::to_owned).to_vec(), rows }
    }

    /// One recording for OpenSim: tensions and courses with the ends of their intervals, displacements of freed bones, and the number of resolved
    /// directions over time.
    pub fn sto(&self, recording: &str) -> StoTable {
        let muscles: Vec<&String> =
            self.frames.first().map(|f| f.tensions_n.0.iter().map(|(m, _)| m).collect()).unwrap_or_default();
        let of = |what: &str| muscles.iter().map(|m| format!("{m}_{what}")).collect::<Vec<_>>();
        let freed = self.frames.iter().find(|f| f.recording == recording).map(|f| f.bones.0.iter());
        let axes = |bone: &String| ["x", "y"].map(|axis| format!("{bone}_shift_{axis}_mm"));
        let labels = [
            vec!["time".to_owned()],
            of("tension_n_per_m"),
            of("low_n_per_m"),
            of("high_n_per_m"),
            of("course_n_per_m"),
            of("course_low_n_per_m"),
            of("course_high_n_per_m"),
            freed.into_iter().flatten().flat_map(|(bone, _)| axes(bone)).collect(),
            vec!["resolved".to_owned()],
        ];
        let row = |f: &FrameRecord| {
            let values = [&f.tensions_n, &f.low, &f.high, &f.course, &f.course_low, &f.course_high]
                .into_iter()
                .flat_map(|b| b.0.iter().map(|(_, v)| *v));
            let shifts = f.bones.0.iter().flat_map(|(_, b)| b.shift_mm.iter().copied());
            std::iter::once(f.time_s).chain(values).chain(shifts).chain([f.resolved as f64]).collect()
        };
        let rows = self.frames.iter().filter(|f| f.recording == recording).map(row).collect();
        StoTable {
            title: format!("tongue-fit: muscle tensions over time, {recording}"),
            labels: labels.concat(),
            rows,
        }
    }
}
