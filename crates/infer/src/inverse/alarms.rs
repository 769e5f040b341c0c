//! Alarms: reasons to doubt a fit.

use std::ops::RangeInclusive;

use nalgebra::SVector;
use serde::{Serialize, Serializer};

use tongue_core::body::{Body, Mesh};
use tongue_core::statics::{self, FromRest, Solution};
use tongue_core::system::System;
use tongue_input::measured::muscles::Muscles;

use super::{AT_BOUND, Fit, FitStatus, TargetOnBody};

/// Thickness that turns a tension per metre into a force comparable with published ones (left and right together), m: about the width of an
/// adult tongue body, chosen and not measured.
pub const THICKNESS_M: f64 = 0.04;
/// Smallest error of a contracting muscle's shortening that raises an alarm, percentage points.
const MISSED_PERCENT: f64 = 5.0;
/// Smallest additional angle at a node of a folded chain, radians (60 degrees).
const FOLD: f64 = std::f64::consts::FRAC_PI_3;

/// Ratios of volume to that at rest without an alarm; beside attachments ordinary activations reach 0.4 to 1.6, full ones 0.1 to 2.8.
const VOLUME_RATIOS: RangeInclusive<f64> = 0.25..=2.0;
/// Stretches of muscles for which the law is meant: fibres of muscle shorten to about half of their length
/// (Gordon, Huxley and Julian 1966).
const STRETCHES: RangeInclusive<f64> = 0.4..=2.0;

/// Lengths of vocal tracts, mm, from those of infants to those of men with protruded lips.
const TRACT_MM: RangeInclusive<f64> = 70.0..=220.0;

/// A reason for doubt; serialised with its sentence.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case", remote = "Self")]
pub enum Alarm {
    #[error("{muscle} is shorter but ends without tension")]
    AtLowerBound { muscle: String },
    #[error("the tension of {muscle} ends at the upper bound")]
    AtUpperBound { muscle: String },
    /// `force_n` is the tension times the thickness.
    #[error(
        "{muscle} pulls {force_n:.1} N over {:.0} mm of thickness, more than its published {capacity_n:.0} N",
        1e3 * thickness_m
    )]
    BeyondCapacity { muscle: String, force_n: f64, capacity_n: f64, thickness_m: f64 },
    #[error("the target is missed by {misfit:.3} (RMS)")]
    TargetNotMet { misfit: f64 },
    /// Both in per cent: simulated of the model's length at rest, measured of the length in the baseline.
    #[error("{muscle} shortens {simulated_percent:.0} %, measured {measured_percent:.0} %")]
    ShorteningMissed { muscle: String, simulated_percent: f64, measured_percent: f64 },
    #[error(
        "the barrier against inversion acts in {elements} element{}: the published law does not hold there",
        if *elements == 1 { "" } else { "s" }
    )]
    BarrierActs { elements: usize },
    /// The branch from rest ends at the part `ends_at` of the tensions; `None` if it is not known whether the branch leads to the shape.
    #[error("{}", branch(*ends_at))]
    NotOnBranch { ends_at: Option<f64> },
    #[error(
        "points of the tissue have {least_volume_ratio:.2} to {largest_volume_ratio:.2} of their volume at rest; the law is not meant for \
         less than {} or more than {}",
        VOLUME_RATIOS.start(),
        VOLUME_RATIOS.end()
    )]
    Overstrained { least_volume_ratio: f64, largest_volume_ratio: f64 },
    #[error(
        "{muscle} is {stretch:.2} times as long as at rest; the law is not meant for less than {} or more than {}",
        STRETCHES.start(),
        STRETCHES.end()
    )]
    MuscleOverstrained { muscle: String, stretch: f64 },
    #[error("whether {muscle} contracts is decided within the rounding of the data")]
    DecidedWithinRounding { muscle: String },
    /// `turn_degrees` is the largest angle at a node beyond that at rest.
    #[error("the chain of {muscle} folds by {turn_degrees:.0} degrees")]
    FoldedChain { muscle: String, turn_degrees: f64 },
    #[error(
        "nothing is resolved: the data determine no combination of activations, so the activations are those of the prior; check the unit \
         and the places of the data"
    )]
    NothingResolved,
    #[error(
        "what was measured lies {rms_mm:.0} mm (RMS) from the body, farther than a tongue moves; give it in millimetres and in the axes of \
         the body"
    )]
    FarFromData { rms_mm: f64 },
    #[error(
        "the tract is {length_mm:.0} mm long from glottis to lips, where {} to {} are possible: its walls are in another order, frame or unit",
        TRACT_MM.start(),
        TRACT_MM.end()
    )]
    ImplausibleTract { length_mm: f64 },
    #[error("no verdict: {reason}")]
    NoVerdict { reason: String },
    #[error("no posterior: {reason}")]
    NoPosterior { reason: String },
    #[error(
        "{outside} of {predicted} measured stretches lie outside what the others predict, where one in twenty should: these lengths and the \
         model contradict each other; check them and those of the baseline"
    )]
    Contradicted { outside: usize, predicted: usize },
    #[error("equilibrium not certain: {reason}")]
    EquilibriumNotCertain { reason: &'static str },
}

