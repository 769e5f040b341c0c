//! Derivatives of the observations of frames by unknowns or by the shape at rest, for several frames in lanes or for one frame in any body.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SVector};

use crate::inverse::{BONE_SD_M, MovableBone};
use tongue_core::effect::Configuration;
use tongue_core::geometry::Point;
use tongue_core::statics::lanes::{LANES, Lanes, Load, UnitChange};
use tongue_core::statics::{SolveSettings, SolveStatus};

use super::frame::{Frame, FramePosture, FrameSolver};
use super::ornstein_uhlenbeck::Softplus;
use super::rest_shape::{RestShape, STEP};

/// Derivatives of the residuals of a frame and, in the last rows, of the distances of its hidden points.
pub(super) struct Rates {
    /// Simulated less measured values, in standard deviations.
    pub residuals: DVector<f64>,
    /// Positions of all nodes, m.
    pub positions: Vec<Point>,
    pub by_unknown: DMatrix<f64>,
    /// For each row, its derivative by the positions of nodes, and a factor.
    rows: Vec<(Vec<(usize, Point)>, f64)>,
}

impl Rates {
    /// The rows of a frame with these positions, with columns of zeros; `None` where a residual is not finite.
    fn new(frame: &Frame, positions: Vec<Point>, columns: &Columns<'_>) -> Option<Self> {
        let all = frame.observations.iter().chain(&frame.hidden);
        let found = all.clone().map(|o| o.observation.residual_and_slope(&positions));
        let (mut residuals, slopes): (Vec<f64>, Vec<_>) = found.unzip();
        residuals.truncate(frame.observations.len());
        let mut rows: Vec<_> = slopes.into_iter().map(|slope| (slope, 1.0)).collect();
        match columns {
            // Hidden points have weight 1, so that 1e3 gives millimetres.
            Columns::Unknowns { .. } => rows.iter_mut().skip(residuals.len()).for_each(|row| row.1 = 1e3),
            Columns::Shape(_) => {
                for ((slope, _), o) in rows.iter_mut().zip(all) {
                    slope.iter_mut().for_each(|(_, s)| *s *= 1e3 / o.observation.weight);
                }
            }
        }
        let is_finite = residuals.iter().all(|r| r.is_finite());
        let by_unknown = DMatrix::zeros(rows.len(), columns.count());
        is_finite.then_some(Self { residuals: DVector::from_vec(residuals), positions, by_unknown, rows })
    }

    /// Sets a column from the motion of every node for a unit of a change, and the derivative of the change by the unknown.
    fn set_column(&mut self, column: usize, motion: impl Fn(usize) -> Point, by_unknown: f64) {
        for (row, (slope, factor)) in self.rows.iter().enumerate() {
            let rate: f64 = slope.iter().map(|(n, s)| s.dot(&motion(*n))).sum();
            self.by_unknown[(row, column)] = factor * rate * by_unknown;
        }
    }

    pub fn jacobian_of_fitted(&self) -> DMatrix<f64> {
        self.by_unknown.rows(0, self.residuals.len()).into_owned()
    }

    pub fn jacobian_of_hidden(&self) -> DMatrix<f64> {
        let fitted = self.residuals.len();
        self.by_unknown.rows(fitted, self.rows.len() - fitted).into_owned()
    }

    /// `None` where a derivative of a residual is not finite.
    fn finite(self) -> Option<Self> {
        self.by_unknown.rows(0, self.residuals.len()).iter().all(|v| v.is_finite()).then_some(self)
    }
}

/// What frames are differentiated by: a column for each unknown, or for each direction of the shape at rest.
pub(super) enum Columns<'a> {
    /// One for each contracting muscle, then two for each freed bone. Derivatives of observations are in standard deviations, those of
    /// distances of hidden points in millimetres.
    Unknowns { muscles: &'a [usize], freed: &'a [MovableBone<2>], link: Softplus },
    /// The directions of a shape at rest. Derivatives of observations and of distances of hidden points are in millimetres.
    Shape(&'a RestShape),
}

impl<'a> Columns<'a> {
    fn count(&self) -> usize {
        match self {
            Self::Unknowns { muscles, freed, .. } => muscles.len() + 2 * freed.len(),
            Self::Shape(shape) => shape.count(),
        }
    }

