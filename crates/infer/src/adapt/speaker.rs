//! A speaker's body from recordings or from landmarks.

use std::collections::BTreeSet;

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::standard_deviations as sd;
use crate::track::{self, Followed, RestShape, TrackSettings, TrackingContext};
use tongue_core::body::{Anatomy, Body, HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::TongueSurface;
use tongue_core::system::Model;
use tongue_input::measured::recording::{AlignedRecording, Mark};

use super::place::median_place;
use super::rest::{TRUSTED_AREA, TRUSTED_STRETCH, area_ratios};
use super::{
    Adaptation, Landmarks, Placement, Registration, RegistrationData, Rest, RestError, fit_rest_shape,
    followed_bones, mark_of, outline_of, similarity_by_bones,
};

/// Method by which the rest shape is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RestShapeMethod {
    /// Turned, scaled and shifted only.
    #[default]
    Similarity,
    /// The shape that explains many frames at once.
    #[serde(alias = "frame")]
    Joint,
    /// The shape of a contour that was drawn in a rest posture.
    Contour,
}

/// Largest turn of a body that is placed by a contour without both bones, degrees. One that is mirrored or upside down needs a larger one.
const LARGEST_TURN_DEG: f64 = 45.0;
/// Contour points nearer to the body's own outline than this lie on it, m.
const ON_OUTLINE_M: f64 = 1e-6;

/// A body adapted to a speaker.
#[derive(Debug, Clone)]
pub struct Speaker {
    pub body: Body<2>,
    /// The bones that follow their observed places.
    pub followed: Vec<Followed>,
    pub how: RestShapeMethod,
    /// The placement of the body before its shape was changed.
    pub similarity: Similarity,
    /// Smallest ratio of a cell's area to that in the placed body.
    pub least_area_ratio: f64,
    /// Root mean square distance of the contours from the body, m.
    pub rms_m: Option<f64>,
    /// The uncertainty of the placement, if coils placed the body.
    pub placement: Option<Placement>,
    /// A landmark that is far from its place in the body, and the distance, m.
    pub misplaced: Option<(String, f64)>,
    /// Notes for the user: rejected changes and missing data.
    pub notes: Vec<String>,
}

/// Largest root mean square distance of a contour with which a body is trusted, m.
const TRUSTED_RMS_M: f64 = 1.5e-3;
/// Largest distance of a landmark from its place with which a body is trusted, m: two standard deviations of the hyoid.
const TRUSTED_LANDMARK_M: f64 = 10e-3;

impl Speaker {
    pub fn adaptation(&self) -> Adaptation {
        let marks = self.followed.iter().map(|f| (f.name.clone(), [f.mark.x, f.mark.y]));
        let coils = self.placement.iter().flat_map(|placement| placement.coils.iter().cloned());
        Adaptation { rest: self.how, marks_m: marks.collect(), coils_m: coils.collect() }
    }

    /// Every muscle with its length in the body from which this one was made and in this one, m.
    pub fn lengths_m<'a>(&'a self, before: &'a Body<2>) -> impl Iterator<Item = (&'a str, f64, f64)> {
        let both = before.mesh.muscles.iter().zip(&self.body.mesh.muscles);
        both.map(|(a, b)| {
            (a.name.as_str(), before.mesh.distance(a.ends()), self.body.mesh.distance(b.ends()))
        })
    }

    /// Reasons not to trust this body; empty if there are none. `before` is the body from which it was made.
    pub fn doubts(&self, before: &Body<2>) -> Vec<String> {
        let mut out = Vec::new();
        if self.least_area_ratio < TRUSTED_AREA {
            out.push(format!(
                "a cell keeps {:.0} % of its area, where a speaker's tongue keeps {:.0}",
                100.0 * self.least_area_ratio,
                100.0 * TRUSTED_AREA
            ));
        }
        // Compared with the body that is only turned and scaled.
        let scale = self.similarity.scale();
        let changes =
            self.lengths_m(before).map(|(muscle, before, after)| (muscle, after / (scale * before)));
        let most = changes.max_by(|a, b| a.1.ln().abs().total_cmp(&b.1.ln().abs()));
        if let Some((muscle, ratio)) = most.filter(|(_, r)| r.ln().abs() > TRUSTED_STRETCH.ln()) {
            out.push(format!(
                "{muscle} becomes {ratio:.2} times as long as in the body turned and scaled only, where a factor of {TRUSTED_STRETCH} is the most"
            ));
        }
        if let Some(rms) = self.rms_m.filter(|r| *r > TRUSTED_RMS_M) {
            out.push(format!("the contour is missed by {:.1} mm (RMS)", rms * 1e3));
        }
        if let Some((landmark, off_m)) = &self.misplaced {
            out.push(format!(
                "the landmark \"{landmark}\" is {:.0} mm from its place in the body",
                off_m * 1e3
            ));
        }
        out
    }
}

