//! Mean tensions over the intervals of labels, relative to their mean over the recording.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::draws::{Draws, Means};
use super::ranged::Ranged;

/// Means of all tensions over the interval of a label, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    pub label: usize,
    pub frames: usize,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Ranged>,
}

/// The labels of a recording while its frames are taken one after another.
pub(super) struct Segments<'a> {
    labels: &'a [&'a [usize]],
    /// The last frame of every label; `None` for labels without frames.
    last: Vec<Option<usize>>,
    /// Sums over the frames of labels that have begun: number of the label, frames, sums of each muscle and draw.
    open: Vec<(usize, usize, Means)>,
    done: Vec<LabelMean>,
}

impl<'a> Segments<'a> {
    pub fn new(labels: &'a [&'a [usize]]) -> Self {
        let count = labels.iter().copied().flatten().max().map_or(0, |most| most + 1);
        let mut last = vec![None; count];
        labels.iter().enumerate().for_each(|(t, own)| own.iter().for_each(|l| last[*l] = Some(t)));
        Self { labels, last, open: Vec::new(), done: Vec::new() }
    }

    /// Takes the draws of a window of frames; `means` are those over the recording.
    pub fn take(&mut self, window: Range<usize>, draws: &Draws, means: &Means) {
        let from = window.start;
        for t in window {
            for &label in self.labels[t] {
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
            self.done.extend(ended.into_iter().map(|(label, frames, sums)| {
                let of = |(sums, means): (&Vec<f64>, &Vec<f64>)| {
                    Ranged::of(sums.iter().zip(means).map(|(sum, mean)| sum / frames as f64 - mean))
                };
                let changes = sums.0.iter().zip(&means.0).map(of).collect();
                LabelMean { label, frames, changes }
            }));
        }
    }

    /// The means of all labels, in their order.
    pub fn finish(mut self) -> Vec<LabelMean> {
        self.done.sort_by_key(|segment| segment.label);
        self.done
    }
}
