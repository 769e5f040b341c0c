//! The columns of a muscle of a fit that `fit.csv` and `muscles.csv` have in common.

use serde_json::{Value, json};

use super::column::{self, Column};
use super::export::Export;
use super::record::FitRecord;
use tongue_input::measured::TargetKind::{Ratio, Stretch};
use tongue_input::measured::{Target, TargetKind};

#[derive(Clone, Copy)]
pub(super) struct OfMuscle<'a> {
    pub record: &'a FitRecord,
    pub substitute_baseline: bool,
    pub muscle: usize,
}

impl OfMuscle<'_> {
    pub fn target(&self) -> &Target {
        &self.record.fit.matched.target
    }

    pub fn name(&self) -> &str {
        &self.record.fit.matched.muscles[self.muscle]
    }

    fn own(&self, values: &[f64]) -> Option<f64> {
        values.get(self.muscle).copied()
    }

    fn mm(&self, lengths_m: &[f64]) -> Option<f64> {
        self.own(lengths_m).map(|l| l * 1e3)
    }

    fn measured(&self, kind: TargetKind) -> Option<f64> {
        self.own(&self.target().measured_in(kind))
    }

    fn simulated(&self, kind: TargetKind) -> Option<f64> {
        self.own(&self.record.fit.simulated(kind))
    }

    fn residual(&self, kind: TargetKind) -> Value {
        json!(self.simulated(kind).zip(self.measured(kind)).map(|(s, m)| s - m))
    }

    /// The measured length of the quantity that was fitted, scaled to the size of the model, mm.
    fn target_mm(&self) -> Option<f64> {
        let (fit, target) = (&self.record.fit, self.target());
        let unit = match target.kind {
            Ratio => fit.lengths()[target.reference] * 1e3,
            Stretch => self.mm(&fit.rest_lengths)?,
        };
        Some(self.measured(target.kind)? * unit)
    }
}

/// The columns of `fit.csv`, as [`select_columns`] takes them.
pub(super) const OF_ONE_FIT: &str = "subject,vowel,baseline,target_kind,status,muscle,active,uncertain,\
    tension_n_per_m,rest_length_mm,simulated_length_mm,baseline_length_mm,measured_length_mm,simulated_ratio,\
    target_ratio measured_ratio,residual_ratio ratio_residual,simulated_stretch,\
    target_stretch measured_stretch,residual_stretch stretch_residual";

impl FitRecord {
    pub fn to_csv(&self) -> std::io::Result<String> {
        column::table(&select_columns(OF_ONE_FIT), &self.muscles(false)).text(&self.made_by)
    }

    pub(super) fn muscles(&self, substitute_baseline: bool) -> Vec<OfMuscle<'_>> {
        let numbers = 0..self.fit.matched.muscles.len();
        numbers.map(|muscle| OfMuscle { record: self, substitute_baseline, muscle }).collect()
    }
}

/// Lengths in mm: measured ones are the subject's; others are in the size of the model. What was not measured is empty.
pub(super) fn columns<'a>() -> Vec<Column<'a, OfMuscle<'a>>> {
    column::columns::<OfMuscle<'a>, _>([
        ("subject", "", "subject", |r| json!(r.target().subject)),
        ("vowel", "", "vowel", |r| json!(r.target().vowel)),
        ("baseline", "", "vowel with which this one is compared", |r| json!(r.target().baseline)),
        ("substitute_baseline", "", "whether the baseline stands in for a missing /ɯ/", |r| {
            r.substitute_baseline.into()
        }),
        ("target_kind", "", "quantity that was fitted: ratio or stretch", |r| json!(r.target().kind)),
        ("status", "", "how the fit ended", |r| json!(r.record.fit.answer.status)),
        ("muscle", "", "muscle", |r| r.name().into()),
        ("active", "", "whether it may contract", |r| r.target().active.contains(&r.muscle).into()),
        ("fitted", "", "whether the fit has to meet it", |r| r.target().fitted.contains(&r.muscle).into()),
        ("uncertain", "", "whether its change is within the rounding of the data", |r| {
            r.target().activation.get(r.muscle).is_some_and(|a| a.uncertain).into()
        }),
        ("tension_n_per_m", "N/m", "tension that was found", |r| json!(r.own(&r.record.fit.tensions()))),
        ("baseline_length_mm", "mm", "measured in the baseline", |r| json!(r.own(&r.target().baseline_mm))),
        ("measured_length_mm", "mm", "measured in the vowel", |r| json!(r.own(&r.target().measured_mm))),
        ("rest_length_mm", "mm", "length of the model at rest", |r| json!(r.mm(&r.record.fit.rest_lengths))),
        ("target_length_mm", "mm", "measured length in the size of the model", |r| json!(r.target_mm())),
        ("simulated_length_mm", "mm", "length of the model", |r| json!(r.mm(&r.record.fit.lengths()))),
        ("residual_mm", "mm", "simulated less target length", |r| {
            json!(r.mm(&r.record.fit.lengths()).zip(r.target_mm()).map(|(s, t)| s - t))
        }),
        ("target_ratio", "", "measured length over that of the reference muscle", |r| {
            json!(r.measured(Ratio))
        }),
        ("simulated_ratio", "", "simulated length over that of the reference muscle", |r| {
            json!(r.simulated(Ratio))
        }),
        ("residual_ratio", "", "simulated less measured ratio", |r| r.residual(Ratio)),
        ("target_stretch", "", "measured length over that in the baseline", |r| json!(r.measured(Stretch))),
        ("simulated_stretch", "", "simulated length over that at rest", |r| json!(r.simulated(Stretch))),
        ("residual_stretch", "", "simulated less measured stretch", |r| r.residual(Stretch)),
    ])
}

/// The columns with these names, in this order; `a b` gives the column `a` the name `b`.
pub(super) fn select_columns<'a>(names: &'static str) -> Vec<Column<'a, OfMuscle<'a>>> {
    let all = columns();
    let selected = Vec::from_iter(names.split(',').filter_map(|name| {
        let (name, shown) = name.split_once(' ').unwrap_or((name, name));
        let mut column = all.iter().find(|c| c.name == name)?.clone();
        column.name = shown.into();
        Some(column)
    }));
    debug_assert_eq!(selected.len(), names.split(',').count(), "a name is not that of a column: {names:?}");
    selected
}
