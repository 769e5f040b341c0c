//! An equilibrium of a body in space: a record for JSON, and a file for ParaView.

use std::collections::BTreeSet;
use std::io::{self, Write};

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use tongue_core::body::SpaceBody;
use tongue_core::body::space::Operated;
use tongue_core::geometry::hexahedron;
use tongue_core::system::System;

use super::export::{Export, Provenance};
use super::record::{by, mm};
use super::vtu::{Array, point, write_grid};
use crate::run::Equilibrium;
use crate::surgery::{FillingKind, Surgery};
use tongue_input::measured::ByMuscle;

/// One equilibrium in space: `tongue-fit simulate --body FOLDER --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpaceRecord {
    pub body: String,
    pub nodes: usize,
    pub hexahedra: usize,
    pub unknowns: usize,
    /// Whether only one half was solved, because both sides are alike.
    pub half: bool,
    #[serde(flatten)]
    pub found: Equilibrium,
    pub activations: ByMuscle<f64>,
    /// Lengths of one fibre of each muscle, mm.
    pub lengths_mm: ByMuscle<f64>,
    pub stretches: ByMuscle<f64>,
    pub positions_m: Vec<[f64; 3]>,
    /// The node at the tip, counted from 1.
    pub tip_node: Option<usize>,
    /// Displacement of the tip, mm: back, right, up.
    pub foremost_moved_mm: [f64; 3],
    pub rms_displacement_mm: f64,
    pub min_volume_ratio: f64,
    pub max_volume_ratio: f64,
    /// Changes by surgery, if there was any; everything else describes the body after it.
    pub operation: Option<OperationRecord>,
    pub wall_s: f64,
}

