//! Tensions over time: the speaker's body, the uncertainty of its shape, and the search; in space, activations frame by frame.

use std::time::Instant;

use serde::Serialize;

use super::fit;
use crate::report::status_in_words;
use crate::simulation::SimulationError;
use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::effect::Contact;
use tongue_core::geometry::Similarity;
use tongue_core::observe::TongueSurface;
use tongue_core::random::seed_of;
use tongue_core::statistics::grouped;
use tongue_core::system::{Additions, SpaceModel, System};
use tongue_infer::adapt::{self, Adaptation, AdaptationInput, Placement, RestShapeMethod};
use tongue_infer::inverse::MovableBone;
use tongue_infer::inverse::in_space::{Recorded, SpaceFit, SpaceSearch};
use tongue_infer::track::{
    self, Followed, Frame, NotFinite, RestShape, TrackedRecording, TrackingContext, Watch,
};
use tongue_input::measured::recording::AlignedRecording;

const NOT_FINITE: &str = "the covariance of what was seen cannot be factorised; look for numbers that are not finite or very large in the \
                          recordings";

/// Recordings of one speaker to be tracked, as options.
#[derive(Debug, Clone)]
pub struct TrackRun<'a> {
    /// The body with its material and muscles, the settings, and the traced palate.
    pub basis: AdaptationInput<'a>,
    pub adaptation: Option<&'a Adaptation>,
    /// Whether the body stays where it is; otherwise it is placed in the recordings.
    pub is_given: bool,
    /// Method for the shape at rest of a body that is placed.
    pub rest: RestShapeMethod,
    pub free_bones: &'a [String],
    pub hide: &'a [String],
}

#[derive(Debug, Clone)]
pub struct TrackedBody {
    pub body: Body<2>,
    pub followed: Vec<Followed>,
    pub adaptation: Option<Adaptation>,
    /// Where coils placed the body, with its uncertainty.
    pub placement: Option<Placement>,
    /// How the body was turned, scaled and shifted to the recordings; `None` if it stayed where it was.
    pub similarity: Option<Similarity>,
    /// Root mean square distance of the contours from which the body's shape was made, m.
    pub rms_m: Option<f64>,
}

impl TrackedBody {
    pub fn is_fitted(&self) -> bool {
        self.adaptation.as_ref().is_some_and(|a| a.rest == RestShapeMethod::Joint)
    }

    /// The adaptation of the body as it is displayed, whose shape at rest may have been found in tracking.
    pub fn adaptation_after_tracking(&self, displayed: &Body<2>) -> Adaptation {
        let marks = self.followed.iter().map(|f| (f.name.clone(), [f.mark.x, f.mark.y]));
        let own = Adaptation { marks_m: marks.collect(), ..Adaptation::default() };
        let before = self.adaptation.clone().unwrap_or(own);
        let rest = match &self.placement {
            _ if displayed.mesh.nodes == self.body.mesh.nodes => before.rest,
            Some(_) => RestShapeMethod::Similarity,
            None => RestShapeMethod::Joint,
        };
        Adaptation { rest, ..before }
    }

    /// A recording with its coils where the placement puts them on the tongue.
    fn with_coil_positions(&self, seen: &AlignedRecording) -> AlignedRecording {
        match (&self.placement, &self.adaptation) {
            (Some(placement), _) => placement.with_coil_positions(seen),
            (None, Some(adaptation)) => adaptation.with_coil_positions(seen),
            (None, None) => seen.clone(),
        }
    }
}

