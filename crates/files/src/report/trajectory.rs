//! A trajectory as a record for JSON and CSV.

use serde::Serialize;

use super::{ByMuscle, StoTable, Table};
use tongue_core::dynamics::{IntegrationMethod, MotionStatus, StepCounts};

/// One trajectory: `tongue-fit simulate --trajectory --json`, and `trajectory.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrajectoryRecord {
    pub status: MotionStatus,
    pub method: IntegrationMethod,
    /// Fixed step, s; null with error control.
    pub dt_s: Option<f64>,
    /// Error allowed in a step, mm; null with a fixed step.
    pub tolerance_mm: Option<f64>,
    pub t_end_s: f64,
    pub time_s: f64,
    /// Part of the way to its equilibrium, under the tensions at the time reached, that the body has moved;
    /// null if there is no such way.
    pub part_of_way_to_equilibrium: Option<f64>,
    /// Elements in which the barrier against inversion acts at the end: the published law does not hold
    /// there.
    pub guarded: usize,
    pub counts: StepCounts,
    pub lengths_mm: ByMuscle<f64>,
    /// Smallest ratio of the tissue's area to that at rest, of a triangle or in a continuum within an element, at the end.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
    pub wall_s: f64,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    pub muscles: Vec<String>,
    /// Time, s; length of every muscle, m; its tension, N per metre of thickness.
    pub rows: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl History {
    /// The column of times, then for every muscle its name with the first suffix, then again with the second.
    pub(super) fn columns(&self, time: &str, [length, tension]: [&str; 2]) -> Vec<String> {
        let of = |what: &str| self.muscles.iter().map(|m| format!("{m}_{what}")).collect::<Vec<_>>();
        [vec![time.to_owned()], of(length), of(tension)].concat()
    }

    /// A row for each time: `time_s`, the lengths `GGa_mm` .. and tensions `GGa_n_per_m` ...
    pub fn table(&self) -> Table {
        let row = |(time, lengths, tensions): &(f64, Vec<f64>, Vec<f64>)| {
            let values = lengths.iter().map(|l| l * 1e3).chain(tensions.iter().copied());
            std::iter::once(*time).chain(values).map(|v| v.to_string()).collect()
        };
        Table {
            columns: self.columns("time_s", ["mm", "n_per_m"]),
            rows: self.rows.iter().map(row).collect(),
        }
    }

    /// For OpenSim, in SI units as usual there: `time` (s), the lengths `GGa_length_m` .. and tensions
    /// `GGa_tension_n_per_m` .. (per metre of thickness).
    pub fn sto(&self) -> StoTable {
        let row = |(time, lengths, tensions): &(f64, Vec<f64>, Vec<f64>)| {
            std::iter::once(time).chain(lengths).chain(tensions).copied().collect()
        };
        StoTable {
            title: "tongue-fit: muscle lengths and tensions over time".to_owned(),
            labels: self.columns("time", ["length_m", "tension_n_per_m"]),
            rows: self.rows.iter().map(row).collect(),
        }
    }
}
