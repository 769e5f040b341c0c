//! What is told of a muscle of a fit: the columns that `fit.csv` and `muscles.csv` have in common.

use serde_json::{Value, json};

use super::column::{self, Column};
use super::record::FitRecord;
use tongue_input::measured::{ByMuscle, TargetKind};

/// A muscle of a fit; what only a batch tells of it is empty elsewhere.
#[derive(Clone, Copy)]
pub(super) struct OfMuscle<'a> {
    pub fit: &'a FitRecord,
    pub substitute_baseline: bool,
    pub fitted: &'a [String],
    pub muscle: &'a str,
}

impl OfMuscle<'_> {
    fn own(&self, values: &ByMuscle<f64>) -> Option<f64> {
        values.of(self.muscle).copied()
    }

    fn is_in(&self, list: &[String]) -> Value {
        list.iter().any(|name| name == self.muscle).into()
    }

    /// The measured length in the size of the model, mm, for the quantity that was fitted.
    fn target_mm(&self) -> Option<f64> {
        let fit = self.fit;
        Some(match fit.target_kind {
            TargetKind::Ratio => {
                let reference = fit.lengths_mm.of(&fit.reference).copied();
                self.own(&fit.target_ratios)? * reference.unwrap_or(f64::NAN)
            }
            TargetKind::Stretch => self.own(&fit.target_stretches)? * self.own(&fit.rest_lengths_mm)?,
        })
    }

    /// Simulated less measured.
    fn residual(&self, simulated: &ByMuscle<f64>, target: Option<f64>) -> Value {
        json!(self.own(simulated).zip(target).map(|(s, t)| s - t))
    }
}

/// What is told of a muscle of a fit. Lengths in mm: measured ones are the subject's; target, simulated and residual are the model's, whose size
/// is another. What was not measured is empty.
pub(super) fn columns<'a>() -> Vec<Column<'a, OfMuscle<'a>>> {
    column::columns::<OfMuscle<'a>, _>([
        ("subject", "", "subject", |r| json!(r.fit.subject)),
        ("vowel", "", "vowel", |r| json!(r.fit.vowel)),
        ("baseline", "", "vowel with which this one is compared", |r| json!(r.fit.baseline)),
        ("substitute_baseline", "", "whether the baseline stands in for a missing /ɯ/", |r| {
            r.substitute_baseline.into()
        }),
        ("target_kind", "", "quantity that was fitted: ratio or stretch", |r| json!(r.fit.target_kind)),
        ("status", "", "how the fit ended", |r| json!(r.fit.status)),
        ("muscle", "", "muscle", |r| r.muscle.into()),
        ("active", "", "whether it may contract", |r| r.is_in(&r.fit.active)),
        ("fitted", "", "whether the fit has to meet it", |r| r.is_in(r.fitted)),
        ("uncertain", "", "whether its change is within the rounding of the data", |r| {
            r.is_in(&r.fit.uncertain)
        }),
        ("tension_n_per_m", "N/m", "tension that was found", |r| json!(r.own(&r.fit.tensions_n))),
        ("baseline_length_mm", "mm", "measured in the baseline", |r| {
            json!(r.own(&r.fit.baseline_lengths_mm))
        }),
        ("measured_length_mm", "mm", "measured in the vowel", |r| json!(r.own(&r.fit.measured_lengths_mm))),
        ("rest_length_mm", "mm", "length of the model at rest", |r| json!(r.own(&r.fit.rest_lengths_mm))),
        ("target_length_mm", "mm", "measured, in the size of the model", |r| json!(r.target_mm())),
        ("simulated_length_mm", "mm", "length of the model", |r| json!(r.own(&r.fit.lengths_mm))),
        ("residual_mm", "mm", "simulated less target length", |r| {
            r.residual(&r.fit.lengths_mm, r.target_mm())
        }),
        ("target_ratio", "", "measured length over that of the reference muscle", |r| {
            json!(r.own(&r.fit.target_ratios))
        }),
        ("simulated_ratio", "", "simulated length over that of the reference muscle", |r| {
            json!(r.own(&r.fit.ratios))
        }),
        ("residual_ratio", "", "simulated less measured ratio", |r| {
            r.residual(&r.fit.ratios, r.own(&r.fit.target_ratios))
        }),
        ("target_stretch", "", "measured length over that in the baseline", |r| {
            json!(r.own(&r.fit.target_stretches))
        }),
        ("simulated_stretch", "", "simulated length over that at rest", |r| json!(r.own(&r.fit.stretches))),
        ("residual_stretch", "", "simulated less measured stretch", |r| {
            r.residual(&r.fit.stretches, r.own(&r.fit.target_stretches))
        }),
    ])
}

/// Those of the columns with these names, in this order; `a b` shows the column `a` under the name `b`.
pub(super) fn picked<'a>(names: &'static str) -> Vec<Column<'a, OfMuscle<'a>>> {
    let all = columns();
    let pick = |name: &'static str| {
        let (name, shown) = name.split_once(' ').unwrap_or((name, name));
        Some(Column { name: shown.into(), ..all.iter().find(|c| c.name == name)?.clone() })
    };
    let picked: Vec<_> = names.split(',').filter_map(pick).collect();
    debug_assert_eq!(picked.len(), names.split(',').count(), "a name is not that of a column: {names:?}");
    picked
}
