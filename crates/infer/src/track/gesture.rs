//! Gestures: mean tensions over a tenth of a second, relative to their mean over the recording.

use serde::{Deserialize, Serialize};

use super::consider::Draws;
use super::ranged::Ranged;

/// Length of a gesture, s. Means over a gesture have narrower intervals than single frames.
pub const GESTURE_S: f64 = 0.1;

/// Means of all tensions over a gesture, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gesture {
    /// When it begins, s.
    pub from_s: f64,
    /// When it ends: the time of its last frame, s.
    pub to_s: f64,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Ranged>,
}

/// Means of all tensions over the interval of a label, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    /// Number of the label in its recording.
    pub label: usize,
    /// Number of frames in the interval.
    pub frames: usize,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Ranged>,
}

/// The means over these frames less those over the recording.
fn changes(frames: &[usize], draws: &Draws, means: &[Vec<f64>]) -> Vec<Ranged> {
    let change = |(i, means): (usize, &Vec<f64>)| {
        let mean = |d: usize| {
            frames.iter().map(|&t| f64::from(draws.tensions[t][i][d])).sum::<f64>() / frames.len() as f64
        };
        Ranged::of(means.iter().enumerate().map(|(d, whole)| mean(d) - whole))
    };
    means.iter().enumerate().map(change).collect()
}

/// The segments of a recording; `labels` are the numbers of the labels of every frame.
pub(super) fn segments(labels: &[&[usize]], draws: &Draws, means: &[Vec<f64>]) -> Vec<LabelMean> {
    let count = labels.iter().copied().flatten().max().map_or(0, |most| most + 1);
    let one = |label: usize| {
        let frames: Vec<usize> = (0..labels.len()).filter(|&t| labels[t].contains(&label)).collect();
        let changes = || changes(&frames, draws, means);
        (!frames.is_empty()).then(|| LabelMean { label, frames: frames.len(), changes: changes() })
    };
    (0..count).filter_map(one).collect()
}

/// The gestures of a recording with frames at these times, s; `means` are the means of every muscle over the recording, one number for
/// each draw.
pub(super) fn gestures(times: &[f64], draws: &Draws, means: &[Vec<f64>]) -> Vec<Gesture> {
    let mut out = Vec::new();
    let mut from = 0;
    while from < times.len() {
        let inside = |t: &f64| *t < times[from] + GESTURE_S;
        let to = from + times[from..].iter().take_while(|t| inside(t)).count().max(1);
        let changes = changes(&(from..to).collect::<Vec<_>>(), draws, means);
        out.push(Gesture { from_s: times[from], to_s: times[to - 1], changes });
        from = to;
    }
    out
}
