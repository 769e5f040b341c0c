//! Derivatives of the observations of frames by unknowns, for several frames in lanes or for one frame in any body.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::inverse::{BONE_SD_M, MovableBone};
use tongue_core::geometry::Point;
use tongue_core::statics::SolveStatus;
use tongue_core::statics::lanes::{LANES, Load, UnitChange};

use super::frame::{Frame, FramePosture, FrameSolver};
use super::ornstein_uhlenbeck::Softplus;

/// Unit of the derivatives of residuals; those of hidden points are in millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DerivativeUnit {
    StandardDeviations,
    Millimetres,
}

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
    fn new(frame: &Frame, positions: Vec<Point>, columns: usize, unit: DerivativeUnit) -> Option<Self> {
        let found = frame.observations.iter().map(|o| o.observation.residual_and_slope(&positions));
        let (residuals, slopes): (Vec<f64>, Vec<_>) = found.unzip();
        let hidden = frame.hidden.iter().map(|h| h.slope(&positions));
        let rows: Vec<_> = match unit {
            DerivativeUnit::StandardDeviations => {
                slopes.into_iter().map(|s| (s, 1.0)).chain(hidden.map(|s| (s, 1e3))).collect()
            }
            DerivativeUnit::Millimetres => {
                let fitted = slopes
                    .into_iter()
                    .zip(&frame.observations)
                    .map(|(s, o)| times(s, 1e3 / o.observation.weight));
                fitted.chain(hidden.map(|s| times(s, 1e3))).collect()
            }
        };
        let is_finite = residuals.iter().all(|r| r.is_finite());
        let by_unknown = DMatrix::zeros(rows.len(), columns);
        is_finite.then_some(Self { residuals: DVector::from_vec(residuals), positions, by_unknown, rows })
    }

    /// Sets a column from the motion of every node for a unit of a change, and the derivative of the change by the unknown.
    pub fn set_column(&mut self, column: usize, motion: impl Fn(usize) -> Point, by_unknown: f64) {
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

fn times(slope: Vec<(usize, Point)>, unit: f64) -> (Vec<(usize, Point)>, f64) {
    (slope.into_iter().map(|(node, s)| (node, s * unit)).collect::<Vec<_>>(), 1.0)
}

/// Unknowns by which frames are differentiated.
pub(super) trait DerivativeColumns {
    const UNIT: DerivativeUnit;

    fn count(&self) -> usize;

    /// The changes in lanes, one for each column; `None` where lanes do not take them.
    fn changes(&self) -> Option<Vec<UnitChange<'_, 2>>>;

    /// Derivative of the change of a column by its unknown, at unknowns `x`.
    fn by_unknown(&self, column: usize, x: &DVector<f64>) -> f64;

    /// Sets all columns in any body at the solver's last equilibrium; `None` where its stiffness cannot be factorised.
    fn set_alone(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()>;
}

impl FrameSolver<'_> {
    /// Derivatives of frames; `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub(super) fn rates<C: DerivativeColumns>(
        &mut self,
        columns: &C,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<Rates>> {
        let in_lanes = postures.chunks(LANES).flat_map(|group| self.rates_of_group(columns, group));
        let found: Vec<Option<Rates>> = in_lanes.collect();
        let found = found.into_iter().zip(postures);
        found.map(|(found, posture)| found.or_else(|| self.rates_alone(columns, *posture))).collect()
    }

    /// [`FrameSolver::rates`] of at most as many frames as there are lanes; `None` also where lanes cannot be used.
    fn rates_of_group<C: DerivativeColumns>(
        &mut self,
        columns: &C,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<Rates>> {
        let loads: Vec<Load<'_, 2>> = postures.iter().map(|posture| self.load(*posture)).collect();
        let settings = self.settings;
        let (Some(group), Some(changes)) = (self.group(), columns.changes()) else {
            return postures.iter().map(|_| None).collect();
        };
        let begin = postures.iter().zip(group.solve(&loads, &settings));
        let mut all: Vec<Option<Rates>> = Vec::from_iter(begin.map(|((frame, ..), shape)| {
            let is_found = shape.solution.status == SolveStatus::Converged;
            is_found.then(|| Rates::new(frame, shape.positions.clone(), columns.count(), C::UNIT)).flatten()
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
    fn rates_alone<C: DerivativeColumns>(
        &mut self,
        columns: &C,
        (frame, x, from): FramePosture<'_>,
    ) -> Option<Rates> {
        let positions = self.solve(frame, x, from)?.to_vec();
        let mut rates = Rates::new(frame, positions, columns.count(), C::UNIT)?;
        columns.set_alone(self, x, &mut rates)?;
        rates.finite()
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
    /// Derivative of the distances of hidden points from the surface, mm, positive outside.
    pub hidden_jacobian: DMatrix<f64>,
}

/// A column for each contracting muscle, then two for each freed bone.
struct Unknowns<'a> {
    muscles: &'a [usize],
    freed: &'a [MovableBone<2>],
    link: Softplus,
    count: usize,
}

impl<'a> Unknowns<'a> {
    /// The bone and axis of a column after those of the muscles.
    fn bone(&self, column: usize) -> (&'a MovableBone<2>, usize) {
        let number = column - self.muscles.len();
        (&self.freed[number / 2], number % 2)
    }
}

impl DerivativeColumns for Unknowns<'_> {
    const UNIT: DerivativeUnit = DerivativeUnit::StandardDeviations;

    fn count(&self) -> usize {
        self.count
    }

    fn changes(&self) -> Option<Vec<UnitChange<'_, 2>>> {
        let changes = (0..self.count).map(|column| match self.muscles.get(column) {
            Some(&muscle) => UnitChange::Tension(muscle),
            None => {
                let (bone, axis) = self.bone(column);
                UnitChange::Bone(bone.nodes(), axis)
            }
        });
        Some(changes.collect())
    }

    fn by_unknown(&self, column: usize, x: &DVector<f64>) -> f64 {
        if column < self.muscles.len() { self.link.tension(x[column]).1 } else { BONE_SD_M }
    }

    fn set_alone(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let mut response = solver.response()?;
        for column in 0..self.count {
            if let Some(&muscle) = self.muscles.get(column) {
                response.compute_for_tension(muscle);
            } else {
                let (bone, axis) = self.bone(column);
                response.compute_for_load(|at, load| bone.add_force(at, axis, None, load));
                response.displace(bone.nodes(), axis);
            }
            rates.set_column(column, |n| response.motion()[n], self.by_unknown(column, x));
        }
        Some(())
    }
}

impl FrameSolver<'_> {
    /// `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub fn linearise_all(&mut self, postures: &[FramePosture<'_>]) -> Vec<Option<Linearisation>> {
        let count = postures.iter().map(|(_, x, _)| x.len()).max().unwrap_or(0);
        let (muscles, freed, link) = (self.system.contracting(), self.freed, self.link);
        let unknowns = Unknowns { muscles, freed, link, count };
        Vec::from_iter(self.rates(&unknowns, postures).into_iter().zip(postures).map(|(rates, (_, x, _))| {
            let rates = rates?;
            let (jacobian, hidden_jacobian) = (rates.jacobian_of_fitted(), rates.jacobian_of_hidden());
            let Rates { residuals, positions, .. } = rates;
            Some(Linearisation {
                x: (*x).clone(),
                residuals,
                jacobian,
                positions: positions.into(),
                hidden_jacobian,
            })
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
