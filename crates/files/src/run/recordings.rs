//! Recordings of one speaker without their outliers, and what in them and in their results is refused, left out or noted.

use std::path::Path;

use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::choice;
use tongue_core::geometry::Point;
use tongue_core::observe::TongueSurface;
use tongue_core::statistics::{grouped, median};
use tongue_infer::adapt::AdaptationInput;
use tongue_infer::track::{self, Followed, FrameStatus, Tracked, TrackedRecording};
use tongue_input::measured::recording::{
    AlignedFrame, AlignedRecording, FaultKind, Map, Recording, RecordingFaults, Severity, WITHOUT_BONES,
    Waveform, check_plausibility, other_size, remove_outliers,
};

use super::track::{TrackRun, TrackedBody, given_body};
use crate::report::{RecordingResult, TrackRecord, TrackResults, joined, names_or_none, status_name, tally};
use crate::simulation::SimulationError;

/// A recording without its outliers.
#[derive(Debug, Clone)]
pub struct ScreenedRecording {
    pub seen: AlignedRecording,
    pub sound: Option<Waveform>,
    pub faults: RecordingFaults,
    /// The given palate in the frame of the body, m.
    pub palate: Option<Vec<Point>>,
    /// Whether the recording is plausible enough for its results to be trusted.
    pub is_trusted: bool,
}

impl ScreenedRecording {
    /// Screens the recordings of one speaker, each given with the name of its file and the file of its sound. Returns those that can be
    /// tracked, and for each other one a sentence that says why it is left out. `own` is the palate of the recordings in their axes, m, and
    /// `of_body` the one that is used without it, m. `tell` gets a line about what each recording shows.
    ///
    /// # Errors
    /// For a map that does not fit a recording.
    pub fn all(
        read: &[(&str, &Recording, Option<&Path>)],
        map: &Map,
        [own, of_body]: [Option<&[Point]>; 2],
        tell: &dyn Fn(&str),
    ) -> Result<(Vec<Self>, Vec<String>), SimulationError> {
        let (mut all, mut left_out): (Vec<Self>, Vec<String>) = (Vec::new(), Vec::new());
        let recordings: Vec<&Recording> = read.iter().map(|(_, recording, _)| *recording).collect();
        for ((file, _, sound), seen) in read.iter().zip(AlignedRecording::all(&recordings, map)) {
            let mut seen = seen.map_err(|e| SimulationError::Refused(format!("{file}: {e}")))?;
            let side = if seen.mirrored { -1.0 } else { 1.0 };
            let palate = own.map(|palate| {
                let points = palate.iter().map(|p| Point::new(side * p.x, p.y));
                points.map(|p| map.placement().map_or(p, |to| to.place(p))).collect::<Vec<_>>()
            });
            let doubts = check_plausibility(&seen, palate.as_deref());
            if let Some(doubt) = doubts.iter().find(|d| d.is_refused()) {
                left_out.push(format!("{file}, {}: {}", seen.name, doubt.message));
                continue;
            }
            let is_trusted = doubts.iter().all(|d| d.severity < Severity::Untrusted);
            seen.notes.extend(doubts.into_iter().map(|d| d.message));
            let faults = remove_outliers(&mut seen, palate.as_deref().or(of_body));
            let beyond = faults.iter().flatten().filter(|fault| fault.kind == FaultKind::BeyondPalate);
            let beyond: usize = beyond.map(|fault| fault.points.len()).sum();
            let left = seen.frames.iter().flat_map(AlignedFrame::points).flatten().count();
            let is_trusted =
                is_trusted && (palate.is_some() || beyond as f64 <= MOST_BEYOND * (beyond + left) as f64);
            // Recordings are distinguished by their names in every output.
            let same = all.iter().filter(|s| s.seen.name == seen.name).count();
            if same > 0 {
                seen.name = format!("{} ({})", seen.name, same + 1);
            }
            tell(&format!(
                "{}: {} frames, {} contour points, {} sensors, bones: {}; not used: {}",
                seen.name,
                seen.frames.len(),
                seen.contour.len(),
                seen.sensors.len(),
                names_or_none(&seen.bones),
                names_or_none(&seen.ignored)
            ));
            let sound = sound.and_then(|path| Waveform::read(path).map_err(|why| seen.notes.push(why)).ok());
            all.push(Self { seen, sound, faults, palate, is_trusted });
        }
        while let Some((number, doubt)) = other_size(&all.iter().map(|s| &s.seen).collect::<Vec<_>>()) {
            left_out.push(format!("{}: {}", all.remove(number).seen.name, doubt.message));
        }
        Ok((all, left_out))
    }

