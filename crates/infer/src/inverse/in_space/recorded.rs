//! Marks of a body in space, frame by frame: from its own tables, recordings of the midsagittal plane, or lengths of a vowel.

use std::path::Path;

use tongue_core::body::Body;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::Observable;
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording, Mark};
use tongue_input::measured::{
    LengthMeasure, Marked, ReadError, SpaceFrame, SpaceMark, Target, TargetKind, read_space_marks,
};

use crate::adapt::{Registration, RegistrationData, RestError};
use crate::error_model::{Along, ErrorModel, distances_along};
use crate::standard_deviations::{STRETCH, STRETCH_OF_BASELINE_IN_SPACE};

/// Marks of one speaker in the frame of a body in space.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// For each frame the name of its recording, if there is one, and its marks.
    pub frames: Vec<(Option<String>, SpaceFrame)>,
    /// Placement of the body; `None` where the marks are in its frame already.
    pub placed: Option<Registration>,
}

impl Recorded {
    /// Reads tables of bodies in space ([`read_space_marks`]); `usual_sd_m` is the standard deviation where a table gives none.
    pub fn of_tables(paths: &[impl AsRef<Path>], usual_sd_m: f64) -> Result<Self, ReadError> {
        let frames = read_space_marks(paths, usual_sd_m)?;
        Ok(Self { frames: frames.into_iter().map(|frame| (None, frame)).collect(), placed: None })
    }

    /// Whether there are coils, whose distances are counted from the tip.
    pub fn has_coils(&self) -> bool {
        let mut marks = self.frames.iter().flat_map(|(_, frame)| &frame.marks);
        marks.any(|mark| matches!(mark.what, Marked::Coil { .. }))
    }

    /// The lengths of a vowel: a mark for every measured muscle, with the standard deviation of its rounding and of the model's error.
    pub fn of_lengths(target: &Target, body: &Body<3>) -> Self {
        let rest = |m: usize| {
            let line = body.lines.iter().find(|(name, _)| *name == target.muscles[m]);
            line.map_or(1e-3 * target.baseline_mm[m], |(_, line)| line.value(&body.mesh.nodes))
        };
        let of_baseline = if target.has_active_baseline() { STRETCH_OF_BASELINE_IN_SPACE } else { 0.0 };
        let of_model = STRETCH.hypot(of_baseline);
        let rounding = |half_width_mm: &[f64], mm: &[f64], m: usize| half_width_mm[m] / mm[m] / 3f64.sqrt();
        let marks = target.comparable(target.kind).map(|m| {
            let (value, reference) = (target.values[m], target.reference);
            let own = rounding(&target.half_width_mm, &target.measured_mm, m);
            // The standard deviation of a stretch or ratio, times the length at rest by which it is multiplied.
            let (measure, rounding_m, model_m) = match target.kind {
                TargetKind::Stretch => {
                    let other = rounding(&target.baseline_half_width_mm, &target.baseline_mm, m);
                    (LengthMeasure::Stretch(value), value * rest(m) * own.hypot(other), of_model * rest(m))
                }
                TargetKind::Ratio => {
                    let name = target.muscles[reference].clone();
                    let other = rounding(&target.half_width_mm, &target.measured_mm, reference);
                    let same_length_m = value * rest(reference);
                    let model_m = of_model * rest(m).hypot(same_length_m);
                    (LengthMeasure::Ratio(value, Some(name)), same_length_m * own.hypot(other), model_m)
                }
            };
            let sd_m = rounding_m.hypot(model_m);
            SpaceMark { what: Marked::Muscle { muscle: target.muscles[m].clone(), measure }, sd_m }
        });
        let frame = SpaceFrame { time_s: None, marks: marks.collect() };
        Self { frames: vec![(None, frame)], placed: None }
    }

    /// Contours and coils of recordings, brought into the frame of the body by placing its midsagittal `section` ([`RegistrationData`]),
    /// under the palate of the recordings if there is one; without a section they are in that frame already. Bones stay where the body has
    /// them at rest.
    ///
    /// # Errors
    /// [`RestError`] for recordings that contain too little to place a body, or whose bones belong to no such contour.
    pub fn of_recordings(
        recordings: &[&AlignedRecording],
        section: Option<&Body<2>>,
        palate: Option<&[Point]>,
    ) -> Result<Self, RestError> {
        let placed = section
            .map(|section| {
                RegistrationData::of_recordings(recordings, &[])
                    .with_palate(palate)
                    .place(section)?
                    .in_one_frame()
            })
            .transpose()?;
        let similarity = placed.as_ref().map_or(Similarity::IDENTITY, |p| p.similarity);
        let mut frames = Vec::new();
        for one in recordings {
            let by_coils = placed.as_ref().and_then(|p| p.by_coils.as_ref());
            let seated =
                by_coils.map_or_else(|| (*one).clone(), |placement| placement.with_coil_positions(one));
            frames.extend(one.frames.iter().map(|frame| {
                let marks = space_marks(&seated, frame, &similarity);
                (Some(one.name.clone()), SpaceFrame { time_s: Some(frame.time_s), marks })
            }));
        }
        Ok(Self { frames: frames.into_iter().filter(|(_, f)| !f.marks.is_empty()).collect(), placed })
    }
}

/// Marks of a frame of a recording, in the frame of the body.
fn space_marks(
    recording: &AlignedRecording,
    frame: &AlignedFrame,
    similarity: &Similarity,
) -> Vec<SpaceMark> {
    let scale = similarity.scale();
    let contour: Vec<&Mark> = frame.contour.iter().flatten().collect();
    let at_mm = distances_along(contour.iter().map(|mark| Some(mark.at)), 1e3);
    let along = contour.iter().zip(at_mm).map(|(m, at_mm)| Along { channel: 0, at_mm, sd_mm: 1e3 * m.sd });
    let own_mm2 = ErrorModel::default().own(&along.collect::<Vec<_>>(), f64::INFINITY);
    let on_contour = contour.iter().zip(own_mm2).map(|(m, mm2)| SpaceMark {
        what: Marked::Contour(similarity.place_back(m.at)),
        sd_m: 1e-3 * mm2.sqrt() / scale,
    });
    let coils = recording.sensors.iter().zip(&frame.sensors).filter_map(|((_, behind), mark)| {
        let Mark { at, sd } = (*mark)?;
        let what = Marked::Coil { behind_tip_m: behind.max(0.0) / scale, place: similarity.place_back(at) };
        Some(SpaceMark { what, sd_m: sd / scale })
    });
    on_contour.chain(coils).collect()
}
