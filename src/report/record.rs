//! What a result says of itself in JSON and CSV: stable field names, units in the names, muscles by name.

use nalgebra::SVector;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::export::{Export, Provenance, Rows};
use crate::inverse::{self, Fit};
use crate::measured::{TargetKind, Vowel};
use crate::muscle::{Muscle, PerMuscle};
use crate::statics::{self, Solution};

/// A value for each of the eight muscles, written as an object `{GGa: .., ..}` in the order of the tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByMuscle<T>(pub PerMuscle<T>);

impl<T: Serialize> Serialize for ByMuscle<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for m in Muscle::ALL {
            map.serialize_entry(m.name(), &self.0[m.index()])?;
        }
        map.end()
    }
}

/// A value for some muscles, written as an object.
#[derive(Debug, Clone, PartialEq)]
pub struct SomeMuscles(pub Vec<(Muscle, f64)>);

impl Serialize for SomeMuscles {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(m, v)| (m.name(), v)))
    }
}

fn mm(lengths_m: &PerMuscle<f64>) -> ByMuscle<f64> {
    ByMuscle(lengths_m.map(|l| l * 1e3))
}

fn ratios(lengths: &PerMuscle<f64>) -> ByMuscle<f64> {
    ByMuscle(TargetKind::Ratio.values(lengths, lengths))
}

fn stretches(lengths: &PerMuscle<f64>, rest: &PerMuscle<f64>) -> ByMuscle<f64> {
    ByMuscle(TargetKind::Stretch.values(lengths, rest))
}

/// The branch of equilibria that begins at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BranchRecord {
    /// Where it ends; `None` when it reaches the whole load.
    pub critical: Option<statics::Critical>,
    /// Whether another equilibrium at this load was met.
    pub another: bool,
}

/// One equilibrium: `tongue-fit simulate --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationRecord {
    /// How the solve ended.
    pub status: statics::Status,
    /// Tensions given, N per metre of thickness.
    pub tensions_n: ByMuscle<f64>,
    /// Lengths, mm.
    pub lengths_mm: ByMuscle<f64>,
    /// Lengths to that of GGa.
    pub ratios: ByMuscle<f64>,
    /// Lengths to those at rest.
    pub stretches: ByMuscle<f64>,
    /// Positions of all nodes, m.
    pub positions_m: Vec<[f64; 2]>,
    /// Largest residual force on a free node, N.
    pub max_residual_force_n: f64,
    /// Part of the tensions at which the positions are an equilibrium.
    pub load_reached: f64,
    /// What is known of the eigenvalues of the stiffness.
    pub stability: statics::Stability,
    /// What is known of the way from rest.
    pub connection: statics::Connection,
    /// The branch of equilibria from rest, where it was followed.
    pub branch: Option<BranchRecord>,
    /// Newton iterations.
    pub iterations: usize,
    /// Factorisations of the stiffness matrix.
    pub factorisations: usize,
    /// Smallest ratio of a triangle's area to that at rest.
    pub min_area_ratio: f64,
    /// Largest such ratio.
    pub max_area_ratio: f64,
    /// Potential energy, J per metre of thickness.
    pub energy_j: f64,
    /// Time of the solve, s.
    pub wall_s: f64,
}

impl SimulationRecord {
    /// Collects what a solve left: lengths (m) at the solution and at rest, positions (m), area ratios.
    pub fn new(
        solution: &Solution,
        tensions: &PerMuscle<f64>,
        lengths: &PerMuscle<f64>,
        rest_lengths: &PerMuscle<f64>,
        positions: &[SVector<f64, 2>],
        area_ratios: (f64, f64),
        wall_s: f64,
    ) -> Self {
        Self {
            status: solution.status,
            tensions_n: ByMuscle(*tensions),
            lengths_mm: mm(lengths),
            ratios: ratios(lengths),
            stretches: stretches(lengths, rest_lengths),
            positions_m: positions.iter().map(|p| [p.x, p.y]).collect(),
            max_residual_force_n: solution.max_residual_force,
            load_reached: solution.load_reached,
            stability: solution.stability,
            connection: solution.connection,
            branch: None,
            iterations: solution.iterations,
            factorisations: solution.factorisations,
            min_area_ratio: area_ratios.0,
            max_area_ratio: area_ratios.1,
            energy_j: solution.energy,
            wall_s,
        }
    }
}