impl TrackRun<'_> {
    /// The given body, or one adapted to these recordings. `progress` gets the number of steps done and that of all steps.
    pub fn body(
        &self,
        seen: &[&AlignedRecording],
        progress: &dyn Fn(usize, usize),
    ) -> Result<TrackedBody, SimulationError> {
        if self.is_given {
            return Ok(given_body(self.basis.body.clone(), self.adaptation));
        }
        let made = self.basis.adapt_to_recordings(seen, self.rest, self.hide, progress)?;
        Ok(TrackedBody {
            adaptation: Some(made.adaptation()),
            body: made.body,
            followed: made.followed,
            placement: made.placement,
            similarity: Some(made.similarity),
            rms_m: made.rms_m,
        })
    }

    /// The uncertainty of the speaker's shape; `None` for a body without mandible and hyoid, with a note to `tell`.
    pub fn shape(
        &self,
        speaker: &TrackedBody,
        wall: Option<&Contact>,
        seen: &[&AlignedRecording],
        tell: &dyn Fn(&str),
    ) -> Result<Option<RestShape>, SimulationError> {
        let body = &speaker.body;
        if [HYOID, MANDIBLE].iter().any(|bone| body.bone(bone).is_empty()) {
            tell(&format!(
                "{} has no bones \"{MANDIBLE}\" and \"{HYOID}\", so its shape at rest counts as known",
                body.what
            ));
            return Ok(None);
        }
        let (model, contracting) = (&self.basis.model, &self.basis.contracting);
        let mut shape = match &speaker.placement {
            Some(placement) => RestShape::of_coils(body, model, contracting, placement),
            None => RestShape::of(body, model, contracting, |bone| adapt::median_place(seen, bone)),
        }?;
        if let Some(wall) = wall {
            shape = shape.with_wall(wall.clone())?;
        }
        let is_kept =
            speaker.is_fitted() || speaker.adaptation.as_ref().is_some_and(|a| !a.coils_m.is_empty());
        Ok(Some(if is_kept { shape.as_found() } else { shape }))
    }

    /// The traced palate as a wall; `None` if the body at rest would pass through it, with a note to `tell`.
    pub fn wall(&self, body: &Body<2>, tell: &dyn Fn(&str)) -> Result<Option<Contact>, SimulationError> {
        let Some(palate) = self.basis.palate else { return Ok(None) };
        let wall = fit::wall(&body.mesh, &self.basis.model, palate)?;
        if wall.first_penetration(&body.mesh.nodes, &body.mesh.connections).is_some() {
            tell("the body at rest passes through the palate: the tongue is tracked without contact");
            return Ok(None);
        }
        Ok(Some(wall))
    }

    /// Tracks all recordings. Those that show the same bones are tracked together and share levels and a shape. `add_sound` may add
    /// formants to the frames of a recording.
    pub fn track(
        &self,
        speaker: &TrackedBody,
        (shape, wall): (Option<&RestShape>, Option<&Contact>),
        seen: &[&AlignedRecording],
        add_sound: &dyn Fn(&mut [Frame]),
        watch: &Watch<'_>,
    ) -> Result<(), SimulationError> {
        let (body, model) = (&speaker.body, &self.basis.model);
        let mut additions = Additions::default();
        wall.into_iter().for_each(|wall| additions.add_contact(wall.clone()));
        let system = System::with_additions(&body.mesh, model, &self.basis.contracting, additions)?;
        let surface = TongueSurface::of(body).ok_or_else(|| {
            SimulationError::Refused(format!("{} has no outline of tissue to compare with", body.what))
        })?;
        let compared = track::labels_to_compare(seen);
        let sessions = grouped(0..seen.len(), |&nth| [HYOID, MANDIBLE].map(|b| seen[nth].shows_bone(b)));
        for (nth_session, session) in sessions.into_iter().enumerate() {
            if !session.iter().any(|&number| (watch.is_wanted)(number)) {
                continue;
            }
            // The unknowns of one session are independent of those of another.
            let mut settings = self.basis.settings.clone();
            if nth_session > 0 {
                settings.seed = seed_of(settings.seed, nth_session);
            }
            let freed = self.unseen_free_bones(seen[session[0]]);
            let freed = freed.map(|name| MovableBone::of(body, model, &self.basis.contracting, name));
            let freed = freed.collect::<Result<Vec<_>, _>>()?;
            let mut frames = Vec::from_iter(session.iter().map(|&nth| {
                track::frames(&speaker.with_coil_positions(seen[nth]), &surface, &speaker.followed, self.hide)
            }));
            for (frames, &nth) in frames.iter_mut().zip(&session) {
                add_sound(frames);
                track::mark(frames, &seen[nth].labels, &compared);
            }
            let context =
                TrackingContext { system: &system, followed: &speaker.followed, freed: &freed, shape };
            let watch = Watch {
                is_wanted: &|number| (watch.is_wanted)(session[number]),
                take: &|number, result| (watch.take)(session[number], result),
                ..*watch
            };
            context
                .smooth(frames, &settings, &watch)
                .map_err(|NotFinite| SimulationError::Refused(NOT_FINITE.to_owned()))?;
        }
        Ok(())
    }

    pub fn run(
        &self,
        seen: &[&AlignedRecording],
        tell: &dyn Fn(&str),
    ) -> Result<Vec<TrackedRecording>, SimulationError> {
        self.check_free_bones(seen)?;
        let speaker = self.body(seen, &|_, _| ())?;
        let wall = self.wall(&speaker.body, tell)?;
        let shape = self.shape(&speaker, wall.as_ref(), seen, tell)?;
        let unknown = (shape.as_ref(), wall.as_ref());
        Watch::collect(|watch| self.track(&speaker, unknown, seen, &|_| (), watch))
    }

    /// The bones whose displacement is an unknown in a recording: free bones that it does not show.
    pub(super) fn unseen_free_bones<'b>(
        &'b self,
        seen: &'b AlignedRecording,
    ) -> impl Iterator<Item = &'b str> {
        self.free_bones.iter().map(|b| b.trim()).filter(|b| !seen.shows_bone(b))
    }

    /// Refuses a free bone that is named twice or is seen in every recording.
    pub fn check_free_bones(&self, seen: &[&AlignedRecording]) -> Result<(), SimulationError> {
        let mut names: Vec<&str> = Vec::new();
        for name in self.free_bones.iter().map(|b| b.trim()) {
            let refused = |why: &str| Err(SimulationError::Refused(format!("{name}: {why}")));
            if names.contains(&name) {
                return refused("this bone is free already; give each bone once");
            }
            MovableBone::of(self.basis.body, &self.basis.model, &self.basis.contracting, name)?;
            if seen.iter().all(|s| s.shows_bone(name)) {
                return refused(
                    "it is seen in every recording, and carried to where it is seen; leave the option out",
                );
            }
            names.push(name);
        }
        Ok(())
    }
}

