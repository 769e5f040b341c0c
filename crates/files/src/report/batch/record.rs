//! The JSON record of one fit of a batch.

use serde::Serialize;

use crate::report::ByMuscle;
use crate::report::Provenance;
use crate::report::record::FitRecord;
use tongue_infer::inverse::AT_BOUND;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::alternatives::{Optimum, Subset};
use tongue_infer::inverse::batch::{Assessment, Job};
use tongue_infer::inverse::rounding::RoundingSegment;
use tongue_infer::inverse::uncertainty::{Interval, Intervals, LEVEL};
use tongue_input::measured::TargetKind;
use tongue_input::measured::lengths::rest_distance::RestDistance;
use tongue_input::measured::published_patterns::PatternCheck;
use tongue_input::measured::thesis::Thesis;

/// One fit of a batch: the record of the fit, and its reliability.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssessedRecord {
    /// The fields of `tongue-fit --vowel`.
    #[serde(flatten)]
    pub fit: FitRecord,
    /// Line of the row in its file.
    pub line: u64,
    /// Whether the baseline replaces a missing /ɯ/.
    pub substitute_baseline: bool,
    /// The muscles that the fit has to hit.
    pub fitted: Vec<String>,
    /// Smallest objective.
    pub cost: f64,
    /// Errors of the muscles that the fit does not see, with two references.
    pub passive: Passive,
    /// Distance of the model in its baseline from the row's baseline.
    pub rest_shape: Option<RestDistance>,
    /// For every singular direction, the range of tensions within the rounding of the data; null if the
    /// equilibrium is singular.
    pub within_rounding: Option<Vec<RoundingSegmentRecord>>,
    /// Ranges of the answers to lengths redrawn within their rounding; null if not asked for.
    pub intervals: Option<IntervalsRecord>,
    /// Other local optima, where other starts ended.
    pub other_optima: Vec<OptimumRecord>,
    /// Number of other subsets of contracting muscles that meet the target within rounding.
    pub other_subsets_within_rounding: usize,
    /// The best of the other subsets.
    pub other_subsets: Vec<SubsetRecord>,
    /// Comparison with the published activation pattern (Fang et al. 2009).
    pub pattern: Option<PatternCheck>,
}

/// Root mean square residuals of the passive muscles; null if there is no such number. Ratios are without
/// GGa, whose ratio is 1 by definition.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Passive {
    /// Stretches of the fit.
    pub rms_stretch: Option<f64>,
    /// Stretches if nothing changed against the baseline.
    pub no_change_rms_stretch: Option<f64>,
    /// Stretches of the thesis's own simulation (table 4.8 over table 4.5), with the stretch of GGa of this
    /// fit.
    pub thesis_rms_stretch: Option<f64>,
    /// Ratios of the fit.
    pub rms_ratio: Option<f64>,
    /// Ratios if nothing changed against the baseline.
    pub no_change_rms_ratio: Option<f64>,
    /// Ratios of the thesis's own simulation (table 4.8).
    pub thesis_rms_ratio: Option<f64>,
}

/// [`tongue_infer::inverse::rounding::RoundingSegment`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoundingSegmentRecord {
    /// Sensitivity of the targets in this direction, 1/N.
    pub singular_value: f64,
    /// Unit vector over the active muscles.
    pub direction: ByMuscle<f64>,
    /// One end, N.
    pub from_n: ByMuscle<f64>,
    /// The other, N.
    pub to_n: ByMuscle<f64>,
}

/// [`Intervals`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntervalsRecord {
    /// Part of the draws inside the interval.
    pub level: f64,
    /// Number of draws.
    pub draws: usize,
    /// Number of draws without an equilibrium.
    pub failed: usize,
    /// Number of draws that no tensions meet.
    pub not_met: usize,
    /// Tensions of the contracting muscles, N; null if an interval has no meaning: the answer is at the upper
    /// bound, the muscle is slack in all draws, all draws are the same, or most of them cannot be met.
    pub tensions_n: ByMuscle<Option<Interval>>,
    /// Simulated lengths over that of GGa.
    pub ratios: ByMuscle<Interval>,
    /// Simulated lengths over those at rest.
    pub stretches: ByMuscle<Interval>,
}

/// [`Optimum`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptimumRecord {
    pub tensions_n: ByMuscle<f64>,
    /// Objective.
    pub cost: f64,
    /// Number of starts that ended there.
    pub starts: usize,
}

/// [`Subset`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubsetRecord {
    pub tensions_n: ByMuscle<f64>,
    /// Root mean square residual of the fitted values.
    pub misfit: f64,
    /// Root mean square residual of the whole row.
    pub row_rms: f64,
    /// Whether the fitted values lie within the rounding of the data.
    pub within_rounding: bool,
}

/// Number of listed subsets; the record also has the count of all subsets within rounding.
const LISTED_SUBSETS: usize = 8;

