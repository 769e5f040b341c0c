//! Results of tracking as records, for JSON, tables and pages.

mod assumptions;
#[cfg(feature = "files")]
mod figure;
#[cfg(feature = "files")]
mod page;
pub(super) mod tables;
mod text_grid;

pub use assumptions::{
    FormantsRecord, MISSED_BY_PLANE, courses_columns, formants_csv, held_out_columns, limit_of_plane,
    placement_sentence, prior_interval_n, repeats_columns, repetitions_sentence,
};
#[cfg(feature = "files")]
pub use page::track_page;
pub use tables::{contrasts, draws_csv, over_speakers, segments_csv, track_csv};

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::{ByMuscle, joined};
use crate::run::ScreenedRecording;
use tongue_core::body::Body;
use tongue_core::geometry::Point;
use tongue_infer::adapt::Placement;
use tongue_infer::track::{
    Comparison, CourseSummary, HeldOut, Interval, LabelMean, Repeatability, TrackSettings, Tracked,
    TrackedRecording,
};
use tongue_input::measured::recording::{AlignedRecording, Label, Waveform};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordingResult {
    pub seen: AlignedRecording,
    /// Names of the bones whose displacement was an unknown.
    pub freed: Vec<String>,
    /// The frames have the faults found before the fit and in it.
    pub tracked: TrackedRecording,
    /// The sound that was recorded with it, if it has a file.
    pub sound: Option<Waveform>,
}

impl RecordingResult {
    pub fn new(recording: ScreenedRecording, freed: Vec<String>, mut tracked: TrackedRecording) -> Self {
        let ScreenedRecording { seen, sound, faults, .. } = recording;
        for (frame, faults) in tracked.frames.iter_mut().zip(faults) {
            frame.faults.splice(0..0, faults);
        }
        Self { seen, freed, tracked, sound }
    }

    /// Contour, sensors and bones as they were measured in the frames that are shown, m.
    #[cfg(feature = "files")]
    fn marks(&self) -> impl Iterator<Item = Vec<Option<Point>>> {
        let frames = self.seen.frames.iter().zip(&self.tracked.frames);
        frames.filter(|(_, tracked)| !tracked.positions.is_empty()).map(|(seen, _)| {
            seen.points().map(|mark| Some(mark?.at)).chain(seen.bones.iter().copied()).collect()
        })
    }

    /// The labels that figures show: all but those of the prompt, which belongs to a whole recording; none if there are more than 60.
    pub(super) fn shown_labels(&self) -> Vec<&Label> {
        const MOST: usize = 60;
        let [first, last] =
            [self.tracked.frames.first(), self.tracked.frames.last()].map(|f| f.map_or(0.0, |f| f.time_s));
        let labels = self.seen.labels.iter();
        let shown = labels.filter(|l| l.tier != "prompt" && l.to_s >= first && l.from_s <= last);
        let shown: Vec<&Label> = shown.collect();
        if shown.len() > MOST { Vec::new() } else { shown }
    }
}

/// The frames of all recordings. A frame is made into a record when it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackResults {
    /// The body of all recordings; each recording has its own shape at rest.
    pub body: Body<2>,
    /// Names of the contracting muscles; `contracting` has their indices in the body.
    pub muscles: Vec<String>,
    pub contracting: Vec<usize>,
    pub palate: Vec<Point>,
    pub recordings: Vec<RecordingResult>,
}

impl TrackResults {
    pub fn frames(&self) -> impl Iterator<Item = (&RecordingResult, &Tracked)> {
        self.recordings.iter().flat_map(|r| r.tracked.frames.iter().map(move |frame| (r, frame)))
    }

    /// Means over labelled time spans, less those over the whole recording.
    fn segments(&self) -> impl Iterator<Item = (&RecordingResult, &Label, &LabelMean)> {
        self.recordings.iter().flat_map(|one| {
            one.tracked.segments.iter().filter_map(move |s| Some((one, one.seen.labels.get(s.label)?, s)))
        })
    }

    fn by_muscle(&self, of: &[Interval], end: fn(&Interval) -> f64) -> ByMuscle<f64> {
        ByMuscle::new(&self.muscles, of.iter().map(end))
    }