pub(super) fn given_body(body: Body<2>, adaptation: Option<&Adaptation>) -> TrackedBody {
    let followed = match adaptation {
        Some(a) => a.followed_bones(&body),
        None => adapt::followed_bones(&body, body.bones.iter().map(|bone| &bone.name)),
    };
    let adaptation = adaptation.cloned();
    TrackedBody { body, followed, adaptation, placement: None, similarity: None, rms_m: None }
}

#[derive(Debug, Clone, Serialize)]
pub struct SpaceTrackFrame {
    pub recording: Option<String>,
    pub time_s: Option<f64>,
    #[serde(flatten)]
    pub fit: SpaceFit,
}

/// `tongue-fit track FILES --body space --json`.
#[derive(Debug, Clone, Serialize)]
pub struct SpaceTrack {
    #[serde(rename = "tongue")]
    pub body: String,
    /// Why frames cannot be trusted; then the exit status is 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untrusted: Option<String>,
    pub frames: Vec<SpaceTrackFrame>,
    pub notes: Vec<String>,
    pub wall_s: f64,
    /// Whether the sides of the body were kept alike.
    #[serde(skip)]
    pub is_alike: bool,
}

impl SpaceTrack {
    /// Finds the activations of one frame after another, each search from the answer of the frame before, and keeps the positions of all
    /// frames if there are at most `most_shapes`, otherwise only those of the last one. `tell` gets how each search ended.
    pub fn find(
        body: &Body<3>,
        model: &SpaceModel,
        recorded: &Recorded,
        search: &SpaceSearch,
        most_shapes: usize,
        tell: &dyn Fn(&str),
    ) -> Result<Self, SimulationError> {
        let (clock, system) = (Instant::now(), System::in_space(body, model)?);
        let half = if search.sides_apart { None } else { body.half() };
        let left = half.as_ref().map(|half| System::of_half(half, model)).transpose()?;
        search.settings.check()?;
        let mut frames: Vec<SpaceTrackFrame> = Vec::new();
        for (recording, frame) in &recorded.frames {
            let before = frames.last().map(|before| &before.fit.answer);
            let fit = match half.as_ref().zip(left.as_ref()) {
                Some(alike) => search.fit_alike((body, &system), alike, &frame.marks, before),
                None => search.fit(body, &system, &frame.marks, before),
            }?;
            let (status, rms) = (status_in_words(&fit.answer.status), 1e3 * fit.rms_m);
            tell(&format!("{status}: {rms:.2} mm RMS in {} factorisations", fit.factorisations));
            if let Some(before) = frames.last_mut().filter(|_| recorded.frames.len() > most_shapes) {
                before.fit.answer.positions = Vec::new();
            }
            frames.push(SpaceTrackFrame { recording: recording.clone(), time_s: frame.time_s, fit });
        }
        Ok(Self {
            body: body.what.clone(),
            untrusted: None,
            frames,
            notes: Vec::new(),
            wall_s: clock.elapsed().as_secs_f64(),
            is_alike: half.is_some(),
        })
    }
}
