//! Places a body in the frame of a recording: shift, turn and scale by least squares on all observations.
//!
//! ```text
//! minimise  sum (d_i / 3 mm)² + (spine / 2.5 mm)² + (hyoid / 5 mm)² + (turn / 20°)² + (ln scale / 0.15)² + |M^-1 (trace - vault)|²
//! ```
//! with `d_i` the distances of the mean contour from the surface at rest. The muscles can pull almost any body to a contour, so a good fit
//! of the frames does not confirm the placement. The turn is uncertain by about 9°, the shift by 5 mm and the scale by a tenth, which
//! results have to include.

use nalgebra::DVector;

use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::TongueSurface;
use tongue_input::measured::recording::{AlignedRecording, WITHOUT_BONES};

use super::coils::{self, Coil, FEWEST_COILS, Placement, SHIFT_UNIT_M, TURNS, Vault, resample};
use super::{RestError, mark_of, median_point, outline_of};
use crate::least_squares::minimise;
use crate::standard_deviations as sd;

/// Number of points to which a mean contour is resampled, so that its weight does not depend on its sampling.
const POINTS: usize = 11;
/// Standard deviation of the turn relative to the axes of the recording, rad.
const TURN_SD: f64 = sd::TURN_DEG.to_radians();
/// Sum of squares above which the observations do not belong to one tongue: most speakers have less than 20, and one whose hyoid and mental
/// spine are 7 and 5 mm off has 29.
const MOST_COST: f64 = 45.0;
/// Largest distance of a bone from its place in the placed body, m, in real recordings whose contour and bones are in one frame.
const FARTHEST_BONE_M: f64 = 10e-3;
/// With fewer frames the distance may be larger, up to twice as large in a single one, because few postures are seen. In parts of a real
/// recording the hyoid lies up to 12 mm from its place in 1 frame, 11 in 10, 10 in 20 and 7 in 40.
const FEW_FRAMES: f64 = 40.0;
/// Largest distance for contours without a root, m: bones are 10 to 12 mm off where the rear fifth to third is missing.
const FARTHEST_BONE_WITHOUT_ROOT_M: f64 = 14e-3;
/// Usual ratios of a contour's length to the distance between the two bones: 2.2 in a real speaker, 2.7 in the built-in body.
const USUAL_LENGTHS: std::ops::RangeInclusive<f64> = 1.9..=2.85;
/// Ratios of a speaker's size to the body's at which a distant bone is not explained by a wrong unit.
const RIGHT_UNIT_SCALES: std::ops::RangeInclusive<f64> = 0.75..=1.3;
/// Distance along the surface from the root at which a contour begins, m; used only at the start of the search.
const SEEN_FROM_M: f64 = 8e-3;

/// Observations of a speaker, over all frames, m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RegistrationData {
    /// The mean contour from the root to the tip.
    pub contour: Vec<Point>,
    pub spine: Option<Point>,
    pub hyoid: Option<Point>,
    /// Coils on the tongue, which are used if no contour was observed.
    pub coils: Vec<Coil>,
    pub palate: Vec<Point>,
    /// Number of frames; 0 for a drawn contour.
    pub frames: usize,
}

#[derive(Debug, Clone, Default)]
pub struct Registration {
    pub similarity: Similarity,
    /// Root mean square distance of the mean contour from the body at rest, m.
    pub rms_m: f64,
    /// Distances of the mental spine and the hyoid from where the placed body has them, m.
    pub bones_m: Vec<(&'static str, f64)>,
    /// Observed distance between the two, m.
    pub bones_apart_m: Option<f64>,
    pub contour_m: f64,
    /// Sum of the squared distances of contour and bones, in standard deviations. If the speaker is larger than the body, distances are
    /// divided by the scale first.
    pub cost: f64,
    pub by_coils: Option<Placement>,
    /// Whether a traced palate was not used, because it fits no place where contour and bones fit.
    pub without_palate: bool,
    pub frames: usize,
}

impl Registration {
    /// The placement; [`RestError::NotOneFrame`] if a bone is farther from its place than in recordings whose contour and bones are in one
    /// frame.
    pub fn in_one_frame(self) -> Result<Self, RestError> {
        let of_few = FARTHEST_BONE_M * (2.0 - self.frames as f64 / FEW_FRAMES).max(1.0);
        let is_short = self.lengths().is_some_and(|lengths| lengths < *USUAL_LENGTHS.start());
        let most_m = if is_short { of_few.max(FARTHEST_BONE_WITHOUT_ROOT_M) } else { of_few };
        match self.far_bone(most_m) {
            Some(what) => Err(RestError::NotOneFrame(format!(
                "{what}: {}, or leave the bones out with a map (--map) of the line {WITHOUT_BONES}",
                self.cause()
            ))),
            None => Ok(self),
        }
    }