    /// A frame as JSON, medians of the draws with 95 % intervals: tensions (`low` and `high` are the same as `level_low` and `level_high`),
    /// courses (tensions less their mean over the recording in the same draw), distances of the fitted points (null if there are none), and
    /// of held-out points the distance across the contour from the predicted place to the measured one (its interval is null where too few
    /// points judge it). Displacements of bones that were not seen have the range of 95 % of their draws.
    fn frame(&self, one: &RecordingResult, frame: &Tracked) -> Value {
        let [levels, courses] =
            [&frame.tensions, &frame.courses].map(|of| ENDS.map(|end| self.by_muscle(of, end)));
        let bones = one.freed.iter().cloned().zip(frame.bones.iter().map(|d| {
            let interval_mm = [0, 1].map(|axis| [d.low_m[axis], d.high_m[axis]].map(mm));
            json!({ "shift_mm": d.shift_m.map(mm), "interval_mm": interval_mm })
        }));
        let hidden = &frame.hidden;
        let squares: f64 = hidden.iter().map(|h| h.missed_m * h.missed_m).sum();
        let missed = (!hidden.is_empty()).then(|| mm((squares / hidden.len() as f64).sqrt()));
        let mut record = json!({
            "recording": one.seen.name,
            "time_s": frame.time_s,
            "status": frame.status,
            "tensions_n": levels[0],
            "low": levels[1],
            "high": levels[2],
            "level_low": levels[1],
            "level_high": levels[2],
            "course": courses[0],
            "course_low": courses[1],
            "course_high": courses[2],
            "bones": ByMuscle(bones.collect()),
            "rms_mm": frame.rms_m.map(mm),
            "rms_sd": frame.rms_sd,
            "held_out_rms_mm": missed,
            "held_out": hidden.iter().map(|h| {
            let interval_mm = h.interval_m.map(|ends| ends.map(mm));
            json!({ "point": h.point, "missed_mm": mm(h.missed_m), "interval_mm": interval_mm })
        }).collect::<Vec<_>>(),
            "resolved": frame.resolved,
            "other_way": frame.other_way,
            "reached_rms_mm": frame.reached_rms_m.map(mm),
            "formants": frame.formants,
            "faults": frame.faults,
        });
        if let Some(fields) = record.as_object_mut() {
            let where_there_is_one = ["bones", "held_out", "reached_rms_mm", "formants", "faults"];
            let nothing = [json!({}), json!([]), Value::Null];
            fields.retain(|name, value| {
                !(where_there_is_one.contains(&name.as_str()) && nothing.contains(value))
            });
        }
        record
    }

    /// A labelled time span as JSON: medians and ends of the 95 % intervals of courses, N per metre of thickness.
    fn segment(&self, (one, label, mean): (&RecordingResult, &Label, &LabelMean)) -> Value {
        json!({
            "recording": one.seen.name,
            "tier": label.tier,
            "label": label.name,
            "from_s": label.from_s,
            "to_s": label.to_s,
            "frames": mean.frames,
            "course": self.by_muscle(&mean.changes, |c| c.median),
            "low": self.by_muscle(&mean.changes, |c| c.low),
            "high": self.by_muscle(&mean.changes, |c| c.high),
        })
    }
}

/// The median of an interval, and its ends.
const ENDS: [fn(&Interval) -> f64; 3] = [|r| r.median, |r| r.low, |r| r.high];

fn mm(metres: f64) -> f64 {
    metres * 1e3
}

impl Serialize for TrackResults {
    /// The keys are `segments`, if there are any, and `frames`.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap as _;
        let mut map = serializer.serialize_map(None)?;
        if self.recordings.iter().any(|r| !r.tracked.segments.is_empty()) {
            map.serialize_entry("segments", &Each(&|| Box::new(self.segments().map(|s| self.segment(s)))))?;
        }
        map.serialize_entry("frames", &Each(&|| Box::new(self.frames().map(|(r, f)| self.frame(r, f)))))?;
        map.end()
    }
}

/// A list whose items are made while it is written.
struct Each<'a>(&'a dyn Fn() -> Box<dyn Iterator<Item = Value> + 'a>);

impl Serialize for Each<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((self.0)())
    }
}

pub fn status_name(status: &impl Serialize) -> String {
    serde_json::to_value(status).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

pub fn status_in_words(status: &impl Serialize) -> String {
    status_name(status).replace('_', " ")
}

pub fn tally<T: Ord>(items: impl IntoIterator<Item = T>) -> BTreeMap<T, usize> {
    let mut counts = BTreeMap::new();
    items.into_iter().for_each(|item| *counts.entry(item).or_default() += 1);
    counts
}

/// Text such as `12 converged, 1 target not met`.
pub fn status_counts(statuses: &BTreeMap<String, usize>) -> String {
    joined(statuses.iter().map(|(status, n)| format!("{n} {}", status.replace('_', " "))), ", ")
}

#[derive(Debug, Clone, Serialize)]
pub struct TrackRecord {
    pub recordings: Vec<String>,
    #[serde(rename = "tongue")]
    pub body: String,
    /// Origin of the shape at rest; null for a body that is used as it was given.
    pub rest: Option<tongue_infer::adapt::RestShapeMethod>,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "assumptions::placement")]
    pub placement: Option<Placement>,
    #[serde(rename = "prior", serialize_with = "assumptions::prior")]
    pub settings: TrackSettings,
    pub statuses: BTreeMap<String, usize>,
    /// Why recordings cannot be trusted; then the exit status is 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untrusted: Option<String>,
    /// Median over the frames of the root mean square distance.
    pub median_rms_mm: Option<f64>,
    /// Differences between labels, for each tier in which several labels repeat.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    pub courses: Vec<CourseSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeatability>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formants: Option<FormantsRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
    pub notes: Vec<String>,
    #[serde(flatten)]
    pub results: TrackResults,
    pub wall_s: f64,
}
