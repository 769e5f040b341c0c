//! Where the variance comes from, and what knowing a source would gain; linearised at the most probable point.
//!
//! The best linear estimate of `a·g` from the stretches is `G y` with `G = aᵀ Jᵀ (J Jᵀ + C)⁻¹`; what it misses is a sum of independent
//! parts, one for every source, whose variances add up to the posterior's: `|a - Jᵀ Gᵀ|²` of the scores (apart for tensions, tones, the
//! hyoid and constants), `G C_ends Gᵀ` of the ends, and so on. A stretch that is left out is `y_m - G y` of all others. This budget of
//! errors is not what knowing a source would gain, since the estimate would then weigh the stretches otherwise: that is told
//! beside it, as the part by which the standard deviation would shrink.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::density::{Density, Parameter};
use super::map::Mode;

/// A source of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Tensions that the stretches do not resolve.
    Unresolved,
    /// Tensions in the baseline.
    BaselineTone,
    /// Place of the hyoid.
    Hyoid,
    /// By how much the hyoid tilts.
    HyoidTilt,
    /// Ends of the muscles.
    MuscleEnds,
    /// Outline.
    Outline,
    /// How nearly incompressible the tissue is.
    Compressibility,
    /// How wide muscles are.
    BundleWidth,
    /// How far bones hold the tissue.
    BonePatch,
    /// The model's own error.
    Discrepancy,
    /// Rounding of the lengths.
    Rounding,
    /// Errors of what was seen beside the lengths.
    OtherData,
}

/// A number for every source: its share of a variance, or by which part a standard deviation would shrink if it were known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Shares {
    /// What the stretches do not say of the tensions, even where all else is known.
    pub unresolved: f64,
    /// Tensions in the baseline.
    pub baseline_tone: f64,
    /// Place of the hyoid.
    pub hyoid: f64,
    /// By how much the hyoid tilts.
    pub hyoid_tilt: f64,
    /// Ends of the muscles.
    pub muscle_ends: f64,
    /// Outline.
    pub outline: f64,
    /// How nearly incompressible the tissue is.
    pub compressibility: f64,
    /// How wide muscles are; zero but of a continuum.
    pub bundle_width: f64,
    /// How far bones hold the tissue; zero but of a continuum.
    pub bone_patch: f64,
    /// The model's own error.
    pub discrepancy: f64,
    /// Rounding of the lengths.
    pub rounding: f64,
    /// Errors of what was seen beside the lengths.
    pub other_data: f64,
}

impl Shares {
    /// Of every source what is given.
    fn of(mut part: impl FnMut(Source) -> f64) -> Self {
        Self {
            unresolved: part(Source::Unresolved),
            baseline_tone: part(Source::BaselineTone),
            hyoid: part(Source::Hyoid),
            hyoid_tilt: part(Source::HyoidTilt),
            muscle_ends: part(Source::MuscleEnds),
            outline: part(Source::Outline),
            compressibility: part(Source::Compressibility),
            bundle_width: part(Source::BundleWidth),
            bone_patch: part(Source::BonePatch),
            discrepancy: part(Source::Discrepancy),
            rounding: part(Source::Rounding),
            other_data: part(Source::OtherData),
        }
    }

    /// Name and value of each.
    pub fn each(&self) -> [(&'static str, f64); 12] {
        [
            ("unresolved", self.unresolved),
            ("baseline tone", self.baseline_tone),
            ("hyoid", self.hyoid),
            ("hyoid's tilt", self.hyoid_tilt),
            ("muscle ends", self.muscle_ends),
            ("outline", self.outline),
            ("compressibility", self.compressibility),
            ("width of muscles", self.bundle_width),
            ("hold of bones", self.bone_patch),
            ("discrepancy", self.discrepancy),
            ("rounding", self.rounding),
            ("errors of other data", self.other_data),
        ]
    }

    fn get(&self, source: Source) -> f64 {
        self.each()[source as usize].1
    }

    /// The mean of several.
    pub fn mean(all: &[Self]) -> Self {
        Self::of(|source| all.iter().map(|s| s.get(source)).sum::<f64>() / all.len().max(1) as f64)
    }

    /// Parts of their sum.
    fn of_sum(self) -> Self {
        let total: f64 = self.each().iter().map(|(_, v)| v).sum();
        Self::of(|source| if total > 0.0 { self.get(source) / total } else { 0.0 })
    }
}

/// The source that a number that is sampled belongs to.
fn source_of(parameter: Parameter) -> Source {
    match parameter {
        Parameter::Tension(..) => Source::Unresolved,
        Parameter::Tone(_) => Source::BaselineTone,
        Parameter::Hyoid(..) => Source::Hyoid,
        Parameter::Tilt => Source::HyoidTilt,
    }
}

/// The linear problem at a mode, for the stretches that were measured.
pub(super) struct Parts<'a> {
    density: &'a Density<'a>,
    mode: &'a Mode,
    jacobian: DMatrix<f64>,
    /// Covariance of the stretches before anything is measured.
    before: DMatrix<f64>,
    /// Covariances of the scores where one source is known; `None` of one that has no part.
    known: Vec<(Source, DMatrix<f64>)>,
}

