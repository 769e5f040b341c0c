use nalgebra::SVector;
use serde::Serialize;
use tongue_core::body::Body;
use tongue_core::geometry::hexahedron;
use tongue_core::system::System;

use super::record::{by_muscle, mm};
use crate::run::{Equilibrium, Solved};
use crate::surgery::{OperationRecord, foremost_moved_mm};
use tongue_input::measured::{ByMuscle, TargetKind, reference_muscle};

#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pulls<T = Vec<f64>> {
    /// N (2D: per metre of thickness).
    TensionsN(T),
    /// 0 to 1, in a tongue in space.
    Activations(T),
}

impl<T> Pulls<T> {
    pub fn of<const D: usize>(body: &Body<D>, values: T) -> Self {
        if body.is_activated() { Self::Activations(values) } else { Self::TensionsN(values) }
    }

    pub fn values(&self) -> &T {
        match self {
            Self::TensionsN(values) | Self::Activations(values) => values,
        }
    }
}

/// One equilibrium of any body: `tongue-fit simulate --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationRecord {
    #[serde(flatten)]
    pub equilibrium: Equilibrium,
    #[serde(flatten)]
    pub pulls: Pulls<ByMuscle<f64>>,
    /// In a body of hexahedra those of one fibre of each muscle.
    pub lengths_mm: ByMuscle<f64>,
    pub stretches: ByMuscle<f64>,
    pub positions_m: Vec<Vec<f64>>,
    #[serde(flatten)]
    pub of_body: OfBody,
    pub wall_s: f64,
}

/// What only bodies with tensions, or only those of hexahedra, have in their records.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OfBody {
    Pulled {
        /// Lengths over that of the reference muscle, which is GGa if there is one.
        ratios: ByMuscle<f64>,
        /// Smallest ratio of the tissue's area to that at rest, over triangles or, in a continuum, within elements.
        min_area_ratio: f64,
        max_area_ratio: f64,
        /// Potential energy (2D: per metre of thickness).
        energy_j: f64,
    },
    Hexahedra(Box<HexahedraRecord>),
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HexahedraRecord {
    #[serde(rename = "tongue")]
    pub body: String,
    pub nodes: usize,
    pub hexahedra: usize,
    pub unknowns: usize,
    /// Whether only one half was solved, because both sides are alike.
    pub half: bool,
    /// The node at the tip, counted from 1.
    pub tip_node: Option<usize>,
    /// Displacement of the tip: back, right, up; `None` if it is removed.
    pub foremost_moved_mm: Option<[f64; 3]>,
    pub rms_displacement_mm: f64,
    pub min_volume_ratio: f64,
    pub max_volume_ratio: f64,
    /// What surgery changed, if there was any; everything else describes the body after it.
    pub operation: Option<OperationRecord>,
}

impl<const D: usize> Solved<D> {
    pub fn record(&self, body: &Body<D>, operation: Option<OperationRecord>) -> SimulationRecord {
        let (mesh, names) = (&body.mesh, &body.mesh.muscle_names());
        let Self { positions, pulls, system, .. } = self;
        let equilibrium = Equilibrium { alarms: self.alarms(body), ..self.equilibrium.clone() };
        let rest = if body.is_activated() { &mesh.nodes } else { system.rest() };
        let ends = mesh.muscles.iter().map(|m| m.ends());
        let [lengths, at_rest]: [Vec<f64>; 2] =
            [&positions[..], rest].map(|x| ends.clone().map(|[a, b]| (x[b] - x[a]).norm()).collect());
        let of_kind =
            |kind: TargetKind| ByMuscle::new(names, kind.values(&lengths, &at_rest, reference_muscle(names)));
        let of_body = if body.is_activated() {
            OfBody::Hexahedra(Box::new(HexahedraRecord::new(body, system, positions, operation)))
        } else {
            let (min_area_ratio, max_area_ratio) = system.tissue_ratios(positions);
            let energy_j = equilibrium.solution.energy;
            OfBody::Pulled { ratios: of_kind(TargetKind::Ratio), min_area_ratio, max_area_ratio, energy_j }
        };
        SimulationRecord {
            pulls: Pulls::of(body, by_muscle(names, pulls)),
            lengths_mm: mm(names, &lengths),
            stretches: of_kind(TargetKind::Stretch),
            positions_m: positions.iter().map(|p| p.iter().copied().collect()).collect(),
            of_body,
            wall_s: self.wall_s,
            equilibrium,
        }
    }
}

impl HexahedraRecord {
    fn new<const D: usize>(
        body: &Body<D>,
        system: &System<D>,
        positions: &[SVector<f64, D>],
        operation: Option<OperationRecord>,
    ) -> Self {
        let mesh = &body.mesh;
        let ratios = mesh.hexahedra.iter().map(|c| volume(positions, c) / volume(&mesh.nodes, c));
        let (min_volume_ratio, max_volume_ratio) =
            ratios.fold((f64::INFINITY, 0.0), |(l, m): (f64, f64), r| (l.min(r), m.max(r)));
        let squares: f64 =
            positions.iter().zip(&mesh.nodes).map(|(x, rest)| ((x - rest) * 1e3).norm_squared()).sum();
        Self {
            body: body.what.clone(),
            nodes: mesh.nodes.len(),
            hexahedra: mesh.hexahedra.len(),
            unknowns: D * system.pattern().unknowns(),
            half: system.rest().len() < mesh.nodes.len(),
            tip_node: body.tip().map(|node| node + 1),
            foremost_moved_mm: foremost_moved_mm(body, positions),
            rms_displacement_mm: (squares / mesh.nodes.len().max(1) as f64).sqrt(),
            min_volume_ratio,
            max_volume_ratio,
            operation,
        }
    }
}

pub(super) fn volume<const D: usize>(x: &[SVector<f64, D>], nodes: &[usize; 8]) -> f64 {
    hexahedron::volume(&hexahedron::corners(x, nodes))
}