    /// The changes in lanes, one for each column; `None` where lanes do not take them.
    fn changes(&self) -> Option<Vec<UnitChange<'a, 2>>> {
        match *self {
            Self::Unknowns { muscles, freed, .. } => {
                let tensions = muscles.iter().map(|&muscle| UnitChange::Tension(muscle));
                let axes = freed.iter().flat_map(|bone| [(bone, 0), (bone, 1)]);
                let displacements = axes.map(|(bone, axis)| UnitChange::Bone(bone.nodes(), axis));
                Some(tensions.chain(displacements).collect())
            }
            Self::Shape(shape) => Some(shape.in_lanes()?.iter().map(UnitChange::Rest).collect()),
        }
    }

    /// Derivative of the change of a column by its unknown, at unknowns `x`.
    fn by_unknown(&self, column: usize, x: &DVector<f64>) -> f64 {
        match self {
            Self::Unknowns { muscles, link, .. } if column < muscles.len() => link.tension(x[column]).1,
            Self::Unknowns { .. } => BONE_SD_M,
            Self::Shape(_) => 1.0,
        }
    }

    /// Sets all columns in any body at the solver's last equilibrium; `None` where its stiffness cannot be factorised.
    fn set_alone(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let (muscles, freed) = match *self {
            Self::Unknowns { muscles, freed, .. } => (muscles, freed),
            Self::Shape(shape) => return shape.set_columns(solver, x, rates),
        };
        let mut response = solver.response()?;
        for column in 0..self.count() {
            if let Some(&muscle) = muscles.get(column) {
                response.compute_for_tensions([muscle]);
            } else {
                let number = column - muscles.len();
                let (bone, axis) = (&freed[number / 2], number % 2);
                response.compute_for_load(|at, load| bone.add_force(at, axis, None, load));
                response.displace(bone.nodes(), axis);
            }
            rates.set_column(column, |n| response.motion()[n], self.by_unknown(column, x));
        }
        Some(())
    }
}

impl RestShape {
    /// Derivatives of frames by each direction, mm; `None` for a frame without an equilibrium at its positions.
    pub(super) fn rates(
        &self,
        solver: &mut FrameSolver<'_>,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<Rates>> {
        let found = solver.rates(&Columns::Shape(self), postures).into_iter().zip(postures);
        Vec::from_iter(found.map(|(rates, (frame, ..))| {
            let mut rates = rates?;
            self.add_coils(&mut rates, frame);
            rates.by_unknown.iter().all(|v| v.is_finite()).then_some(rates)
        }))
    }

    /// Adds the derivatives by the directions that move coils along the surface.
    fn add_coils(&self, rates: &mut Rates, frame: &Frame) {
        let Rates { positions, by_unknown, .. } = rates;
        let first = by_unknown.ncols() - self.prior.coils.len();
        for (k, (coil, weights)) in self.prior.coils.iter().enumerate() {
            let motion: Point = weights.iter().map(|(n, w)| positions[*n] * *w).sum();
            let rows = frame.observations.iter().chain(&frame.hidden).enumerate();
            for (row, hidden) in rows.filter(|(_, hidden)| hidden.name == *coil) {
                by_unknown[(row, first + k)] =
                    hidden.along.channel.checked_sub(1).map_or(0.0, |axis| 1e3 * motion[axis]);
            }
        }
    }

    /// Sets the column of every direction: the factorised stiffness turns the forces of each perturbed body into motion.
    fn set_columns(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let tensions = solver.tensions_of(x);
        let positions = rates.positions.clone();
        let mut free = vec![false; positions.len()];
        solver.system.pattern().nodes().iter().for_each(|&n| free[n] = true);
        let mut response = solver.response()?;
        let (mut before, mut after) =
            (vec![SVector::zeros(); positions.len()], vec![SVector::zeros(); positions.len()]);
        self.system.force(Configuration { positions: &positions, tensions: &tensions }, &mut before);
        let directions = self.prior.directions.iter().zip(self.perturbed_systems()?);
        for (column, (direction, changed)) in directions.enumerate() {
            // Nodes on bone move with the body at rest.
            let there: Vec<Point> = Vec::from_iter(
                positions.iter().enumerate().map(|(n, p)| if free[n] { *p } else { p + direction[n] * STEP }),
            );
            changed.force(Configuration { positions: &there, tensions: &tensions }, &mut after);
            response.compute_for_load(|_, load| {
                for (l, (a, b)) in load.iter_mut().zip(after.iter().zip(&before)) {
                    *l += (a - b) / STEP;
                }
            });
            rates.set_column(column, |n| if free[n] { response.motion()[n] } else { direction[n] }, 1.0);
        }
        Some(())
    }
}

