//! Results of tracking: JSON, tidy CSV, OpenSim's table.

use serde::Serialize;

use super::{BoneRecord, ByMuscle, StoTable, Table};
use tongue_core::statistics::upper_median;
use tongue_infer::track::{Displacement, FrameStatus, HeldOut, Prior, Tracked};
use tongue_input::measured::recording::{Fault, Seen};

/// One frame of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameRecord {
    /// Name of the recording.
    pub recording: String,
    /// Time, s.
    pub time_s: f64,
    /// How it ended.
    pub status: FrameStatus,
    /// Fitted tensions of the frame, N per metre of thickness.
    pub tensions_n: ByMuscle<f64>,
    /// Lower ends of the 95 % intervals.
    pub low: ByMuscle<f64>,
    /// Upper ends.
    pub high: ByMuscle<f64>,
    /// Displacements of the bones that are unknowns because they were not seen.
    #[serde(skip_serializing_if = "ByMuscle::is_empty")]
    pub bones: ByMuscle<BoneRecord>,
    /// Root mean square distance of the fitted points, mm; null if there are none.
    pub rms_mm: Option<f64>,
    /// Root mean square distance of the held-out points, mm; null if there are none.
    pub held_out_rms_mm: Option<f64>,
    /// Directions of the tensions whose standard deviation is below a quarter of the prior's scale.
    pub resolved: usize,
    /// Faults of the measured points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

/// Reliability of the course of one muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CourseRecord {
    /// The muscle.
    pub muscle: String,
    /// Whether the course is reliable: the data outweigh the prior, and it does not depend on the frames that
    /// made the rest shape.
    pub known: bool,
    /// Median over the frames of the standard deviation of its score: 1 if all comes from the prior, 0 if all
    /// comes from the data.
    pub unknown_part: f64,
    /// Correlation of its courses with rest shapes made from odd and from even frames; null if none was made.
    pub odd_even_correlation: Option<f64>,
    /// Mean difference of the levels of these two courses, N per metre of thickness.
    pub odd_even_level_n: Option<f64>,
}

/// Largest part of the prior's standard deviation that the scores of a reliable course keep.
const UNKNOWN: f64 = 0.6;
/// Smallest correlation of reliable courses with rest shapes from odd and from even frames.
const SAME_COURSE: f64 = 0.8;

/// Reliability of every muscle's course over all frames; `pair` has the same frames with rest shapes from odd
/// and from even frames.
pub fn courses(names: &[String], frames: &[&Tracked], pair: Option<&[Vec<Tracked>; 2]>) -> Vec<CourseRecord> {
    let course = |(i, name): (usize, &String)| {
        let sd = frames.iter().map(|f| f.covariance[(i, i)].max(0.0).sqrt());
        let unknown_part = upper_median(sd).unwrap_or(1.0);
        let tensions = |all: &[Tracked]| all.iter().map(|f| f.tensions_n[i]).collect::<Vec<f64>>();
        let both = pair.map(|[odd, even]| (tensions(odd), tensions(even)));
        let correlation = both.as_ref().and_then(|(a, b)| correlation(a, b));
        let level = both
            .as_ref()
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>().abs() / a.len().max(1) as f64);
        CourseRecord {
            muscle: name.clone(),
            known: unknown_part < UNKNOWN && correlation.is_none_or(|r| r >= SAME_COURSE),
            unknown_part,
            odd_even_correlation: correlation,
            odd_even_level_n: level,
        }
    };
    names.iter().enumerate().map(course).collect()
}

fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma).powi(2);
        bb += (y - mb).powi(2);
    }
    let r = ab / (aa * bb).sqrt();
    r.is_finite().then_some(r)
}

/// The prior of the intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorRecord {
    /// Scale of the half-normal tensions, N per metre of thickness.
    pub scale_n: f64,
    /// Whether mean and covariance of the scores were learned from the recordings.
    pub learned: bool,
    /// Correlation time of the tensions, s.
    pub memory_s: f64,
    /// Medians of the prior of the tensions, N per metre of thickness.
    pub medians_n: ByMuscle<f64>,
}