    /// Refuses maps with points that the body lacks: unknown bones, and sensors beyond the end of its surface.
    pub fn check_points(all: &[Self], body: &Body<2>) -> Result<(), SimulationError> {
        let along = TongueSurface::of(body).map(|s| s.tip);
        for Self { seen, .. } in all {
            if let Some(bone) = seen.bones.iter().find(|b| body.bone(b).is_empty()) {
                let known: Vec<&str> = body.bones.iter().map(|b| b.name.as_str()).collect();
                return Err(SimulationError::Refused(format!(
                    "{}: the map names the bone {bone:?}, which {} does not have; {}",
                    seen.name,
                    body.what,
                    choice::hint(bone, known)
                )));
            }
            let places = seen.sensors.iter().zip(&seen.measured).filter(|(_, measured)| **measured);
            let beyond =
                places.map(|(sensor, _)| sensor).find(|(_, at)| along.is_some_and(|along| *at > along));
            if let Some((sensor, at)) = beyond {
                return Err(SimulationError::Refused(format!(
                    "{}: surface_mm of {sensor} is {:.0}, but the surface of {} is {:.0} mm long from the tip to the root; correct it, or \
                     write \"coil\"",
                    seen.name,
                    at * 1e3,
                    body.what,
                    along.unwrap_or(0.0) * 1e3
                )));
            }
        }
        Ok(())
    }

    /// Sentences about the recordings; one that several recordings share names all of them.
    pub fn notes(all: &[Self], body: &Body<2>, freed: &[String]) -> Vec<String> {
        let notes = all.iter().flat_map(|one| {
            one.own_notes(body, freed).into_iter().map(|note| (one.seen.name.as_str(), note))
        });
        let same = grouped(notes, |(_, note)| note.clone()).into_iter();
        same.map(|all| format!("{}: {}", joined(all.iter().map(|(name, _)| name), "; "), all[0].1)).collect()
    }

    fn own_notes(&self, body: &Body<2>, freed: &[String]) -> Vec<String> {
        let Self { seen, faults, .. } = self;
        let mut out = seen.notes.clone();
        let count = seen.frames.len();
        for (kind, what) in [
            (FaultKind::Jumped, "points jump; they are left out"),
            (FaultKind::OutOfOrder, "points of the contour are exchanged; they are left out"),
            (FaultKind::BeyondPalate, "points lie beyond the palate; they are left out"),
            (FaultKind::BoneMissing, "a bone was not seen; it is placed where the nearest frames show it"),
        ] {
            let n = faults.iter().flatten().filter(|f| f.kind == kind).count();
            if n > 0 {
                out.push(format!("in {n} of {count} frames {what}"));
            }
        }
        for (nth, name) in seen.contour.iter().enumerate() {
            let shown =
                seen.frames.iter().filter(|f| f.contour.get(nth).is_some_and(Option::is_some)).count();
            // Of a fan of lines many are never met by the tongue.
            if (1..count / 2).contains(&shown) {
                out.push(format!("{name} was seen in {shown} of {count} frames"));
            }
        }
        for bone in [MANDIBLE, HYOID] {
            if seen.shows_bone(bone) || body.bone(bone).is_empty() {
                continue;
            }
            let what = if freed.iter().any(|f| f.trim() == bone) {
                "its displacement is an unknown".to_owned()
            } else {
                format!(
                    "it stays where it is at rest; track --free-bone {bone} makes its displacement an unknown"
                )
            };
            out.push(format!("the {} was never seen; {what}", bone.replace('_', " ")));
        }
        out
    }

    /// Sentences about points that are left out in most frames of a recording.
    pub fn left_out(results: &[RecordingResult]) -> Vec<String> {
        let mut out = Vec::new();
        for RecordingResult { seen, tracked, .. } in results {
            let (frames, points) = (&tracked.frames, seen.contour.len() + seen.sensors.len());
            for name in seen.names().take(points) {
                let faults =
                    frames.iter().filter(|f| f.faults.iter().any(|fault| fault.points.contains(name)));
                let (count, of) = (faults.count(), frames.len());
                if of > 1 && 2 * count > of {
                    out.push(format!(
                        "{}: {name} is left out in {count} of {of} frames; correct it, or write \"{name}\" = \"ignore\" into a map",
                        seen.name
                    ));
                }
            }
        }
        out
    }

    /// Names the recordings whose notes say that they cannot be trusted; `None` if there are none.
    pub fn implausible(all: &[Self]) -> Option<String> {
        let names: Vec<&str> = all.iter().filter(|r| !r.is_trusted).map(|r| r.seen.name.as_str()).collect();
        (!names.is_empty())
            .then(|| format!("recordings cannot be trusted for what is noted of them: {}", names.join("; ")))
    }
}

