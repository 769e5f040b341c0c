//! Results as records for JSON and CSV (fits, trajectories, conclusions); names of fields end with their units, and values of
//! muscles are keyed by name.

use serde::{Serialize, Serializer};
use serde_json::json;

use super::export::Provenance;
use super::{ByMuscle, ReportError, SectionPicture, Series, Svg, Table, changes, tongue};
use tongue_core::body::Body;
use tongue_core::dynamics::{IntegrationMethod, MotionOutcome};
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::solution_curve::{CurvePoint, SolutionCurve};
use tongue_infer::inverse::{AT_BOUND, Fit};
use tongue_infer::posterior::{Report, Verdict};
use tongue_input::measured::TargetKind;

pub(super) fn mm(names: &[String], lengths_m: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, lengths_m.iter().map(|l| l * 1e3))
}

pub(super) fn by_muscle(names: &[String], values: &[f64]) -> ByMuscle<f64> {
    ByMuscle::new(names, values.iter().copied())
}

/// One fit: `tongue-fit --vowel a --json`, and `fit.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitRecord {
    #[serde(flatten)]
    pub made_by: Provenance,
    /// Has the keys `verdict`: for every muscle whether it pulls harder than in the baseline (`muscle`, `p_rises`, `word`,
    /// `tension_n_per_m`, `mostly_prior`); `verdict_hyoid_mm`: the 95 % intervals of the hyoid's displacement (back, up); and
    /// `verdict_from`: `draws` or `short_run`. They are left out if there is no verdict.
    #[serde(flatten)]
    pub verdict: Option<Verdict>,
    /// Why a verdict that was asked for could not be made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_verdict: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conclusion: Option<Conclusion>,
    #[serde(flatten, serialize_with = "serialize_fit")]
    pub fit: Fit,
    pub alarms: Vec<Alarm>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posterior: Option<Report>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contrasts: Vec<tongue_infer::posterior::Contrast>,
    /// Duration of the whole fit; left out of files that must be the same after every run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_s: Option<f64>,
}

/// A fit as JSON. Simulated lengths are the model's, whose size is not the subject's. Ratios are lengths over that of the reference muscle;
/// stretches are lengths over that at rest (simulated) or in the baseline (measured). Singular values, 1/N, are those of d(fitted
/// value)/d(tension), largest first. Null directions are unit vectors over `active`, and `segments` the ends of the curves along them.
/// Tensions (`tensions_n`, `from_n`, `to_n`) are in N/m, per metre of thickness. `replay_difference_m` is the largest distance of a node
/// between the search's answer and the shape to which its tensions lead from rest.
fn serialize_fit<S: Serializer>(fit: &Fit, serializer: S) -> Result<S::Ok, S::Error> {
    let (target, all, replay) = (&fit.matched.target, &fit.matched.muscles, &fit.answer.replay);
    let (measured, active) = (&target.muscles, fit.active_names());
    let identifiability = fit.answer.identifiability.as_ref().map(|i| {
        let curves = fit.answer.solution_curves();
        let ends = curves
            .filter_map(|v| Some([v.points.first()?, v.points.last()?].map(|p| by_muscle(&active, &p.x))));
        json!({
            "singular_values": i.singular_values,
            "undetermined": i.null_directions.len(),
            "null_directions": i.null_directions.iter().map(|n| &n.direction).collect::<Vec<_>>(),
            "segments": ends.map(|[from, to]| json!({ "from_n": from, "to_n": to })).collect::<Vec<_>>(),
        })
    });
    let uncertain = measured.iter().zip(&target.activation).filter(|(_, a)| a.uncertain);
    let record = json!({
        "subject": target.subject,
        "vowel": target.vowel,
        "baseline": target.baseline,
        "target_kind": target.kind,
        "reference": measured[target.reference],
        "active": active,
        "uncertain": uncertain.map(|(name, _)| name).collect::<Vec<_>>(),
        "not_measured": fit.not_measured(),
        "status": fit.answer.status,
        "tensions_n": by_muscle(all, &fit.tensions()),
        "lengths_mm": mm(all, &fit.lengths()),
        "rest_lengths_mm": mm(all, &fit.rest_lengths),
        "measured_lengths_mm": by_muscle(measured, &target.measured_mm),
        "baseline_lengths_mm": by_muscle(measured, &target.baseline_mm),
        "ratios": by_muscle(all, &fit.simulated(TargetKind::Ratio)),
        "target_ratios": by_muscle(measured, &target.measured_in(TargetKind::Ratio)),
        "stretches": by_muscle(all, &fit.simulated(TargetKind::Stretch)),
        "target_stretches": by_muscle(measured, &target.measured_in(TargetKind::Stretch)),
        "residuals": by_muscle(measured, &fit.residuals()),
        "misfit": fit.answer.misfit,
        "passive_rms": fit.passive_rms(),
        "evaluations": fit.answer.counts.evaluations,
        "starts": fit.answer.starts,
        "valley": SolutionCurveRecord::of(fit),
        "guarded": replay.trace.solution.guarded,
        "connection": replay.trace.solution.connection,
        "identifiability": identifiability,
        "max_residual_force_n": replay.trace.solution.max_residual_force,
        "replay_difference_m": replay.largest_difference,
        "min_area_ratio": replay.min_area_ratio,
        "max_area_ratio": replay.max_area_ratio,
    });
    record.serialize(serializer)
}

