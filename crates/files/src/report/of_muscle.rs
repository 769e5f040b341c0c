//! What is told of a muscle of a fit: the columns that `fit.csv` and `muscles.csv` have in common.

use serde_json::Value;

use super::Told;
use super::column::Column;

/// A muscle of a fit, or of its posterior.
#[derive(Clone, Copy)]
pub(super) struct OfMuscle<'a> {
    pub record: &'a Told,
    pub muscle: &'a str,
}

impl OfMuscle<'_> {
    pub fn fit(&self, pointer: &str) -> Value {
        self.record.at(pointer).clone()
    }

    pub fn own(&self, pointer: &str) -> Value {
        self.record.of(pointer, self.muscle).clone()
    }

    fn number(&self, pointer: &str) -> Option<f64> {
        self.record.number_of(pointer, self.muscle)
    }

    fn listed(&self, pointer: &str) -> Value {
        self.record.lists(pointer, self.muscle).into()
    }

    /// The measured length in the size of the model, mm, for the quantity that was fitted.
    fn target_mm(&self) -> Option<f64> {
        Some(match self.record.text("/target_kind") {
            "ratio" => {
                let reference = self.record.number_of("/lengths_mm", self.record.text("/reference"));
                self.number("/target_ratios")? * reference.unwrap_or(f64::NAN)
            }
            _ => self.number("/target_stretches")? * self.number("/rest_lengths_mm")?,
        })
    }

    /// Simulated less measured.
    fn residual(&self, simulated: &str, target: Option<f64>) -> Value {
        number(self.number(simulated).zip(target).map(|(s, t)| s - t))
    }
}

/// A value that may be missing.
pub(super) fn number(value: Option<f64>) -> Value {
    value.map_or(Value::Null, Value::from)
}

/// What is told of a muscle of a fit. Lengths in mm: measured ones are the subject's; target, simulated and residual are the model's, whose size
/// is another. What was not measured is empty.
pub(super) fn columns<'a>() -> Vec<Column<'a, OfMuscle<'a>>> {
    type Of<'a> = fn(&OfMuscle<'a>) -> Value;
    let columns: [(_, _, _, Of<'a>); 23] = [
        ("subject", "", "subject", |r| r.fit("/subject")),
        ("vowel", "", "vowel", |r| r.fit("/vowel")),
        ("baseline", "", "vowel that changes are counted from", |r| r.fit("/baseline")),
        ("substitute_baseline", "", "whether the baseline stands in for a missing /ɯ/", |r| {
            r.fit("/substitute_baseline")
        }),
        ("target_kind", "", "quantity that was fitted: ratio or stretch", |r| r.fit("/target_kind")),
        ("status", "", "how the fit ended", |r| r.fit("/status")),
        ("muscle", "", "muscle", |r| r.muscle.into()),
        ("active", "", "whether it may contract", |r| r.listed("/active")),
        ("fitted", "", "whether the fit has to meet it", |r| r.listed("/fitted")),
        ("uncertain", "", "whether its change is within the rounding of the data", |r| {
            r.listed("/uncertain")
        }),
        ("tension_n_per_m", "N/m", "tension that was found", |r| r.own("/tensions_n")),
        ("baseline_length_mm", "mm", "measured in the baseline", |r| r.own("/baseline_lengths_mm")),
        ("measured_length_mm", "mm", "measured in the vowel", |r| r.own("/measured_lengths_mm")),
        ("rest_length_mm", "mm", "length of the model at rest", |r| r.own("/rest_lengths_mm")),
        ("target_length_mm", "mm", "measured, in the size of the model", |r| number(r.target_mm())),
        ("simulated_length_mm", "mm", "length of the model", |r| r.own("/lengths_mm")),
        ("residual_mm", "mm", "simulated less target length", |r| r.residual("/lengths_mm", r.target_mm())),
        ("target_ratio", "", "measured length over that of the reference muscle", |r| {
            r.own("/target_ratios")
        }),
        ("simulated_ratio", "", "simulated length over that of the reference muscle", |r| r.own("/ratios")),
        ("residual_ratio", "", "simulated less measured ratio", |r| {
            r.residual("/ratios", r.number("/target_ratios"))
        }),
        ("target_stretch", "", "measured length over that in the baseline", |r| r.own("/target_stretches")),
        ("simulated_stretch", "", "simulated length over that at rest", |r| r.own("/stretches")),
        ("residual_stretch", "", "simulated less measured stretch", |r| {
            r.residual("/stretches", r.number("/target_stretches"))
        }),
    ];
    columns.into_iter().map(|(name, unit, meaning, value)| Column::new(name, unit, meaning, value)).collect()
}

/// Those of the columns with these names, in this order; `a b` shows the column `a` under the name `b`.
pub(super) fn picked<'a>(names: &[&'static str]) -> Vec<Column<'a, OfMuscle<'a>>> {
    let mut all: Vec<_> = columns().into_iter().map(Some).collect();
    let pick = |name: &&'static str| {
        let (name, shown) = name.split_once(' ').unwrap_or((name, name));
        let found = all.iter_mut().find(|c| c.as_ref().is_some_and(|c| c.name == name))?.take()?;
        Some(Column { name: shown.into(), ..found })
    };
    let picked: Vec<_> = names.iter().filter_map(pick).collect();
    debug_assert_eq!(picked.len(), names.len(), "a name is not that of a column, or stands twice: {names:?}");
    picked
}
