//! Results of tracking: JSON, tidy CSV, OpenSim's table.

use serde::Serialize;

use super::svg::{self, Svg};
use super::{BoneRecord, ByMuscle, FormantsRecord, StoTable, Table};
use tongue_infer::adapt::Placement;
use tongue_infer::track::{
    Displacement, Foretold, FrameStatus, Gesture, HeldOut, Link, Ranged, Repeated, Repeats, Segment,
    Settings, Tracked, TrackedFormant,
};
use tongue_input::measured::recording::{Fault, Label, Seen};

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
    /// Of a shape that no way was found to: the root mean square distance from the shape that is reached at the same tensions, mm.
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

/// How well courses repeat where labels do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatsRecord {
    /// The tier whose labels repeat.
    pub tier: String,
    /// How often each of them does.
    pub labels: std::collections::BTreeMap<String, usize>,
    /// Of every muscle.
    pub muscles: ByMuscle<Repeated>,
}

impl RepeatsRecord {
    /// Of muscles with these names.
    fn new(repeats: Repeats, muscles: &[String]) -> Self {
        let Repeats { tier, labels, muscles: all } = repeats;
        Self { tier, labels: labels.into_iter().collect(), muscles: ByMuscle::new(muscles, all) }
    }

    /// A picture of it.
    pub fn picture(&self) -> Svg {
        let row = |(muscle, r): &(String, Repeated)| (muscle.clone(), [r.icc, r.by_chance, r.chance_95]);
        let rows: Vec<_> = self.muscles.0.iter().map(row).collect();
        svg::repeats(&format!("What repeats: {}", self.said()), &rows)
    }

    /// In a sentence.
    pub fn said(&self) -> String {
        let labels: Vec<String> = self.labels.iter().map(|(name, n)| format!("{name} {n} times")).collect();
        format!("repetitions of {}: {}", self.tier, labels.join(", "))
    }

    /// A row for every muscle.
    pub fn table(&self) -> Table {
        let columns = ["muscle", "icc", "by_chance", "chance_95", "tier", "labels", "repetitions"];
        let (labels, repetitions) = (self.labels.len(), self.labels.values().sum::<usize>());
        let row = |(muscle, r): &(String, Repeated)| {
            let numbers = [r.icc, r.by_chance, r.chance_95].map(|v| v.to_string());
            let rest = [self.tier.clone(), labels.to_string(), repetitions.to_string()];
            std::iter::once(muscle.clone()).chain(numbers).chain(rest).collect()
        };
        Table { columns: columns.map(str::to_owned).to_vec(), rows: self.muscles.0.iter().map(row).collect() }
    }
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

/// The prior that the intervals stand under.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorRecord {
    /// Scale of the tensions, N per metre of thickness.
    pub scale_n: f64,
    /// Time over which tensions are remembered, s.
    pub memory_s: f64,
    /// Standard deviation of a muscle's level before the link, the same in all frames, N per metre of thickness.
    pub level_sd_n: f64,
    /// Standard deviation of its course before the link, N per metre of thickness.
    pub course_sd_n: f64,
    /// Median of a tension before anything is seen, and the ends of its 95 % interval, N per metre of thickness.
    pub median_n: f64,
    /// See `median_n`.
    pub interval_n: [f64; 2],
    /// Standard deviation of the error of a contour that lasts from frame to frame for `memory_s`, mm.
    pub slow_error_mm: f64,
    /// Standard deviation of the error of a contour that all frames share, mm.
    pub static_error_mm: f64,
    /// Seed of the draws, and how many.
    pub seed: u64,
    /// See `seed`.
    pub draws: usize,
}

impl PriorRecord {
    /// Of settings.
    pub fn new(settings: &Settings) -> Self {
        let link = &settings.link;
        Self {
            scale_n: link.scale_n(),
            memory_s: settings.memory_s,
            level_sd_n: link.level_sd_n,
            course_sd_n: link.course_sd_n,
            median_n: link.prior_quantile(0.0),
            interval_n: [-TWO_SIDED_95, TWO_SIDED_95].map(|z| link.prior_quantile(z)),
            slow_error_mm: settings.errors.slow_mm,
            static_error_mm: settings.errors.static_mm,
            seed: settings.seed,
            draws: settings.draws,
        }
    }
}

/// Where coils placed the body; numbers with the ends of their 95 % intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlacementRecord {
    /// Size of the speaker's tongue over that of the body.
    pub scale: [f64; 3],
    /// Turn of the body from the axes of the recording, from back towards up, degrees.
    pub turn_deg: [f64; 3],
    /// Where the middle of the outline at rest lies in the recording, to the back, mm.
    pub back_mm: [f64; 3],
    /// The same upwards.
    pub up_mm: [f64; 3],
    /// Distance of every coil behind the tip, along the body at rest, mm.
    pub coils_mm: std::collections::BTreeMap<String, f64>,
}

impl PlacementRecord {
    /// Of a placement.
    fn new(placement: &Placement) -> Self {
        let [back, up, turn, scale] = placement.intervals();
        let mm = |interval: [f64; 3]| interval.map(|m| 1e3 * m);
        Self {
            scale,
            turn_deg: turn.map(f64::to_degrees),
            back_mm: mm(back),
            up_mm: mm(up),
            coils_mm: placement.coils.iter().map(|(name, behind)| (name.clone(), 1e3 * behind)).collect(),
        }
    }

    /// In a sentence.
    pub fn said(&self) -> String {
        let [scale, turn] = [self.scale, self.turn_deg];
        let coils: Vec<String> = self.coils_mm.iter().map(|(name, mm)| format!("{name} {mm:.0}")).collect();
        format!(
            "placed by coils: scale {:.2} ({:.2} to {:.2}), turned by {:.0}° ({:.0} to {:.0}), known to {:.0} mm; coils behind the tip, \
             mm: {}",
            scale[0],
            scale[1],
            scale[2],
            turn[0],
            turn[1],
            turn[2],
            (0.5 * (self.back_mm[2] - self.back_mm[1])).max(0.5 * (self.up_mm[2] - self.up_mm[1])),
            coils.join(", ")
        )
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
    /// Where it lies, if coils placed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacementRecord>,
    /// The prior of the intervals.
    pub prior: PriorRecord,
    /// Number of frames by status.
    pub statuses: std::collections::BTreeMap<String, usize>,
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
fn segment_records(seen: &Seen, segments: &[Segment], muscles: &[String]) -> Vec<SegmentRecord> {
    let record = |s: &Segment| {
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
    pub fn add_segments(&mut self, seen: &Seen, segments: &[Segment], muscles: &[String]) {
        self.segments.extend(segment_records(seen, segments, muscles));
    }

    /// Adds what repeats.
    pub fn add_repeats(&mut self, repeats: Repeats, muscles: &[String]) {
        self.repeats = Some(RepeatsRecord::new(repeats, muscles));
    }

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
