//! The linearisation of frames at given unknowns: the scores of the tensions, and the displacements of bones that were not seen.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::inverse::{BONE_SD_M, FreedBone};
use tongue_core::geometry::Point;
use tongue_core::statics::lanes::Change;

use super::frame::{Frame, Posture, Solver};
use super::link::Link;
use super::rates::{Columns, Rates, Unit};

/// The linearisation of a frame at given unknowns.
#[derive(Debug, Clone)]
pub struct Linear {
    /// The unknowns at which it was made.
    pub x: DVector<f64>,
    /// Simulated less measured values, in standard deviations.
    pub residuals: DVector<f64>,
    /// Derivative of the residuals by the unknowns.
    pub jacobian: DMatrix<f64>,
    /// Positions of all nodes, m.
    pub positions: Arc<[Point]>,
    /// Derivative by the unknowns of the distances of the hidden points from the surface, mm, positive outside.
    pub hidden_jacobian: DMatrix<f64>,
}

/// The unknowns of a frame: a column for each contracting muscle, then two for each freed bone.
struct Unknowns<'a> {
    muscles: &'a [usize],
    freed: &'a [FreedBone<2>],
    link: Link,
    count: usize,
}

impl<'a> Unknowns<'a> {
    /// The bone of a column behind those of the muscles, and the axis along which it is displaced.
    fn bone(&self, column: usize) -> (&'a FreedBone<2>, usize) {
        let number = column - self.muscles.len();
        (&self.freed[number / 2], number % 2)
    }
}

impl Columns for Unknowns<'_> {
    const UNIT: Unit = Unit::StandardDeviations;

    fn count(&self) -> usize {
        self.count
    }

    fn changes(&self) -> Option<Vec<Change<'_, 2>>> {
        let change = |column| match self.muscles.get(column) {
            Some(&muscle) => Change::Tension(muscle),
            None => {
                let (bone, axis) = self.bone(column);
                Change::Bone(bone.nodes(), axis)
            }
        };
        Some((0..self.count).map(change).collect())
    }

    fn by_unknown(&self, column: usize, x: &DVector<f64>) -> f64 {
        if column < self.muscles.len() { self.link.tension(x[column]).1 } else { BONE_SD_M }
    }

    fn set_alone(&self, solver: &mut Solver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let mut response = solver.response()?;
        for column in 0..self.count {
            if let Some(&muscle) = self.muscles.get(column) {
                response.to_tension(muscle);
            } else {
                let (bone, axis) = self.bone(column);
                response.to_load(|at, load| bone.add_force(at, axis, None, load));
                response.carry(bone.nodes(), axis);
            }
            rates.set(column, |n| response.motion()[n], self.by_unknown(column, x));
        }
        Some(())
    }
}

impl Solver<'_> {
    /// The linearisations of frames; `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub fn linearise_all(&mut self, postures: &[Posture<'_>]) -> Vec<Option<Linear>> {
        let count = postures.iter().map(|(_, x, _)| x.len()).max().unwrap_or(0);
        let (muscles, freed, link) = (self.system.contracting(), self.freed, self.link);
        let unknowns = Unknowns { muscles, freed, link, count };
        let linear = |(rates, (_, x, _)): (Option<Rates>, &Posture<'_>)| {
            let rates = rates?;
            let (jacobian, hidden_jacobian) = (rates.of_seen(), rates.of_hidden());
            let Rates { residuals, positions, .. } = rates;
            Some(Linear {
                x: (*x).clone(),
                residuals,
                jacobian,
                positions: positions.into(),
                hidden_jacobian,
            })
        };
        self.rates(&unknowns, postures).into_iter().zip(postures).map(linear).collect()
    }

    pub fn linearise(&mut self, frame: &Frame, x: &DVector<f64>, from: Option<&[Point]>) -> Option<Linear> {
        self.linearise_all(&[(frame, x, from)]).pop()?
    }
}