impl AssessedRecord {
    /// The record of a finished job of the batch of `command`; `thesis` is for comparison.
    pub fn new<const D: usize>(job: &Job, a: &Assessment<D>, thesis: Option<&Thesis>, command: &str) -> Self {
        let mut fit = FitRecord::new(&a.fit, &a.alarms, Provenance::new(command), 0.0);
        fit.wall_s = None;
        let names = &a.fit.muscles;
        let named = |values: &[f64]| ByMuscle::new(&fit.active, values.iter().copied());
        let subset = |s: &Subset| SubsetRecord {
            tensions_n: ByMuscle(
                s.muscles.iter().map(|&m| names[m].clone()).zip(s.tensions.iter().copied()).collect(),
            ),
            misfit: s.misfit,
            row_rms: s.row_rms,
            within_rounding: s.within_rounding,
        };
        let segment = |s: &RoundingSegment| RoundingSegmentRecord {
            singular_value: s.singular_value,
            direction: named(&s.direction),
            from_n: named(&s.from_n),
            to_n: named(&s.to_n),
        };
        let optimum =
            |o: &Optimum| OptimumRecord { tensions_n: named(&o.tensions), cost: o.cost, starts: o.starts };
        Self {
            line: job.line,
            substitute_baseline: job.substitute,
            fitted: a.fit.target.fitted.iter().map(|&m| names[m].clone()).collect(),
            cost: a.fit.starts.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min),
            passive: passive(a, thesis),
            rest_shape: a.rest,
            within_rounding: a.segments.as_ref().map(|all| all.iter().map(segment).collect()),
            intervals: a.intervals.as_ref().map(|i| intervals(a, i)),
            other_optima: a.optima.iter().map(optimum).collect(),
            other_subsets_within_rounding: a.subsets.iter().filter(|s| s.within_rounding).count(),
            other_subsets: a.subsets.iter().take(LISTED_SUBSETS).map(subset).collect(),
            pattern: a.pattern.clone(),
            fit,
        }
    }
}

fn intervals<const D: usize>(a: &Assessment<D>, i: &Intervals) -> IntervalsRecord {
    let fit = &a.fit;
    let mut tensions = vec![None; fit.muscles.len()];
    let mostly_met = 2 * i.not_met <= i.draws;
    for (&m, interval) in fit.target.active.iter().zip(&i.tensions) {
        let at_upper_bound = a.alarms.contains(&Alarm::AtUpperBound { muscle: fit.muscles[m].clone() });
        // The draws say nothing about the tension of a muscle that is slack in all of them.
        let slack = interval.high < AT_BOUND;
        let width = interval.high - interval.low;
        tensions[m] = (mostly_met && !at_upper_bound && !slack && width > 0.0).then_some(*interval);
    }
    IntervalsRecord {
        level: LEVEL,
        draws: i.draws,
        failed: i.failed,
        not_met: i.not_met,
        tensions_n: ByMuscle::new(&fit.muscles, tensions),
        ratios: ByMuscle::new(&fit.muscles, i.ratios.iter().copied()),
        stretches: ByMuscle::new(&fit.muscles, i.stretches.iter().copied()),
    }
}

/// Errors of the passive muscles and their references; `thesis` is used if it simulated this row.
fn passive<const D: usize>(a: &Assessment<D>, thesis: Option<&Thesis>) -> Passive {
    let (fit, target) = (&a.fit, &a.fit.target);
    let (stretch, ratio) = (TargetKind::Stretch, TargetKind::Ratio);
    let (measured, reference) = (target.muscles.len(), target.reference);
    let (lengths, rest) = (&fit.lengths[..measured], &fit.baseline_lengths[..measured]);
    let rms = |kind: TargetKind, simulated: &[f64], wanted: &[f64]| {
        let unseen = |m: &usize| !target.active.contains(m) && kind.constrains(*m, reference);
        let squares: Vec<f64> =
            (0..measured).filter(unseen).map(|m| (simulated[m] - wanted[m]).powi(2)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let wanted = |kind: TargetKind| kind.values(&target.measured_mm, &target.baseline_mm, reference);
    let simulated = |kind: TargetKind| kind.values(lengths, rest, reference);
    let no_change = |kind: TargetKind| kind.values(&target.baseline_mm, &target.baseline_mm, reference);
    let error = |kind: TargetKind, values: &[f64]| rms(kind, values, &wanted(kind));
    let thesis = thesis.filter(|t| t.simulated(target));
    let thesis_stretches = thesis.and_then(|t| t.stretches_a(&target.muscles, simulated(stretch)[reference]));
    let thesis_ratios = thesis.and_then(|t| t.ratios_a(&target.muscles));
    Passive {
        rms_stretch: error(stretch, &simulated(stretch)),
        no_change_rms_stretch: error(stretch, &no_change(stretch)),
        thesis_rms_stretch: thesis_stretches.and_then(|values| error(stretch, &values)),
        rms_ratio: error(ratio, &simulated(ratio)),
        no_change_rms_ratio: error(ratio, &no_change(ratio)),
        thesis_rms_ratio: thesis_ratios.and_then(|values| error(ratio, &values)),
    }
}