impl FitRecord {
    /// Draws the conclusion: the text that is printed last, and whether it can be trusted, which gives the exit
    /// status.
    pub fn conclude(&mut self) -> &Conclusion {
        let Self { alarms, posterior, verdict, .. } = &*self;
        let contradiction = alarms.iter().find(|alarm| alarm.is_contradiction());
        let cause = alarms.iter().find(|alarm| alarm.forbids_trust());
        let beside = |what: &str| match cause {
            None => format!("Trust the {what} more than these tensions"),
            Some(cause) => format!("Trust the {what}, not these tensions: {cause}"),
        };
        let (decided_by, trusted, text) = match (contradiction, verdict, posterior, cause) {
            (Some(alarm), ..) => (DecidedBy::Posterior, false, alarm.to_string()),
            (_, Some(_), ..) => (DecidedBy::Verdict, true, beside("verdict")),
            (.., Some(report), _) if report.summary.is_none() => {
                let why = &report.diagnostics.why;
                (DecidedBy::Posterior, false, format!("the chains of the posterior have not mixed: {why}"))
            }
            (.., Some(_), _) => (DecidedBy::Posterior, true, beside("posterior")),
            (.., None) => {
                let text = "Without a verdict these tensions ignore errors of anatomy and model";
                (DecidedBy::Fit, true, text.to_owned())
            }
            (.., Some(cause)) => (DecidedBy::Fit, false, format!("the fit cannot be trusted: {cause}")),
        };
        let tensions_trusted = cause.is_none();
        self.conclusion.insert(Conclusion { decided_by, trusted, tensions_trusted, text })
    }

    pub fn picture(&self, body: &Body<2>) -> Result<Svg, ReportError> {
        let (fit, target) = (&self.fit, &self.fit.matched.target);
        let title =
            format!("{} /{}/: at rest (grey) and at the tensions found", target.subject, target.vowel);
        let palate = body.palate.as_deref().unwrap_or_default();
        let shown = fit.answer.tensions.iter().map(|t| if *t >= AT_BOUND { *t } else { 0.0 });
        let tensions: Vec<f64> = shown.collect();
        tongue(&SectionPicture::new(&body.mesh, &fit.answer.positions, &tensions, palate, &title))
    }

    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self).map(|s| s + "\n")
    }

    /// Figure 4.9 of the thesis: the measured and simulated change of every measured muscle, and the changes of `others` if there are any.
    pub fn changes(&self, title: &str, measured: &str, others: Option<Series>) -> Result<Svg, ReportError> {
        let target = &self.fit.matched.target;
        let star = |muscle: &String| if self.fit.has_tension(muscle) { "*" } else { "" };
        let labels: Vec<String> = target.muscles.iter().map(|m| format!("{m}{}", star(m))).collect();
        let simulated = self.fit.simulated(TargetKind::Stretch)[..labels.len()].to_vec();
        let mut series = vec![
            Series { name: measured.to_owned(), values: target.measured_in(TargetKind::Stretch) },
            Series { name: "simulated".to_owned(), values: simulated },
        ];
        series.extend(others);
        changes(&labels, &series, target.baseline.label(), title)
    }
}