/// What the data leave open, by muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiabilityRecord {
    /// Singular values of d(fitted value)/d(tension), 1/N, largest first.
    pub singular_values: Vec<f64>,
    /// How many directions are undetermined.
    pub undetermined: usize,
    /// Unit vectors over `active`, in its order.
    pub null_directions: Vec<Vec<f64>>,
    /// For each of them, how far the fit stays within the misfit tolerance.
    pub segments: Vec<Segment>,
}

/// The two ends of a curve of tensions that fit equally well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Segment {
    /// One end, N.
    pub from_n: SomeMuscles,
    /// The other, N.
    pub to_n: SomeMuscles,
}

/// One fit: `tongue-fit --vowel a --json`, and `fit.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitRecord {
    /// Version of tongue-fit.
    pub version: &'static str,
    /// The command line.
    pub command: String,
    /// The subject.
    pub subject: String,
    /// The vowel fitted.
    pub vowel: Vowel,
    /// The vowel taken as rest.
    pub baseline: Vowel,
    /// `ratio` or `stretch`.
    pub target_kind: TargetKind,
    /// Contracting muscles.
    pub active: Vec<Muscle>,
    /// Muscles whose change is within the rounding of the data.
    pub uncertain: Vec<Muscle>,
    /// How the fit ended.
    pub status: inverse::Status,
    /// Tensions found, N per metre of thickness.
    pub tensions_n: ByMuscle<f64>,
    /// Simulated lengths, mm (of the model, whose size is not the subject's).
    pub lengths_mm: ByMuscle<f64>,
    /// Lengths of the model at rest, mm.
    pub rest_lengths_mm: ByMuscle<f64>,
    /// Measured lengths, mm.
    pub measured_lengths_mm: ByMuscle<f64>,
    /// Measured lengths in the baseline, mm.
    pub baseline_lengths_mm: ByMuscle<f64>,
    /// Simulated lengths to that of GGa.
    pub ratios: ByMuscle<f64>,
    /// Measured lengths to that of GGa.
    pub target_ratios: ByMuscle<f64>,
    /// Simulated lengths to those at rest.
    pub stretches: ByMuscle<f64>,
    /// Measured lengths to those in the baseline.
    pub target_stretches: ByMuscle<f64>,
    /// Simulated less measured, in the quantity that was fitted.
    pub residuals: ByMuscle<f64>,
    /// Root mean square residual of the fitted muscles.
    pub misfit: f64,
    /// Root mean square residual of the muscles that do not contract and that the fit does not see.
    pub passive_rms: Option<f64>,
    /// Equilibria solved in the search.
    pub evaluations: usize,
    /// Where each start of the search ended.
    pub starts: Vec<inverse::Start>,
    /// What the data leave open; null where the equilibrium is singular.
    pub identifiability: Option<IdentifiabilityRecord>,
    /// Largest residual force of the answer solved again from rest, N.
    pub max_residual_force_n: f64,
    /// Largest difference of a length between the search's answer and the solve from rest, m.
    pub replay_difference_m: f64,
    /// Smallest ratio of a triangle's area to that at rest.
    pub min_area_ratio: f64,
    /// Largest such ratio.
    pub max_area_ratio: f64,
    /// Time of the whole fit, s; left out of files that are to be the same after every run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_s: Option<f64>,
}

