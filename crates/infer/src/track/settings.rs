use super::ornstein_uhlenbeck::Softplus;
use super::rest_shape::RestShape;
use crate::error_model::ErrorModel;
use crate::inverse::MovableBone;
use tongue_core::geometry::Point;
use tongue_core::random::seed_of;
use tongue_core::system::System;

/// Settings of tracking.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackSettings {
    /// Prior of the tensions, and their transform.
    pub link: Softplus,
    /// Time constant of tensions and slow errors, s; with 0 frames are independent.
    pub memory_s: f64,
    pub errors: ErrorModel,
    pub draws: usize,
    pub seed: u64,
    /// Largest number of frames of a recording whose positions are part of the results, equally spaced.
    pub shapes: usize,
    /// Whether it is checked how the shape of every frame can be reached from rest.
    pub reachability: bool,
    /// Largest number of frames by which the shared unknowns are found. More are spread evenly over all recordings; levels, static error
    /// and shape are then held, with the covariance from those frames, while the states of each recording are found.
    pub shared_frames: usize,
    /// Number of draws of the tensions over labels that are part of the results ([`LabelCourse`](super::LabelCourse)).
    pub kept_draws: usize,
}

impl TrackSettings {
    /// Whether the positions of frame `t` are part of the results.
    pub fn is_shown(&self, t: usize, frames: usize) -> bool {
        self.shapes > 0 && t.is_multiple_of(frames.div_ceil(self.shapes).max(1))
    }

    /// The settings for one of several speakers, whose draws are independent of those of others.
    pub fn of_speaker(self, name: &str) -> Self {
        let seed = name.bytes().fold(self.seed, |seed, byte| seed_of(seed, usize::from(byte)));
        Self { seed, ..self }
    }

    /// Settings for this scale of tensions (default: 20 N per metre of thickness) and this time constant (default: 0.1 s).
    pub fn new(scale_n: f64, memory_s: f64) -> Self {
        Self {
            link: Softplus::of_scale(scale_n),
            memory_s,
            errors: ErrorModel::default(),
            draws: 1000,
            seed: 0,
            shapes: usize::MAX,
            reachability: true,
            shared_frames: 240,
            kept_draws: 0,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    pub name: String,
    pub nodes: Vec<usize>,
    /// Place of its mark when the bone is at rest, m.
    pub mark: Point,
}

#[derive(Clone, Copy)]
pub struct TrackingContext<'a> {
    pub system: &'a System<2>,
    pub followed: &'a [Followed],
    /// Bones of unknown displacement ([`BONE_SD_M`](crate::inverse::BONE_SD_M), correlated in time like tensions).
    pub freed: &'a [MovableBone<2>],
    /// Uncertainty of the shape at rest; `None` if it is known.
    pub shape: Option<&'a RestShape>,
}

impl<'a> TrackingContext<'a> {
    /// A body of known shape with all bones at rest.
    pub fn fixed(system: &'a System<2>) -> Self {
        Self { system, followed: &[], freed: &[], shape: None }
    }

    /// The context with the body at rest of `body`, if there is one.
    pub(super) fn on_body<'b>(&self, body: Option<&'b RestShape>) -> TrackingContext<'b>
    where
        'a: 'b,
    {
        TrackingContext { system: body.map_or(self.system, |body| &body.system), ..*self }
    }
}

/// Numbers of the unknowns, in their order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    pub muscles: usize,
    pub bones: usize,
    pub knots: usize,
}

impl Sizes {
    /// Number of unknowns of a frame: deviations, displacements, slow error.
    pub fn state(&self) -> usize {
        self.muscles + self.bones + self.knots
    }

    /// Number of unknowns that all frames share on a body of known shape: levels, static error.
    pub fn shared(&self) -> usize {
        self.muscles + self.knots
    }
}
