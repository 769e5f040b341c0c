//! Premises of a fit: the baseline, and unknowns other than the tensions.
//!
//! The thesis takes the baseline vowel as rest. But the baseline is a posture too, in which muscles pull with a **tone** `F0`. A stretch
//! is then `L(F) / L(F0)`. Muscles that are shorter than in the baseline have an unknown tension, longer ones have none, and unmeasured
//! muscles keep their tone. A free **bone** is displaced by `d`. Then
//!
//! ```text
//! minimise  sum over shorter (s - s_measured)²  +  sum over the others max(0, 1 - s)²
//!           +  sum over shorter (σ/σ_F)² (F - F0)²  +  (σ/σ_d)² |d|²           σ = 0.01, σ_F = 17 N/m, σ_d = 5 mm
//! ```
//!
//! The second sum uses the signs of the changes, which constrain `d`; the last two sums are priors. Their strengths were found on the
//! data of Takano and Honda (2007): `tongue-fit validate`.

use std::sync::Arc;

use nalgebra::{DMatrix, SVector};
use serde::{Deserialize, Serialize};

use tongue_core::body::{Body, HYOID};
use tongue_core::limits;
use tongue_core::statics::{self, Workspace};
use tongue_core::system::{Model, System};
use tongue_input::measured::TargetKind;

use super::{FitError, FitSettings, FreedBone};

/// Tension of muscles in the baseline, N (2D: per metre of thickness).
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Tone {
    Uniform(f64),
    /// By the names of the muscles; other muscles have none.
    ByMuscle(#[serde(serialize_with = "by_name")] Vec<(String, f64)>),
}

impl Tone {
    /// The tension of a muscle, N (2D: per metre of thickness); upper and lower case are the same.
    pub fn of(&self, muscle: &str) -> f64 {
        match self {
            Self::Uniform(tone) => *tone,
            Self::ByMuscle(all) => {
                all.iter().find(|(m, _)| m.eq_ignore_ascii_case(muscle)).map_or(0.0, |(_, tone)| *tone)
            }
        }
    }

    /// Whether no muscle has a tension, as in the thesis.
    pub fn is_none(&self) -> bool {
        match self {
            Self::Uniform(tone) => *tone == 0.0,
            Self::ByMuscle(all) => all.iter().all(|(_, tone)| *tone == 0.0),
        }
    }

    /// The posture from which changes are counted, in words.
    pub fn posture(&self) -> String {
        match self {
            _ if self.is_none() => "at rest".to_owned(),
            Self::Uniform(tone) => format!("in the baseline with {tone} N/m in every muscle"),
            Self::ByMuscle(_) => "in the baseline with its tone by muscle".to_owned(),
        }
    }
}

fn by_name<S: serde::Serializer>(all: &[(String, f64)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(all.iter().map(|(muscle, tone)| (muscle, tone)))
}

impl Default for Tone {
    fn default() -> Self {
        Self::Uniform(0.0)
    }
}

/// A bone with an unknown displacement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LooseBone {
    pub name: String,
    /// The coordinates along which it may move, from 0.
    pub axes: Vec<usize>,
}

/// Motion of the hyoid in a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HyoidMotion {
    /// Anywhere in the plane, near its place.
    Free,
    Forward,
    Fixed,
}

/// A user's choice of premises; the defaults depend on the fitted quantity.
#[derive(Debug, Clone, Default)]
pub struct Said {
    /// Whether the thesis's assumptions are the default.
    pub thesis: bool,
    /// Tensions in the baseline. Default: [`TONE`] for stretches, none for ratios.
    pub tone: Option<Tone>,
    /// Motion of the hyoid. Default: free for stretches if the body has a hyoid, fixed for ratios.
    pub hyoid: Option<HyoidMotion>,
    pub free_bones: Vec<String>,
}

/// Premises of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Premises {
    pub tone: Tone,
    pub bones: Vec<LooseBone>,
    /// Standard deviation of a bone's displacement along an axis, m.
    pub bone_sd_m: f64,
    /// Standard deviation of a tension from its tone, N (2D: per metre of thickness); it is used if a bone is
    /// free.
    pub tension_sd: f64,
}

