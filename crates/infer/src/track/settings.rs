//! Settings of tracking, and what recordings are tracked on.

use super::ornstein_uhlenbeck::Softplus;
use super::shape::RestShape;
use crate::error_model::{Errors, Knots};
use crate::inverse::MovableBone;
use tongue_core::geometry::Point;
use tongue_core::random::seed_of;
use tongue_core::system::System;

/// Settings for finding the tensions of recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackSettings {
    /// Prior of the tensions, and their link to the unknowns of the search.
    pub link: Softplus,
    /// Time over which tensions and slow errors are remembered, s; 0: frames are independent.
    pub memory_s: f64,
    pub errors: Errors,
    pub draws: usize,
    pub seed: u64,
    /// Largest number of frames of a recording whose positions are part of the results; they are equally spaced.
    pub shapes: usize,
    /// Whether it is checked how the shape of every frame can be reached from rest.
    pub reachability: bool,
    /// Largest number of frames by which what all recordings share is found. More are spread evenly over all recordings; levels, static
    /// error and shape are then held, with the covariance that those frames give them, while each recording is searched for its states.
    pub shared_frames: usize,
    /// Number of draws of the tensions over labels that are part of the results ([`LabelCourse`](super::LabelCourse)).
    pub kept_draws: usize,
}

impl TrackSettings {
    /// Whether the positions of frame `t` of so many are part of the results.
    pub fn is_shown(&self, t: usize, frames: usize) -> bool {
        self.shapes > 0 && t.is_multiple_of(frames.div_ceil(self.shapes).max(1))
    }

    /// The settings for one of several speakers: what is unknown of one is independent of what is unknown of another.
    pub fn of_speaker(self, name: &str) -> Self {
        let seed = name.bytes().fold(self.seed, |seed, byte| seed_of(seed, usize::from(byte)));
        Self { seed, ..self }
    }

    /// Settings for tensions of this scale (default: 20 N per metre of thickness) and this memory (default: 0.1 s).
    pub fn new(scale_n: f64, memory_s: f64) -> Self {
        Self {
            link: Softplus::of_scale(scale_n),
            memory_s,
            errors: Errors::default(),
            draws: 1000,
            seed: 0,
            shapes: usize::MAX,
            reachability: true,
            shared_frames: 240,
            kept_draws: 0,
        }
    }
}

/// A bone of a body that follows its observed place.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    pub name: String,
    pub nodes: Vec<usize>,
    /// Place where its mark is seen when the bone is at its rest position, m.
    pub mark: Point,
}

/// A body on which recordings are tracked.
#[derive(Clone, Copy)]
pub struct TrackingContext<'a> {
    pub system: &'a System<2>,
    /// Bones that are moved to their observed places.
    pub followed: &'a [Followed],
    /// Bones whose displacement is unknown ([`BONE_SD_M`](crate::inverse::BONE_SD_M), remembered like tensions).
    pub freed: &'a [MovableBone<2>],
    /// Uncertainty of its shape; `None` if the shape is known.
    pub shape: Option<&'a RestShape>,
}

impl<'a> TrackingContext<'a> {
    /// A body of known shape with all bones at rest.
    pub fn fixed(system: &'a System<2>) -> Self {
        Self { system, followed: &[], freed: &[], shape: None }
    }

    /// The same on the body at rest of `body`, if there is one.
    pub(super) fn on<'b>(&self, body: Option<&'b RestShape>) -> TrackingContext<'b>
    where
        'a: 'b,
    {
        TrackingContext { system: body.map_or(self.system, |body| &body.system), ..*self }
    }

    pub(super) fn sizes(&self, knots: &Knots) -> Sizes {
        let muscles = self.system.contracting().len();
        Sizes { muscles, bones: 2 * self.freed.len(), knots: knots.len() }
    }
}

/// Numbers of the unknowns, in their order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    pub muscles: usize,
    /// Displacements of freed bones.
    pub bones: usize,
    /// Knots of the errors.
    pub knots: usize,
}

impl Sizes {
    /// Unknowns of a frame: courses, displacements, slow error.
    pub fn state(&self) -> usize {
        self.muscles + self.bones + self.knots
    }

    /// Number of unknowns that all frames share on a fixed body: levels, static error.
    pub fn shared(&self) -> usize {
        self.muscles + self.knots
    }
}
