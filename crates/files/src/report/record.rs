//! Results as records for JSON and CSV: stable field names, units in the names, muscles by name.

use serde::Serialize;
use serde_json::{Value, json};

use super::column;
use super::export::{Export, Provenance};
use super::of_muscle::{self, OfMuscle};
use super::{ByMuscle, Conclusion, ReportError, Series, Svg, Table, changes};
use crate::run::Equilibrium;
use tongue_core::statics;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::valley::{Valley, ValleyPoint};
use tongue_infer::inverse::{self, Fit};
use tongue_input::measured::{TargetKind, Vowel};

/// Lengths in metres as millimetres, by muscle.
pub(super) fn mm(names: &[String], lengths_m: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, lengths_m.iter().map(|l| l * 1e3))
}

pub(super) fn by(names: &[String], values: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, values.iter().copied())
}

/// One equilibrium: `tongue-fit simulate --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationRecord {
    #[serde(flatten)]
    pub found: Equilibrium,
    pub tensions_n: ByMuscle<f64>,
    pub lengths_mm: ByMuscle<f64>,
    /// Lengths over that of the reference muscle (GGa if there is one).
    pub ratios: ByMuscle<f64>,
    pub stretches: ByMuscle<f64>,
    pub positions_m: Vec<Vec<f64>>,
    /// Smallest ratio of the tissue's area to that at rest, of a triangle or in a continuum within an element.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
    /// Potential energy, J per metre of thickness.
    pub energy_j: f64,
    pub wall_s: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiabilityRecord {
    /// Singular values of d(fitted value)/d(tension), 1/N, largest first.
    pub singular_values: Vec<f64>,
    pub undetermined: usize,
    /// Unit vectors over `active`, in its order.
    pub null_directions: Vec<Vec<f64>>,
    /// For each of them the ends of the curve of tensions that fit as well ([`ValleyRecord`]), which is not straight between them.
    pub segments: Vec<Value>,
}

/// One fit: `tongue-fit --vowel a --json`, and `fit.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitRecord {
    /// Provenance: `version`, `command` and, if it is known, `tissue`.
    #[serde(flatten)]
    pub made_by: Provenance,
    /// `verdict`: for every muscle whether it pulls harder than in the baseline (`muscle`, `p_rises`, `word`, `tension_n_per_m`,
    /// `mostly_prior`); `verdict_hyoid_mm`, the 95 % intervals of the hyoid's displacement (back, up); and `verdict_from`: `draws` or
    /// `short_run`. Left out where there is none.
    #[serde(flatten)]
    pub verdict: Option<tongue_infer::posterior::Verdict>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conclusion: Option<Conclusion>,
    pub subject: String,
    pub vowel: Vowel,
    pub baseline: Vowel,
    pub target_kind: TargetKind,
    pub reference: String,
    pub active: Vec<String>,
    pub uncertain: Vec<String>,
    /// Muscles of the table or the body that were not measured in both rows, which are not observations.
    pub not_measured: Vec<String>,
    pub status: inverse::FitStatus,
    pub tensions_n: ByMuscle<f64>,
    /// Simulated lengths, mm (of the model, whose size is not the subject's).
    pub lengths_mm: ByMuscle<f64>,
    /// Lengths of the model at rest, mm, which stretches are counted from.
    pub rest_lengths_mm: ByMuscle<f64>,
    pub measured_lengths_mm: ByMuscle<f64>,
    pub baseline_lengths_mm: ByMuscle<f64>,
    /// Simulated lengths over that of GGa.
    pub ratios: ByMuscle<f64>,
    pub target_ratios: ByMuscle<f64>,
    /// Simulated lengths over those of the model at rest.
    pub stretches: ByMuscle<f64>,
    pub target_stretches: ByMuscle<f64>,
    /// Simulated less measured, in the quantity that was fitted.
    pub residuals: ByMuscle<f64>,
    pub misfit: f64,
    /// Root mean square residual of the muscles that do not contract and that the fit does not see.
    pub passive_rms: Option<f64>,
    pub evaluations: usize,
    pub starts: Vec<inverse::Start>,
    pub alarms: Vec<Alarm>,
    /// The curve of all tensions that fit as well, if one direction is undetermined.
    pub valley: Option<ValleyRecord>,
    /// Elements in which the barrier against inversion acts.
    pub guarded: usize,
    pub connection: statics::Connection,
    /// What the data leave undetermined; null if the equilibrium is singular.
    pub identifiability: Option<IdentifiabilityRecord>,
    pub max_residual_force_n: f64,
    /// Largest distance of a node between the search's answer and the shape to which its tensions lead from
    /// rest, m.
    pub replay_difference_m: f64,
    /// Smallest ratio of the tissue's area to that at rest, of a triangle or in a continuum within an element.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posterior: Option<tongue_infer::posterior::Report>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contrasts: Vec<tongue_infer::posterior::Contrast>,
    /// Duration of the whole fit, s; left out of files that must be the same after every run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_s: Option<f64>,
}