    /// Length of the contour over the distance between the bones.
    fn lengths(&self) -> Option<f64> {
        self.bones_apart_m.map(|apart_m| self.contour_m / apart_m).filter(|lengths| *lengths > 0.0)
    }

    /// Why a bone is far from its place, and the remedy.
    fn cause(&self) -> String {
        let (times, scale) = (self.lengths().unwrap_or(*USUAL_LENGTHS.start()), self.similarity.scale());
        let why = match times {
            t if t > *USUAL_LENGTHS.end() => {
                "its unit is larger than that of the bones; give both in one unit"
            }
            t if t < *USUAL_LENGTHS.start() => {
                "its root is not drawn, its unit is smaller, or a bone is another point; correct that"
            }
            _ if !RIGHT_UNIT_SCALES.contains(&scale) => {
                return format!(
                    "the recording is {scale:.2} times as large as the body; correct its unit (unit_mm in a map)"
                );
            }
            _ => return "contour and bones are not in one frame; export both in the same one".to_owned(),
        };
        let [least, most] = [USUAL_LENGTHS.start(), USUAL_LENGTHS.end()];
        format!(
            "the contour is {times:.1} times as long as the bones are apart, where {least} to {most} times is usual: {why}"
        )
    }

    /// A sentence about the bone that is farthest from its place, if it is farther than this.
    fn far_bone(&self, most_m: f64) -> Option<String> {
        let (bone, off_m) = self.bones_m.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (*off_m > most_m).then(|| {
            format!(
                "the {} lies {:.0} mm from where a tongue with this contour has it, where {:.0} mm are the most",
                bone.replace('_', " "),
                off_m * 1e3,
                most_m * 1e3
            )
        })
    }

    /// A sentence about observations that no place of the body explains together.
    pub fn doubt(&self) -> Option<String> {
        if self.without_palate {
            return Some(
                "the palate does not fit the contour and the bones, so the body was placed without it: check the frame and the unit of \
                 the palate"
                    .to_owned(),
            );
        }
        if let Some(what) = self.far_bone(FARTHEST_BONE_M) {
            return Some(if (self.frames as f64) < FEW_FRAMES {
                format!(
                    "{what} in whole recordings: with so few frames ({}) the body is placed less well; give the whole recording, or check that \
                     contour and bones are in one frame",
                    self.frames
                )
            } else {
                format!("{what}: {}", self.cause())
            });
        }
        (self.cost > MOST_COST && !self.bones_m.is_empty()).then(|| {
            let bones = self.bones_m.iter().map(|(b, m)| format!("{} by {:.0}", b.replace('_', " "), m * 1e3));
            format!(
                "the contour and the bones do not fit one tongue (the contour is missed by {:.0} mm, the {} mm): correct their names, or give \
                 them in one frame",
                self.rms_m * 1e3,
                bones.collect::<Vec<_>>().join(" mm, the ")
            )
        })
    }
}

impl RegistrationData {
    /// Observations from recordings of one speaker. Points in `hide` are not used; of a hidden coil only its distance from its neighbours
    /// is used, if three others are left.
    pub fn of_recordings(recordings: &[&AlignedRecording], hide: &[String]) -> Self {
        let mut all: Vec<(Vec<Point>, usize)> = Vec::new();
        for one in recordings {
            let shown = mean_contour(one).zip(&one.contour).filter(|(_, name)| !hide.contains(name));
            let means: Vec<Point> = shown.filter_map(|(at, _)| at).collect();
            all.extend(resample(&means, POINTS).map(|points| (points, one.frames.len())));
        }
        let frames: usize = all.iter().map(|(_, n)| n).sum();
        let contour = (0..if all.is_empty() { 0 } else { POINTS })
            .map(|i| all.iter().map(|(p, n)| p[i] * (*n as f64 / frames as f64)).sum())
            .collect();
        Self {
            contour,
            spine: median_place(recordings, MANDIBLE),
            hyoid: median_place(recordings, HYOID),
            coils: coils::coils(recordings, hide),
            palate: Vec::new(),
            frames,
        }
    }

