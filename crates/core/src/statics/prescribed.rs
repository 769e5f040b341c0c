//! Bones that are displaced from rest: a jaw that opens, a hyoid that rises.
//!
//! A bone that is moved in one step would invert the cells beside it, and no step of Newton's method
//! could undo that. So it is moved in parts, each at most half of the step limit of the effects, and the
//! body is solved after each.

use nalgebra::SVector;

use crate::effect::Configuration;
use crate::system::System;

use super::Workspace;

/// Residual force below which the next part of the way begins, N.
pub(super) const FOLLOWED: f64 = 1e-4;
/// Largest number of parts. The reference tongue's jaw opens by 10 degrees in 12.
pub(super) const MOST_PARTS: usize = 1000;

/// Shortest part of the remaining way that is still tried.
const LEAST_PART: f64 = 1e-6;

/// How far the bones came.
pub(super) enum Progress {
    There,
    APart,
    /// They could not move at all: the cells beside them or a wall forbid it.
    Nowhere,
}

/// Moves the bones along a part of their remaining way.
pub(super) fn carry<const D: usize>(system: &System<D>, w: &mut Workspace<D>) -> Progress {
    if w.carried.iter().all(|&(node, to)| w.positions[node] == to) {
        return Progress::There;
    }
    w.step.fill(SVector::zeros());
    for &(node, to) in &w.carried {
        w.step[node] = to - w.positions[node];
    }
    let at = Configuration { positions: &w.positions, tensions: &w.tensions };
    let limit = system.effects().iter().map(|e| e.step_limit(at, &w.step)).fold(1.0, f64::min);
    if limit < LEAST_PART {
        w.step.fill(SVector::zeros());
        return Progress::Nowhere;
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
    Progress::APart
}
