//! An equilibrium of a body in space: a record for JSON, and a file for ParaView.

use std::io::{self, Write};

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use tongue_core::body::SpaceBody;
use tongue_core::body::space::Operated;
use tongue_core::geometry::hexahedron;
use tongue_core::statics::{self, Solution};
use tongue_core::system::System;

use super::by_muscle::{by, mm};
use super::export::{Export, Provenance};
use super::record::AlarmRecord;
use super::vtu::{END_OF_GRID, array, begin, grid, point};
use crate::surgery::FillingKind;
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
    pub status: statics::SolveStatus,
    /// Activations, 0 to 1.
    pub activations: ByMuscle<f64>,
    /// Lengths of one fibre of each muscle, mm.
    pub lengths_mm: ByMuscle<f64>,
    /// Their lengths over those at rest.
    pub stretches: ByMuscle<f64>,
    pub positions_m: Vec<[f64; 3]>,
    /// Displacement of the foremost node in the midsagittal plane, mm: back, right, up.
    pub foremost_moved_mm: [f64; 3],
    /// Root mean square displacement of all nodes, mm.
    pub rms_displacement_mm: f64,
    /// Smallest ratio of an element's volume to that at rest.
    pub min_volume_ratio: f64,
    pub max_volume_ratio: f64,
    /// Largest residual force on a free node, N.
    pub max_residual_force_n: f64,
    pub stability: statics::Stability,
    /// What is known of the way from rest.
    pub connection: statics::Connection,
    /// Number of fibres so short that the barrier acts in them.
    pub guarded: usize,
    pub iterations: usize,
    pub factorisations: usize,
    /// The branch of equilibria from rest, if it was followed.
    pub branch: Option<statics::Trace>,
    pub alarms: Vec<AlarmRecord>,
    /// Changes by surgery, if there was any; everything else describes the body after it.
    pub operation: Option<OperationRecord>,
    pub wall_s: f64,
}

impl SpaceRecord {
    /// The record of a solve: activations of all muscles and positions of all nodes, m.
    pub fn new(
        body: &SpaceBody,
        (system, solution): (&System<3>, &Solution),
        activations: &[f64],
        positions: &[Vector3<f64>],
        wall_s: f64,
    ) -> Self {
        let mesh = &body.mesh;
        let names = mesh.muscle_names();
        let length = |x: &[Vector3<f64>], [a, b]: [usize; 2]| (x[b] - x[a]).norm();
        let lengths: Vec<f64> = mesh.muscles.iter().map(|m| length(positions, m.ends())).collect();
        let rest: Vec<f64> = mesh.muscles.iter().map(|m| length(&mesh.nodes, m.ends())).collect();
        let stretches: Vec<f64> = lengths.iter().zip(&rest).map(|(l, r)| l / r).collect();
        let volume = |x: &[Vector3<f64>], c| hexahedron::volume(&hexahedron::corners(x, c));
        let ratios = mesh.hexahedra.iter().map(|c| volume(positions, c) / volume(&mesh.nodes, c));
        let (least, most) = ratios.fold((f64::INFINITY, 0.0), |(l, m): (f64, f64), r| (l.min(r), m.max(r)));
        let moved = |n: usize| (positions[n] - mesh.nodes[n]) * 1e3;
        let squares: f64 = (0..mesh.nodes.len()).map(|n| moved(n).norm_squared()).sum();
        Self {
            body: body.what.clone(),
            nodes: mesh.nodes.len(),
            hexahedra: mesh.hexahedra.len(),
            unknowns: 3 * system.pattern().unknowns(),
            half: system.rest().len() < mesh.nodes.len(),
            status: solution.status,
            activations: by(&names, activations),
            lengths_mm: mm(&names, &lengths),
            stretches: by(&names, &stretches),
            positions_m: positions.iter().map(|p| [p.x, p.y, p.z]).collect(),
            foremost_moved_mm: body.foremost().map_or([0.0; 3], |n| moved(n).into()),
            rms_displacement_mm: (squares / mesh.nodes.len().max(1) as f64).sqrt(),
            min_volume_ratio: least,
            max_volume_ratio: most,
            max_residual_force_n: solution.max_residual_force,
            stability: solution.stability,
            connection: solution.connection,
            guarded: solution.guarded,
            iterations: solution.iterations,
            factorisations: solution.factorisations,
            branch: None,
            alarms: Vec::new(),
            operation: None,
            wall_s,
        }
    }
}

