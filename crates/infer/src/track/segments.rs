//! Mean tensions over the frames of labels that can be trusted, relative to their mean over the recording.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::compare::LabelDraws;
use super::draws::{Draws, Means};
use super::frame::Frame;
use super::interval::Interval;
use super::results::Tracked;

/// Means of all tensions over the frames of a label, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    pub label: usize,
    pub frames: usize,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Interval>,
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
}

impl<'a> Segments<'a> {
    pub fn new(frames: &'a [Frame]) -> Self {
        let count = frames.iter().flat_map(|f| &f.labels).max().map_or(0, |most| most + 1);
        let mut last = vec![None; count];
        frames.iter().enumerate().for_each(|(t, f)| f.labels.iter().for_each(|l| last[*l] = Some(t)));
        Self { frames, last, open: Vec::new(), done: Vec::new(), draws: BTreeMap::new() }
    }

    /// Takes the draws of a window of frames, and what was found of all frames so far; `means` are those over the recording.
    pub fn take(&mut self, window: Range<usize>, found: &[Tracked], draws: &Draws, means: &Means) {
        let from = window.start;
        for t in window {
            let frame = &self.frames[t];
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

    /// The means of all labels, in their order, and the draws of those that are compared.
    pub fn finish(mut self) -> (Vec<LabelMean>, Vec<LabelDraws>) {
        self.done.sort_by_key(|segment| segment.label);
        (self.done, self.draws.into_values().collect())
    }
}
