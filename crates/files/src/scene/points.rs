//! Tensions of a scene from points measured on the tongue.

use std::any::Any;

use nalgebra::Vector2;
use serde::Serialize;

use super::file::{Points, Scene};
use crate::simulation::SimulationError;
use tongue_core::body::Body;
use tongue_core::system::System;
use tongue_infer::track::{
    self, Errors, Frame, FrameStatus, TongueSurface, TrackSettings, TrackingContext, Watch,
};
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording, Mark};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointsFit {
    pub status: FrameStatus,
    pub rms_mm: Option<f64>,
    /// Number of directions of the tensions whose standard deviation is below a quarter of the prior's scale;
    /// the others come from the prior.
    pub resolved: usize,
    /// Lower ends of the 95 % intervals, N per metre of thickness: one for each chain of the mesh.
    pub low_n: Vec<f64>,
    pub high_n: Vec<f64>,
}

/// The points of a scene as observations of its body; `None` if it has none.
pub(super) fn frame<const D: usize>(scene: &Scene, body: &Body<D>) -> Result<Option<Frame>, SimulationError> {
    let Some(points) = &scene.points else { return Ok(None) };
    let flat = (body as &dyn Any).downcast_ref::<Body<2>>();
    let surface = flat.and_then(TongueSurface::of).ok_or_else(|| {
        let why = "points are seen in the midsagittal plane, on the outline of a body; take the reference tongue or a mesh in the plane";
        SimulationError::contradiction("[points]", scene.body_key(), why)
    })?;
    Ok(track::frames(&seen(points), &surface, &[], &[]).pop())
}

fn seen(points: &Points) -> AlignedRecording {
    let mark = |at: &[f64; 2]| Some(Mark { at: Vector2::from(*at) * 1e-3, sd: points.noise_mm * 1e-3 });
    let named = |stem: &str, count: usize| (1..=count).map(|i| format!("{stem}_{i}")).collect::<Vec<_>>();
    let behind = points.sensors.iter().map(|s| s.surface_mm * 1e-3);
    AlignedRecording {
        name: "points".to_owned(),
        contour: named("contour", points.contour_mm.len()),
        sensors: named("sensor", points.sensors.len()).into_iter().zip(behind).collect(),
        measured: vec![true; points.sensors.len()],
        frames: vec![AlignedFrame {
            time_s: 0.0,
            contour: points.contour_mm.iter().map(mark).collect(),
            sensors: points.sensors.iter().map(|s| mark(&s.at_mm)).collect(),
            bones: Vec::new(),
        }],
        ..AlignedRecording::default()
    }
}

/// Finds the tensions of all chains of the mesh, N, and their intervals. `None` in space, for which [`frame`]
/// makes no observations.
pub(super) fn fit<const D: usize>(
    points: &Points,
    frame: &Frame,
    system: &System<D>,
) -> Option<(Vec<f64>, PointsFit)> {
    let system = (system as &dyn Any).downcast_ref::<System<2>>()?;
    let settings =
        TrackSettings { errors: Errors::INDEPENDENT, ..TrackSettings::new(points.prior_n_per_m, 0.0) };
    // A scene says what its body is, so its shape is known.
    let stage = TrackingContext { system, followed: &[], freed: &[], shape: None };
    let found = Watch::collect(|watch| track::track(&stage, vec![vec![frame.clone()]], &settings, watch));
    let found = found.ok()?.pop()?.frames.pop()?;
    let of_body = |values: &[f64]| {
        let mut all = vec![0.0; system.muscle_count()];
        system.contracting().iter().zip(values).for_each(|(&muscle, value)| all[muscle] = *value);
        all
    };
    let told = PointsFit {
        status: found.status,
        rms_mm: found.rms_m.map(|r| r * 1e3),
        resolved: found.resolved,
        low_n: of_body(&found.levels.iter().map(|l| l.low).collect::<Vec<_>>()),
        high_n: of_body(&found.levels.iter().map(|l| l.high).collect::<Vec<_>>()),
    };
    Some((of_body(&found.tensions_n()), told))
}
