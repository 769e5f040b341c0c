//! All that is said of one fit of a batch, in JSON.

use serde::Serialize;

use crate::inverse::alarms::Alarm;
use crate::inverse::alternatives::{Optimum, Subset};
use crate::inverse::batch::{Assessment, Job};
use crate::inverse::uncertainty::{Interval, Intervals, LEVEL};
use crate::measured::patterns::PatternCheck;
use crate::measured::rest_shape::RestDistance;
use crate::measured::{TargetKind, Vowel, published};
use crate::muscle::{Muscle, PerMuscle};
use crate::report::record::{ByMuscle, FitRecord, SomeMuscles};

/// One fit of a batch: the record of the fit, and how far it can be believed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssessedRecord {
    /// As `tongue-fit --vowel` writes it.
    #[serde(flatten)]
    pub fit: FitRecord,
    /// Line of the row in its file.
    pub line: u64,
    /// Whether the baseline stands in for a missing /ɯ/.
    pub substitute_baseline: bool,
    /// The muscles that the fit has to hit.
    pub fitted: Vec<Muscle>,
    /// Smallest objective.
    pub cost: f64,
    /// The muscles that the fit does not see, beside two yardsticks.
    pub passive: Passive,
    /// How far the model at rest is from the baseline.
    pub rest_shape: RestDistance,
    /// For every singular direction, how far the tensions may go within the rounding of the data; null where the equilibrium is
    /// singular.
    pub within_rounding: Option<Vec<RoundingSegmentRecord>>,
    /// 95 % intervals; null where none were asked for.
    pub intervals: Option<IntervalsRecord>,
    /// Where other starts ended.
    pub other_optima: Vec<OptimumRecord>,
    /// How many other subsets of contracting muscles meet the target within rounding.
    pub other_subsets_within_rounding: usize,
    /// The best of the other subsets.
    pub other_subsets: Vec<SubsetRecord>,
    /// Beside the published activation pattern (Fang et al. 2009).
    pub pattern: PatternCheck,
    /// Reasons for doubt.
    pub alarms: Vec<AlarmRecord>,
}

/// Root mean square residuals of the passive muscles; null where there is no such number. Of ratios GGa is left out, whose ratio
/// is 1 by definition.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Passive {
    /// Stretches of the fit.
    pub rms_stretch: Option<f64>,
    /// Stretches if nothing changed against the baseline.
    pub no_change_rms_stretch: Option<f64>,
    /// Stretches of the thesis's own simulation (table 4.8 over table 4.5), taking GGa as stretched as here.
    pub thesis_rms_stretch: Option<f64>,
    /// Ratios of the fit.
    pub rms_ratio: Option<f64>,
    /// Ratios if nothing changed against the baseline.
    pub no_change_rms_ratio: Option<f64>,
    /// Ratios of the thesis's own simulation (table 4.8).
    pub thesis_rms_ratio: Option<f64>,
}

/// [`crate::inverse::rounding::RoundingSegment`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoundingSegmentRecord {
    /// How strongly the targets answer, 1/N.
    pub singular_value: f64,
    /// Unit vector over the active muscles.
    pub direction: SomeMuscles,
    /// One end, N.
    pub from_n: SomeMuscles,
    /// The other, N.
    pub to_n: SomeMuscles,
}

/// [`Intervals`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntervalsRecord {
    /// Part of the draws within.
    pub level: f64,
    /// Draws.
    pub draws: usize,
    /// Draws without an equilibrium.
    pub failed: usize,
    /// Draws that no tensions meet.
    pub not_met: usize,
    /// Tensions of all muscles, N; zero for passive ones.
    pub tensions_n: ByMuscle<Interval>,
    /// Simulated lengths over that of GGa.
    pub ratios: ByMuscle<Interval>,
    /// Simulated lengths over those at rest.
    pub stretches: ByMuscle<Interval>,
}

/// [`Optimum`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptimumRecord {
    /// Tensions, N.
    pub tensions_n: SomeMuscles,
    /// Objective.
    pub cost: f64,
    /// Starts that ended there.
    pub starts: usize,
}

/// [`Subset`] by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubsetRecord {
    /// Tensions, N.
    pub tensions_n: SomeMuscles,
    /// Root mean square residual of the fitted values.
    pub misfit: f64,
    /// Root mean square residual of the whole row.
    pub row_rms: f64,
    /// Whether the fitted values lie within the rounding of the data.
    pub within_rounding: bool,
}

/// An alarm and its sentence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AlarmRecord {
    /// What and where.
    #[serde(flatten)]
    pub alarm: Alarm,
    /// For a reader.
    pub message: String,
}

/// Subsets that are listed; the count of all that are within rounding is given beside them.
const LISTED_SUBSETS: usize = 8;

