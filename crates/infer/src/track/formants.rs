//! Formants of a tract around the tracked tongue.
//!
//! A formant has its exact value at the most probable shape of a frame, and the standard deviation of its linear response to draws of
//! tensions, displaced bones and shape at rest. Errors of the walls ([`TRACT_SD`](crate::acoustics::TRACT_SD)) are not included.

use std::sync::Arc;

use nalgebra::{DMatrix, stack};
use serde::{Deserialize, Serialize};

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::observe::{Observable, Observation};
use tongue_core::statistics::mean_and_variance;

use super::frame::{Frame, FrameObservation};
use super::settings::Followed;
use super::smoother::{SmoothedRecording, Smoother, in_chunks};
use crate::acoustics::{Articulation, FormantFrequency, VocalTract};
use crate::error_model::Along;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrackedFormant {
    pub hz: f64,
    /// Standard deviation over the draws, Hz, with walls that count as known.
    pub sd_hz: f64,
}

/// Adds the lowest formants of a tract to the results of frames. Jaw and larynx follow the bones of each frame; the opening of the lips is
/// that of `posture`.
pub fn add_formants(
    frames: &mut [Frame],
    airway: &Arc<VocalTract>,
    followed: &[Followed],
    posture: &Articulation,
    count: usize,
) {
    let joint = Point::from(airway.tract.jaw.joint_mm) * 1e-3;
    for frame in frames {
        let mut posture = *posture;
        for (bone, shift) in followed.iter().zip(&frame.shifts) {
            match bone.name.as_str() {
                MANDIBLE => posture.jaw_deg += opened_deg(bone.mark - joint, *shift),
                HYOID => (0..2).for_each(|axis| posture.hyoid_mm[axis] += 1e3 * shift[axis]),
                _ => {}
            }
        }
        frame.formants =
            (0..count).map(|number| FormantFrequency::new(Arc::clone(airway), posture, number)).collect();
    }
}

/// Angle of a jaw, degrees: the rotation nearest to the shift of its mark, whose place at rest is given relative to the joint.
pub fn opened_deg(mark: Point, shift: Point) -> f64 {
    let turned = Point::new(-mark.y, mark.x);
    (turned.dot(&shift) / mark.norm_squared()).to_degrees()
}

/// Derivatives of each frame's formants (Hz) by its unknowns, then by the parameters of the shape at rest. `None` without an equilibrium,
/// with a closed tract, or if no frame has formants.
pub(super) fn jacobians(smoother: &Smoother<'_>, recording: &SmoothedRecording) -> Vec<Option<DMatrix<f64>>> {
    if recording.frames.iter().all(|f| f.formants.is_empty()) {
        return vec![None; recording.frames.len()];
    }
    in_chunks(0..recording.frames.len(), |chunk| {
        let mut solver = smoother.solver();
        Vec::from_iter(chunk.iter().map(|&t| {
            let (frame, here) = (&recording.frames[t], &recording.here[t]);
            let positions = &here.linear.as_ref()?.positions;
            if !frame.formants.iter().all(|h| h.value(positions).is_finite()) {
                return None;
            }
            // Formants are taken as hidden points, whose derivatives are in thousandths of a unit.
            let hidden = frame.formants.iter().enumerate().map(|(i, formant)| FrameObservation {
                name: format!("F{}", i + 1),
                observation: Observation::new(formant.clone(), 0.0),
                along: Along { channel: 0, at_mm: 0.0, sd_mm: 1.0 },
            });
            let frame = Frame { hidden: hidden.collect(), formants: Vec::new(), ..frame.clone() };
            let x = smoother.unknowns(&here.z, &smoother.shared);
            let rates = solver.rates(&solver.unknowns(), &[(&frame, &x, Some(positions))]).pop()??;
            let mut all = rates.jacobian_of_hidden() * 1e-3;
            if let Some(shape) = smoother.context.shape {
                let by_shape = shape.rates(&mut solver, &[(&frame, &x, Some(&rates.positions))]).pop()??;
                all = stack![all, by_shape.jacobian_of_hidden() * 1e-3];
            }
            Some(all)
        }))
    })
}

/// Formants of a frame with the spread of their draws; empty where there are none.
pub(super) fn tracked_formants(
    frame: &Frame,
    positions: &[Point],
    draws: &[Vec<f32>],
) -> Vec<TrackedFormant> {
    let formants = frame.formants.iter().zip(draws).map(|(formant, draws)| {
        let hz = formant.value(positions);
        let (_, variance) = mean_and_variance(draws.iter().map(|d| f64::from(*d)));
        (hz.is_finite() && !draws.is_empty()).then(|| TrackedFormant { hz, sd_hz: variance.sqrt() })
    });
    formants.collect::<Option<_>>().unwrap_or_default()
}
