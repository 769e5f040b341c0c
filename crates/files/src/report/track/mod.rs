//! Results of tracking as records, for JSON, tables and pages.

mod premises;
mod tables;

pub use premises::{PlacementRecord, PriorRecord, RepeatsRecord};

use serde::Serialize;

use super::{BoneRecord, ByMuscle, FormantsRecord};
use tongue_infer::adapt::Placement;
use tongue_infer::track::{
    Displacement, Foretold, FrameStatus, Gesture, HeldOut, LabelMean, Link, Ranged, Repeats, Tracked,
    TrackedFormant,
};
use tongue_input::measured::recording::{AlignedRecording, Fault, Label};

/// One frame of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameRecord {
    /// Name of the recording.
    pub recording: String,
    /// Time, s.
    pub time_s: f64,
    /// How it ended.
    pub status: FrameStatus,
    /// Tensions, N per metre of thickness: medians.
    pub tensions_n: ByMuscle<f64>,
    /// Lower ends of the 95 % intervals; the same as `level_low`.
    pub low: ByMuscle<f64>,
    /// Upper ends; the same as `level_high`.
    pub high: ByMuscle<f64>,
    /// Lower ends of the 95 % intervals of the tensions.
    pub level_low: ByMuscle<f64>,
    /// Upper ends.
    pub level_high: ByMuscle<f64>,
    /// Tensions less their mean over the recording: medians.
    pub course: ByMuscle<f64>,
    /// Lower ends of their 95 % intervals.
    pub course_low: ByMuscle<f64>,
    /// Upper ends.
    pub course_high: ByMuscle<f64>,
    /// Displacements of the bones that were freed because they were not seen.
    #[serde(skip_serializing_if = "ByMuscle::is_empty")]
    pub bones: ByMuscle<BoneRecord>,
    /// Root mean square distance of the fitted points, mm; null if there are none.
    pub rms_mm: Option<f64>,
    /// The same of the points that were kept back, from where they were foretold; null without any.
    pub held_out_rms_mm: Option<f64>,
    /// The points that were kept back.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held_out: Vec<HiddenRecord>,
    /// Directions of the tensions whose standard deviation is below a half of the prior's.
    pub resolved: usize,
    /// Whether the shape is reached in another way than by pulling all muscles harder together: from the posture before or after it, or
    /// one muscle before the others.
    pub other_way: bool,
    /// Of a shape that no way was found to: the root mean square distance from the nearest shape that is reached, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached_rms_mm: Option<f64>,
    /// Its lowest formants, if they are wanted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub formants: Vec<TrackedFormant>,
    /// Faults of the measured points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

/// A point that was kept back in one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HiddenRecord {
    /// The point.
    pub point: String,
    /// How far across the contour it was seen from where it was foretold, mm.
    pub missed_mm: f64,
    /// The 95 % interval of that distance, mm.
    pub interval_mm: [f64; 2],
}

/// What is known of one muscle over all frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CourseRecord {
    /// The muscle.
    pub muscle: String,
    /// Whether its course can be read: it varies by more than it is uncertain, and single frames are narrow enough.
    pub known: bool,
    /// Variance of its course over the frames as part of that and the mean variance of its draws.
    pub reliability: f64,
    /// Mean width of the 95 % intervals of its course, N per metre of thickness.
    pub course_width_n: f64,
    /// The same of its level.
    pub level_width_n: f64,
    /// That as part of the prior's width: 1 is all prior, 0 all data.
    pub unknown_part: f64,
}

/// A gesture of one recording: means over a tenth of a second less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GestureRecord {
    /// Which recording.
    pub recording: String,
    /// When it begins, s.
    pub from_s: f64,
    /// When it ends, s.
    pub to_s: f64,
    /// Changes of the tensions, N per metre of thickness: medians.
    pub change: ByMuscle<f64>,
    /// Lower ends of their 95 % intervals.
    pub low: ByMuscle<f64>,
    /// Upper ends.
    pub high: ByMuscle<f64>,
}

/// Means over a labelled stretch of a recording, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SegmentRecord {
    /// Which recording.
    pub recording: String,
    /// The label: its tier, what it says, and when it holds.
    #[serde(flatten)]
    pub label: Label,
    /// Frames in it.
    pub frames: usize,
    /// Courses, N per metre of thickness: medians.
    pub course: ByMuscle<f64>,
    /// Lower ends of their 95 % intervals.
    pub low: ByMuscle<f64>,
    /// Upper ends.
    pub high: ByMuscle<f64>,
}

/// A course is known whose reliability is above this,
const RELIABLE: f64 = 0.5;
/// and whose intervals are narrower than this part of the prior's scale on average: 24 N/m at 20 N/m.
const NARROW: f64 = 1.2;
/// Half width of the 95 % interval of a normal distribution in standard deviations.
const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// What is known of every muscle over all frames.
pub fn courses(names: &[String], frames: &[&Tracked], link: &Link) -> Vec<CourseRecord> {
    let count = frames.len().max(1) as f64;
    let prior_width = link.prior_quantile(TWO_SIDED_95) - link.prior_quantile(-TWO_SIDED_95);
    let course = |(i, name): (usize, &String)| {
        let mean = |of: &dyn Fn(&Tracked) -> f64| frames.iter().map(|f| of(f)).sum::<f64>() / count;
        let middle = mean(&|f| f.courses[i].median);
        let varies = mean(&|f| (f.courses[i].median - middle).powi(2));
        let unsure = mean(&|f| f.courses[i].variance);
        let reliability = if varies > 0.0 { varies / (varies + unsure) } else { 0.0 };
        let course_width_n = mean(&|f| f.courses[i].width());
        let level_width_n = mean(&|f| f.levels[i].width());
        CourseRecord {
            muscle: name.clone(),
            known: reliability > RELIABLE && course_width_n < NARROW * link.scale_n(),
            reliability,
            course_width_n,
            level_width_n,
            unknown_part: level_width_n / prior_width,
        }
    };
    names.iter().enumerate().map(course).collect()
}