    /// Adds a trace of the palate in the frame of the recordings, m.
    #[must_use]
    pub fn with_palate(self, palate: Option<&[Point]>) -> Self {
        Self { palate: palate.unwrap_or_default().to_vec(), ..self }
    }

    pub fn of_contour(contour: &[Point], spine: Option<Point>, hyoid: Option<Point>) -> Self {
        Self { contour: resample(contour, POINTS).unwrap_or_default(), spine, hyoid, ..Self::default() }
    }

    pub fn place(&self, body: &Body<2>) -> Result<Registration, RestError> {
        // A bone that is recorded together with coils may be a coil on the jaw, which is not at the mental spine.
        if self.contour.is_empty() && self.hyoid.is_none() && self.coils.len() >= FEWEST_COILS {
            let placement = coils::place(body, &self.coils, &self.palate)?;
            let (similarity, by_coils) = (placement.similarity, Some(placement));
            return Ok(Registration { similarity, by_coils, frames: self.frames, ..Registration::default() });
        }
        if self.contour.is_empty() && (self.spine.is_none() || self.hyoid.is_none()) {
            return Err(RestError::Body(
                "neither a contour nor three coils nor the mental spine and the hyoid were seen, by which it would be placed"
                    .to_owned(),
            ));
        }
        let surface = outline_of(body)?;
        let bones: Vec<(&'static str, Point, Point, f64)> =
            [(MANDIBLE, self.spine, sd::SPINE_MM), (HYOID, self.hyoid, sd::HYOID_MM)]
                .into_iter()
                .filter_map(|(bone, measured, sd)| Some((bone, mark_of(body, bone)?, measured?, 1e-3 * sd)))
                .collect();
        let distances = |to: &Similarity| -> Vec<f64> {
            let distance = |p: &Point| to.scale() * surface.distance(to.place_back(*p), &body.mesh.nodes);
            self.contour.iter().map(distance).collect()
        };
        let vault = Vault::of(body, &self.palate);
        let residuals = |x: &DVector<f64>| {
            let similarity = similarity(x);
            let mut out: Vec<f64> =
                distances(&similarity).iter().map(|d| d / (1e-3 * sd::CONTOUR_MM)).collect();
            for (_, mark, measured, sd) in &bones {
                let away = (similarity.place(*mark) - measured) / *sd;
                out.extend([away.x, away.y]);
            }
            out.extend([x[2], x[3]]);
            vault.iter().for_each(|vault| out.extend(vault.residuals(&similarity).iter()));
            Some(DVector::from_vec(out))
        };
        // The search begins with one observation at its place in the body: the mental spine, or else the middle of the contour.
        let (mark, measured) = match (bones.first(), mean(self.contour.iter().copied())) {
            (Some((_, mark, measured, _)), _) => (*mark, *measured),
            (None, Some(middle)) => (middle_of(&surface, body), middle),
            (None, None) => (Point::zeros(), Point::zeros()),
        };
        let starts = TURNS.map(|turn| {
            let mut x = DVector::zeros(4);
            x[2] = turn / TURN_SD;
            let shift = (measured - similarity(&x).place(mark)) / SHIFT_UNIT_M;
            (x[0], x[1]) = (shift.x, shift.y);
            x
        });
        let best = minimise(starts, &residuals, &|_| true, (1e-5, 1e-7))
            .ok_or_else(|| RestError::Body("no place of it can be compared with what was seen".to_owned()))?;
        let similarity = similarity(&best.x);
        let squares: f64 = distances(&similarity).iter().map(|d| d * d).sum();
        let rms_m = (squares / self.contour.len().max(1) as f64).sqrt();
        let similarity = identity_if_in_frame(similarity, &bones, rms_m);
        let bones_m = bones
            .iter()
            .map(|(bone, mark, measured, _)| (*bone, (similarity.place(*mark) - measured).norm()));
        // Without the prior of turn and scale and without the palate; a larger speaker may differ by more.
        let of_palate = vault.map_or(0.0, |vault| vault.residuals(&similarity).norm_squared());
        let others = best.x[2].powi(2) + best.x[3].powi(2) + of_palate;
        let cost = (best.residuals.norm_squared() - others) / similarity.scale().max(1.0).powi(2);
        if !self.palate.is_empty() && cost > MOST_COST {
            let without = Self { palate: Vec::new(), ..self.clone() }.place(body)?;
            if without.cost <= MOST_COST {
                return Ok(Registration { without_palate: true, ..without });
            }
        }
        let bones_apart_m = self.spine.zip(self.hyoid).map(|(spine, hyoid)| (hyoid - spine).norm());
        Ok(Registration {
            similarity,
            rms_m,
            bones_m: bones_m.collect(),
            bones_apart_m,
            contour_m: self.contour.windows(2).map(|w| (w[1] - w[0]).norm()).sum(),
            cost,
            frames: self.frames,
            ..Registration::default()
        })
    }
}

/// Unknowns of the search: two shifts, turn and logarithm of the scale, in units of the search.
fn similarity(x: &DVector<f64>) -> Similarity {
    Similarity::new((sd::LN_SCALE * x[3]).exp(), TURN_SD * x[2], Point::new(x[0], x[1]) * SHIFT_UNIT_M)
}

/// The identity for a recording in the frame of the body, so that rounding does not change the body.
fn identity_if_in_frame(found: Similarity, bones: &[(&str, Point, Point, f64)], rms_m: f64) -> Similarity {
    const SAME_M: f64 = 1e-9;
    let same = bones.iter().all(|(_, mark, measured, _)| (mark - measured).norm() <= SAME_M);
    if same && !bones.is_empty() && rms_m <= SAME_M { Similarity::IDENTITY } else { found }
}

fn middle_of(surface: &TongueSurface, body: &Body<2>) -> Point {
    let places =
        (0..POINTS).map(|i| SEEN_FROM_M + (surface.tip - SEEN_FROM_M) * i as f64 / (POINTS - 1) as f64);
    places.map(|at| surface.curve.place(at, &body.mesh.nodes)).sum::<Point>() / POINTS as f64
}

fn mean(points: impl Iterator<Item = Point>) -> Option<Point> {
    let (sum, count) = points.fold((Point::zeros(), 0_usize), |(s, n), p| (s + p, n + 1));
    (count > 0).then(|| sum / count as f64)
}

/// The mean of each point of a contour over all frames, m; `None` for a point that was not seen.
pub(crate) fn mean_contour(recording: &AlignedRecording) -> impl Iterator<Item = Option<Point>> {
    (0..recording.contour.len())
        .map(|i| mean(recording.frames.iter().filter_map(|f| f.contour.get(i)?.map(|m| m.at))))
}

/// Median place of a bone over all frames, m.
pub fn median_place(recordings: &[&AlignedRecording], bone: &str) -> Option<Point> {
    let all = recordings.iter().filter_map(|s| Some((s, s.bone(bone)?)));
    median_point(all.flat_map(|(s, b)| s.frames.iter().filter_map(move |f| f.bones[b])))
}
