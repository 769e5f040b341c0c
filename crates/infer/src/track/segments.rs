//! Mean tensions over the trusted frames of labels less those over the recording, and statistics of all frames.
//!
//! Only tiers with several repeated labels count, as a label that is the same in every recording distinguishes nothing.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Serialize;

use super::draws::{BATCH, FrameDraws, Means};
use super::frame::Frame;
use super::interval::Interval;
use super::ornstein_uhlenbeck::Softplus;
use super::results::{LabelCourse, LabelDraws, LabelMean, LabelPoint, Tracked, TrackedRecording};
use tongue_core::statistics::{TWO_SIDED_95, grouped};
use tongue_input::measured::recording::Label;

/// Number of the frames of a label whose draws are kept, less one.
const PARTS: usize = 10;

/// The labels of a recording while its frames are taken one after another.
pub(super) struct Segments<'a> {
    frames: &'a [Frame],
    /// Last frame of every label; `None` for labels without frames.
    last: Vec<Option<usize>>,
    /// Labels that have begun, with the number of their frames so far and the sums over these.
    open: BTreeMap<usize, (usize, Means)>,
    done: Vec<LabelMean>,
    /// Draws of the labels that are compared.
    draws: BTreeMap<usize, LabelDraws>,
    kept_draws: usize,
    /// For frames whose draws are kept, the labels and the places in these, 0 to 1.
    parts: BTreeMap<usize, Vec<(usize, f64)>>,
    courses: BTreeMap<usize, Vec<LabelPoint>>,
}

impl<'a> Segments<'a> {
    /// `kept_draws` is the number of draws that are kept over labels.
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

    /// Takes the draws of a window of frames and the results of all frames so far; `means` are those over the recording.
    pub fn take(&mut self, window: Range<usize>, found: &[Tracked], draws: &[FrameDraws], means: &Means) {
        let from = window.start;
        for t in window {
            let frame = &self.frames[t];
            for (label, part) in
                self.parts.remove(&t).into_iter().flatten().filter(|_| found[t].status.is_trusted())
            {
                let drawn = &draws[t - from].tensions;
                // The second half of every batch mirrors the first.
                let first = (0..drawn.first().map_or(0, Vec::len)).filter(|draw| draw % BATCH < BATCH / 2);
                let kept: Vec<usize> = first.take(self.kept_draws).collect();
                let course = |(all, means): (&Vec<f32>, &Vec<f64>)| {
                    kept.iter().map(|&d| (f64::from(all[d]) - means[d]) as f32).collect()
                };
                let tensions = drawn.iter().map(|all| kept.iter().map(|&d| all[d]).collect()).collect();
                let courses = drawn.iter().zip(&means.0).map(course).collect();
                let point = LabelPoint { time_s: frame.time_s, part, tensions, courses };
                self.courses.entry(label).or_default().push(point);
            }
            for &label in frame.labels.iter().filter(|_| found[t].status.is_trusted()) {
                let (frames, sums) = self.open.entry(label).or_insert_with(|| (0, Means::zeros(means)));
                *frames += 1;
                sums.add(&draws[t - from].tensions);
            }
            for &label in frame.labels.iter().filter(|label| self.last[**label] == Some(t)) {
                let Some((frames, mut sums)) = self.open.remove(&label) else { continue };
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

    pub fn finish(mut self) -> TrackedRecording {
        self.done.sort_by_key(|segment| segment.label);
        let label_courses = self.courses.into_iter().map(|(label, points)| LabelCourse { label, points });
        TrackedRecording {
            segments: self.done,
            compared: self.draws.into_values().collect(),
            label_courses: label_courses.collect(),
            ..TrackedRecording::default()
        }
    }
}

/// A tier with no more labels than this is preferred to one with more.
const FEW: usize = 12;

/// The repetitions of each label of a tier: the number of the recording, and the label.
pub(super) type Groups<'a> = Vec<Vec<(usize, &'a Label)>>;

/// Tiers with at least two labels that repeat, in order of preference: few labels before many, then most repetitions. A repetition has at
/// least `fewest` frames. Recordings are given by the times of their frames, s, and their labels.
pub(super) fn distinguishing<'a>(recordings: &[(Vec<f64>, &'a [Label])], fewest: usize) -> Vec<Groups<'a>> {
    let all = recordings.iter().enumerate().flat_map(|(number, (times, labels))| {
        let long = labels.iter().filter(move |l| times.iter().filter(|t| l.holds(**t)).count() >= fewest);
        long.map(move |label| (number, label))
    });
    let tiers = grouped(all, |(_, label)| &label.tier).into_iter();
    let repeating = tiers.map(|tier| {
        let mut groups = grouped(tier, |(_, label)| &label.name);
        groups.retain(|repetitions| repetitions.len() > 1);
        groups
    });
    let mut tiers: Vec<Groups<'a>> = repeating.filter(|groups| groups.len() > 1).collect();
    tiers.sort_by_key(|groups| {
        (groups.len() > FEW, std::cmp::Reverse(groups.iter().map(Vec::len).sum::<usize>()))
    });
    tiers
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CourseSummary {
    pub muscle: String,
    /// Whether the course varies more than it is uncertain, and intervals of single frames are narrow enough.
    pub known: bool,
    /// Variance of the course over the frames as part of that and the mean variance of its draws.
    pub reliability: f64,
    /// Mean width of the 95 % intervals of its course, N per metre of thickness.
    pub course_width_n: f64,
    /// Mean width of the 95 % intervals of its level, N per metre of thickness.
    pub level_width_n: f64,
    /// `level_width_n` as a part of the prior's: 1 where only the prior determines the level, 0 where only the data do.
    pub unknown_part: f64,
}