/// The tone with the smallest error, N per metre of thickness; the error hardly changes from 6 to 12.
pub const TONE: f64 = 8.0;
/// Standard deviation of a measured stretch, against which those of tensions and displacements are weighed.
pub const STRETCH_SD: f64 = 0.01;
/// Standard deviation of the displacement of a bone, m.
pub const BONE_SD_M: f64 = 5e-3;
/// Standard deviation of a tension from its tone, N per metre of thickness.
const TENSION_SD: f64 = STRETCH_SD / 6e-4;
const NO_BASELINE: &str = "there is no equilibrium of the baseline at this tone; take a smaller one";
/// Number of steps in which the branch from rest is followed.
const TRACE_STEPS: usize = 10;
/// Largest displacement of a bone, in standard deviations.
pub(super) const MOST_SDS: f64 = 4.0;

impl Default for Premises {
    /// The premises of the thesis: the baseline is rest, and bones are fixed.
    fn default() -> Self {
        Self { tone: Tone::default(), bones: Vec::new(), bone_sd_m: BONE_SD_M, tension_sd: TENSION_SD }
    }
}

impl Premises {
    /// A baseline with [`TONE`] in every muscle, and a movable hyoid.
    pub fn active_baseline(dimension: usize) -> Self {
        let hyoid = LooseBone { name: HYOID.to_owned(), axes: (0..dimension).collect() };
        Self { tone: Tone::Uniform(TONE), bones: vec![hyoid], ..Self::default() }
    }

    /// The premises for a quantity in a body of the plane.
    pub fn of(kind: TargetKind, body: &Body<2>, said: &Said) -> Result<Self, FitError> {
        let active = kind == TargetKind::Stretch && !said.thesis;
        let tone = said.tone.clone().unwrap_or(Tone::Uniform(if active { TONE } else { 0.0 }));
        let named = body.bones.iter().any(|b| b.name == HYOID);
        let axes = match said.hyoid {
            Some(HyoidMotion::Free) => 0..2,
            None if active && named => 0..2,
            Some(HyoidMotion::Forward) => 0..1,
            Some(HyoidMotion::Fixed) | None => 0..0,
        };
        let mut bones = vec![LooseBone { name: HYOID.to_owned(), axes: axes.collect() }];
        for name in &said.free_bones {
            if bones.iter().any(|b| b.name == *name && !(b.name == HYOID && b.axes.is_empty())) {
                let what = format!("the bone {name} is free already; give each bone once");
                return Err(FitError::Unknown { what });
            }
            bones.push(LooseBone { name: name.clone(), axes: vec![0, 1] });
        }
        bones.retain(|b| !b.axes.is_empty());
        Ok(Self { tone, bones, ..Self::default() })
    }

    pub fn is_thesis(&self) -> bool {
        self.tone.is_none() && self.bones.is_empty()
    }
}

/// A body for fits: ready to be solved, with its baseline posture.
#[derive(Debug, Clone)]
pub struct Setup<const D: usize = 2> {
    pub premises: Premises,
    /// The body; every muscle that a fit can give a tension can contract in it.
    pub system: Arc<System<D>>,
    /// Names of all chains of the body.
    pub muscles: Vec<String>,
    pub bones: Arc<Vec<FreedBone<D>>>,
    /// Tensions of all chains of the body in the baseline, N (2D: per metre of thickness).
    pub tensions: Vec<f64>,
    pub positions: Vec<SVector<f64, D>>,
    /// Lengths of all chains of the body in the baseline, m, from which changes are counted.
    pub lengths: Vec<f64>,
}

impl<const D: usize> Setup<D> {
    /// A body whose baseline is rest and whose bones are fixed.
    pub fn at_rest(system: impl Into<Arc<System<D>>>) -> Self {
        let system = system.into();
        Self {
            premises: Premises::default(),
            muscles: Vec::new(),
            bones: Arc::default(),
            tensions: vec![0.0; system.muscle_count()],
            positions: system.rest().to_vec(),
            lengths: system.lengths(system.rest()),
            system,
        }
    }

    /// A body under premises, in which every muscle can contract.
    pub fn new(body: &Body<D>, model: &Model, premises: Premises) -> Result<Self, FitError> {
        let all: Vec<usize> = (0..body.mesh.muscles.len()).collect();
        let mut freed = Vec::new();
        for LooseBone { name, axes } in &premises.bones {
            if axes.iter().any(|a| *a >= D) {
                let what =
                    format!("the bone \"{name}\" cannot be freed along an axis that the body does not have");
                return Err(FitError::Unknown { what });
            }
            freed.push(FreedBone::of(body, model, &all, name)?);
        }
        let names: Vec<&str> = body.mesh.muscles.iter().map(|m| m.name.as_str()).collect();
        Ok(Self {
            bones: Arc::new(freed),
            ..Self::in_system(System::new(&body.mesh, model, &all)?, &names, premises)?
        })
    }