impl AssessedRecord {
    /// The record of a finished job of the batch that `command` asked for; `tables` are the thesis's, to compare with.
    pub fn new(job: &Job, a: &Assessment, tables: Option<&published::Tables>, command: &str) -> Self {
        let target = &job.target;
        let mut fit = FitRecord::new(&a.fit, command, 0.0);
        fit.wall_s = None;
        let named =
            |values: &[f64]| SomeMuscles(target.active.iter().copied().zip(values.iter().copied()).collect());
        let subset = |s: &Subset| SubsetRecord {
            tensions_n: SomeMuscles(s.muscles.iter().copied().zip(s.tensions.iter().copied()).collect()),
            misfit: s.misfit,
            row_rms: s.row_rms,
            within_rounding: s.within_rounding,
        };
        Self {
            line: job.line,
            substitute_baseline: job.substitute,
            fitted: target.fitted.clone(),
            cost: a.fit.starts.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min),
            passive: passive(a, tables),
            rest_shape: a.rest,
            within_rounding: a.segments.as_ref().map(|all| {
                let record = |s: &crate::inverse::rounding::RoundingSegment| RoundingSegmentRecord {
                    singular_value: s.singular_value,
                    direction: named(&s.direction),
                    from_n: named(&s.from_n),
                    to_n: named(&s.to_n),
                };
                all.iter().map(record).collect()
            }),
            intervals: a.intervals.as_ref().map(|i| intervals(&target.active, i)),
            other_optima: a
                .optima
                .iter()
                .map(|o: &Optimum| OptimumRecord {
                    tensions_n: named(&o.tensions),
                    cost: o.cost,
                    starts: o.starts,
                })
                .collect(),
            other_subsets_within_rounding: a.subsets.iter().filter(|s| s.within_rounding).count(),
            other_subsets: a.subsets.iter().take(LISTED_SUBSETS).map(subset).collect(),
            pattern: a.pattern.clone(),
            alarms: a
                .alarms
                .iter()
                .map(|alarm| AlarmRecord { message: alarm.message(), alarm: alarm.clone() })
                .collect(),
            fit,
        }
    }
}

fn intervals(active: &[Muscle], i: &Intervals) -> IntervalsRecord {
    let mut tensions = [Interval { low: 0.0, high: 0.0 }; crate::muscle::COUNT];
    for (m, interval) in active.iter().zip(&i.tensions) {
        tensions[m.index()] = *interval;
    }
    IntervalsRecord {
        level: LEVEL,
        draws: i.draws,
        failed: i.failed,
        not_met: i.not_met,
        tensions_n: ByMuscle(tensions),
        ratios: ByMuscle(i.ratios),
        stretches: ByMuscle(i.stretches),
    }
}

/// The passive muscles beside their yardsticks; `tables` where the thesis simulated this row.
fn passive(a: &Assessment, tables: Option<&published::Tables>) -> Passive {
    let (fit, target) = (&a.fit, &a.fit.target);
    let (ratio, stretch) = (TargetKind::Ratio, TargetKind::Stretch);
    let measured = |kind: TargetKind| kind.values(&target.measured_mm, &target.baseline_mm);
    let rms = |kind: TargetKind, values: &PerMuscle<f64>| {
        let measured = measured(kind);
        let unseen: Vec<f64> = Muscle::ALL
            .into_iter()
            .filter(|m| !target.active.contains(m) && kind.constrains(*m))
            .map(|m| (values[m.index()] - measured[m.index()]).powi(2))
            .collect();
        (!unseen.is_empty()).then(|| (unseen.iter().sum::<f64>() / unseen.len() as f64).sqrt())
    };
    let simulated = |kind: TargetKind| kind.values(&fit.lengths, &fit.rest_lengths);
    let thesis =
        tables.filter(|_| target.subject == "S2" && target.vowel == Vowel::A && target.baseline == Vowel::U);
    let thesis_stretches = |t: &published::Tables| {
        let gga = Muscle::GGa.index();
        let gga_mm = simulated(stretch)[gga] * t.rest_length_mm[gga];
        Muscle::ALL.map(|m| t.simulated_ratio_a[m.index()] * gga_mm / t.rest_length_mm[m.index()])
    };
    Passive {
        rms_stretch: rms(stretch, &simulated(stretch)),
        no_change_rms_stretch: rms(stretch, &[1.0; crate::muscle::COUNT]),
        thesis_rms_stretch: thesis.and_then(|t| rms(stretch, &thesis_stretches(t))),
        rms_ratio: rms(ratio, &simulated(ratio)),
        no_change_rms_ratio: rms(ratio, &ratio.values(&target.baseline_mm, &target.baseline_mm)),
        thesis_rms_ratio: thesis.and_then(|t| rms(ratio, &t.simulated_ratio_a)),
    }
}