/// A body before and after surgery, at the same activations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationRecord {
    /// Where, as it was asked for.
    pub regions: Vec<String>,
    /// What is left there: removed, scar, flap or silent.
    pub filling: Option<FillingKind>,
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
    /// How far its nodes stay from there, mm (RMS).
    pub made_up_to_mm: Option<f64>,
}

impl OperationRecord {
    /// Compares positions of all nodes before and after, m.
    pub fn new(body: &SpaceBody, operated: &Operated, [before, after]: [&[Vector3<f64>]; 2]) -> Self {
        let way = |x: &[Vector3<f64>]| -> [f64; 3] {
            body.foremost().map_or([0.0; 3], |n| ((x[n] - body.mesh.nodes[n]) * 1e3).into())
        };
        let (tip_before_mm, tip_after_mm) = (way(before), way(after));
        Self {
            regions: Vec::new(),
            filling: None,
            elements: operated.elements,
            volume_cm3: 1e6 * operated.volume_m3,
            tip_before_mm,
            tip_after_mm,
            reach_lost_mm: tip_after_mm[0] - tip_before_mm[0],
            deviation_mm: tip_after_mm[1],
            made_up_by: None,
            made_up_to_mm: None,
        }
    }
}

/// One shape of a body in space as a VTU file. Points have the given positions (m) and `displacement_m`. Each
/// hexahedron has `volume_ratio` (to that at rest), `muscle` (number of the most active muscle through it; -1
/// if there is none), its `activation`, and at its centre the present direction `fibre` of its fibres and
/// their `stretch`.
#[derive(Debug, Clone, Copy)]
pub struct SpaceVtu<'a> {
    pub body: &'a SpaceBody,
    /// Positions of all nodes, m.
    pub positions: &'a [Vector3<f64>],
    pub activations: &'a [f64],
}

/// VTK's cell type of a hexahedron.
const HEXAHEDRON: u8 = 12;

/// The fibres of the most active muscle in an element.
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
        let volume = |x: &[Vector3<f64>], c| hexahedron::volume(&hexahedron::corners(x, c));
        begin(out, "UnstructuredGrid", by)?;
        let of_grid: Vec<_> = cells.iter().map(|c| (c.as_slice(), HEXAHEDRON)).collect();
        grid(out, &mesh.nodes, self.positions, &of_grid)?;
        out.write_all(b"<CellData Scalars=\"volume_ratio\">\n")?;
        let ratios = cells.iter().map(|c| (volume(self.positions, c) / volume(&mesh.nodes, c)).to_string());
        array(out, "volume_ratio", "Float64", 1, ratios)?;
        let of = |f: &Option<Fibre>| f.as_ref().map_or(0.0, |f| self.activations[f.muscle]).to_string();
        array(out, "activation", "Float64", 1, fibres.iter().map(of))?;
        let stretch = |f: &Option<Fibre>| f.as_ref().map_or(1.0, |f| f.stretch).to_string();
        array(out, "stretch", "Float64", 1, fibres.iter().map(stretch))?;
        let direction = |f: &Option<Fibre>| point(&f.as_ref().map_or_else(Vector3::zeros, |f| f.direction));
        array(out, "fibre", "Float64", 3, fibres.iter().map(direction))?;
        let number = |m: &Option<usize>| m.map_or_else(|| "-1".to_owned(), |m| m.to_string());
        array(out, "muscle", "Int64", 1, muscles.iter().map(number))?;
        out.write_all(END_OF_GRID)
    }
}