impl SpaceRecord {
    /// The record of a solve: activations of all muscles and positions of all nodes, m.
    pub fn new(
        body: &SpaceBody,
        (system, found): (&System<3>, &Equilibrium),
        activations: &[f64],
        positions: &[Vector3<f64>],
        wall_s: f64,
    ) -> Self {
        let mesh = &body.mesh;
        let names = mesh.muscle_names();
        let length = |x: &[Vector3<f64>], [a, b]: [usize; 2]| (x[b] - x[a]).norm();
        let lengths: Vec<f64> = mesh.muscles.iter().map(|m| length(positions, m.ends())).collect();
        let rest = mesh.muscles.iter().map(|m| length(&mesh.nodes, m.ends()));
        let ratios = mesh.hexahedra.iter().map(|c| volume(positions, c) / volume(&mesh.nodes, c));
        let (min_volume_ratio, max_volume_ratio) =
            ratios.fold((f64::INFINITY, 0.0), |(l, m): (f64, f64), r| (l.min(r), m.max(r)));
        let squares: f64 =
            positions.iter().zip(&mesh.nodes).map(|(x, rest)| ((x - rest) * 1e3).norm_squared()).sum();
        Self {
            body: body.what.clone(),
            nodes: mesh.nodes.len(),
            hexahedra: mesh.hexahedra.len(),
            unknowns: 3 * system.pattern().unknowns(),
            half: system.rest().len() < mesh.nodes.len(),
            found: found.clone(),
            activations: by(&names, activations),
            lengths_mm: mm(&names, &lengths),
            stretches: ByMuscle::new(&names, lengths.iter().zip(rest).map(|(l, r)| l / r)),
            positions_m: positions.iter().map(|p| [p.x, p.y, p.z]).collect(),
            tip_node: body.tip().map(|node| node + 1),
            foremost_moved_mm: foremost_moved_mm(body, positions),
            rms_displacement_mm: (squares / mesh.nodes.len().max(1) as f64).sqrt(),
            min_volume_ratio,
            max_volume_ratio,
            operation: None,
            wall_s,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationRecord {
    /// Where, as it was asked for.
    pub regions: Vec<String>,
    pub filling: FillingKind,
    pub elements: usize,
    /// Their volume at rest, cm³.
    pub volume_cm3: f64,
    /// Way of the tip before, mm: back, right, up.
    pub tip_before_mm: [f64; 3],
    pub tip_after_mm: [f64; 3],
    /// How far the tip reaches less to the front than before, mm.
    pub reach_lost_mm: f64,
    /// How far the tip deviates to the right, mm; to the left below zero.
    pub deviation_mm: f64,
    /// Activations that bring the tip back to where it was before, where they were searched for.
    pub made_up_by: Option<ByMuscle<f64>>,
    /// Their 95 % intervals: a tip alone determines few of them.
    pub made_up_interval_95: Option<ByMuscle<[f64; 2]>>,
    /// How far its nodes stay from there, mm (RMS).
    pub made_up_to_mm: Option<f64>,
    #[serde(skip)]
    pub before: BeforeSurgery,
}

/// What a picture after surgery shows of the body before it. Positions are those of all nodes in the axes of the body, m.
#[derive(Debug, Clone, PartialEq)]
pub struct BeforeSurgery {
    pub body: SpaceBody,
    pub positions: Vec<Vector3<f64>>,
    /// Numbers of its operated elements.
    pub elements: BTreeSet<usize>,
    /// Positions after surgery where the tip was brought back; empty where that was not asked for.
    pub made_up: Vec<Vector3<f64>>,
}

impl OperationRecord {
    pub fn new(
        surgery: &Surgery,
        body: &SpaceBody,
        operated: &Operated,
        [before, after]: [&[Vector3<f64>]; 2],
    ) -> Self {
        let [tip_before_mm, tip_after_mm] = [before, after].map(|x| foremost_moved_mm(body, x));
        Self {
            regions: surgery.operate.clone(),
            filling: surgery.filling,
            elements: operated.elements.len(),
            volume_cm3: 1e6 * operated.volume_m3,
            tip_before_mm,
            tip_after_mm,
            reach_lost_mm: tip_after_mm[0] - tip_before_mm[0],
            deviation_mm: tip_after_mm[1],
            made_up_by: None,
            made_up_interval_95: None,
            made_up_to_mm: None,
            before: BeforeSurgery {
                body: body.clone(),
                positions: before.to_vec(),
                elements: operated.elements.clone(),
                made_up: Vec::new(),
            },
        }
    }
}

fn foremost_moved_mm(body: &SpaceBody, positions: &[Vector3<f64>]) -> [f64; 3] {
    body.tip().map_or([0.0; 3], |n| ((positions[n] - body.mesh.nodes[n]) * 1e3).into())
}

fn volume(x: &[Vector3<f64>], nodes: &[usize; 8]) -> f64 {
    hexahedron::volume(&hexahedron::corners(x, nodes))
}

/// One shape of a body in space as a VTU file. Points have the given positions (m) and `displacement_m`. Each
/// hexahedron has `volume_ratio` (to that at rest), `muscle` (number of the most active muscle through it; -1
/// if there is none), its `activation`, and at its centre the present direction `fibre` of its fibres and
/// their `stretch`.
#[derive(Debug, Clone, Copy)]
pub struct SpaceVtu<'a> {
    pub body: &'a SpaceBody,
    pub positions: &'a [Vector3<f64>],
    pub activations: &'a [f64],
}

const HEXAHEDRON: u8 = 12;

struct Fibre {
    muscle: usize,
    direction: Vector3<f64>,
    stretch: f64,
}

/// The most active muscle of each element, if one runs through it; of several that are as active the first.
pub(super) fn most_active(body: &SpaceBody, activations: &[f64]) -> Vec<Option<usize>> {
    let mut of: Vec<Option<usize>> = vec![None; body.mesh.hexahedra.len()];
    for (number, muscle) in body.muscles.iter().enumerate() {
        for &element in &muscle.region {
            let before = of[element].map_or(f64::NEG_INFINITY, |m| activations[m]);
            if activations[number] > before {
                of[element] = Some(number);
            }
        }
    }
    of
}

impl SpaceVtu<'_> {
    fn fibre(&self, element: usize, muscle: usize) -> Option<Fibre> {
        let mesh = &self.body.mesh;
        let x = hexahedron::corners(&mesh.nodes, &mesh.hexahedra[element]);
        let now = hexahedron::corners(self.positions, &mesh.hexahedra[element]);
        let (gradients, _) = hexahedron::gradients(&x, [0.0; 3])?;
        let parts = now.iter().zip(gradients).map(|(x, g)| x * g.transpose());
        let f = parts.fold(Matrix3::zeros(), |sum, part| sum + part);
        let mean: Vector3<f64> = self.body.directions(muscle, element).into_iter().flatten().sum();
        let along = f * mean.try_normalize(0.0)?;
        Some(Fibre { muscle, direction: along.try_normalize(0.0)?, stretch: along.norm() })
    }
}

impl Export for SpaceVtu<'_> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let mesh = &self.body.mesh;
        let cells = &mesh.hexahedra;
        let muscles = most_active(self.body, self.activations);
        let fibres: Vec<Option<Fibre>> =
            muscles.iter().enumerate().map(|(e, m)| m.and_then(|m| self.fibre(e, m))).collect();
        let ratio = |c| (volume(self.positions, c) / volume(&mesh.nodes, c)).to_string();
        let of = |name, components, value: &dyn Fn(Option<&Fibre>) -> String| {
            let values = fibres.iter().map(|fibre| value(fibre.as_ref())).collect();
            Array { name, kind: "Float64", components, values }
        };
        let number = |m: &Option<usize>| m.map_or_else(|| "-1".to_owned(), |m| m.to_string());
        let arrays = [
            Array { values: cells.iter().map(ratio).collect(), ..of("volume_ratio", 1, &|_| String::new()) },
            of("activation", 1, &|f| f.map_or(0.0, |f| self.activations[f.muscle]).to_string()),
            of("stretch", 1, &|f| f.map_or(1.0, |f| f.stretch).to_string()),
            of("fibre", 3, &|f| point(&f.map_or_else(Vector3::zeros, |f| f.direction))),
            Array {
                name: "muscle",
                kind: "Int64",
                components: 1,
                values: muscles.iter().map(number).collect(),
            },
        ];
        let of_grid: Vec<_> = cells.iter().map(|c| (c.as_slice(), HEXAHEDRON)).collect();
        write_grid(out, by, [&mesh.nodes, self.positions], &of_grid, &arrays)
    }
}
