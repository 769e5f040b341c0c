//! Results of tracking as records, for JSON, tables and pages.

#[cfg(feature = "files")]
mod figure;
mod formants;
#[cfg(feature = "files")]
mod page;
mod premises;
mod tables;

pub use formants::{FormantsRecord, FormantsTable};
#[cfg(feature = "files")]
pub use page::{TrackPage, fixed};
pub use premises::{PlacementRecord, PriorRecord, RepeatsRecord};
pub use tables::{SegmentsTable, TrackTable, contrasts};

use serde::{Serialize, Serializer};

use super::ByMuscle;
use tongue_core::body::Body;
use tongue_core::geometry::Point;
use tongue_infer::track::{
    Comparison, CourseSummary, Displacement, Foretold, FrameStatus, HeldOut, LabelDraws, LabelMean, Ranged,
    Tracked, TrackedFormant, TrackedRecording,
};
use tongue_input::measured::recording::{AlignedRecording, Fault, Label};

#[derive(Debug, Clone, PartialEq, Serialize)]
struct FrameRecord<'a> {
    recording: &'a str,
    time_s: f64,
    status: FrameStatus,
    tensions_n: ByMuscle<f64>,
    /// Ends of the 95 % intervals; the same as `level_low` and `level_high`.
    low: ByMuscle<f64>,
    high: ByMuscle<f64>,
    level_low: ByMuscle<f64>,
    level_high: ByMuscle<f64>,
    /// Tensions less their mean over the recording: medians and ends of their 95 % intervals.
    course: ByMuscle<f64>,
    course_low: ByMuscle<f64>,
    course_high: ByMuscle<f64>,
    /// Displacements of the bones that were freed because they were not seen.
    #[serde(skip_serializing_if = "ByMuscle::is_empty")]
    bones: ByMuscle<BoneRecord>,
    /// Root mean square distance of the fitted points, mm and in their standard deviations; null if there are none.
    rms_mm: Option<f64>,
    rms_sd: Option<f64>,
    /// The same of the held-out points from where they were predicted; null without any.
    held_out_rms_mm: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    held_out: Vec<HiddenRecord<'a>>,
    /// Directions of the tensions whose standard deviation is below a half of the prior's.
    resolved: usize,
    /// Whether the shape is reached in another way than by pulling all muscles harder together: from the posture before or after it, or
    /// one muscle before the others.
    other_way: bool,
    /// Of a shape that no way was found to: the root mean square distance from the nearest shape that is reached, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    reached_rms_mm: Option<f64>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    formants: &'a [TrackedFormant],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    faults: &'a [Fault],
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct HiddenRecord<'a> {
    point: &'a str,
    /// How far across the contour it was seen from where it was predicted, and the 95 % interval of that distance, mm.
    missed_mm: f64,
    interval_mm: [f64; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct BoneRecord {
    shift_mm: [f64; 2],
    /// The 95 % interval of each.
    interval_mm: [[f64; 2]; 2],
}

/// Means over a labelled stretch of a recording, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct SegmentRecord<'a> {
    recording: &'a str,
    /// The label: its tier, what it says, and when it holds.
    #[serde(flatten)]
    label: &'a Label,
    frames: usize,
    /// Courses, N per metre of thickness: medians and ends of their 95 % intervals.
    course: ByMuscle<f64>,
    low: ByMuscle<f64>,
    high: ByMuscle<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct RecordingResult {
    pub name: String,
    pub labels: Vec<Label>,
    pub freed: Vec<String>,
    pub rest: Vec<Point>,
    /// The measured points of the frames that are shown, m: contour, sensors and bones.
    pub marks: Vec<Vec<Option<Point>>>,
    /// Whether its face looks to the right in the file.
    pub mirrored: bool,
    /// Its frames, with the faults that were found before the fit and in it.
    pub frames: Vec<Tracked>,
    pub segments: Vec<LabelMean>,
    /// Draws of the means over labels that are compared.
    pub compared: Vec<LabelDraws>,
}

impl RecordingResult {
    /// Of a recording that was tracked; `faults` of its frames were found before, `freed` are the names of the free bones.
    pub fn new<'b>(
        seen: &AlignedRecording,
        faults: &[Vec<Fault>],
        freed: impl Iterator<Item = &'b str>,
        TrackedRecording { rest, mut frames, segments, compared }: TrackedRecording,
    ) -> Self {
        for (frame, faults) in frames.iter_mut().zip(faults) {
            frame.faults.splice(0..0, faults.iter().cloned());
        }
        let shown = seen.frames.iter().zip(&frames).filter(|(_, f)| !f.positions.is_empty());
        let marks = shown.map(|(seen, _)| {
            let points = seen.contour.iter().chain(&seen.sensors).map(|m| m.map(|m| m.at));
            points.chain(seen.bones.iter().copied()).collect()
        });
        Self {
            name: seen.name.clone(),
            labels: seen.labels.clone(),
            freed: freed.map(str::to_owned).collect(),
            rest,
            marks: marks.collect(),
            mirrored: seen.mirrored,
            frames,
            segments,
            compared,
        }
    }
}

