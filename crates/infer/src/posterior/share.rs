//! Where the variance comes from: of a tension, a change or a stretch, the part of every source, linearised at the most probable point.
//!
//! The best linear estimate of `a·g` from the stretches is `G y` with `G = aᵀ Jᵀ (J Jᵀ + C)⁻¹`; what it misses is a sum of independent
//! parts, one for every source, whose variances add up to the posterior's: `|a - Jᵀ Gᵀ|²` of the scores (apart for tensions, tones and
//! the hyoid), `G C_ends Gᵀ` of the ends, and so on. A stretch that is left out is `y_m - G y` of all others.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::density::{Density, Parameter};
use super::map::Mode;

/// Parts of a variance; they add up to one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Shares {
    /// What the stretches do not say of the tensions, even where all else is known.
    pub unresolved: f64,
    /// Tensions in the baseline.
    pub baseline_tone: f64,
    /// Place of the hyoid.
    pub hyoid: f64,
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
}

impl Shares {
    /// Name and value of each.
    pub fn each(&self) -> [(&'static str, f64); 10] {
        [
            ("unresolved", self.unresolved),
            ("baseline tone", self.baseline_tone),
            ("hyoid", self.hyoid),
            ("muscle ends", self.muscle_ends),
            ("outline", self.outline),
            ("compressibility", self.compressibility),
            ("width of muscles", self.bundle_width),
            ("hold of bones", self.bone_patch),
            ("discrepancy", self.discrepancy),
            ("rounding", self.rounding),
        ]
    }

    /// The mean of several.
    pub fn mean(all: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / all.len().max(1) as f64;
        Self {
            unresolved: mean(|s| s.unresolved),
            baseline_tone: mean(|s| s.baseline_tone),
            hyoid: mean(|s| s.hyoid),
            muscle_ends: mean(|s| s.muscle_ends),
            outline: mean(|s| s.outline),
            compressibility: mean(|s| s.compressibility),
            bundle_width: mean(|s| s.bundle_width),
            bone_patch: mean(|s| s.bone_patch),
            discrepancy: mean(|s| s.discrepancy),
            rounding: mean(|s| s.rounding),
        }
    }
}

/// The linear problem at a mode, for the stretches that were measured.
pub(super) struct Parts<'a> {
    density: &'a Density<'a>,
    mode: &'a Mode,
    jacobian: DMatrix<f64>,
    /// Covariance of the stretches before anything is measured.
    before: DMatrix<f64>,
}

impl<'a> Parts<'a> {
    pub fn new(density: &'a Density<'a>, mode: &'a Mode) -> Self {
        let jacobian = mode.linear.jacobian.select_rows(&density.seen.muscles);
        let before = &jacobian * jacobian.transpose() + density.covariance();
        Self { density, mode, jacobian, before }
    }

    /// Of `a·g`.
    pub fn of_scores(&self, a: &DVector<f64>) -> Option<Shares> {
        let gain = self.before.clone().cholesky()?.solve(&(&self.jacobian * a));
        Some(self.shares(&(a - self.jacobian.tr_mul(&gain)), &gain))
    }

    /// Of the stretch of the measured muscle at a position, told from all others.
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
        let density = self.density;
        let of_kind = |is: fn(&Parameter) -> bool| {
            let each = density.parameters.iter().zip(missed.iter());
            each.filter(|(p, _)| is(p)).map(|(_, m)| m * m).sum::<f64>()
        };
        let seen = &density.seen.muscles;
        let of_source =
            |source: &DMatrix<f64>| errors.dot(&(source.select_rows(seen).select_columns(seen) * errors));
        let rounding = density.seen.rounding.iter().zip(errors.iter());
        let geometry = &self.mode.geometry;
        let absolute = Shares {
            unresolved: of_kind(|p| matches!(p, Parameter::Tension(_))),
            baseline_tone: of_kind(|p| matches!(p, Parameter::Tone(_))),
            hyoid: of_kind(|p| matches!(p, Parameter::Hyoid(_))),
            muscle_ends: of_source(&geometry.ends),
            outline: of_source(&geometry.outline),
            compressibility: of_source(&geometry.kappa),
            bundle_width: of_source(&geometry.width),
            bone_patch: of_source(&geometry.patch),
            discrepancy: density.discrepancy() * errors.norm_squared(),
            rounding: rounding.map(|(r, e)| density.rounding(*r) * e * e).sum(),
        };
        let total: f64 = absolute.each().iter().map(|(_, v)| v).sum();
        let part = |v: f64| if total > 0.0 { v / total } else { 0.0 };
        Shares {
            unresolved: part(absolute.unresolved),
            baseline_tone: part(absolute.baseline_tone),
            hyoid: part(absolute.hyoid),
            muscle_ends: part(absolute.muscle_ends),
            outline: part(absolute.outline),
            compressibility: part(absolute.compressibility),
            bundle_width: part(absolute.bundle_width),
            bone_patch: part(absolute.bone_patch),
            discrepancy: part(absolute.discrepancy),
            rounding: part(absolute.rounding),
        }
    }
}