impl FitRecord {
    /// The record of a fit with its provenance and the `alarms` about it.
    pub fn new<const D: usize>(fit: &Fit<D>, alarms: &[Alarm], made_by: Provenance) -> Self {
        let (target, all) = (&fit.target, &fit.muscles);
        let measured = &target.muscles;
        let names = |positions: &mut dyn Iterator<Item = usize>| positions.map(|m| all[m].clone()).collect();
        let active: Vec<String> = names(&mut target.active.iter().copied());
        let identifiability = fit.identifiability.as_ref().map(|i| IdentifiabilityRecord {
            singular_values: i.singular_values.clone(),
            undetermined: i.null_directions.len(),
            null_directions: i.null_directions.iter().map(|n| n.direction.clone()).collect(),
            segments: i
                .null_directions
                .iter()
                .filter_map(|n| {
                    let points = &n.valley.as_ref()?.points;
                    let (from, to) = (points.first()?, points.last()?);
                    Some(json!({ "from_n": by(&active, &from.x), "to_n": by(&active, &to.x) }))
                })
                .collect(),
        });
        let valley = fit.valley().map(|v| ValleyRecord::new(v, &active, all, |lengths| fit.of_body(lengths)));
        let simulated = |kind: TargetKind| kind.values(&fit.lengths, &fit.rest_lengths, target.reference);
        let of_target =
            |kind: TargetKind| kind.values(&target.measured_mm, &target.baseline_mm, target.reference);
        Self {
            made_by,
            subject: target.subject.clone(),
            vowel: target.vowel.clone(),
            baseline: target.baseline.clone(),
            target_kind: target.kind,
            reference: measured[target.reference].clone(),
            uncertain: names(&mut (0..measured.len()).filter(|&m| target.activation[m].uncertain)),
            status: fit.status,
            tensions_n: by(all, &fit.tensions),
            lengths_mm: mm(all, &fit.lengths),
            rest_lengths_mm: mm(all, &fit.rest_lengths),
            measured_lengths_mm: by(measured, &target.measured_mm),
            baseline_lengths_mm: by(measured, &target.baseline_mm),
            ratios: by(all, &simulated(TargetKind::Ratio)),
            target_ratios: by(measured, &of_target(TargetKind::Ratio)),
            stretches: by(all, &simulated(TargetKind::Stretch)),
            target_stretches: by(measured, &of_target(TargetKind::Stretch)),
            residuals: by(measured, &fit.residuals),
            not_measured: fit.not_measured(),
            active,
            misfit: fit.misfit,
            passive_rms: fit.passive_rms(),
            evaluations: fit.evaluations,
            starts: fit.starts.clone(),
            alarms: alarms.to_vec(),
            valley,
            guarded: fit.replay.solution.guarded,
            connection: fit.replay.solution.connection,
            identifiability,
            max_residual_force_n: fit.replay.solution.max_residual_force,
            replay_difference_m: fit.replay.largest_difference,
            min_area_ratio: fit.replay.min_area_ratio,
            max_area_ratio: fit.replay.max_area_ratio,
            verdict: None,
            conclusion: None,
            posterior: None,
            contrasts: Vec::new(),
            wall_s: None,
        }
    }

    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self).map(|s| s + "\n")
    }

    /// Figure 4.9 of the thesis: the change of every measured muscle, with that of other tensions if there are any.
    pub fn changes(&self, title: &str, measured: &str, others: Option<Series>) -> Result<Svg, ReportError> {
        let of = |values: &ByMuscle<f64>| {
            self.target_stretches.0.iter().filter_map(|(muscle, _)| values.of(muscle).copied()).collect()
        };
        let contracts = |m: &str| self.tensions_n.of(m).is_some_and(|tension| *tension >= inverse::AT_BOUND);
        let label = |(m, _): &(String, f64)| format!("{m}{}", if contracts(m) { "*" } else { "" });
        let labels: Vec<String> = self.target_stretches.0.iter().map(label).collect();
        let mut series = vec![
            Series { name: measured.to_owned(), values: of(&self.target_stretches) },
            Series { name: "simulated".to_owned(), values: of(&self.stretches) },
        ];
        series.extend(others);
        changes(&labels, &series, self.baseline.label(), title)
    }

    pub fn to_csv(&self) -> std::io::Result<String> {
        const COLUMNS: &str = "subject,vowel,baseline,target_kind,status,muscle,active,uncertain,tension_n_per_m,\
            rest_length_mm,simulated_length_mm,baseline_length_mm,measured_length_mm,simulated_ratio,\
            target_ratio measured_ratio,residual_ratio ratio_residual,simulated_stretch,\
            target_stretch measured_stretch,residual_stretch stretch_residual";
        let names = self.tensions_n.0.iter().map(|(muscle, _)| muscle.as_str());
        let row = |muscle| OfMuscle { fit: self, substitute_baseline: false, fitted: &[], muscle };
        let rows: Vec<_> = names.map(row).collect();
        column::table(&of_muscle::picked(COLUMNS), &rows).text(&self.made_by)
    }
}