impl TrackRun<'_> {
    /// Refuses recordings that do not fit the body. Returns notes about all: their faults, and doubts whether they fit.
    pub fn check(&self, recordings: &[ScreenedRecording]) -> Result<Vec<String>, SimulationError> {
        ScreenedRecording::check_points(recordings, self.basis.body)?;
        let mut notes = ScreenedRecording::notes(recordings, self.basis.body, self.free_bones);
        if self.is_given {
            let bones = given_body(self.basis.body.clone(), self.adaptation).followed;
            recordings.iter().try_for_each(|one| check_frame(&one.seen, &bones))?;
        } else {
            let seen: Vec<&AlignedRecording> = recordings.iter().map(|r| &r.seen).collect();
            let placed = self.basis.place(&seen, self.hide)?;
            notes.extend(placed.doubt());
            notes.extend(check_scale(placed.similarity.scale(), placed.bones_apart_m)?);
        }
        Ok(notes)
    }

    /// The record of recordings that were tracked, and a sentence for each one that the body cannot reach, which is left out. All recordings
    /// decide which labels are compared.
    pub fn record(
        &self,
        speaker: &TrackedBody,
        recordings: Vec<ScreenedRecording>,
        tracked: Vec<TrackedRecording>,
    ) -> (TrackRecord, Vec<String>) {
        let seen: Vec<&AlignedRecording> = recordings.iter().map(|one| &one.seen).collect();
        let compared = track::labels_to_compare(&seen);
        let (mut results, mut unmet) = (Vec::new(), Vec::new());
        for (one, tracked) in recordings.into_iter().zip(tracked) {
            if let Some(why) = out_of_reach(&one.seen, &tracked.frames, !self.is_given) {
                unmet.push(format!("{}: {why}", one.seen.name));
            } else {
                let freed = self.unseen_free_bones(&one.seen).map(str::to_owned).collect();
                results.push(RecordingResult::new(one, freed, tracked));
            }
        }
        let AdaptationInput { body, settings, contracting, palate, .. } = &self.basis;
        let muscles: Vec<String> = contracting.iter().map(|&m| body.mesh.muscles[m].name.clone()).collect();
        let met: Vec<&AlignedRecording> = results.iter().map(|one| &one.seen).collect();
        let of_recordings: Vec<&[Tracked]> = results.iter().map(|one| &one.tracked.frames[..]).collect();
        let frames: Vec<&Tracked> = of_recordings.iter().copied().flatten().collect();
        let labelled = results.iter().map(|one| (&one.tracked.frames[..], &one.seen.labels[..]));
        let draws = results.iter().map(|one| &one.tracked.compared[..]);
        let record = TrackRecord {
            recordings: met.iter().map(|seen| seen.name.clone()).collect(),
            body: speaker.body.what.clone(),
            rest: speaker.adaptation.as_ref().map(|a| a.rest),
            placement: speaker.placement.clone(),
            settings: settings.clone(),
            statuses: tally(frames.iter().map(|f| status_name(&f.status))),
            untrusted: None,
            median_rms_mm: median(frames.iter().filter_map(|f| f.rms_m)).map(|r| r * 1e3),
            comparisons: track::compare(&compared, &muscles, &settings.link, draws),
            courses: track::course_summaries(&muscles, &frames, &settings.link),
            repeats: track::repeatability(labelled, &muscles),
            formants: None,
            held_out: track::held_out(&met, &of_recordings, self.hide),
            notes: Vec::new(),
            results: TrackResults {
                body: speaker.body.clone(),
                contracting: contracting.clone(),
                muscles,
                palate: palate.unwrap_or_default().to_vec(),
                recordings: results,
            },
            wall_s: 0.0,
        };
        (record, unmet)
    }
}

/// Refuses a recording whose bones are too far from those of a body to be in its frame.
fn check_frame(seen: &AlignedRecording, followed: &[Followed]) -> Result<(), SimulationError> {
    for bone in followed {
        let Some(number) = seen.bone(&bone.name) else { continue };
        let away = seen.frames.iter().filter_map(|f| f.bones[number]).map(|p| (p - bone.mark).norm());
        if let Some(median) = median(away).filter(|d| *d > MOST_BONE_MOTION_M) {
            return Err(SimulationError::Refused(format!(
                "{}: the {} is seen {:.0} mm from where the body has it, so the recording is not in the body's frame; adapt a body to the \
                 speaker (tongue-fit adapt), or correct back, up, turn_deg and shift_mm in a map",
                seen.name,
                bone.name.replace('_', " "),
                median * 1e3
            )));
        }
    }
    Ok(())
}

