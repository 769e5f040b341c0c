//! Gestures: what tensions do over a tenth of a second, beside their mean over the recording.

use serde::{Deserialize, Serialize};

use super::consider::Draws;
use super::found::Ranged;

/// Length of a gesture, s. Intervals of single frames are wide; those of their means are not.
pub const GESTURE_S: f64 = 0.1;

/// Means of all tensions over a gesture, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gesture {
    /// When it begins, s.
    pub from_s: f64,
    /// When it ends: the time of its last frame, s.
    pub to_s: f64,
    /// Of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Ranged>,
}

/// The gestures of a recording whose frames were at these times; `means` are those of every muscle over it, a number a draw.
pub(super) fn gestures(times: &[f64], draws: &Draws, means: &[Vec<f64>]) -> Vec<Gesture> {
    let mut out = Vec::new();
    let mut from = 0;
    while from < times.len() {
        let inside = |t: &f64| *t < times[from] + GESTURE_S;
        let to = from + times[from..].iter().take_while(|t| inside(t)).count().max(1);
        let change = |(i, means): (usize, &Vec<f64>)| {
            let mean = |d: usize| {
                let sum: f64 = draws.tensions[from..to].iter().map(|f| f64::from(f[i][d])).sum();
                sum / (to - from) as f64
            };
            Ranged::of(means.iter().enumerate().map(|(d, whole)| mean(d) - whole))
        };
        let changes = means.iter().enumerate().map(change).collect();
        out.push(Gesture { from_s: times[from], to_s: times[to - 1], changes });
        from = to;
    }
    out
}
