//! Mean tensions over the frames of labels that can be trusted, relative to their mean over the recording.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::compare::LabelDraws;
use super::consider_parameters::BATCH;
use super::draws::{Draws, Means};
use super::frame::Frame;
use super::interval::Interval;
use super::results::{Tracked, TrackedRecording};

/// Means of all tensions over the frames of a label, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    pub label: usize,
    pub frames: usize,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Interval>,
}

/// Number of the frames of a label whose draws are kept, less one.
const PARTS: usize = 10;

/// Draws of the tensions over one label, from its first frame to its last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelCourse {
    /// Its number among the labels of the recording.
    pub label: usize,
    /// At most eleven of its frames, evenly spread over all of them; without those that cannot be trusted.
    pub points: Vec<LabelPoint>,
}

/// Draws of a frame of a label, N per metre of thickness, for each muscle in the order of the draws of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelPoint {
    pub time_s: f64,
    /// Where in the label it lies: 0 at its first frame, 1 at its last.
    pub part: f64,
    pub tensions: Vec<Vec<f32>>,
    /// The tensions less their mean over the recording in the same draw.
    pub courses: Vec<Vec<f32>>,
}

/// The labels of a recording while its frames are taken one after another.
pub(super) struct Segments<'a> {
    frames: &'a [Frame],
    /// The last frame of every label; `None` for labels without frames.
    last: Vec<Option<usize>>,
    /// Sums over the frames of labels that have begun: number of the label, frames, sums of each muscle and draw.
    open: Vec<(usize, usize, Means)>,
    done: Vec<LabelMean>,
    /// Draws of the labels that are compared.
    draws: BTreeMap<usize, LabelDraws>,
    kept_draws: usize,
    /// For frames whose draws are kept, the labels and the parts of these.
    parts: BTreeMap<usize, Vec<(usize, f64)>>,
    courses: BTreeMap<usize, Vec<LabelPoint>>,
}

impl<'a> Segments<'a> {
    /// Of a recording whose first draws, as many as `kept_draws`, are kept over its labels.
    pub fn new(frames: &'a [Frame], kept_draws: usize) -> Self {
        let count = frames.iter().flat_map(|f| &f.labels).max().map_or(0, |most| most + 1);
        let mut of_label: Vec<Vec<usize>> = vec![Vec::new(); count];
        frames.iter().enumerate().for_each(|(t, f)| f.labels.iter().for_each(|l| of_label[*l].push(t)));
        let last = of_label.iter().map(|own| own.last().copied()).collect();
        let mut parts: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
        for (label, own) in of_label.iter().enumerate().filter(|(_, own)| kept_draws > 0 && !own.is_empty()) {
            let steps = own.len() - 1;
            let (from_s, span_s) = (frames[own[0]].time_s, frames[own[steps]].time_s - frames[own[0]].time_s);
            let mut chosen: Vec<usize> = (0..=PARTS).map(|p| own[(p * steps + PARTS / 2) / PARTS]).collect();
            chosen.dedup();
            for t in chosen {
                let part = if span_s > 0.0 { (frames[t].time_s - from_s) / span_s } else { 0.0 };
                parts.entry(t).or_default().push((label, part));
            }
        }
        let (open, done, draws, courses) = Default::default();
        Self { frames, last, open, done, draws, kept_draws, parts, courses }
    }

    /// Takes the draws of a window of frames, and what was found of all frames so far; `means` are those over the recording.
    pub fn take(&mut self, window: Range<usize>, found: &[Tracked], draws: &Draws, means: &Means) {
        let from = window.start;
        for t in window {
            let frame = &self.frames[t];
            for (label, part) in
                self.parts.remove(&t).into_iter().flatten().filter(|_| found[t].status.is_trusted())
            {
                // The second half of every batch mirrors the first.
                let numbers =
                    |count: usize| (0..count).filter(|draw| draw % BATCH < BATCH / 2).take(self.kept_draws);
                let own = |all: &Vec<f32>| numbers(all.len()).map(|d| all[d]).collect();
                let less = |(all, means): (&Vec<f32>, &Vec<f64>)| {
                    numbers(all.len()).map(|d| (f64::from(all[d]) - means[d]) as f32).collect()
                };
                let tensions = draws.tensions[t - from].iter().map(own).collect();
                let courses = draws.tensions[t - from].iter().zip(&means.0).map(less).collect();
                let point = LabelPoint { time_s: frame.time_s, part, tensions, courses };
                self.courses.entry(label).or_default().push(point);
            }
            for &label in frame.labels.iter().filter(|_| found[t].status.is_trusted()) {
                if !self.open.iter().any(|(l, ..)| *l == label) {
                    self.open.push((label, 0, Means::zeros(means)));
                }
                for (_, frames, sums) in self.open.iter_mut().filter(|(l, ..)| *l == label) {
                    *frames += 1;
                    sums.add(&draws.tensions[t - from]);
                }
            }
            let (ended, open) = self.open.drain(..).partition(|(l, ..)| self.last[*l] == Some(t));
            self.open = open;
            let ended: Vec<(usize, usize, Means)> = ended;
            for (label, frames, mut sums) in ended {
                sums.0.iter_mut().flatten().for_each(|sum| *sum /= frames as f64);
                let of = |(own, means): (&Vec<f64>, &Vec<f64>)| {
                    Interval::of(own.iter().zip(means).map(|(own, mean)| own - mean))
                };
                let changes = sums.0.iter().zip(&means.0).map(of).collect();
                self.done.push(LabelMean { label, frames, changes });
                if let Some(&(_, compared)) = frame.compared.iter().find(|(l, _)| *l == label) {
                    let one = LabelDraws::of(compared, frames, &sums);
                    self.draws.entry(compared).and_modify(|all| all.add(&one)).or_insert(one);
                }
            }
        }
    }

    /// The means of all labels, in their order, and the draws of those that are compared or kept.
    pub fn finish(mut self) -> TrackedRecording {
        self.done.sort_by_key(|segment| segment.label);
        let course = |(label, points)| LabelCourse { label, points };
        TrackedRecording {
            segments: self.done,
            compared: self.draws.into_values().collect(),
            label_courses: self.courses.into_iter().map(course).collect(),
            ..TrackedRecording::default()
        }
    }
}