fn branch(ends_at: Option<f64>) -> String {
    ends_at.map_or_else(
        || "it is not known whether the branch of equilibria from rest leads to this shape".to_owned(),
        |load| {
            format!("the branch of equilibria from rest ends at {load:.3} of these tensions; the shape lies beyond")
        },
    )
}

impl Serialize for Alarm {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct WithText {
            #[serde(flatten, with = "Alarm")]
            alarm: Alarm,
            text: String,
        }
        Serialize::serialize(&WithText { alarm: self.clone(), text: self.to_string() }, serializer)
    }
}

impl Alarm {
    /// Whether the measured lengths and the model contradict each other.
    pub fn is_contradiction(&self) -> bool {
        matches!(self, Self::Contradicted { .. } | Self::NoVerdict { .. })
    }

    /// Whether a fit in the plane with this alarm is not trusted. It has such an alarm exactly if its answer is not
    /// [`Answer::is_trustworthy`](super::Answer::is_trustworthy).
    pub fn forbids_trust(&self) -> bool {
        matches!(
            self,
            Self::TargetNotMet { .. }
                | Self::AtUpperBound { .. }
                | Self::BarrierActs { .. }
                | Self::NotOnBranch { .. }
                | Self::EquilibriumNotCertain { .. }
        )
    }
}

/// All alarms of a fit, in a fixed order.
pub fn alarms<const D: usize>(mesh: &Mesh<D>, fit: &Fit<D>) -> Vec<Alarm> {
    let mut out = Vec::new();
    let TargetOnBody { target, muscles, .. } = &fit.matched;
    let (answer, tensions, lengths) = (&fit.answer, fit.tensions(), fit.lengths());
    let name = |m: usize| muscles[m].clone();
    if answer.misfit.is_finite() && answer.misfit > fit.settings.misfit_tolerance {
        out.push(Alarm::TargetNotMet { misfit: answer.misfit });
    }
    for &m in &target.active {
        if tensions[m] < AT_BOUND && target.measured_mm[m] < target.baseline_mm[m] {
            out.push(Alarm::AtLowerBound { muscle: name(m) });
        }
        if tensions[m] > fit.settings.upper_bound - AT_BOUND {
            out.push(Alarm::AtUpperBound { muscle: name(m) });
        }
    }
    for &m in &target.active {
        let simulated_percent = 100.0 * (1.0 - lengths[m] / fit.rest_lengths[m]);
        let measured_percent = 100.0 * (1.0 - target.measured_mm[m] / target.baseline_mm[m]);
        if (simulated_percent - measured_percent).abs() > MISSED_PERCENT {
            out.push(Alarm::ShorteningMissed { muscle: name(m), simulated_percent, measured_percent });
        }
    }
    out.extend(of_equilibrium(&answer.replay.trace.solution, answer.replay.trace.from_rest));
    for capacity in Muscles::built_in().capacities(muscles) {
        let force_n = THICKNESS_M * capacity.portions.iter().map(|&m| tensions[m]).sum::<f64>();
        if force_n > capacity.capacity_n {
            let (muscle, capacity_n) = (capacity.muscle, capacity.capacity_n);
            out.push(Alarm::BeyondCapacity { muscle, force_n, capacity_n, thickness_m: THICKNESS_M });
        }
    }
    let uncertain = (0..target.muscles.len()).filter(|&m| target.activation[m].uncertain);
    out.extend(uncertain.map(|m| Alarm::DecidedWithinRounding { muscle: name(m) }));
    let doubts = [
        (answer.status == FitStatus::ReplayDiffers, "solving again from rest gives another shape"),
        (answer.status == FitStatus::NoEquilibrium, "none was found"),
        (answer.status == FitStatus::IterationLimit, "the search stopped at its iteration limit"),
        (answer.identifiability.is_none(), "the stiffness there is singular or not positive definite"),
    ];
    out.extend(
        doubts.iter().filter(|(holds, _)| *holds).map(|(_, reason)| Alarm::EquilibriumNotCertain { reason }),
    );
    let ratios = [answer.replay.min_area_ratio, answer.replay.max_area_ratio];
    out.extend(of_strain(mesh, ratios, &answer.positions));
    out
}