impl<'a> Parts<'a> {
    pub fn new(density: &'a Density<'a>, mode: &'a Mode) -> Self {
        let jacobian = mode.linear.jacobian.select_rows(density.rows());
        let before = &jacobian * jacobian.transpose() + density.covariance();
        let mut parts = Self { density, mode, jacobian, before, known: Vec::new() };
        let sources = [
            Source::BaselineTone,
            Source::Hyoid,
            Source::HyoidTilt,
            Source::MuscleEnds,
            Source::Outline,
            Source::Compressibility,
            Source::BundleWidth,
            Source::BonePatch,
            Source::Discrepancy,
            Source::Rounding,
            Source::OtherData,
        ];
        let known =
            sources.into_iter().filter_map(|source| Some((source, parts.covariance_if_known(source)?)));
        parts.known = known.collect();
        parts
    }

    /// Covariance of the scores if a source were known; 1e-12 is added to the variances, since stretches may be exact without it.
    fn covariance_if_known(&self, source: Source) -> Option<DMatrix<f64>> {
        let n = self.density.rows().len();
        let errors = self.density.covariance() - self.errors_by(source) + DMatrix::identity(n, n) * 1e-12;
        let mut jacobian = self.jacobian.clone();
        let is_known: Vec<bool> = self.density.parameters.iter().map(|p| source_of(*p) == source).collect();
        is_known.iter().enumerate().filter(|(_, k)| **k).for_each(|(p, _)| jacobian.column_mut(p).fill(0.0));
        let gain = jacobian.tr_mul(&errors.cholesky()?.solve(&jacobian));
        let size = gain.nrows();
        let mut covariance = (DMatrix::identity(size, size) + gain).cholesky()?.inverse();
        is_known.iter().enumerate().filter(|(_, k)| **k).for_each(|(p, _)| covariance[(p, p)] = 0.0);
        Some(covariance)
    }

    /// Covariance of the stretches by a source that is not sampled.
    fn errors_by(&self, source: Source) -> DMatrix<f64> {
        let (density, geometry) = (self.density, &self.mode.geometry);
        let n = density.rows().len();
        match source {
            Source::MuscleEnds => density.measured(&geometry.ends),
            Source::Outline => density.measured(&geometry.outline),
            Source::Compressibility => density.measured(&geometry.kappa),
            Source::BundleWidth => density.measured(&geometry.width),
            Source::BonePatch => density.measured(&geometry.patch),
            Source::Discrepancy => density.discrepancies(),
            Source::OtherData => density.errors_beside(),
            Source::Rounding => density.rounding(),
            _ => DMatrix::zeros(n, n),
        }
    }

    /// Of `a·g`: the budget of errors, and by which part the standard deviation would shrink if each source were known.
    pub fn of_scores(&self, a: &DVector<f64>) -> Option<(Shares, Shares)> {
        let gain = self.before.clone().cholesky()?.solve(&(&self.jacobian * a));
        let budget = self.shares(&(a - self.jacobian.tr_mul(&gain)), &gain);
        let whole = a.norm_squared() - (&self.jacobian * a).dot(&gain);
        let gained = |source: Source| {
            let known = self.known.iter().find(|(s, _)| *s == source)?;
            Some(1.0 - (a.dot(&(&known.1 * a)) / whole).max(0.0).sqrt())
        };
        let gains = Shares::of(|source| match source {
            Source::Unresolved => 1.0,
            _ => gained(source).unwrap_or(0.0).max(0.0),
        });
        Some((budget, gains))
    }

    /// Of the measured stretch at a position, told from all others.
    pub fn of_left_out(&self, position: usize) -> Option<Shares> {
        let others: Vec<usize> = (0..self.before.nrows()).filter(|i| *i != position).collect();
        let among = self.before.select_rows(&others).select_columns(&others);
        let across = self.before.select_rows(&others).column(position).into_owned();
        let gain = among.cholesky()?.solve(&across);
        let mut all = DVector::zeros(self.before.nrows());
        all[position] = 1.0;
        others.iter().zip(gain.iter()).for_each(|(&i, g)| all[i] = -g);
        Some(self.shares(&self.jacobian.tr_mul(&all), &all))
    }

    /// Of the sum of what is missed in the scores and of the errors of the stretches, with these weights.
    fn shares(&self, missed: &DVector<f64>, errors: &DVector<f64>) -> Shares {
        let of_scores = |source: Source| {
            let each = self.density.parameters.iter().zip(missed.iter());
            each.filter(|(p, _)| source_of(**p) == source).map(|(_, m)| m * m).sum::<f64>()
        };
        let of_errors = |source: Source| errors.dot(&(self.errors_by(source) * errors));
        Shares::of(|source| of_scores(source) + of_errors(source)).of_sum()
    }
}
