//! A speaker's body: the built-in tongue (or another one) turned, scaled and shifted to the speaker's bones. If there are contours, its
//! shape at rest is changed smoothly as well.
//!
//! The change of shape is a thin-plate spline (Bookstein 1989) of a few control points. Its displacements have a prior (a Gaussian
//! process: neighbours move together), and cells that shrink or grow have a cost. If a cell would still fold, the change is rejected and
//! only the similarity is used.

mod areas;
mod coils;
mod joint;
mod landmarks;
mod least_squares;
mod place;
mod prior;
mod rest;
mod speaker;

pub(crate) use areas::{area_ratios, area_residuals, is_believable};
pub use coils::{Coil, FEWEST_COILS, Placement};
pub(crate) use coils::{FIRST_COIL_SD_M, GAP_SD_M, MEASURED_COIL_SD_M};
pub use joint::{JointFit, JointSettings, joint};
pub use landmarks::Landmarks;
pub use place::{Placed, Sight};
pub use prior::learned;
pub use rest::{ControlPoints, Rest, RestError, resting};
pub use speaker::{Basis, How, Speaker};

use serde::{Deserialize, Serialize};

use crate::track::Followed;
use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};

/// The point of a bone that recordings mark: the foremost of its nodes, m. For the hyoid the anterior hyoglossus begins there.
pub fn mark_of(body: &Body<2>, bone: &str) -> Option<Point> {
    let nodes = body.bone(bone).iter().map(|&n| body.mesh.nodes[n]);
    nodes.min_by(|a, b| a.x.total_cmp(&b.x))
}

/// The bones of a body that follow their observed places in a recording, with marks where the bones are.
pub fn followed(body: &Body<2>, seen: &[String]) -> Vec<Followed> {
    let bone = |name: &&String| {
        let mark = mark_of(body, name)?;
        Some(Followed { name: (*name).clone(), nodes: body.bone(name).to_vec(), mark })
    };
    seen.iter().filter_map(|name| bone(&name)).collect()
}

/// The similarity that moves the spine and the hyoid of a body to their observed places. `None` if one of them is missing.
pub fn by_bones(body: &Body<2>, seen: impl Fn(&str) -> Option<Point>) -> Option<Similarity> {
    let bones = [MANDIBLE, HYOID];
    let from = bones.iter().map(|b| mark_of(body, b)).collect::<Option<Vec<_>>>()?;
    let to = bones.iter().map(|b| seen(b)).collect::<Option<Vec<_>>>()?;
    Similarity::between(&from, &to)
}

/// Data of an adapted body about the recording that it was adapted to; a part of its file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Adaptation {
    /// How the rest shape was found.
    pub rest: How,
    /// Place where the mark of each bone is seen when the bone is at its rest position, m.
    pub marks_m: std::collections::BTreeMap<String, [f64; 2]>,
    /// Scale of the prior of tensions, N per metre of thickness.
    #[serde(default)]
    pub scale_n: Option<f64>,
    /// Names of the muscles of the learned prior.
    #[serde(default)]
    pub muscles: Vec<String>,
    /// Its mean scores.
    #[serde(default)]
    pub mean: Vec<f64>,
    /// Its covariance of scores, one row for each muscle.
    #[serde(default)]
    pub covariance: Vec<Vec<f64>>,
}

impl Adaptation {
    /// Reads the adaptation from the text of a body's file (`tongue-fit adapt`); `None` for other bodies.
    ///
    /// # Errors
    /// The message of the JSON reader, or a description of an inconsistency.
    pub fn from_json(text: &str) -> Result<Option<Self>, String> {
        #[derive(Deserialize)]
        struct File {
            #[serde(default)]
            adaptation: Option<Adaptation>,
        }
        let found = serde_json::from_str::<File>(text).map_err(|e| e.to_string())?.adaptation;
        let Some(found) = found else { return Ok(None) };
        let n = found.muscles.len();
        let square = found.covariance.len() == n && found.covariance.iter().all(|row| row.len() == n);
        let numbers = found
            .mean
            .iter()
            .chain(found.covariance.iter().flatten())
            .chain(found.marks_m.values().flatten());
        if found.mean.len() != n || !square || !numbers.copied().all(f64::is_finite) {
            return Err(
                "its adaptation needs a finite mean and covariance for each of its muscles".to_owned()
            );
        }
        Ok(Some(found))
    }

    /// The bones of the body that follow their observed places.
    pub fn followed(&self, body: &Body<2>) -> Vec<Followed> {
        let bones = self.marks_m.iter().map(|(name, mark)| Followed {
            name: name.clone(),
            nodes: body.bone(name).to_vec(),
            mark: Point::from(*mark),
        });
        bones.filter(|b| !b.nodes.is_empty()).collect()
    }

    /// The learned prior of these muscles; `None` if it was learned for other muscles.
    pub fn prior(&self, muscles: &[String], memory_s: f64) -> Option<crate::track::CoursePrior> {
        let n = muscles.len();
        let covariance = nalgebra::DMatrix::from_fn(n, n, |i, j| {
            *self.covariance.get(i).and_then(|row| row.get(j)).unwrap_or(&f64::NAN)
        });
        let good = self.muscles == muscles && n > 0 && covariance.clone().cholesky().is_some();
        let mean = nalgebra::DVector::from_vec(self.mean.clone());
        good.then(|| crate::track::CoursePrior {
            scale_n: self.scale_n.unwrap_or(20.0),
            mean,
            covariance,
            memory_s,
        })
    }
}
