//! The linearisation of frames at given unknowns: several frames at once in lanes, and one at a time where lanes do not serve.

use nalgebra::{DMatrix, DVector};

use crate::inverse::BONE_SD_M;
use tongue_core::geometry::Point;
use tongue_core::statics::lanes::{Change, Equilibrium, LANES, Load};
use tongue_core::statics::{Response, SolveStatus};

use super::frame::{Frame, Posture, Solver};

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
    pub positions: Vec<Point>,
    /// Derivative by the unknowns of the distances of the hidden points from the surface, mm, positive outside.
    pub hidden_jacobian: DMatrix<f64>,
}

/// A linearisation of which some columns are known.
struct Begun {
    linear: Linear,
    slopes: Vec<Vec<(usize, Point)>>,
    hidden: Vec<Vec<(usize, Point)>>,
}

impl Begun {
    /// Of a frame whose equilibrium at the unknowns `x` has these positions; `None` where a residual is not finite.
    fn new(frame: &Frame, x: &DVector<f64>, positions: Vec<Point>) -> Option<Self> {
        let found = frame.observations.iter().map(|o| o.residual_and_slope(&positions));
        let (residuals, slopes): (Vec<f64>, Vec<_>) = found.unzip();
        let hidden: Vec<_> = frame.hidden.iter().map(|h| h.slope(&positions)).collect();
        let is_finite = residuals.iter().all(|r| r.is_finite());
        let linear = Linear {
            x: x.clone(),
            jacobian: DMatrix::zeros(residuals.len(), x.len()),
            hidden_jacobian: DMatrix::zeros(hidden.len(), x.len()),
            residuals: DVector::from_vec(residuals),
            positions,
        };
        is_finite.then_some(Self { linear, slopes, hidden })
    }

    /// Sets a column from the motion of all nodes for a unit of a change, which `by_unknown` of an unknown are.
    fn set(&mut self, column: usize, motion: &[Point], by_unknown: f64) {
        let rate = |slope: &[(usize, Point)]| -> f64 { slope.iter().map(|(n, s)| s.dot(&motion[*n])).sum() };
        for (row, slope) in self.slopes.iter().enumerate() {
            self.linear.jacobian[(row, column)] = rate(slope) * by_unknown;
        }
        for (row, slope) in self.hidden.iter().enumerate() {
            self.linear.hidden_jacobian[(row, column)] = 1e3 * rate(slope) * by_unknown;
        }
    }

    fn done(self) -> Option<Linear> {
        self.linear.jacobian.iter().all(|v| v.is_finite()).then_some(self.linear)
    }
}

impl Solver<'_> {
    /// The linearisations of frames; `None` for a frame without a stable equilibrium. Frames without positions are solved from rest.
    pub fn linearise_all(&mut self, postures: &[Posture<'_>]) -> Vec<Option<Linear>> {
        let in_lanes = postures.chunks(LANES).flat_map(|group| self.linearise_group(group));
        let found: Vec<Option<Linear>> = in_lanes.collect();
        let alone = |(found, posture): (Option<Linear>, &Posture<'_>)| {
            found.or_else(|| self.linearise_alone(*posture))
        };
        found.into_iter().zip(postures).map(alone).collect()
    }

    /// The linearisation of one frame.
    pub fn linearise(&mut self, frame: &Frame, x: &DVector<f64>, from: Option<&[Point]>) -> Option<Linear> {
        self.linearise_all(&[(frame, x, from)]).pop()?
    }

    /// As [`Solver::linearise_all`] for as many frames as there are lanes; `None` too where lanes do not serve.
    fn linearise_group(&mut self, postures: &[Posture<'_>]) -> Vec<Option<Linear>> {
        let loads: Vec<Load<'_, 2>> = postures.iter().map(|posture| self.load(*posture)).collect();
        let (settings, system, freed, link) = (self.settings, self.system, self.freed, self.link);
        let Some(group) = self.group() else { return postures.iter().map(|_| None).collect() };
        let shapes = group.solve(&loads, &settings);
        let begin = |(&(frame, x, _), shape): (&Posture<'_>, &Equilibrium<2>)| {
            let is_found = shape.solution.status == SolveStatus::Converged;
            is_found.then(|| Begun::new(frame, x, shape.positions.clone())).flatten()
        };
        let mut begun: Vec<Option<Begun>> = postures.iter().zip(shapes).map(begin).collect();
        let muscles = system.contracting();
        let columns = postures.iter().map(|(_, x, _)| x.len()).max().unwrap_or(0);
        for column in 0..columns {
            let change = match muscles.get(column) {
                Some(&muscle) => Change::Tension(muscle),
                None => {
                    let (number, axis) = ((column - muscles.len()) / 2, (column - muscles.len()) % 2);
                    Change::Bone(freed[number].nodes(), axis)
                }
            };
            let motions = group.motions(change);
            for ((begun, motion), (_, x, _)) in begun.iter_mut().zip(motions).zip(postures) {
                let by_unknown = if column < muscles.len() { link.tension(x[column]).1 } else { BONE_SD_M };
                match motion.zip(begun.as_mut()) {
                    Some((motion, begun)) => begun.set(column, &motion, by_unknown),
                    None => *begun = None,
                }
            }
        }
        begun.into_iter().map(|begun| begun?.done()).collect()
    }

    /// The linearisation by the solver for any body; needs one factorisation more than the equilibrium.
    fn linearise_alone(&mut self, (frame, x, from): Posture<'_>) -> Option<Linear> {
        let positions = self.solve(frame, x, from)?.to_vec();
        let mut begun = Begun::new(frame, x, positions)?;
        let (muscles, freed, link) = (self.system.contracting(), self.freed, self.link);
        let mut response = Response::new(self.system, &mut self.workspace).ok()?;
        for column in 0..x.len() {
            let by_unknown = if let Some(&muscle) = muscles.get(column) {
                response.to_tension(muscle);
                link.tension(x[column]).1
            } else {
                let (number, axis) = ((column - muscles.len()) / 2, (column - muscles.len()) % 2);
                let bone = &freed[number];
                response.to_load(|at, load| bone.add_force(at, axis, None, load));
                response.carry(bone.nodes(), axis);
                BONE_SD_M
            };
            begun.set(column, response.motion(), by_unknown);
        }
        begun.done()
    }
}
