//! What a run of `tongue-fit track` does with its inputs: the speaker's body, what is not known of it, and the tensions on it.

use miette::{IntoDiagnostic, miette};
use tongue_fit::adapt::{self, Adaptation, Basis, How, Placement, Sight};
use tongue_fit::body::{Body, HYOID, MANDIBLE};
use tongue_fit::effect::{Contact, Effect};
use tongue_fit::geometry::Point;
use tongue_fit::inverse::FreedBone;
use tongue_fit::measured::recording::Seen;
use tongue_fit::report::OutputDir;
use tongue_fit::report::batch;
use tongue_fit::report::batch::journal::Journal;
use tongue_fit::system::{self, Additions, Model, System};
use tongue_fit::track::{self, Followed, RestShape, Stage, TongueSurface, TrackedRecording};

use super::recordings::Given;
use super::track_files::Found;
use super::track_sound::Sound;
use super::{interrupt, output, recording_checks};

/// Distance from the palate at which it begins to act, m.
const PALATE_REACH_M: f64 = 1e-3;

/// A body ready for tracking.
pub struct Speaker {
    pub body: Body<2>,
    /// Its bones that follow their observed places.
    pub followed: Vec<Followed>,
    /// How it was adapted; `None` for a body that was not.
    pub adaptation: Option<Adaptation>,
    /// What is known of where coils placed it.
    pub placement: Option<Placement>,
}

impl Speaker {
    /// Whether its shape at rest was fitted to recordings.
    pub fn is_fitted(&self) -> bool {
        self.adaptation.as_ref().is_some_and(|a| a.rest == How::Joint)
    }

    /// The adaptation of a displayed body, whose shape at rest may have been found in tracking.
    pub fn tracked(&self, displayed: &Body<2>) -> Adaptation {
        let marks = self.followed.iter().map(|f| (f.name.clone(), [f.mark.x, f.mark.y]));
        let own = Adaptation { marks_m: marks.collect(), ..Adaptation::default() };
        let before = self.adaptation.clone().unwrap_or(own);
        let is_found = displayed.mesh.nodes != self.body.mesh.nodes;
        let rest = match is_found {
            true if self.placement.is_some() => How::Similarity,
            true => How::Joint,
            false => before.rest,
        };
        Adaptation { rest, ..before }
    }

    /// A recording with its coils where the placement has them on the tongue.
    fn seated(&self, seen: &Seen) -> Seen {
        match (&self.placement, &self.adaptation) {
            (Some(placement), _) => placement.seated(seen),
            (None, Some(adaptation)) => adaptation.seated(seen),
            (None, None) => seen.clone(),
        }
    }
}

/// A run of `tongue-fit track`: what it was given.
pub struct Run<'a> {
    /// Method for the rest shape if no body is given.
    pub rest: How,
    /// Names of the bones that may be displaced where they were not seen.
    pub free_bones: &'a [String],
    pub given: &'a Given,
    pub basis: Basis<'a>,
    /// Whether the body is used where it is.
    pub is_given: bool,
    pub palate: Option<&'a [Point]>,
}