/// All tensions that meet an undetermined target as well as the answer: points on a curve from end to end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValleyRecord {
    pub points: Vec<ValleyPointRecord>,
    pub answer: usize,
    /// Why the curve ends before the first point and after the last.
    pub ends: [String; 2],
}

impl ValleyRecord {
    /// The record of a curve over `unknowns` in a body with these muscles; `of_body` selects their lengths
    /// from those of all chains.
    pub fn new(
        valley: &Valley,
        unknowns: &[String],
        muscles: &[String],
        of_body: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Self {
        let point = |p: &ValleyPoint| ValleyPointRecord {
            tensions_n: by(unknowns, &p.x),
            lengths_mm: mm(muscles, &of_body(&p.lengths)),
            misfit: p.misfit,
            passive_rms: p.other_rms,
        };
        Self {
            points: valley.points.iter().map(point).collect(),
            answer: valley.answer,
            ends: valley.ends.map(|end| end.text(unknowns)),
        }
    }

    /// A row for each point: its number, tension and length of every muscle, misfit and passive residual.
    pub fn table(&self) -> Table {
        let Some(first) = self.points.first() else { return Table::default() };
        let tensions = first.tensions_n.0.iter().map(|(m, _)| format!("tension_{m}_n_per_m"));
        let lengths = first.lengths_mm.0.iter().map(|(m, _)| format!("{m}_mm"));
        let columns = ["point", "is_answer"].map(str::to_owned).into_iter().chain(tensions).chain(lengths);
        let columns = columns.chain(["misfit", "passive_rms"].map(str::to_owned)).collect();
        let row = |(number, p): (usize, &ValleyPointRecord)| {
            let values = p.tensions_n.0.iter().chain(&p.lengths_mm.0).map(|(_, v)| v.to_string());
            let first = [number.to_string(), (number == self.answer).to_string()];
            let rms = p.passive_rms.map(|r| r.to_string()).unwrap_or_default();
            first.into_iter().chain(values).chain([p.misfit.to_string(), rms]).collect()
        };
        Table { columns, rows: self.points.iter().enumerate().map(row).collect() }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValleyPointRecord {
    pub tensions_n: ByMuscle<f64>,
    pub lengths_mm: ByMuscle<f64>,
    pub misfit: f64,
    /// Root mean square residual of the other measured muscles, in the fitted quantity.
    pub passive_rms: Option<f64>,
}
