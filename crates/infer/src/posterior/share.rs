//! Sources of the variance, and how much knowing a source would gain; linearised at the most probable point.
//!
//! The best linear estimate of `a·g` from the stretches is `G y` with `G = aᵀ Jᵀ (J Jᵀ + C)⁻¹`. Its error is a sum of independent parts,
//! one for every source, whose variances add up to the posterior's: `|a - Jᵀ Gᵀ|²` of the scores (split into tensions, tones, the hyoid
//! and constants), `G C_ends Gᵀ` of the ends, and so on. A stretch that is left out is `y_m - G y` of all others. This budget of errors
//! does not say how much knowing a source would gain, because the estimate would then weigh the stretches differently. That gain is
//! reported too, as the part by which the standard deviation would shrink.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::density::Density;
use super::map::Mode;
use super::unknowns::Parameter;

/// The sources, each with its field of [`Shares`] and its name.
macro_rules! sources {
    ($($(#[$doc:meta])* $source:ident, $field:ident, $name:literal;)*) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Source { $($(#[$doc])* $source,)* }

        const SOURCES: [Source; 12] = [$(Source::$source),*];

        /// A number for every source: its share of a variance, or the part by which a standard deviation would shrink if the source were known.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
        pub struct Shares { $($(#[$doc])* pub $field: f64,)* }

        impl Shares {
            /// The numbers that a function gives for the sources.
            fn of(mut part: impl FnMut(Source) -> f64) -> Self {
                Self { $($field: part(Source::$source),)* }
            }

            /// Name and value for each source.
            pub fn each(&self) -> [(&'static str, f64); 12] {
                [$(($name, self.$field)),*]
            }
        }
    };
}

sources! {
    /// Tensions that the stretches do not resolve, even if everything else is known.
    Unresolved, unresolved, "unresolved";
    /// Tensions in the baseline.
    BaselineTone, baseline_tone, "baseline tone";
    /// Place of the hyoid.
    Hyoid, hyoid, "hyoid";
    /// Tilt of the hyoid.
    HyoidTilt, hyoid_tilt, "hyoid's tilt";
    /// Ends of the muscles.
    MuscleEnds, muscle_ends, "muscle ends";
    /// Outline.
    Outline, outline, "outline";
    /// Compressibility of the tissue.
    Compressibility, compressibility, "compressibility";
    /// Width of muscles; zero except in a continuum.
    BundleWidth, bundle_width, "width of muscles";
    /// Radius of the patches in which bones hold the tissue; zero except in a continuum.
    BonePatch, bone_patch, "hold of bones";
    /// The model's own error.
    Discrepancy, discrepancy, "discrepancy";
    /// Rounding of the lengths.
    Rounding, rounding, "rounding";
    /// Errors of the other measurements.
    OtherData, other_data, "errors of other data";
}

impl Shares {
    fn get(&self, source: Source) -> f64 {
        self.each()[source as usize].1
    }

    pub fn mean(all: &[Self]) -> Self {
        Self::of(|source| all.iter().map(|s| s.get(source)).sum::<f64>() / all.len().max(1) as f64)
    }

    fn of_sum(self) -> Self {
        let total: f64 = self.each().iter().map(|(_, v)| v).sum();
        Self::of(|source| if total > 0.0 { self.get(source) / total } else { 0.0 })
    }
}

/// The source to which a sampled unknown belongs.
fn source_of(parameter: Parameter) -> Source {
    match parameter {
        Parameter::Tension(..) => Source::Unresolved,
        Parameter::Tone(_) => Source::BaselineTone,
        Parameter::Hyoid(..) => Source::Hyoid,
        Parameter::Tilt => Source::HyoidTilt,
    }
}

/// The linear problem at a mode, for the measured stretches.
pub(super) struct Parts<'a> {
    density: &'a Density<'a>,
    mode: &'a Mode,
    jacobian: DMatrix<f64>,
    /// Prior covariance of the stretches.
    before: DMatrix<f64>,
    /// Covariances of the scores if one source were known; `None` for a source without effect.
    known: Vec<(Source, DMatrix<f64>)>,
}

impl<'a> Parts<'a> {
    pub fn new(density: &'a Density<'a>, mode: &'a Mode) -> Self {
        let jacobian = mode.linear.jacobian.select_rows(density.rows());
        let before = &jacobian * jacobian.transpose() + density.covariance();
        let mut parts = Self { density, mode, jacobian, before, known: Vec::new() };
        let others = SOURCES.into_iter().filter(|source| *source != Source::Unresolved);
        let known = others.filter_map(|source| Some((source, parts.covariance_if_known(source)?)));
        parts.known = known.collect();
        parts
    }

    /// Covariance of the scores if a source were known; 1e-12 is added to the variances, because the stretches may then be exact.
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

    /// Covariance of the stretches due to a source that is not sampled.
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

    /// For `a·g`: the budget of errors, and the part by which the standard deviation would shrink if each source were known.
    pub(crate) fn of_scores(&self, a: &DVector<f64>) -> Option<(Shares, Shares)> {
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

    /// The budget of errors for the measured stretch at a position, predicted from all others.
    pub(crate) fn of_left_out(&self, position: usize) -> Option<Shares> {
        let others: Vec<usize> = (0..self.before.nrows()).filter(|i| *i != position).collect();
        let among = self.before.select_rows(&others).select_columns(&others);
        let across = self.before.select_rows(&others).column(position).into_owned();
        let gain = among.cholesky()?.solve(&across);
        let mut all = DVector::zeros(self.before.nrows());
        all[position] = 1.0;
        others.iter().zip(gain.iter()).for_each(|(&i, g)| all[i] = -g);
        Some(self.shares(&self.jacobian.tr_mul(&all), &all))
    }

    /// The budget of the sum of errors in the scores and in the stretches, with these weights.
    fn shares(&self, missed: &DVector<f64>, errors: &DVector<f64>) -> Shares {
        let of_scores = |source: Source| {
            let each = self.density.parameters.iter().zip(missed.iter());
            each.filter(|(p, _)| source_of(**p) == source).map(|(_, m)| m * m).sum::<f64>()
        };
        let of_errors = |source: Source| errors.dot(&(self.errors_by(source) * errors));
        Shares::of(|source| of_scores(source) + of_errors(source)).of_sum()
    }
}