/// A run of `tongue-fit track`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackRecord {
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// The body that was placed.
    #[serde(rename = "tongue")]
    pub body: String,
    /// Origin of its rest shape; null for a given body.
    pub rest: Option<tongue_infer::adapt::How>,
    /// Where it lies, if coils placed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacementRecord>,
    /// The prior of the intervals.
    pub prior: PriorRecord,
    /// Number of frames by status.
    pub statuses: std::collections::BTreeMap<String, usize>,
    /// Why frames cannot be trusted: the reason for an exit status of 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untrusted: Option<String>,
    /// Median over the frames of the root mean square distance, mm.
    pub median_rms_mm: Option<f64>,
    /// What is known of each muscle.
    pub courses: Vec<CourseRecord>,
    /// Gestures of all recordings.
    pub gestures: Vec<GestureRecord>,
    /// Labelled stretches of all recordings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<SegmentRecord>,
    /// How well courses repeat, where labels do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<RepeatsRecord>,
    /// What its formants are those of, if they are wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formants: Option<FormantsRecord>,
    /// The points that were kept back: this model and its opponents.
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
    seen: &AlignedRecording,
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
        let by = |of: &[Ranged], end: fn(&Ranged) -> f64| ByMuscle::new(muscles, of.iter().map(end));
        let squares: f64 = frame.hidden.iter().map(|h| h.missed_m * h.missed_m).sum();
        let hidden = |h: &Foretold| HiddenRecord {
            point: h.point.clone(),
            missed_mm: h.missed_m * 1e3,
            interval_mm: h.interval_m.map(|x| x * 1e3),
        };
        let (levels, courses) = (&frame.levels, &frame.courses);
        let mut all = faults.get(t).cloned().unwrap_or_default();
        all.extend(frame.faults.iter().cloned());
        FrameRecord {
            recording: seen.name.clone(),
            time_s: frame.time_s,
            status: frame.status,
            tensions_n: by(levels, |l| l.median),
            low: by(levels, |l| l.low),
            high: by(levels, |l| l.high),
            level_low: by(levels, |l| l.low),
            level_high: by(levels, |l| l.high),
            course: by(courses, |c| c.median),
            course_low: by(courses, |c| c.low),
            course_high: by(courses, |c| c.high),
            bones: ByMuscle(freed.iter().map(|&n| n.to_owned()).zip(frame.bones.iter().map(bone)).collect()),
            rms_mm: frame.rms_m.map(|r| r * 1e3),
            held_out_rms_mm: (!frame.hidden.is_empty())
                .then(|| (squares / frame.hidden.len() as f64).sqrt() * 1e3),
            held_out: frame.hidden.iter().map(hidden).collect(),
            resolved: frame.resolved,
            other_way: frame.other_way,
            reached_rms_mm: frame.reached_rms_m.map(|r| r * 1e3),
            formants: frame.formants.clone(),
            faults: all,
        }
    };
    tracked.iter().enumerate().map(record).collect()
}

/// The gestures of a recording as records.
pub fn gesture_records(recording: &str, gestures: &[Gesture], muscles: &[String]) -> Vec<GestureRecord> {
    let record = |g: &Gesture| {
        let by = |end: fn(&Ranged) -> f64| ByMuscle::new(muscles, g.changes.iter().map(end));
        GestureRecord {
            recording: recording.to_owned(),
            from_s: g.from_s,
            to_s: g.to_s,
            change: by(|c| c.median),
            low: by(|c| c.low),
            high: by(|c| c.high),
        }
    };
    gestures.iter().map(record).collect()
}

/// The labelled stretches of a recording as records.
fn segment_records(
    seen: &AlignedRecording,
    segments: &[LabelMean],
    muscles: &[String],
) -> Vec<SegmentRecord> {
    let record = |s: &LabelMean| {
        let by = |end: fn(&Ranged) -> f64| ByMuscle::new(muscles, s.changes.iter().map(end));
        Some(SegmentRecord {
            recording: seen.name.clone(),
            label: seen.labels.get(s.label)?.clone(),
            frames: s.frames,
            course: by(|c| c.median),
            low: by(|c| c.low),
            high: by(|c| c.high),
        })
    };
    segments.iter().filter_map(record).collect()
}

/// The name of a status as outputs write it.
pub fn status_name(status: FrameStatus) -> String {
    serde_json::to_value(status).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

impl TrackRecord {
    /// Adds where coils placed the body.
    pub fn add_placement(&mut self, placement: &Placement) {
        self.placement = Some(PlacementRecord::new(placement));
    }

    /// Adds the labelled stretches of a recording.
    pub fn add_segments(&mut self, seen: &AlignedRecording, segments: &[LabelMean], muscles: &[String]) {
        self.segments.extend(segment_records(seen, segments, muscles));
    }

    /// Adds what repeats.
    pub fn add_repeats(&mut self, repeats: Repeats, muscles: &[String]) {
        self.repeats = Some(RepeatsRecord::new(repeats, muscles));
    }
}
