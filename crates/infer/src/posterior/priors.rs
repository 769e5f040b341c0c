//! Prior distributions: one entry for every source of uncertainty, each of which can be fixed or left out.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::PosteriorError;
use crate::standard_deviations as sd;
use tongue_core::body::ContinuumSettings;
use tongue_core::limits::TENSION;
use tongue_core::toml_text;

/// Stands for every muscle without an entry of its own.
const EVERY: &str = "*";

/// All priors. The defaults were fixed before `tongue-fit validate --posterior` was run and are not tuned on it. The discrepancy and the
/// scales of the tensions had been found on the same three speakers by marginal likelihood, the tilt of the hyoid on S1 to S4.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Priors {
    /// Tension F of every muscle in the vowel.
    pub tension: TensionPrior,
    /// Tension F0 of every muscle in the baseline.
    pub baseline: BaselinePrior,
    /// Displacement of the hyoid from its place in the body.
    pub hyoid: HyoidPrior,
    /// Tilt of the hyoid as it moves back.
    pub hyoid_tilt: HyoidTiltPrior,
    /// Displacements of the ends of the muscles from their places in the body.
    pub muscle_ends: MuscleEndsPrior,
    /// Displacement of the outline from its place in the body.
    pub outline: OutlinePrior,
    /// Compressibility of the tissue.
    pub compressibility: CompressibilityPrior,
    /// Width of muscles; only in a continuum.
    pub bundle_width: BundleWidthPrior,
    /// Radius of the patches in which bones hold the tissue; only in a continuum.
    pub bone_patch: BonePatchPrior,
    /// The model's own error.
    pub discrepancy: DiscrepancyPrior,
    /// Rounding of the measured lengths.
    pub rounding: RoundingPrior,
    /// Young's modulus.
    pub young_modulus: YoungModulusPrior,
}