/// A curve of tensions that meet an undetermined target equally well, with the names of its unknowns and of muscles.
#[derive(Debug, Clone)]
pub struct SolutionCurveRecord<'a> {
    pub curve: &'a SolutionCurve,
    pub unknowns: Vec<String>,
    /// Names of muscles, and the indices of their chains in the body.
    pub muscles: Vec<(String, usize)>,
}

impl<'a> SolutionCurveRecord<'a> {
    /// The curve of a fit that leaves one direction undetermined.
    pub fn of(fit: &'a Fit) -> Option<Self> {
        let muscles = fit.matched.muscles.iter().cloned().zip(fit.matched.numbers.iter().copied()).collect();
        Some(Self { curve: fit.answer.solution_curve()?, unknowns: fit.active_names(), muscles })
    }

    /// Why the curve ends before the first and after the last point.
    pub fn ends(&self) -> [String; 2] {
        self.curve.ends.map(|end| end.text(&self.unknowns))
    }

    fn lengths_mm(&self, point: &CurvePoint) -> ByMuscle<f64> {
        ByMuscle(self.muscles.iter().map(|(m, number)| (m.clone(), point.lengths[*number] * 1e3)).collect())
    }

    /// A row for each point: its index, tension and length of every muscle, misfit and passive residual.
    pub fn table(&self) -> Table {
        let tensions = self.unknowns.iter().map(|m| format!("tension_{m}_n_per_m"));
        let lengths = self.muscles.iter().map(|(m, _)| format!("{m}_mm"));
        let columns = ["point", "is_answer"].map(str::to_owned).into_iter().chain(tensions).chain(lengths);
        let columns = columns.chain(["misfit", "passive_rms"].map(str::to_owned)).collect();
        let rows = self.curve.points.iter().enumerate().map(|(number, p)| {
            let lengths_mm = self.lengths_mm(p);
            let values = p.x.iter().chain(lengths_mm.0.iter().map(|(_, mm)| mm)).map(f64::to_string);
            let first = [number.to_string(), (number == self.curve.answer).to_string()];
            let rms = p.other_rms.map(|r| r.to_string()).unwrap_or_default();
            first.into_iter().chain(values).chain([p.misfit.to_string(), rms]).collect()
        });
        Table { columns, rows: rows.collect() }
    }
}

impl Serialize for SolutionCurveRecord<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let point = |p: &CurvePoint| {
            json!({
                "tensions_n": by_muscle(&self.unknowns, &p.x),
                "lengths_mm": self.lengths_mm(p),
                "misfit": p.misfit,
                "passive_rms": p.other_rms,
            })
        };
        let points: Vec<_> = self.curve.points.iter().map(point).collect();
        json!({ "points": points, "answer": self.curve.answer, "ends": self.ends() }).serialize(serializer)
    }
}

/// One trajectory: `tongue-fit simulate --trajectory --json`, and `trajectory.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrajectoryRecord {
    #[serde(flatten)]
    pub outcome: MotionOutcome,
    pub method: IntegrationMethod,
    /// Fixed step; null with error control.
    pub dt_s: Option<f64>,
    /// Error allowed in a step; null with a fixed step.
    pub tolerance_mm: Option<f64>,
    pub t_end_s: f64,
    /// Part of the way to the equilibrium under the present tensions that the body has moved; null if it has no equilibrium to go to.
    pub part_of_way_to_equilibrium: Option<f64>,
    /// Elements in which the barrier against inversion acts at the end.
    pub guarded: usize,
    pub lengths_mm: ByMuscle<f64>,
    /// Smallest ratio at the end of the tissue's area to that at rest, over triangles or, in a continuum, within elements.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
    pub wall_s: f64,
}

/// The part of a record that decides whether the record can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DecidedBy {
    Verdict,
    /// A posterior that was asked for and gives no verdict, or contradicts the lengths.
    Posterior,
    /// The fit, if there is neither.
    Fit,
}

/// What is concluded of the fit of a vowel: the text that is printed last, and the exit status.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conclusion {
    pub decided_by: DecidedBy,
    /// Whether the part that decides can be trusted: if so, the exit status is 0, otherwise 3.
    pub trusted: bool,
    /// Whether the fit's tensions can be trusted too ([`Alarm::forbids_trust`]).
    pub tensions_trusted: bool,
    pub text: String,
}