/// Alarms for a solution in which the barrier acts, or which is not known to lie on the branch from rest.
pub fn of_equilibrium(solution: &Solution, from_rest: FromRest) -> Vec<Alarm> {
    let mut out: Vec<Alarm> = barrier(solution.guarded).into_iter().collect();
    let ends_at = from_rest.critical().filter(|_| from_rest.leads_here()).map(|c| c.load);
    if from_rest != FromRest::Branch && solution.status == statics::SolveStatus::Converged {
        out.push(Alarm::NotOnBranch { ends_at });
    }
    out
}

/// Alarms for too much strain of tissue and muscles at these positions of all nodes, m. `system` may be that of the body's half.
pub fn of_shape<const D: usize>(
    body: &Body<D>,
    system: &System<D>,
    positions: &[SVector<f64, D>],
) -> Vec<Alarm> {
    let ratios = if body.is_activated() {
        body.volume_ratios(positions)
    } else {
        system.tissue_ratios(positions).into()
    };
    of_strain(&body.mesh, ratios, positions)
}

/// Alarms for too much strain of tissue, by its least and largest ratio of volume (in the plane: area) to that at rest, and of muscles.
pub fn of_strain<const D: usize>(
    mesh: &Mesh<D>,
    [least_volume_ratio, largest_volume_ratio]: [f64; 2],
    positions: &[SVector<f64, D>],
) -> Vec<Alarm> {
    // A body without cells has no ratios.
    let has_tissue = least_volume_ratio <= largest_volume_ratio;
    let is_usual = [least_volume_ratio, largest_volume_ratio].iter().all(|r| VOLUME_RATIOS.contains(r));
    let tissue =
        (has_tissue && !is_usual).then_some(Alarm::Overstrained { least_volume_ratio, largest_volume_ratio });
    let muscles = mesh.muscles.iter().filter_map(|muscle| {
        let [a, b] = muscle.ends();
        let stretch = (positions[b] - positions[a]).norm() / mesh.distance([a, b]);
        let muscle = muscle.name.clone();
        (!STRETCHES.contains(&stretch)).then_some(Alarm::MuscleOverstrained { muscle, stretch })
    });
    let folded = mesh.muscles.iter().filter_map(|muscle| {
        let turn = sharpest_turn(mesh, positions, &muscle.nodes);
        let muscle = muscle.name.clone();
        (turn > FOLD).then(|| Alarm::FoldedChain { muscle, turn_degrees: turn.to_degrees() })
    });
    tissue.into_iter().chain(muscles).chain(folded).collect()
}

/// An alarm for a vocal tract of this length, mm, that nobody has.
pub fn of_tract(length_mm: f64) -> Option<Alarm> {
    (!TRACT_MM.contains(&length_mm)).then_some(Alarm::ImplausibleTract { length_mm })
}

pub fn barrier(elements: usize) -> Option<Alarm> {
    (elements > 0).then_some(Alarm::BarrierActs { elements })
}

/// Largest angle of a muscle's chain at a node beyond that at rest, radians.
fn sharpest_turn<const D: usize>(mesh: &Mesh<D>, positions: &[SVector<f64, D>], chain: &[usize]) -> f64 {
    chain.windows(3).map(|n| turn(positions, n) - turn(&mesh.nodes, n)).fold(0.0, f64::max)
}

fn turn<const D: usize>(at: &[SVector<f64, D>], n: &[usize]) -> f64 {
    (at[n[1]] - at[n[0]]).angle(&(at[n[2]] - at[n[1]]))
}