impl Run<'_> {
    pub fn model(&self) -> Model {
        self.basis.model
    }

    /// The given body, or one adapted to these recordings.
    pub fn speaker(&self, seen: &[&Seen], hide: &[String]) -> miette::Result<Speaker> {
        if self.is_given {
            return Ok(self.known(self.given.body.clone(), self.given.adaptation.as_ref()));
        }
        let bar = output::bar(1, "{bar:40} rest shape, {eta} left")?;
        let progress = |done: usize, of: usize| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        };
        let made = self.basis.to_recordings(seen, self.rest, hide, &progress);
        bar.finish_and_clear();
        let made = made.into_diagnostic()?;
        recording_checks::check_scale(made.similarity.scale())?;
        output::step(|| {
            let rms = made.rms_m.map_or_else(String::new, |r| format!(", contours met to {:.2} mm", r * 1e3));
            format!("{}: scale {:.3}{rms}", made.body.what, made.similarity.scale())
        });
        let adaptation = made.adaptation();
        Ok(Speaker { placement: made.placement, ..self.known(made.body, Some(&adaptation)) })
    }

    /// A body with its adaptation.
    fn known(&self, body: Body<2>, adaptation: Option<&Adaptation>) -> Speaker {
        let followed = match adaptation {
            Some(a) => a.followed(&body),
            None => {
                let bones: Vec<String> = body.bones.iter().map(|b| b.name.clone()).collect();
                adapt::followed(&body, &bones)
            }
        };
        Speaker { body, followed, adaptation: adaptation.cloned(), placement: None }
    }

    /// What is not known of the speaker's shape; nothing for bodies that are no tongues.
    pub fn shape(
        &self,
        speaker: &Speaker,
        wall: Option<&Contact>,
        seen: &[&Seen],
    ) -> miette::Result<Option<RestShape>> {
        let body = &speaker.body;
        if [HYOID, MANDIBLE].iter().any(|bone| body.bone(bone).is_empty()) {
            output::note(&format!(
                "{} has no bones \"{MANDIBLE}\" and \"{HYOID}\", so its shape at rest counts as known",
                body.what
            ));
            return Ok(None);
        }
        let (model, contracting) = (self.model(), &self.basis.contracting);
        let shape = match &speaker.placement {
            Some(placement) => RestShape::of_coils(body, &model, contracting, placement),
            None => {
                let sight = Sight::of(seen, &[]);
                let at = |bone: &str| if bone == HYOID { sight.hyoid } else { sight.spine };
                RestShape::of(body, &model, contracting, at)
            }
        };
        let touching = |shape: RestShape| match wall {
            Some(wall) => shape.under(wall.clone()),
            None => Ok(shape),
        };
        let shape = shape.and_then(touching).into_diagnostic()?;
        let is_kept =
            speaker.is_fitted() || speaker.adaptation.as_ref().is_some_and(|a| !a.coils_m.is_empty());
        Ok(Some(if is_kept { shape.as_found() } else { shape }))
    }

    pub fn found(&self, mut body: Body<2>, recording: TrackedRecording) -> Found {
        let TrackedRecording { rest, frames, gestures, segments } = recording;
        body.mesh.nodes = rest;
        Found { body, contracting: self.basis.contracting.clone(), frames, gestures, segments }
    }

    /// The journal of this run, with the recordings that an earlier run of the same inputs has finished; `sound` is the tract that was read.
    pub fn journal(
        &self,
        out: &OutputDir,
        seen: &[&Seen],
        sound: &str,
    ) -> miette::Result<Journal<TrackedRecording>> {
        let words = super::words_of_the_result();
        let (mesh, model) = (&self.given.body.mesh, self.model());
        let key = batch::sha256(&[
            tongue_fit::VERSION,
            &words.join(" "),
            &format!("{seen:?}"),
            &format!("{mesh:?} {model:?} {:?}", self.given.adaptation),
            sound,
        ]);
        let path = out.path().join("track.journal");
        let last_words = format!(
            "stopped; the finished recordings are kept in \"{}\": the same command resumes after them",
            path.display()
        );
        let journal = Journal::open(path, &key, &words, seen.len()).into_diagnostic()?;
        journal.notes().iter().for_each(|note| output::note(note));
        if !journal.is_empty() {
            output::note(&format!("resuming after {} of {} recordings", journal.len(), seen.len()));
        }
        interrupt::set_last_words(Some(last_words));
        Ok(journal)
    }

    pub fn track(
        &self,
        speaker: &Speaker,
        (shape, wall): (&Option<RestShape>, &Option<Contact>),
        sound: Option<&Sound>,
        seen: &[&Seen],
        hide: &[String],
    ) -> miette::Result<Vec<TrackedRecording>> {
        let body = &speaker.body;
        let effects = wall.iter().map(|w| Box::new(w.clone()) as Box<dyn Effect<2>>).collect();
        let additions = Additions { effects, ..Additions::default() };
        let system =
            System::with(&body.mesh, &self.model(), &self.basis.contracting, additions).into_diagnostic()?;
        let freed = seen.first().map(|s| self.freed(s)).into_iter().flatten();
        let freed = freed.map(|name| FreedBone::of(body, &self.model(), &self.basis.contracting, name));
        let freed = freed.collect::<Result<Vec<_>, _>>().into_diagnostic()?;
        let surface = TongueSurface::of(body)
            .ok_or_else(|| miette!("{} has no outline of tissue to compare with", body.what))?;
        let mut frames: Vec<_> = seen
            .iter()
            .map(|s| track::frames(&speaker.seated(s), &surface, &speaker.followed, hide))
            .collect();
        frames.iter_mut().for_each(|f| sound.iter().for_each(|s| s.listen(f, &speaker.followed)));
        let bar = output::bar(1, "{bar:40} {percent:>3} % of the tensions, {eta} left")?;
        let progress = |done: usize, of: usize| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        };
        let stage =
            Stage { system: &system, followed: &speaker.followed, freed: &freed, shape: shape.as_ref() };
        let found = track::track(&stage, frames, &self.basis.settings, &progress);
        bar.finish_and_clear();
        found.ok_or_else(|| {
            miette!(
                "the covariance of what was seen cannot be factorised; look for numbers that are not finite or very large in the \
                 recordings"
            )
        })
    }

    /// The bones whose displacement is an unknown in a recording.
    pub fn freed<'b>(&'b self, seen: &'b Seen) -> impl Iterator<Item = &'b str> {
        self.free_bones.iter().map(|b| b.trim()).filter(|b| !seen.shows_bone(b))
    }

    /// Refuses free bones without an effect.
    pub fn check_freed(&self, seen: &[&Seen]) -> miette::Result<()> {
        let mut names: Vec<&str> = Vec::new();
        for name in self.free_bones.iter().map(|b| b.trim()) {
            if names.contains(&name) {
                return Err(miette!("--free-bone {name}: this bone is free already; give each bone once"));
            }
            FreedBone::of(&self.given.body, &self.model(), &self.basis.contracting, name)
                .into_diagnostic()?;
            if seen.iter().all(|s| s.shows_bone(name)) {
                return Err(miette!(
                    "--free-bone {name}: it is seen in every recording, and carried to where it is seen; leave the option out"
                ));
            }
            names.push(name);
        }
        Ok(())
    }

    /// The given palate as a wall; `None` if the body at rest would pass through it.
    pub fn wall(&self, body: &Body<2>) -> miette::Result<Option<Contact>> {
        let Some(palate) = self.palate else { return Ok(None) };
        let stiffness = system::coefficients(&body.mesh, &self.model()).into_diagnostic()?.tissue_stiffness;
        let wall = Contact::new(palate.to_vec(), &body.mesh.surface_nodes(), stiffness, PALATE_REACH_M);
        if wall.penetrated(&body.mesh.nodes, &body.mesh.connections).is_some() {
            output::note("the body at rest passes through the palate: the tongue is tracked without contact");
            return Ok(None);
        }
        Ok(Some(wall))
    }
}