    /// As [`Setup::new`], in a prepared system in which every muscle with a tone can contract; its bones are
    /// not free.
    ///
    /// # Errors
    /// [`FitError::Limit`] for a tone or a standard deviation out of range; [`FitError::Unknown`] if there
    /// is no equilibrium at the tone, or if the body lacks the muscle of a tone.
    pub fn in_system(
        system: impl Into<Arc<System<D>>>,
        muscles: &[&str],
        premises: Premises,
    ) -> Result<Self, FitError> {
        let system = system.into();
        limits::BONE_SD_M.check(premises.bone_sd_m)?;
        limits::TENSION_SD.check(premises.tension_sd)?;
        let muscles: Vec<String> = muscles.iter().map(|m| (*m).to_owned()).collect();
        let tensions: Vec<f64> = muscles.iter().map(|m| premises.tone.of(m)).collect();
        tensions.iter().try_for_each(|t| limits::TONE.check(*t))?;
        if let Tone::ByMuscle(all) = &premises.tone
            && let Some((name, _)) =
                all.iter().find(|(name, _)| !muscles.iter().any(|m| m.eq_ignore_ascii_case(name)))
        {
            let what = format!("the tone names {name}, a muscle that this body does not have; leave it out");
            return Err(FitError::Unknown { what });
        }
        if tensions.iter().all(|t| *t == 0.0) {
            return Ok(Self { premises, muscles, ..Self::at_rest(system) });
        }
        let mut w = Workspace::new(&system);
        let settings = statics::SolveSettings::default();
        let found = statics::solve_and_trace(&system, &mut w, &tensions, &settings, TRACE_STEPS).solution;
        if found.status != statics::SolveStatus::Converged || found.guarded > 0 {
            return Err(FitError::Unknown { what: NO_BASELINE.to_owned() });
        }
        let positions = w.positions().to_vec();
        Ok(Self {
            premises,
            muscles,
            bones: Arc::default(),
            tensions,
            lengths: system.lengths(&positions),
            positions,
            system,
        })
    }

    /// The same body under other premises with the same bones (or none): only its baseline is solved again,
    /// from the present one.
    pub fn under(&self, premises: Premises) -> Result<Self, FitError> {
        let bones = if premises.bones.is_empty() { Arc::default() } else { Arc::clone(&self.bones) };
        if premises.bones.len() != bones.len() {
            let what = "premises about the same bones are needed here".to_owned();
            return Err(FitError::Unknown { what });
        }
        let tensions = self.muscles.iter().map(|m| premises.tone.of(m)).collect::<Vec<_>>();
        if tensions == self.tensions {
            return Ok(Self { premises, bones, ..self.clone() });
        }
        let mut w = Workspace::new(&self.system);
        w.start_from(&self.positions);
        let solution = statics::solve(&self.system, &mut w, &tensions, &statics::SolveSettings::default());
        if solution.status != statics::SolveStatus::Converged {
            return Err(FitError::Unknown { what: NO_BASELINE.to_owned() });
        }
        let positions = w.positions().to_vec();
        let lengths = self.system.lengths(&positions);
        Ok(Self { premises, bones, tensions, positions, lengths, ..self.clone() })
    }

    /// The settings of fits here: if priors keep an answer away from its target, the target counts as met
    /// within the standard deviation of a stretch.
    pub fn settings(&self, settings: &FitSettings) -> FitSettings {
        let tolerance = if self.bones.is_empty() { 0.0 } else { STRETCH_SD };
        FitSettings { misfit_tolerance: settings.misfit_tolerance.max(tolerance), ..*settings }
    }
}

/// The fitted displacement of a bone.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedBone<const D: usize> {
    pub name: String,
    pub shift: SVector<f64, D>,
    /// Half width of the 95 % interval of each coordinate, m: linearised at the answer, from the standard
    /// deviation of a stretch and the priors. 0 for fixed coordinates.
    pub half_width: SVector<f64, D>,
}

/// Standard deviations of the unknowns, in their units, if residuals have [`STRETCH_SD`]; `None` if the
/// Jacobian does not have full rank.
pub(super) fn standard_deviations(jacobian: &DMatrix<f64>) -> Option<Vec<f64>> {
    let inverse = (jacobian.tr_mul(jacobian)).cholesky()?.inverse();
    Some(inverse.diagonal().iter().map(|v| STRETCH_SD * v.sqrt()).collect())
}
