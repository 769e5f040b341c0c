//! Bones that are carried away from where they are at rest: a jaw that opens, a hyoid that rises.
//!
//! Moved at once, a bone would turn over the cells beside it, and no step of Newton's method could undo that. So it is carried
//! in parts, each at most half of what the effects can be trusted for, and the body follows after each.

use nalgebra::SVector;

use crate::effect::Configuration;
use crate::system::System;

use super::Workspace;

/// Residual force at which the body has followed well enough for the next part, N.
pub(super) const FOLLOWED: f64 = 1e-4;
/// Most parts. The reference tongue's jaw opens by 10 degrees in 12.
pub(super) const MOST_PARTS: usize = 1000;

/// A part of the way left that is not worth going.
const LEAST_PART: f64 = 1e-6;

/// How far the bones came.
pub(super) enum Carried {
    There,
    APart,
    /// Something is in the way at once: too far for the cells beside them, or a wall.
    Nowhere,
}

/// Moves the bones a part of what is left of their way.
pub(super) fn carry<const D: usize>(system: &System<D>, w: &mut Workspace<D>) -> Carried {
    let there = |&(node, to): &(usize, SVector<f64, D>)| w.positions[node] == to;
    if w.carried.iter().all(there) {
        return Carried::There;
    }
    w.step.fill(SVector::zeros());
    for &(node, to) in &w.carried {
        w.step[node] = to - w.positions[node];
    }
    let at = Configuration { positions: &w.positions, tensions: &w.tensions };
    let limit = system.effects().iter().map(|e| e.step_limit(at, &w.step)).fold(1.0, f64::min);
    if limit < LEAST_PART {
        w.step.fill(SVector::zeros());
        return Carried::Nowhere;
    }
    for &(node, to) in &w.carried {
        if limit < 1.0 {
            w.positions[node] += w.step[node] * (0.5 * limit);
        } else {
            w.positions[node] = to;
        }
    }
    w.factor_ready = false;
    // The step belongs to unknowns only; Newton's method relies on zeros elsewhere.
    w.step.fill(SVector::zeros());
    Carried::APart
}
