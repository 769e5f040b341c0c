//! Changes of the recordings of synthetic speakers before they are tracked.

use tongue_core::geometry::NaturalSpline;
use tongue_fit::geometry::Point;
use tongue_input::measured::recording::{AlignedFrame, Label, Mark};

use crate::speakers::Recorded;

/// Redraws the contours by splines through their points; `every` sixteenths of a span lie between the new points.
pub fn redrawn(speaker: &mut Recorded, every: usize) {
    for recording in &mut speaker.recordings {
        for frame in &mut recording.frames {
            let sd = frame.contour[0].unwrap().sd;
            let points: Vec<Point> = frame.contour.iter().map(|mark| mark.unwrap().at).collect();
            let curve = NaturalSpline::through(&points).unwrap();
            frame.contour =
                curve.polygon.iter().step_by(every).map(|at| Some(Mark { at: *at, sd })).collect();
        }
        recording.contour = (0..recording.frames[0].contour.len()).map(|i| format!("tongue_{i}")).collect();
    }
}

/// Gives each frame twice, half a period apart.
pub fn doubled(speaker: &mut Recorded) {
    for (recording, truth) in speaker.recordings.iter_mut().zip(&mut speaker.truth) {
        let half = 0.5 * (recording.frames[1].time_s - recording.frames[0].time_s);
        let twice = |frame: &AlignedFrame| {
            [frame.clone(), AlignedFrame { time_s: frame.time_s + half, ..frame.clone() }]
        };
        recording.frames = recording.frames.iter().flat_map(twice).collect();
        *truth = truth.iter().flat_map(|t| [t.clone(), t.clone()]).collect();
    }
}

/// Labels each tenth of a second.
pub fn labelled(speaker: &mut Recorded) {
    for recording in &mut speaker.recordings {
        recording.labels = Vec::from_iter((0..4).map(|number| {
            let from_s = 0.1 * f64::from(number);
            Label { tier: "part".to_owned(), name: number.to_string(), from_s, to_s: from_s + 0.099 }
        }));
    }
}