/// A body to be adapted, and assumptions of the adaptation.
#[derive(Debug, Clone)]
pub struct AdaptationInput<'a> {
    pub body: &'a Body<2>,
    /// The anatomy from which it was meshed, if there was one.
    pub anatomy: Option<&'a Anatomy>,
    pub model: Model,
    pub contracting: Vec<usize>,
    /// Prior of the tensions, and errors of the recordings.
    pub settings: TrackSettings,
    /// A trace of the palate in the frame of the recordings, m, used where coils place the body.
    pub palate: Option<&'a [Point]>,
}

impl AdaptationInput<'_> {
    /// Places the body where contour, mental spine and hyoid of recordings fit best ([`RegistrationData`]). Points in `hide` are not used.
    ///
    /// # Errors
    /// [`RestError::Body`] for recordings that contain too little, [`RestError::NotOneFrame`] for bones that belong to no such contour.
    pub fn place(
        &self,
        recordings: &[&AlignedRecording],
        hide: &[String],
    ) -> Result<Registration, RestError> {
        let placed =
            RegistrationData::of_recordings(recordings, hide).with_palate(self.palate).place(self.body);
        placed.and_then(Registration::in_one_frame).map_err(|why| {
            let RestError::Body(why) = why else { return why };
            RestError::Body(format!(
                "{why}; name their channels in a map (--map; --map-template writes one), or give a body that fits the speaker (--mesh, \
                 --anatomy, or --as-is for the built-in one)"
            ))
        })
    }

    /// Adapts the body to recordings. Points in `hide` are not used.
    ///
    /// # Errors
    /// [`RestError`] if the recordings do not show where the body lies, or if no frame with enough points has an equilibrium.
    pub fn adapt_to_recordings(
        &self,
        recordings: &[&AlignedRecording],
        how: RestShapeMethod,
        hide: &[String],
        progress: &dyn Fn(usize, usize),
    ) -> Result<Speaker, RestError> {
        let Registration { similarity, by_coils, .. } = self.place(recordings, hide)?;
        let rest = Rest::new(self.body, similarity)?;
        let mut body = rest.body(&DVector::zeros(rest.unknowns()));
        let bones: BTreeSet<&String> = recordings.iter().flat_map(|s| &s.bones).collect();
        let mut followed = followed_bones(&body, bones);
        // An error of the placement must not count as a displacement of the bone from rest.
        for bone in &mut followed {
            bone.mark = median_place(recordings, &bone.name).unwrap_or(bone.mark);
        }
        // A few coils carry no information about the shape at rest.
        if how != RestShapeMethod::Joint || by_coils.is_some() {
            let speaker = self.speaker(&rest, body, followed, RestShapeMethod::Similarity, None);
            return Ok(Speaker { placement: by_coils, ..speaker });
        }
        let shape =
            RestShape::of(&body, &self.model, &self.contracting, |bone| median_place(recordings, bone))?;
        let surface = outline_of(&body)?;
        let frames = recordings.iter().map(|s| track::frames(s, &surface, &followed, hide)).collect();
        let context = TrackingContext { system: &shape.system, followed: &followed, freed: &[], shape: None };
        let (nodes, rms_m) = track::rest_shape(&context, &shape, frames, &self.settings, progress)
            .ok_or_else(|| RestError::Body("no frame has an equilibrium with enough points".to_owned()))?;
        body.mesh.nodes = nodes;
        // The search may have turned, scaled and shifted the body, too.
        let similarity = Similarity::between(&self.body.mesh.nodes, &body.mesh.nodes).unwrap_or(similarity);
        let rest = Rest::new(self.body, similarity)?;
        Ok(self.speaker(&rest, body, followed, RestShapeMethod::Joint, Some(rms_m)))
    }

    /// Adapts the body to landmarks of one posture at rest, and to its contour.
    pub fn adapt_to_landmarks(&self, landmarks: &Landmarks) -> Result<Speaker, RestError> {
        let at = |bone: &str| landmarks.named.get(bone).copied();
        let by_landmarks = similarity_by_bones(self.body, at);
        if landmarks.contour.len() < 3 && by_landmarks.is_none() {
            let known: Vec<&str> = landmarks.named.keys().map(String::as_str).collect();
            return Err(RestError::Body(format!(
                "it needs the landmarks \"mental_spine\" and \"hyoid\", apart from each other (given: {}), or a contour",
                if known.is_empty() { "none".to_owned() } else { known.join(", ") }
            )));
        }
        // A contour that is the body's own must not change the body by rounding of a curve through its nodes.
        let own = by_landmarks.as_ref().is_some_and(|similarity| {
            let anatomy = self.anatomy.map(|a| a.outline());
            let mut contour = landmarks.contour.iter();
            contour.all(|p| anatomy.is_some_and(|o| o.nearest(similarity.place_back(*p)).1 < ON_OUTLINE_M))
        });
        let similarity = match by_landmarks.filter(|_| own || landmarks.contour.len() < 3) {
            Some(similarity) => similarity,
            None => {
                RegistrationData::of_contour(&landmarks.contour, at(MANDIBLE), at(HYOID))
                    .place(self.body)?
                    .similarity
            }
        };
        let turn_deg = similarity.angle().to_degrees();
        if by_landmarks.is_none() && turn_deg.abs() > LARGEST_TURN_DEG {
            return Err(RestError::NotOneFrame(format!(
                "the contour fits the body only if this is turned by {turn_deg:.0}°, where {LARGEST_TURN_DEG} are the most: it seems to be mirrored \
                 or upside down; give x to the back and y upwards, or both mental_spine and hyoid"
            )));
        }
        let mut rest = Rest::new(self.body, similarity)?;
        let far = landmarks.named.iter().filter(|(name, _)| !self.body.bone(name).is_empty());
        let far = far.filter(|(name, _)| ![MANDIBLE, HYOID].contains(&name.as_str()));
        rest.far = far.map(|(name, at)| (name.clone(), *at)).collect();
        let bones: Vec<(&str, Mark)> = Vec::from_iter(
            LANDMARK_SD_M.iter().filter_map(|(name, sd)| Some((*name, Mark { at: at(name)?, sd: *sd }))),
        );
        let none = DVector::zeros(rest.unknowns());
        let followed = followed_bones(&rest.body(&none), landmarks.named.keys());
        let marks: Vec<Mark> = landmarks.contour.iter().map(|&at| Mark { at, sd: CONTOUR_SD_M }).collect();
        let mut notes = Vec::new();
        let (displacements, how) = match marks.len() {
            0..3 => (none, RestShapeMethod::Similarity),
            _ if own => (none, RestShapeMethod::Contour),
            _ => match fit_rest_shape(&rest, &marks, &bones) {
                Ok(found) => (found, RestShapeMethod::Contour),
                Err(refused @ RestError::Folds { .. }) => {
                    notes.push(format!("{refused}; the body is turned, scaled and shifted only"));
                    (none, RestShapeMethod::Similarity)
                }
                Err(other) => return Err(other),
            },
        };
        let body = rest.body(&displacements);
        let rms_m = TongueSurface::of(&body).filter(|_| !marks.is_empty()).map(|surface| {
            let squares = marks.iter().map(|m| surface.distance(m.at, &body.mesh.nodes).powi(2)).sum::<f64>();
            (squares / marks.len() as f64).sqrt()
        });
        let unused = landmarks.unused(self.body);
        if !unused.is_empty() {
            notes.push(format!(
                "these landmarks are not used, since the body has no bone of their name: {}",
                unused.join(", ")
            ));
        }
        let mut out = self.speaker(&rest, body, followed, how, rms_m);
        let off = |bone: &str| Some((bone.to_owned(), (mark_of(&out.body, bone)? - at(bone)?).norm()));
        let most = [MANDIBLE, HYOID].into_iter().filter_map(off).max_by(|a, b| a.1.total_cmp(&b.1));
        out.misplaced = most.filter(|(_, off_m)| *off_m > TRUSTED_LANDMARK_M);
        out.notes.extend(notes);
        Ok(out)
    }

    /// The result for the changed rest shape `body` of the placed body `rest`.
    fn speaker(
        &self,
        rest: &Rest<'_>,
        mut body: Body<2>,
        followed: Vec<Followed>,
        how: RestShapeMethod,
        rms_m: Option<f64>,
    ) -> Speaker {
        let placed = rest.body(&DVector::zeros(rest.unknowns())).mesh;
        let same =
            rest.similarity == Similarity::IDENTITY && rest.far.is_empty() && body.mesh.nodes == placed.nodes;
        body.what =
            if same { self.body.what.clone() } else { format!("{}, adapted to a speaker", self.body.what) };
        if same {
            body.palate.clone_from(&self.body.palate);
        }
        Speaker {
            least_area_ratio: area_ratios(&placed, &body.mesh.nodes).fold(f64::INFINITY, f64::min),
            body,
            followed,
            how,
            similarity: rest.similarity,
            rms_m,
            placement: None,
            misplaced: None,
            notes: Vec::new(),
        }
    }
}

/// Standard deviations of a drawn contour and of landmarks at rest, m; the hyoid's is larger, because it moves with the neck.
const CONTOUR_SD_M: f64 = 1e-3 * sd::DRAWN_CONTOUR_MM;
const LANDMARK_SD_M: [(&str, f64); 2] = [(MANDIBLE, 1e-3 * sd::DRAWN_SPINE_MM), (HYOID, 1e-3 * sd::HYOID_MM)];