/// The frames of all recordings. A frame is made into a record when it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackResults {
    /// The body of all recordings, which have rest shapes of their own.
    pub body: Body<2>,
    /// Names of the contracting muscles, and their numbers in the body.
    pub muscles: Vec<String>,
    pub contracting: Vec<usize>,
    pub palate: Vec<Point>,
    pub recordings: Vec<RecordingResult>,
}

impl TrackResults {
    pub fn frames(&self) -> impl Iterator<Item = (&RecordingResult, &Tracked)> {
        self.recordings.iter().flat_map(|r| r.frames.iter().map(move |frame| (r, frame)))
    }

    fn by(&self, of: &[Ranged], end: fn(&Ranged) -> f64) -> ByMuscle<f64> {
        ByMuscle::new(&self.muscles, of.iter().map(end))
    }

    fn frame<'a>(&self, recording: &'a RecordingResult, frame: &'a Tracked) -> FrameRecord<'a> {
        let bone = |d: &Displacement| BoneRecord {
            shift_mm: d.shift_m.map(|x| x * 1e3),
            interval_mm: [0, 1].map(|axis| [d.low_m[axis] * 1e3, d.high_m[axis] * 1e3]),
        };
        let squares: f64 = frame.hidden.iter().map(|h| h.missed_m * h.missed_m).sum();
        let hidden = |h: &'a Foretold| HiddenRecord {
            point: &h.point,
            missed_mm: h.missed_m * 1e3,
            interval_mm: h.interval_m.map(|x| x * 1e3),
        };
        let (levels, courses) = (&frame.levels, &frame.courses);
        FrameRecord {
            recording: &recording.name,
            time_s: frame.time_s,
            status: frame.status,
            tensions_n: self.by(levels, |l| l.median),
            low: self.by(levels, |l| l.low),
            high: self.by(levels, |l| l.high),
            level_low: self.by(levels, |l| l.low),
            level_high: self.by(levels, |l| l.high),
            course: self.by(courses, |c| c.median),
            course_low: self.by(courses, |c| c.low),
            course_high: self.by(courses, |c| c.high),
            bones: ByMuscle(recording.freed.iter().cloned().zip(frame.bones.iter().map(bone)).collect()),
            rms_mm: frame.rms_m.map(|r| r * 1e3),
            rms_sd: frame.rms_sd,
            held_out_rms_mm: (!frame.hidden.is_empty())
                .then(|| (squares / frame.hidden.len() as f64).sqrt() * 1e3),
            held_out: frame.hidden.iter().map(hidden).collect(),
            resolved: frame.resolved,
            other_way: frame.other_way,
            reached_rms_mm: frame.reached_rms_m.map(|r| r * 1e3),
            formants: &frame.formants,
            faults: &frame.faults,
        }
    }

    fn segments(&self) -> impl Iterator<Item = SegmentRecord<'_>> {
        self.recordings.iter().flat_map(move |r| {
            let record = |s: &LabelMean| {
                Some(SegmentRecord {
                    recording: &r.name,
                    label: r.labels.get(s.label)?,
                    frames: s.frames,
                    course: self.by(&s.changes, |c| c.median),
                    low: self.by(&s.changes, |c| c.low),
                    high: self.by(&s.changes, |c| c.high),
                })
            };
            r.segments.iter().filter_map(record)
        })
    }
}

impl Serialize for TrackResults {
    /// The keys `segments`, if there are any, and `frames`.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap as _;
        let mut map = serializer.serialize_map(None)?;
        if self.recordings.iter().any(|r| !r.segments.is_empty()) {
            map.serialize_entry("segments", &Each(&|| Box::new(self.segments())))?;
        }
        map.serialize_entry("frames", &Each(&|| Box::new(self.frames().map(|(r, f)| self.frame(r, f)))))?;
        map.end()
    }
}

/// A list whose items are made while it is written.
struct Each<'a, T>(&'a dyn Fn() -> Box<dyn Iterator<Item = T> + 'a>);

impl<T: Serialize> Serialize for Each<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((self.0)())
    }
}

/// The name of a status as outputs write it.
pub fn status_name(status: &impl Serialize) -> String {
    serde_json::to_value(status).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackRecord {
    pub recordings: Vec<String>,
    #[serde(rename = "tongue")]
    pub body: String,
    /// Origin of its rest shape; null for a given body.
    pub rest: Option<tongue_infer::adapt::How>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacementRecord>,
    pub prior: PriorRecord,
    pub statuses: std::collections::BTreeMap<String, usize>,
    /// Why recordings cannot be trusted: the reason for an exit status of 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untrusted: Option<String>,
    /// Median over the frames of the root mean square distance, mm.
    pub median_rms_mm: Option<f64>,
    /// Differences between labels, a comparison for each tier that distinguishes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    pub courses: Vec<CourseSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<RepeatsRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formants: Option<FormantsRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
    pub notes: Vec<String>,
    #[serde(flatten)]
    pub results: TrackResults,
    pub wall_s: f64,
}
