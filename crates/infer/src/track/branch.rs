//! Checks how a speaker can reach the shape of a frame: along the branch of equilibria that begins at rest, or in another way.
//!
//! Two shapes can be equilibria at the same tensions. Increasing all tensions together leads from rest to one of them. The other may be
//! reached from the posture before, or if some muscles pull before the others. Such a shape is a valid result.

use nalgebra::{DVector, SVector};

use tongue_core::body::largest_distance;
use tongue_core::statics::{self, Connection, SolveStatus};

use super::frame::{Frame, Solver};

/// Shapes nearer to each other than this are the same, m.
const SAME_SHAPE_M: f64 = 1e-8;
/// Parts of the path from one posture to another at which the body is solved.
const PARTS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// A frame with its unknowns and the positions of all nodes, m.
pub(super) type Posture<'a> = (&'a Frame, &'a DVector<f64>, &'a [SVector<f64, 2>]);

/// How the shape of a frame can be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reached {
    /// From rest, with all tensions growing together.
    FromRest,
    /// From the posture of a neighbouring frame, or with some muscles pulling before the others.
    OtherWay,
}

impl Solver<'_> {
    /// Whether the equilibrium lies on the branch that begins at rest with the bones of this frame. `relaxed` is the rest shape with the
    /// bones of the previous frame; afterwards it is the rest shape with those of this one.
    pub fn is_on_branch(
        &mut self,
        frame: &Frame,
        x: &DVector<f64>,
        positions: &[SVector<f64, 2>],
        relaxed: &mut Option<Vec<SVector<f64, 2>>>,
    ) -> bool {
        const STEPS: usize = 10;
        /// Parts of the tensions at which the body is solved on the path from rest.
        const LOADS: [f64; 3] = [0.33, 0.67, 1.0];
        let apart = |a: &[SVector<f64, 2>]| largest_distance(a, positions);
        self.carry(frame, x);
        self.tensions.fill(0.0);
        let from = relaxed.take();
        let rests = from.is_some_and(|from| {
            self.workspace.start_from(&from);
            self.is_solved()
        });
        let rests = rests || {
            self.workspace.start_from_rest(self.system);
            self.is_solved()
        };
        if rests {
            *relaxed = Some(self.workspace.positions().to_vec());
            let whole = self.tensions_of(x);
            // The branch is not left if no load needs a descent from a ridge.
            let followed = LOADS.iter().all(|load| {
                self.tensions = whole.iter().map(|f| f * load).collect();
                let done = statics::solve(self.system, &mut self.workspace, &self.tensions, &self.settings);
                done.status == SolveStatus::Converged && done.connection == Connection::Direct
            });
            if followed && apart(self.workspace.positions()) <= SAME_SHAPE_M {
                return true;
            }
        }
        let tensions = self.tensions_of(x);
        self.workspace.start_from_rest(self.system);
        let trace = statics::trace(self.system, &mut self.workspace, &tensions, &self.settings, STEPS);
        trace.critical.is_none() && apart(self.workspace.positions()) <= SAME_SHAPE_M
    }

    /// How the equilibrium of a frame can be reached; `neighbours` are the frames before and after it, with their unknowns and positions.
    /// `None` where no way was found; the workspace then has the shape to which growing all tensions together leads.
    pub(super) fn reached(
        &mut self,
        (frame, x): (&Frame, &DVector<f64>),
        positions: &[SVector<f64, 2>],
        neighbours: &[Posture<'_>],
        relaxed: &mut Option<Vec<SVector<f64, 2>>>,
    ) -> Option<Reached> {
        if self.is_on_branch(frame, x, positions, relaxed) {
            return Some(Reached::FromRest);
        }
        let mut by_neighbour = || {
            neighbours.iter().any(|(other, from, there)| {
                self.is_on_branch(other, from, there, &mut None) && {
                    self.carry(other, from);
                    self.workspace.start_from(there);
                    self.leads((other, from), (frame, x), positions)
                }
            })
        };
        if by_neighbour() || self.pulled_in_turn(frame, x, positions) {
            return Some(Reached::OtherWay);
        }
        self.solve(frame, x, None);
        None
    }

    /// Whether equilibria lead from one posture, where the workspace is, to the positions at another without a descent from a ridge.
    fn leads(
        &mut self,
        (from, x): (&Frame, &DVector<f64>),
        (to, y): (&Frame, &DVector<f64>),
        positions: &[SVector<f64, 2>],
    ) -> bool {
        let (before, after) = (self.tensions_of(x), self.tensions_of(y));
        let mut between = to.clone();
        let arrives = PARTS.iter().all(|&part| {
            for (shift, (a, b)) in between.shifts.iter_mut().zip(from.shifts.iter().zip(&to.shifts)) {
                *shift = a + (b - a) * part;
            }
            self.carry(&between, &(x + (y - x) * part));
            self.tensions = before.iter().zip(&after).map(|(a, b)| a + (b - a) * part).collect();
            self.is_led()
        });
        arrives && largest_distance(self.workspace.positions(), positions) <= SAME_SHAPE_M
    }

    /// Whether the positions are reached from rest if one muscle, or all but one, pulls before the others.
    fn pulled_in_turn(&mut self, frame: &Frame, x: &DVector<f64>, positions: &[SVector<f64, 2>]) -> bool {
        let whole = self.tensions_of(x);
        let muscles = self.system.contracting().to_vec();
        let first = |muscle: usize, alone: bool| {
            let pulls = |(m, f): (usize, &f64)| if (m == muscle) == alone { *f } else { 0.0 };
            whole.iter().enumerate().map(pulls).collect::<Vec<f64>>()
        };
        let ways = muscles.iter().flat_map(|&m| [first(m, true), first(m, false)]).collect::<Vec<_>>();
        ways.into_iter().any(|first| {
            self.carry(frame, x);
            self.workspace.start_from_rest(self.system);
            let stages = [vec![0.0; whole.len()], first, whole.clone()];
            let arrives = stages.windows(2).all(|stage| {
                PARTS.iter().all(|part| {
                    self.tensions = stage[0].iter().zip(&stage[1]).map(|(a, b)| a + (b - a) * part).collect();
                    self.is_led()
                })
            });
            arrives && largest_distance(self.workspace.positions(), positions) <= SAME_SHAPE_M
        })
    }

    /// Solves from the present shape of the workspace, and returns whether no descent from a ridge was needed.
    fn is_led(&mut self) -> bool {
        let done = statics::solve(self.system, &mut self.workspace, &self.tensions, &self.settings);
        done.status == SolveStatus::Converged && done.connection == Connection::Direct
    }
}
