//! The walls of a tract around the surface of a body.

use std::collections::BTreeMap;

use tongue_sound::Acoustics;
use tongue_sound::TractError;
use tongue_sound::formants::{self, Formant};
use tongue_sound::profile::{Articulation, Profile, ProfilePoint, Tract};

use crate::adapt::{mark_of, similarity_by_bones};
use tongue_core::body::{Body, DEFAULT_SPACING_M};
use tongue_core::geometry::Point;
use tongue_core::observe::TongueSurface;
use tongue_core::statics::Response;
use tongue_core::statistics::least_by;
use tongue_core::toml_text::{self, Misread};

const DRAWN: &str = include_str!("../../../../targets/tract.toml");
/// Distance of neighbouring points of the tongue's wall, m.
const POINTS_M: f64 = 2e-3;
/// Number of computed formants: those below 5 kHz, as in Praat's usual settings.
const FORMANTS: usize = 5;

/// Why the sound of a body cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum VocalTractError {
    #[error("{0}")]
    Refused(String),
    #[error(
        "a tract needs the outline of a tongue in the midsagittal plane; take the reference tongue or a mesh in the plane"
    )]
    NoSurface,
    #[error(transparent)]
    Tract(#[from] TractError),
}

impl VocalTractError {
    pub(super) fn no_wall(tract: &Tract) -> Self {
        Self::Refused(format!(
            "tongue.root_mm and tongue.tip_mm of the tract \"{}\" lie nearest to the same place of the body's surface; the tract was \
             drawn for another body",
            tract.name
        ))
    }
}

#[derive(Debug, Clone)]
pub struct VocalTract {
    pub tract: Tract,
    pub acoustics: Acoustics,
    /// Every point of the tongue's wall as a weighted mean of nodes, from root to tip.
    wall: Vec<Vec<(usize, f64)>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Sound {
    pub profile: Profile,
    /// The formants, in ascending order.
    pub formants: Vec<Formant>,
}

impl Sound {
    pub(super) fn new(profile: Profile, acoustics: &Acoustics) -> Result<Self, TractError> {
        Ok(Self { formants: formants::formants(&profile.sections, acoustics, FORMANTS)?, profile })
    }
}

/// Derivatives of the frequency of each formant by the nodes, Hz/m.
pub type FormantRates = Vec<Vec<(usize, Point)>>;

impl VocalTract {
    /// Reads the file of a tract; `origin` is its name in messages.
    pub fn read(text: &str, origin: &str) -> Result<Tract, VocalTractError> {
        let tract: Tract = toml_text::read(text).map_err(|Misread { line, column, problem }| {
            VocalTractError::Refused(format!("{origin}:{line}:{column}: {problem}"))
        })?;
        tract.check()?;
        Ok(tract)
    }

    /// The tract of the reference tongue.
    pub fn reference() -> Result<Tract, VocalTractError> {
        Self::read(DRAWN, "targets/tract.toml")
    }

    /// The tract of the reference tongue, moved by the similarity that carries the mental spine and the hyoid of that tongue to those
    /// of a body.
    pub fn reference_for(body: &Body<2>) -> Result<Tract, VocalTractError> {
        let missing = || {
            VocalTractError::Refused(format!(
                "{} has no mental spine and hyoid (bones \"mandible\" and \"hyoid\") by which the drawn tract could be placed; name a \
                 tract of its own with --tract",
                body.what
            ))
        };
        let reference = Body::tongue(DEFAULT_SPACING_M).map_err(|_| missing())?;
        let to = similarity_by_bones(&reference, |bone| mark_of(body, bone)).ok_or_else(missing)?;
        Ok(Self::reference()?.placed(to.scale(), |[x, y]: [f64; 2]| {
            <[f64; 2]>::from(to.place(Point::from([1e-3 * x, 1e-3 * y])) * 1e3)
        }))
    }

    /// The tract around a body.
    pub fn round(body: &Body<2>, tract: Tract) -> Result<Self, VocalTractError> {
        let curve = TongueSurface::of(body).ok_or(VocalTractError::NoSurface)?.curve;
        let count = (curve.length() / (0.1 * POINTS_M)).ceil().max(1.0) as usize;
        let place = |i: usize| curve.length() * i as f64 / count as f64;
        let [root, tip] =
            tongue_ends(&tract, count + 1, |i| mean(&curve.weights(place(i)), &body.mesh.nodes));
        let [root, tip] = [root, tip].map(place);
        let points = ((tip - root).abs() / POINTS_M).ceil() as usize;
        if points == 0 {
            return Err(VocalTractError::no_wall(&tract));
        }
        let wall =
            (0..=points).map(|i| curve.weights(root + (tip - root) * i as f64 / points as f64)).collect();
        Ok(Self { tract, acoustics: Acoustics::default(), wall })
    }

    /// The sound of a shape (positions of all nodes, m) in a posture.
    pub fn sound(&self, positions: &[Point], posture: &Articulation) -> Result<Sound, VocalTractError> {
        let tongue: Vec<ProfilePoint> = self.wall.iter().map(|weights| mean(weights, positions)).collect();
        let profile = Profile::new(&self.tract, &tongue, posture)?;
        Ok(Sound::new(profile, &self.acoustics)?)
    }

    pub fn rates(&self, sound: &Sound) -> FormantRates {
        let rates = sound.formants.iter().map(|formant| {
            let by_section = formants::rates(&sound.profile.sections, &self.acoustics, formant);
            let mut by_node: BTreeMap<usize, Point> = BTreeMap::new();
            sound.profile.rates_by_tongue(&by_section, |point, rate| {
                for &(node, weight) in self.wall.get(point).into_iter().flatten() {
                    *by_node.entry(node).or_default() += Point::from(rate) * weight;
                }
            });
            by_node.into_iter().collect()
        });
        rates.collect()
    }

    /// Derivatives of the formants by the tension of a muscle, Hz for 1 N per metre of thickness, at the equilibrium of a response.
    pub fn by_tension(rates: &FormantRates, response: &mut Response<'_, 2>, muscle: usize) -> Vec<f64> {
        response.compute_for_tensions([muscle]);
        let motion = response.motion();
        Vec::from_iter(
            rates.iter().map(|formant| formant.iter().map(|(node, rate)| rate.dot(&motion[*node])).sum()),
        )
    }
}

/// Which of `count` points of a surface (m) are nearest to the root and the tip of a tract's tongue.
pub(super) fn tongue_ends(tract: &Tract, count: usize, point: impl Fn(usize) -> ProfilePoint) -> [usize; 2] {
    [tract.tongue.root_mm, tract.tongue.tip_mm].map(|[x, y]| {
        let nearest = least_by(0..count, |&i| {
            let [a, b] = point(i);
            (a - 1e-3 * x).hypot(b - 1e-3 * y)
        });
        nearest.unwrap_or(0)
    })
}

fn mean(weights: &[(usize, f64)], positions: &[Point]) -> ProfilePoint {
    let sum: Point = weights.iter().map(|&(node, weight)| positions[node] * weight).sum();
    [sum.x, sum.y]
}