impl FitRecord {
    /// The record of a fit that took `wall_s` seconds and was asked for by `command`.
    pub fn new(fit: &Fit, command: &str, wall_s: f64) -> Self {
        let target = &fit.target;
        let named =
            |values: &[f64]| SomeMuscles(target.active.iter().copied().zip(values.iter().copied()).collect());
        let identifiability = fit.identifiability.as_ref().map(|i| IdentifiabilityRecord {
            singular_values: i.singular_values.clone(),
            undetermined: i.null_directions.len(),
            null_directions: i.null_directions.iter().map(|n| n.direction.clone()).collect(),
            segments: i
                .null_directions
                .iter()
                .map(|n| Segment { from_n: named(&n.from_n), to_n: named(&n.to_n) })
                .collect(),
        });
        Self {
            version: crate::VERSION,
            command: command.to_owned(),
            subject: target.subject.clone(),
            vowel: target.vowel,
            baseline: target.baseline,
            target_kind: target.kind,
            active: target.active.clone(),
            uncertain: Muscle::ALL.into_iter().filter(|m| target.activation[m.index()].uncertain).collect(),
            status: fit.status,
            tensions_n: ByMuscle(fit.tensions),
            lengths_mm: mm(&fit.lengths),
            rest_lengths_mm: mm(&fit.rest_lengths),
            measured_lengths_mm: ByMuscle(target.measured_mm),
            baseline_lengths_mm: ByMuscle(target.baseline_mm),
            ratios: ratios(&fit.lengths),
            target_ratios: ratios(&target.measured_mm),
            stretches: stretches(&fit.lengths, &fit.rest_lengths),
            target_stretches: stretches(&target.measured_mm, &target.baseline_mm),
            residuals: ByMuscle(fit.residuals),
            misfit: fit.misfit,
            passive_rms: fit.passive_rms(),
            evaluations: fit.evaluations,
            starts: fit.starts.clone(),
            identifiability,
            max_residual_force_n: fit.replay.solution.max_residual_force,
            replay_difference_m: fit.replay.largest_difference,
            min_area_ratio: fit.replay.min_area_ratio,
            max_area_ratio: fit.replay.max_area_ratio,
            wall_s: Some(wall_s),
        }
    }

    /// The same as pretty JSON with a newline at the end.
    ///
    /// # Errors
    /// None that can happen: every field has a JSON form.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self).map(|s| s + "\n")
    }

    /// A tidy table: one row a muscle.
    ///
    /// # Errors
    /// None that can happen: memory can be written to.
    pub fn to_csv(&self) -> std::io::Result<String> {
        #[derive(Serialize)]
        struct Row<'a> {
            subject: &'a str,
            vowel: Vowel,
            baseline: Vowel,
            target_kind: TargetKind,
            status: inverse::Status,
            muscle: Muscle,
            active: bool,
            uncertain: bool,
            tension_n_per_m: f64,
            rest_length_mm: f64,
            simulated_length_mm: f64,
            baseline_length_mm: f64,
            measured_length_mm: f64,
            simulated_ratio: f64,
            measured_ratio: f64,
            ratio_residual: f64,
            simulated_stretch: f64,
            measured_stretch: f64,
            stretch_residual: f64,
        }
        let row = |muscle: Muscle| {
            let i = muscle.index();
            Row {
                subject: &self.subject,
                vowel: self.vowel,
                baseline: self.baseline,
                target_kind: self.target_kind,
                status: self.status,
                muscle,
                active: self.active.contains(&muscle),
                uncertain: self.uncertain.contains(&muscle),
                tension_n_per_m: self.tensions_n.0[i],
                rest_length_mm: self.rest_lengths_mm.0[i],
                simulated_length_mm: self.lengths_mm.0[i],
                baseline_length_mm: self.baseline_lengths_mm.0[i],
                measured_length_mm: self.measured_lengths_mm.0[i],
                simulated_ratio: self.ratios.0[i],
                measured_ratio: self.target_ratios.0[i],
                ratio_residual: self.ratios.0[i] - self.target_ratios.0[i],
                simulated_stretch: self.stretches.0[i],
                measured_stretch: self.target_stretches.0[i],
                stretch_residual: self.stretches.0[i] - self.target_stretches.0[i],
            }
        };
        Rows(&Muscle::ALL.map(row)).text(&Provenance::new(&self.command))
    }
}