#[derive(Debug, Clone)]
pub struct Linearisation {
    pub x: DVector<f64>,
    /// Simulated less measured values, in standard deviations.
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    /// Positions of all nodes, m.
    pub positions: Arc<[Point]>,
}

impl<'a> FrameSolver<'a> {
    pub(super) fn unknowns(&self) -> Columns<'a> {
        Columns::Unknowns { muscles: self.system.contracting(), freed: self.freed, link: self.link }
    }

    /// Derivatives of frames; `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub(super) fn rates(
        &mut self,
        columns: &Columns<'_>,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<Rates>> {
        let in_lanes = postures.chunks(LANES).flat_map(|group| self.rates_of_group(columns, group));
        let found: Vec<Option<Rates>> = in_lanes.collect();
        let found = found.into_iter().zip(postures);
        found.map(|(found, posture)| found.or_else(|| self.rates_alone(columns, *posture))).collect()
    }

    /// [`FrameSolver::rates`] of at most as many frames as there are lanes; `None` also where lanes cannot be used.
    fn rates_of_group(&mut self, columns: &Columns<'_>, postures: &[FramePosture<'_>]) -> Vec<Option<Rates>> {
        let Some(changes) = columns.changes().filter(|_| Lanes::new(self.system).are_used()) else {
            return postures.iter().map(|_| None).collect();
        };
        let loads: Vec<Load<'_, 2>> = postures.iter().map(|posture| self.load(*posture)).collect();
        let group = self.group();
        let begin = postures.iter().zip(group.solve(&loads, &SolveSettings::default()));
        let mut all: Vec<Option<Rates>> = Vec::from_iter(begin.map(|((frame, ..), shape)| {
            let is_found = shape.solution.status == SolveStatus::Converged;
            is_found.then(|| Rates::new(frame, shape.positions.clone(), columns)).flatten()
        }));
        for (column, change) in changes.iter().enumerate() {
            for ((rates, motion), (_, x, _)) in all.iter_mut().zip(group.motions(*change)).zip(postures) {
                match motion.zip(rates.as_mut()) {
                    Some((motion, rates)) => {
                        rates.set_column(column, |n| motion[n], columns.by_unknown(column, x))
                    }
                    None => *rates = None,
                }
            }
        }
        all.into_iter().map(|rates| rates?.finite()).collect()
    }

    /// [`FrameSolver::rates`] of one frame in any body; needs one factorisation more than the equilibrium.
    fn rates_alone(&mut self, columns: &Columns<'_>, (frame, x, from): FramePosture<'_>) -> Option<Rates> {
        let positions = self.solve(frame, x, from)?.to_vec();
        let mut rates = Rates::new(frame, positions, columns)?;
        columns.set_alone(self, x, &mut rates)?;
        rates.finite()
    }

    /// `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub fn linearise_all(&mut self, postures: &[FramePosture<'_>]) -> Vec<Option<Linearisation>> {
        let rates = self.rates(&self.unknowns(), postures);
        Vec::from_iter(rates.into_iter().zip(postures).map(|(rates, (_, x, _))| {
            let rates = rates?;
            let jacobian = rates.jacobian_of_fitted();
            let Rates { residuals, positions, .. } = rates;
            Some(Linearisation { x: (*x).clone(), residuals, jacobian, positions: positions.into() })
        }))
    }

    pub fn linearise(
        &mut self,
        frame: &Frame,
        x: &DVector<f64>,
        from: Option<&[Point]>,
    ) -> Option<Linearisation> {
        self.linearise_all(&[(frame, x, from)]).pop()?
    }
}