/// Largest part of the points that may lie beyond the palate in a recording that is trusted.
const MOST_BEYOND: f64 = 0.2;

/// Largest plausible motion of a bone in speech, m.
const MOST_BONE_MOTION_M: f64 = 20e-3;

/// Range of a speaker's size over that of the body that is adapted.
const SCALES: std::ops::RangeInclusive<f64> = 0.6..=1.6;

/// Range of a size that nearly all speakers have, children among them.
const USUAL_SCALES: std::ops::RangeInclusive<f64> = 0.7..=1.45;

/// Distances of the hyoid from the mental spine in speakers of all sizes, m: in this range their unit and names are right.
const USUAL_BONES_M: std::ops::RangeInclusive<f64> = 30e-3..=60e-3;

/// Refuses a body of an implausible size, and returns a note about one of an unusual size. `bones_apart_m` is the distance between the
/// mental spine and the hyoid as they were seen.
pub fn check_scale(scale: f64, bones_apart_m: Option<f64>) -> Result<Option<String>, SimulationError> {
    let what = format!("the speaker would need a body {scale:.3} times as large as the one given");
    let help = match bones_apart_m.filter(|m| USUAL_BONES_M.contains(m)) {
        Some(m) => format!(
            "the mental spine and the hyoid are apart by a usual {:.0} mm, so the contour is not of their size: give both in one frame, or \
             leave the bones out with a map (--map) of the line {WITHOUT_BONES}",
            m * 1e3
        ),
        None => "correct the unit (unit_mm and scale in a map), or the names of the bones".to_owned(),
    };
    let [possible, usual] =
        [&SCALES, &USUAL_SCALES].map(|s| format!("where {} to {} are", s.start(), s.end()));
    if !SCALES.contains(&scale) {
        return Err(SimulationError::Refused(format!("{what}, {possible} possible; {help}")));
    }
    let is_usual = USUAL_SCALES.contains(&scale);
    Ok((!is_usual).then(|| format!("{what}, {usual} usual; if that is wrong, {help}")))
}

/// The distance between the mental spine and the hyoid as they were seen, m.
pub fn bones_apart_m(followed: &[Followed]) -> Option<f64> {
    let [spine, hyoid] =
        [MANDIBLE, HYOID].map(|bone| followed.iter().find(|f| f.name == bone).map(|f| f.mark));
    Some((spine? - hyoid?).norm())
}

/// Why the tensions of a recording are not reported: most of its frames cannot be reached, or it is met badly.
fn out_of_reach(seen: &AlignedRecording, frames: &[Tracked], is_adapted: bool) -> Option<String> {
    /// Largest median of the root mean square distance, mm: real speakers are met to 0.1 to 1.5 mm.
    const MOST_RMS_MM: f64 = 2.5;
    let out = frames.iter().filter(|f| f.status == FrameStatus::OutOfReach).count();
    let rms = median(frames.iter().filter_map(|f| f.rms_m)).map(|r| r * 1e3);
    let is_met = rms.is_none_or(|mm| mm <= MOST_RMS_MM);
    if 2 * out <= frames.len() && is_met {
        return None;
    }
    let what = if is_met || 2 * out > frames.len() {
        format!("{out} of {} frames cannot be reached by this body", frames.len())
    } else {
        "its points are met badly by this body".to_owned()
    };
    let met = rms.map_or_else(String::new, |mm| format!(" (met to {mm:.1} mm)"));
    let which = if seen.sensors.is_empty() { "names of the bones" } else { "names and places of coils" };
    let other = if is_adapted { "" } else { ", or adapt a body to the speaker (tongue-fit adapt)" };
    Some(format!(
        "{what}{met}, so no tensions are reported; check the unit, the axes and the {which}, and correct them in a map (turn_deg turns a \
         recording whose axes are not those of the head){other}"
    ))
}

#[cfg(test)]
mod tests {
    use super::check_scale;

    #[test]
    fn a_usual_distance_of_the_bones_shows_that_the_unit_is_right() {
        for scale in [0.5, 2.1] {
            let error = |apart_m| check_scale(scale, apart_m).unwrap_err().to_string();
            let usual = error(Some(42e-3));
            assert!(
                usual.contains("in one frame") && usual.contains("ignore") && !usual.contains("unit"),
                "{usual}"
            );
            assert!([error(Some(4e-3)), error(None)].iter().all(|error| error.contains("unit_mm")));
        }
        assert!(check_scale(1.5, Some(42e-3)).unwrap().unwrap().contains("in one frame"));
        assert_eq!(check_scale(1.0, None).unwrap(), None);
    }
}
