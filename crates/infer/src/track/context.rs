//! What recordings are tracked on.

use crate::inverse::MovableBone;
use tongue_core::system::System;

use super::errors::Knots;
use super::frame::Followed;
use super::shape::RestShape;
use super::smoother::Sizes;

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

impl TrackingContext<'_> {
    pub(super) fn sizes(&self, knots: &Knots) -> Sizes {
        let muscles = self.system.contracting().len();
        Sizes { muscles, bones: 2 * self.freed.len(), knots: knots.len() }
    }
}
