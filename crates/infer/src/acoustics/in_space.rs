//! The walls of a tract around a tongue in space.

use nalgebra::Vector3;
use tongue_sound::Acoustics;
use tongue_sound::profile::{Articulation, Profile, ProfilePoint, Tract};

use super::VocalTractError;
use super::vocal_tract::{Sound, tongue_ends};
use tongue_core::body::Body;

/// Distance behind the outer wall up to which a surface counts as a tongue that has passed through the wall, m.
const BEHIND_M: f64 = 0.02;

/// A tract around a body in space. The tract lies in the midsagittal plane of the body: x to the back, y upwards.
#[derive(Debug, Clone)]
pub struct SpaceVocalTract {
    pub tract: Tract,
    pub acoustics: Acoustics,
    /// Nodes of the midsagittal surface from root to tip.
    midline: Vec<usize>,
    /// Triangles of the surface, counter-clockwise as seen from outside.
    surface: Vec<[usize; 3]>,
}

impl SpaceVocalTract {
    /// The tract around a body.
    pub fn round(body: &Body<3>, tract: Tract) -> Result<Self, VocalTractError> {
        let loops = body.midsagittal_mesh().outlines();
        let outline = loops.into_iter().max_by_key(Vec::len).ok_or(VocalTractError::NoSurface)?;
        let at = |n: usize| flat(&body.mesh.nodes[n]);
        let [root, tip] = tongue_ends(&tract, outline.len(), |i| at(outline[i]));
        if root == tip {
            return Err(VocalTractError::no_wall(&tract));
        }
        let count = outline.len();
        let path = |from: usize, to: usize| -> Vec<usize> {
            (0..=(to + count - from) % count).map(|i| outline[(from + i) % count]).collect()
        };
        // The surface is the upper one of the two paths from root to tip.
        let (forward, mut backward) = (path(root, tip), path(tip, root));
        backward.reverse();
        let [top, other] = [&forward, &backward]
            .map(|path| path.iter().map(|&n| at(n)[1]).fold(f64::NEG_INFINITY, f64::max));
        let midline = if top >= other { forward } else { backward };
        Ok(Self { tract, acoustics: Acoustics::default(), midline, surface: body.mesh.outward_faces() })
    }

    /// The sound of a shape (positions of all nodes, m) in a posture.
    ///
    /// # Errors
    /// [`VocalTractError::Tract`] if walls meet, or if the tract has no widths.
    pub fn sound(
        &self,
        positions: &[Vector3<f64>],
        posture: &Articulation,
    ) -> Result<Sound, VocalTractError> {
        let tongue: Vec<ProfilePoint> = self.midline.iter().map(|&n| flat(&positions[n])).collect();
        let triangles: Vec<[Vector3<f64>; 3]> =
            self.surface.iter().map(|t| t.map(|n| positions[n])).collect();
        let profile = Profile::in_space(&self.tract, &tongue, posture, &|outer, direction, side| {
            let from = Vector3::new(outer[0], side, outer[1]);
            let along = Vector3::new(direction[0], 0.0, direction[1]);
            let crossings = triangles.iter().filter_map(|t| entered(t, &from, &along));
            crossings.filter(|at| *at > -BEHIND_M).min_by(f64::total_cmp)
        })?;
        Ok(Sound::new(profile, &self.acoustics)?)
    }
}

fn flat(at: &Vector3<f64>) -> ProfilePoint {
    [at.x, at.z]
}

/// Distance at which a line in a plane of constant y enters a triangle from outside, m.
fn entered([a, b, c]: &[Vector3<f64>; 3], from: &Vector3<f64>, along: &Vector3<f64>) -> Option<f64> {
    if from.y < a.y.min(b.y).min(c.y) || from.y > a.y.max(b.y).max(c.y) {
        return None;
    }
    let (u, v) = (b - a, c - a);
    let normal = u.cross(&v);
    let slope = normal.dot(along);
    if slope >= 0.0 {
        return None;
    }
    let distance = normal.dot(&(a - from)) / slope;
    let place = from + along * distance - a;
    let size = normal.norm_squared();
    let (by_u, by_v) = (place.cross(&v).dot(&normal) / size, u.cross(&place).dot(&normal) / size);
    let within = -1e-9;
    (by_u >= within && by_v >= within && by_u + by_v <= 1.0 - within).then_some(distance)
}
