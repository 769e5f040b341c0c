//! A speaker's body: the built-in tongue (or another one) turned, scaled and shifted to the speaker's bones. If there are contours, its
//! shape at rest is changed smoothly as well.
//!
//! The change of shape is a thin-plate spline (Bookstein 1989) of a few control points, whose displacements have a Gaussian-process prior.
//! Cells that shrink or grow have a cost. If a cell would still fold, the change is rejected and only the similarity is used.

mod coils;
mod landmarks;
mod place;
mod rest;
mod speaker;

pub use coils::{Coil, Placement};
pub use landmarks::Landmarks;
pub(crate) use place::mean_contour;
pub use place::{Registration, RegistrationData, median_place};
pub use rest::{ControlPoints, Rest, RestError, fit_rest_shape};
pub(crate) use rest::{area_residuals, is_believable, straighten};
pub use speaker::{AdaptationInput, RestShapeMethod, Speaker};

use serde::{Deserialize, Serialize};

use crate::track::Followed;
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::TongueSurface;
use tongue_core::toml_text::reworded;
use tongue_input::measured::recording::{AlignedRecording, median_point};

/// The point of a bone that recordings mark, m: the foremost of its nodes. At the hyoid the anterior hyoglossus begins there.
pub fn mark_of(body: &Body<2>, bone: &str) -> Option<Point> {
    let nodes = body.bone(bone).iter().map(|&n| body.mesh.nodes[n]);
    nodes.min_by(|a, b| a.x.total_cmp(&b.x))
}

pub(crate) fn outline_of(body: &Body<2>) -> Result<TongueSurface, RestError> {
    TongueSurface::of(body).ok_or_else(|| RestError::Body("it has no outline".to_owned()))
}

/// Mean of the nodes of the outline, m, about which a body is turned and scaled.
pub(crate) fn centre_of(mesh: &Mesh<2>) -> Point {
    let outline = mesh.surface_nodes();
    outline.iter().map(|&n| mesh.nodes[n]).sum::<Point>() / outline.len().max(1) as f64
}

/// The bones of a body that follow their places in a recording, with marks where the bones are.
pub fn followed_bones<'a>(body: &Body<2>, bones: impl IntoIterator<Item = &'a String>) -> Vec<Followed> {
    Vec::from_iter(bones.into_iter().filter_map(|name| {
        let mark = mark_of(body, name)?;
        Some(Followed { name: name.clone(), nodes: body.bone(name).to_vec(), mark })
    }))
}

/// The similarity that moves the mental spine and the hyoid of a body to their observed places; `None` if one is missing.
pub fn similarity_by_bones(body: &Body<2>, measured: impl Fn(&str) -> Option<Point>) -> Option<Similarity> {
    let bones = [MANDIBLE, HYOID];
    let from = bones.iter().map(|b| mark_of(body, b)).collect::<Option<Vec<_>>>()?;
    let to = bones.iter().map(|b| measured(b)).collect::<Option<Vec<_>>>()?;
    Similarity::between(&from, &to)
}

/// How a body was adapted to a recording; a part of the body's file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Adaptation {
    /// How the rest shape was found.
    pub rest: RestShapeMethod,
    /// Place of each bone's mark when the bone is at rest, m.
    pub marks_m: std::collections::BTreeMap<String, [f64; 2]>,
    /// Distance of each coil behind the tip along the surface at rest, m; empty where the body was not placed by coils.
    #[serde(default, skip_serializing_if = "std::collections::BTreeMap::is_empty")]
    pub coils_m: std::collections::BTreeMap<String, f64>,
}

impl Adaptation {
    /// Reads the adaptation from the text of a body's file (`tongue-fit adapt`); `None` for other bodies.
    pub fn from_json(text: &str) -> Result<Option<Self>, String> {
        #[derive(Deserialize)]
        struct BodyFile {
            adaptation: Option<Adaptation>,
        }
        let found = serde_json::from_str::<BodyFile>(text).map_err(|e| reworded(&e.to_string()))?.adaptation;
        let Some(found) = found else { return Ok(None) };
        if !found.marks_m.values().flatten().chain(found.coils_m.values()).all(|m| m.is_finite()) {
            return Err(
                "the places of its bones (adaptation.marks_m) and coils (coils_m) must be finite numbers"
                    .to_owned(),
            );
        }
        Ok(Some(found))
    }

    /// A recording with its coils where the adaptation has them on the tongue; those whose places were measured stay.
    #[must_use]
    pub fn with_coil_positions(&self, recording: &AlignedRecording) -> AlignedRecording {
        recording.with_coils(|name, measured| self.coils_m.get(name).copied().filter(|_| !measured))
    }

    /// The bones of the body that follow their observed places.
    pub fn followed_bones(&self, body: &Body<2>) -> Vec<Followed> {
        let mut bones = followed_bones(body, self.marks_m.keys());
        bones.iter_mut().for_each(|bone| bone.mark = Point::from(self.marks_m[&bone.name]));
        bones
    }
}