/// A line `field: type = default` becomes a field and its default.
macro_rules! priors {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $kind:ty = $default:expr,)* })*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name { $($(#[$field_doc])* pub $field: $kind,)* }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    )*};
}

priors! {
    /// Half-normal, independently for each muscle.
    TensionPrior {
        /// Scale of the half-normal distribution, N per metre of thickness.
        scale_n_per_m: f64 = sd::TENSION_N,
        /// Known tensions, N per metre of thickness, by muscle; "*" is every muscle not named.
        fixed_n_per_m: BTreeMap<String, f64> = BTreeMap::new(),
    }

    /// Half-normal, independently for each muscle.
    BaselinePrior {
        /// Scale of the half-normal distribution, N per metre of thickness.
        // The same as that of the vowel's tensions, so that without data either is equally likely to be the larger one.
        scale_n_per_m: f64 = sd::TENSION_N,
        /// Known tensions, N per metre of thickness, by muscle; "*" is every muscle not named.
        fixed_n_per_m: BTreeMap<String, f64> = BTreeMap::new(),
        /// Whether the baseline is rest, as in the thesis.
        off: bool = false,
    }

    /// Normal about the hyoid's place in the body, independently for each axis.
    HyoidPrior {
        /// Standard deviation along an axis, mm.
        sd_mm: f64 = sd::HYOID_MM,
        /// A known displacement, x and y, mm.
        fixed_mm: Option<[f64; 2]> = None,
        /// Whether the hyoid stays at its place in the body.
        off: bool = false,
    }

    /// Normal with mean zero, one number for each speaker: the greater horn goes down by this angle for every metre that the hyoid moves
    /// back. The tilt was found on the four speakers of Takano and Honda (2007) and has not been tested on a fifth.
    HyoidTiltPrior {
        /// Standard deviation, rad/m.
        sd_rad_per_m: f64 = 40.0,
        /// A known value, rad/m.
        fixed_rad_per_m: Option<f64> = None,
        /// Whether the hyoid moves without tilting.
        off: bool = false,
    }

    /// Normal, independently for each end and axis; the tissue around an end moves with it.
    MuscleEndsPrior {
        /// Standard deviation along an axis, mm.
        sd_mm: f64 = sd::MUSCLE_END_MM,
        /// Distance around an end over which the tissue moves with it, mm (the standard deviation of a bell curve).
        reach_mm: f64 = 8.0,
        /// Whether the ends stay at their places in the body.
        off: bool = false,
    }

    /// A smooth random displacement of the outline and of the tissue with it.
    OutlinePrior {
        /// Standard deviation along an axis, mm.
        sd_mm: f64 = 1.5,
        /// Distance over which neighbours move together, mm (the standard deviation of a bell curve).
        reach_mm: f64 = 15.0,
        /// Whether the outline stays at its place in the body.
        off: bool = false,
    }

    /// Log-normal kappa, the stiffness against changes of area.
    CompressibilityPrior {
        /// Poisson's ratio at the median; the body gets it.
        poisson_ratio: f64 = 0.499,
        /// Standard deviation of the logarithm of kappa.
        // One and a half times the logarithm of 5.
        sd_ln_kappa: f64 = 2.414,
        /// Whether the body's own Poisson's ratio is kept and taken as exact.
        off: bool = false,
    }

    /// Log-normal, with one width for all muscles. Chosen, not measured: 4 to 9 mm.
    BundleWidthPrior {
        /// Median, mm; the body gets it.
        median_mm: f64 = 6.0,
        /// Standard deviation of its logarithm.
        sd_ln: f64 = 0.2,
        /// A known width, mm.
        fixed_mm: Option<f64> = None,
        /// Whether the body's own width is kept and taken as exact.
        off: bool = false,
    }

    /// Log-normal radius of the patch around a point of bone, the same for all bones. Chosen, not measured: 7 to 14 mm.
    BonePatchPrior {
        /// Median, mm; the body gets it.
        median_mm: f64 = 10.0,
        /// Standard deviation of its logarithm.
        sd_ln: f64 = 0.18,
        /// A known radius, mm.
        fixed_mm: Option<f64> = None,
        /// Whether the body's own radius is kept and taken as exact.
        off: bool = false,
    }

    /// Normal, independently for each stretch.
    DiscrepancyPrior {
        /// Standard deviation of a stretch, dimensionless.
        sd: f64 = sd::STRETCH,
        /// Standard deviation of a further error of a vowel that is sampled alone against a baseline other than /ɯ/, in which muscles pull.
        sd_of_baseline: f64 = sd::STRETCH_OF_BASELINE,
        /// Whether the model is taken as exact.
        off: bool = false,
    }

    /// Uniform within half a unit of the last digit, or within the half width of the table; approximated by a normal distribution of the
    /// same variance.
    RoundingPrior {
        /// Whether the lengths are taken as exact.
        off: bool = false,
    }

    /// Log-normal. Young's modulus scales all tensions and the measurements say nothing about it, so it is reported separately.
    YoungModulusPrior {
        /// Standard deviation of its logarithm.
        // A factor of 1.5 either way.
        sd_ln: f64 = 0.405,
        /// Whether the body's own Young's modulus is taken as exact.
        off: bool = false,
    }
}

impl Priors {
    /// Reads priors from TOML; entries that are missing keep their defaults. `origin` is the name of the text in messages.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, PosteriorError> {
        let priors: Self = toml_text::read(text)
            .map_err(|e| PosteriorError::Refused(format!("{origin}:{}: {}", e.line, e.problem)))?;
        priors.check().map_err(|e| PosteriorError::Refused(format!("{origin}: {e}")))?;
        Ok(priors)
    }

    /// Standard deviations of the model that no file of priors changes.
    pub fn standard_deviations() -> &'static [sd::StandardDeviation] {
        sd::TABLE
    }

    /// Every number that must be positive: name, value, largest accepted value, and usual range (`None` if switched off or without one).
    fn positive_numbers(&self) -> Vec<(&'static str, f64, f64, Option<[f64; 2]>)> {
        let usual = |off: bool, range: [f64; 2]| if off { None } else { Some(range) };
        let (baseline, hyoid, discrepancy) = (&self.baseline, &self.hyoid, &self.discrepancy);
        let (ends, outline) = (&self.muscle_ends, &self.outline);
        let (width, patch) = (&self.bundle_width, &self.bone_patch);
        vec![
            ("tension.scale_n_per_m", self.tension.scale_n_per_m, 1e4, usual(false, [1.0, 200.0])),
            ("baseline.scale_n_per_m", baseline.scale_n_per_m, 1e4, usual(baseline.off, [1.0, 200.0])),
            ("hyoid.sd_mm", hyoid.sd_mm, 50.0, usual(hyoid.off, [0.5, 20.0])),
            ("hyoid_tilt.sd_rad_per_m", self.hyoid_tilt.sd_rad_per_m, 1e3, None),
            ("muscle_ends.sd_mm", ends.sd_mm, 50.0, usual(ends.off, [0.3, 15.0])),
            ("muscle_ends.reach_mm", ends.reach_mm, 1e3, usual(ends.off, [1.0, 50.0])),
            ("outline.sd_mm", outline.sd_mm, 50.0, usual(outline.off, [0.15, 10.0])),
            ("outline.reach_mm", outline.reach_mm, 1e3, usual(outline.off, [1.0, 100.0])),
            ("compressibility.sd_ln_kappa", self.compressibility.sd_ln_kappa, 10.0, None),
            ("bundle_width.median_mm", width.median_mm, 50.0, None),
            ("bundle_width.fixed_mm", width.fixed_mm.unwrap_or(1.0), 50.0, None),
            ("bundle_width.sd_ln", width.sd_ln, 1.0, None),
            ("bone_patch.median_mm", patch.median_mm, 50.0, None),
            ("bone_patch.fixed_mm", patch.fixed_mm.unwrap_or(1.0), 50.0, None),
            ("bone_patch.sd_ln", patch.sd_ln, 1.0, None),
            ("discrepancy.sd", discrepancy.sd, 1.0, usual(discrepancy.off, [0.003, 0.3])),
            ("discrepancy.sd_of_baseline", discrepancy.sd_of_baseline, 1.0, None),
            ("young_modulus.sd_ln", self.young_modulus.sd_ln, 3.0, None),
        ]
    }

    /// Checks that every number is in its range.
    pub fn check(&self) -> Result<(), PosteriorError> {
        let wrong = |what: String| Err(PosteriorError::Refused(what));
        for (name, value, most, _) in self.positive_numbers() {
            if !(value > 0.0 && value <= most) {
                return wrong(format!(
                    "{name} is {value}; it must be above 0 and at most {most} (`off = true` leaves a source out)"
                ));
            }
        }
        let nu = self.compressibility.poisson_ratio;
        if !(0.25..0.5).contains(&nu) {
            return wrong(format!(
                "compressibility.poisson_ratio is {nu}; it must lie from 0.25 to below 0.5"
            ));
        }
        for (name, all) in
            [("tension", &self.tension.fixed_n_per_m), ("baseline", &self.baseline.fixed_n_per_m)]
        {
            if let Some(muscle) = all.keys().find(|m| all.keys().any(|n| n < *m && n.eq_ignore_ascii_case(m)))
            {
                return wrong(format!("{name}.fixed_n_per_m gives {muscle} twice; give each muscle once"));
            }
            if let Some((muscle, value)) = all.iter().find(|(_, v)| TENSION.check(**v).is_err()) {
                return wrong(format!(
                    "{name}.fixed_n_per_m.{muscle} is {value}; it must be from 0 to {}: {}",
                    TENSION.most, TENSION.reason
                ));
            }
        }
        if let Some(&value) = self.hyoid.fixed_mm.iter().flatten().find(|v| !(-50.0..=50.0).contains(*v)) {
            return wrong(format!("hyoid.fixed_mm has {value}; it must lie within 50 mm"));
        }
        let tilt = self.hyoid_tilt.fixed_rad_per_m;
        if let Some(value) = tilt.filter(|v| !(-1e3..=1e3).contains(v)) {
            return wrong(format!("hyoid_tilt.fixed_rad_per_m is {value}; it must lie within 1000 rad/m"));
        }
        if self.discrepancy.off && self.rounding.off {
            return wrong(
                "discrepancy and rounding are both off; one of them is needed, or the data would be exact"
                    .to_owned(),
            );
        }
        Ok(())
    }

    /// Sentences about numbers that are so unusual that they may be in another unit.
    pub fn doubts(&self) -> Vec<String> {
        let unusual = self.positive_numbers().into_iter().filter_map(|(name, value, _, usual)| {
            let [least, most] = usual.filter(|[least, most]| !(least..=most).contains(&&value))?;
            Some(format!("{name} is {value}, where {least} to {most} are usual; check its unit"))
        });
        unusual.collect()
    }

    /// The fixed tension of a muscle in the vowel, N per metre of thickness; `None` where it is unknown.
    pub fn fixed_tension(&self, muscle: &str) -> Option<f64> {
        fixed_value(&self.tension.fixed_n_per_m, muscle)
    }

    /// The fixed tension of a muscle in the baseline, N per metre of thickness; `None` where it is unknown.
    pub fn fixed_tone(&self, muscle: &str) -> Option<f64> {
        if self.baseline.off { Some(0.0) } else { fixed_value(&self.baseline.fixed_n_per_m, muscle) }
    }

    /// Settings of a continuum under these priors; `own` are its present ones.
    pub fn continuum(&self, own: &ContinuumSettings) -> ContinuumSettings {
        let of = |off: bool, fixed: Option<f64>, median: f64, own: f64| {
            if off { own } else { fixed.unwrap_or(median) / 1e3 }
        };
        let (width, patch) = (&self.bundle_width, &self.bone_patch);
        ContinuumSettings {
            bundle_width_m: of(width.off, width.fixed_mm, width.median_mm, own.bundle_width_m),
            patch_radius_m: of(patch.off, patch.fixed_mm, patch.median_mm, own.patch_radius_m),
            ..*own
        }
    }

    /// Standard deviation of the logarithm of the width of muscles; zero where it is known.
    pub fn sd_ln_width(&self) -> f64 {
        let prior = &self.bundle_width;
        if prior.off || prior.fixed_mm.is_some() { 0.0 } else { prior.sd_ln }
    }

    /// Standard deviation of the logarithm of the radius of a bone's patch; zero where it is known.
    pub fn sd_ln_patch(&self) -> f64 {
        let prior = &self.bone_patch;
        if prior.off || prior.fixed_mm.is_some() { 0.0 } else { prior.sd_ln }
    }

    /// A muscle that these priors fix and that the body lacks.
    pub(crate) fn unknown_muscle(&self, muscles: &[String]) -> Option<&str> {
        let named = self.tension.fixed_n_per_m.keys().chain(self.baseline.fixed_n_per_m.keys());
        let mut named = named.filter(|n| *n != EVERY).map(String::as_str);
        named.find(|n| !muscles.iter().any(|m| m.eq_ignore_ascii_case(n)))
    }
}

fn fixed_value(fixed: &BTreeMap<String, f64>, muscle: &str) -> Option<f64> {
    let own = fixed.iter().find(|(name, _)| name.eq_ignore_ascii_case(muscle)).map(|(_, v)| *v);
    own.or_else(|| fixed.get(EVERY).copied())
}