impl PriorRecord {
    /// The record of a prior of these muscles.
    pub fn new(prior: &Prior, muscles: &[String]) -> Self {
        let medians = prior.mean.iter().map(|g| prior.scale_n * tongue_infer::track::scores::tension(*g).0);
        let n = prior.mean.len();
        let plain = Prior::half_normal(n, prior.scale_n, prior.memory_s);
        Self {
            scale_n: prior.scale_n,
            learned: *prior != plain,
            memory_s: prior.memory_s,
            medians_n: ByMuscle::new(muscles, medians),
        }
    }
}

/// A run of `tongue-fit track`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackRecord {
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// The body.
    pub body: String,
    /// Origin of its rest shape; null for a given body.
    pub rest: Option<tongue_infer::adapt::How>,
    /// The prior of the intervals.
    pub prior: PriorRecord,
    /// Number of frames by status.
    pub statuses: std::collections::BTreeMap<String, usize>,
    /// Median over the frames of the root mean square distance, mm.
    pub median_rms_mm: Option<f64>,
    /// Reliability of each muscle's course.
    pub courses: Vec<CourseRecord>,
    /// Errors of the held-out points: this model and its opponents.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
    /// Notes for the reader.
    pub notes: Vec<String>,
    /// All frames.
    pub frames: Vec<FrameRecord>,
    /// Duration of the run, s.
    pub wall_s: f64,
}

/// The frames of a recording as records; `faults` were found before the fit, `freed` are the names of the
/// free bones.
pub fn frame_records<'a>(
    seen: &Seen,
    faults: &[Vec<Fault>],
    tracked: &[Tracked],
    muscles: &[String],
    freed: impl Iterator<Item = &'a str>,
) -> Vec<FrameRecord> {
    let freed: Vec<&str> = freed.collect();
    let bone = |d: &Displacement| BoneRecord {
        shift_mm: d.shift_m.iter().map(|x| x * 1e3).collect(),
        interval_mm: d.low_m.iter().zip(&d.high_m).map(|(l, h)| [l * 1e3, h * 1e3]).collect(),
    };
    let record = |(t, frame): (usize, &Tracked)| {
        let by = |values: &[f64]| ByMuscle::new(muscles, values.iter().copied());
        let squares: f64 = frame.hidden.iter().map(|(_, d)| d * d).sum();
        let mut all = faults.get(t).cloned().unwrap_or_default();
        all.extend(frame.faults.iter().cloned());
        FrameRecord {
            recording: seen.name.clone(),
            time_s: frame.time_s,
            status: frame.status,
            tensions_n: by(&frame.tensions_n),
            low: by(&frame.low_n),
            high: by(&frame.high_n),
            bones: ByMuscle(freed.iter().map(|&n| n.to_owned()).zip(frame.bones.iter().map(bone)).collect()),
            rms_mm: frame.rms_m.map(|r| r * 1e3),
            held_out_rms_mm: (!frame.hidden.is_empty())
                .then(|| (squares / frame.hidden.len() as f64).sqrt() * 1e3),
            resolved: frame.resolved,
            faults: all,
        }
    };
    tracked.iter().enumerate().map(record).collect()
}

/// The name of a status in outputs.
pub fn status_name(status: FrameStatus) -> String {
    serde_json::to_value(status).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

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
                    known.to_string(),
                    status_name(f.status),
                    f.resolved.to_string(),
                    f.rms_mm.map_or_else(String::new, |r| r.to_string()),
                ]);
            }
        }
        Table { columns: columns.map(str::to_owned).to_vec(), rows }
    }

    /// One recording for OpenSim: tensions, the ends of their intervals, displacements of free bones, and the
    /// number of resolved directions over time.
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
            freed.into_iter().flatten().flat_map(|(bone, _)| axes(bone)).collect(),
            vec!["resolved".to_owned()],
        ];
        let row = |f: &FrameRecord| {
            let values =
                [&f.tensions_n, &f.low, &f.high].into_iter().flat_map(|b| b.0.iter().map(|(_, v)| *v));
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