/// Reliability above which a course may be known.
const RELIABLE: f64 = 0.5;
/// Largest mean width of the intervals of a known course, as a part of the prior's scale: 24 N/m at 20 N/m.
pub const NARROW: f64 = 1.2;

pub fn course_summaries(names: &[String], frames: &[&Tracked], link: &Softplus) -> Vec<CourseSummary> {
    let each: Vec<_> = frames.iter().map(|f| (f.tensions.as_slice(), f.courses.as_slice())).collect();
    summaries(names, &each, link)
}

/// [`course_summaries`] from tensions and courses of all muscles.
pub(super) fn summaries(
    names: &[String],
    all: &[(&[Interval], &[Interval])],
    link: &Softplus,
) -> Vec<CourseSummary> {
    let count = all.len().max(1) as f64;
    let prior_width = link.prior_quantile(TWO_SIDED_95) - link.prior_quantile(-TWO_SIDED_95);
    Vec::from_iter(names.iter().enumerate().map(|(i, name)| {
        let mean = |of: &dyn Fn(&Interval) -> f64| all.iter().map(|(_, c)| of(&c[i])).sum::<f64>() / count;
        let middle = mean(&|c| c.median);
        let varies = mean(&|c| (c.median - middle).powi(2));
        let unsure = mean(&|c| c.variance);
        let reliability = if varies > 0.0 { varies / (varies + unsure) } else { 0.0 };
        let course_width_n = mean(&Interval::width);
        let level_width_n = all.iter().map(|(l, _)| l[i].width()).sum::<f64>() / count;
        CourseSummary {
            muscle: name.clone(),
            known: reliability > RELIABLE && course_width_n < NARROW * link.scale_n(),
            reliability,
            course_width_n,
            level_width_n,
            unknown_part: level_width_n / prior_width,
        }
    }))
}

/// Largest part of untrusted frames in a trusted recording.
pub const MOST_UNTRUSTED: f64 = 0.05;

pub fn is_untrusted(frames: &[Tracked]) -> bool {
    let bad = frames.iter().filter(|f| !f.status.is_trusted()).count();
    bad as f64 > MOST_UNTRUSTED * frames.len() as f64
}
