//! How the shape of a frame can be reached: with tensions that grow together from rest, or in another way.
//!
//! Of two equilibria at the same tensions the load path from rest leads to one. The other may be reached from the posture before or after
//! it, or if some muscles pull before others; it is then a valid result.

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::body::largest_distance;
use tongue_core::geometry::Point;
use tongue_core::statics::lanes::{LANES, Load};
use tongue_core::statics::{Connection, SAME_SHAPE_M, SolveSettings, SolveStatus};

use crate::least_squares::{Rule, TrialStep, descend};

use super::frame::{Frame, FramePosture, FrameSolver};
use super::jacobian::Linearisation;
use super::smoother::{SmoothedRecording, Smoother, in_chunks};

/// Parts of the path between two postures at which the body is solved.
const PARTS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

const NEAREST: Rule = Rule { max_steps: 8, damping_decrease: 0.3, least_damping: 1.0, ..Rule::UNDAMPED };

/// Whether and how the shape of a frame is reached from rest.
#[derive(Debug, Clone, PartialEq)]
pub enum Reachability {
    /// At the end of its load path from rest, jumps included ([`tongue_core::statics::FromRest::leads_here`]).
    LoadPath,
    /// From the posture of a neighbouring frame, or with some muscles pulling before the others.
    OtherWay,
    /// The shape cannot be reached. This one, m, can; at similar tensions it is the nearest to the observations.
    Nearest(Vec<SVector<f64, 2>>),
    /// No equilibrium is found from rest.
    Lost,
}

/// How the shape of every frame with an equilibrium can be reached; `unknowns` are those of the equilibria.
pub(super) fn reachabilities(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    unknowns: &[DVector<f64>],
) -> Vec<Option<Reachability>> {
    let count = recording.frames.len();
    let positions = |t: usize| recording.here[t].linear.as_ref().map(|l| &*l.positions);
    let mut reached = in_chunks(0..count, |chunk| {
        let mut solver = smoother.solver();
        let postures: Vec<FramePosture<'_>> =
            chunk.iter().map(|&t| (&recording.frames[t], &unknowns[t], positions(t))).collect();
        solver.how_reached(&postures)
    });
    let mut solver = smoother.solver();
    let mut follow = |from: usize, to: usize, reached: &mut [Option<Reachability>]| {
        let Some((start, end)) = positions(from).zip(positions(to)) else { return };
        if reached[from].is_some() && reached[to].is_none() {
            let [before, after] = [from, to].map(|t| (&recording.frames[t], &unknowns[t]));
            if solver.leads_from_neighbour((before, start), (after, end)) {
                reached[to] = Some(Reachability::OtherWay);
            }
        }
    };
    (1..count).for_each(|t| follow(t - 1, t, &mut reached));
    (1..count).rev().for_each(|t| follow(t, t - 1, &mut reached));
    in_chunks(0..count, |chunk| {
        let mut solver = smoother.solver();
        Vec::from_iter(chunk.iter().map(|&t| {
            positions(t)?;
            Some(reached[t].clone().unwrap_or_else(|| {
                let nearest = solver.nearest_reached(&recording.frames[t], &unknowns[t]);
                nearest.map_or(Reachability::Lost, Reachability::Nearest)
            }))
        }))
    })
}

impl FrameSolver<'_> {
    /// Whether loads that grow together from rest lead to the equilibria of these postures, jumps included
    /// ([`LaneGroup::solve_from_rest`](tongue_core::statics::lanes::LaneGroup::solve_from_rest)); not to one without positions.
    pub fn are_reached_from_rest(&mut self, postures: &[FramePosture<'_>]) -> Vec<bool> {
        let mut reached = Vec::with_capacity(postures.len());
        for postures in postures.chunks(LANES) {
            let ends = self.shapes_from_rest(postures).into_iter().zip(postures);
            reached.extend(ends.map(|(end, (_, _, positions))| {
                let ends = end.as_deref().zip(*positions);
                ends.is_some_and(|(end, positions)| largest_distance(end, positions) <= SAME_SHAPE_M)
            }));
        }
        reached
    }

    /// The shapes to which the loads of at most as many postures as there are lanes lead from rest.
    fn shapes_from_rest(&mut self, postures: &[FramePosture<'_>]) -> Vec<Option<Vec<Point>>> {
        let loads: Vec<Load<'_, 2>> = postures.iter().map(|posture| self.load(*posture)).collect();
        let settings = SolveSettings::default();
        let ends = self.group().solve_from_rest(loads.len(), &settings, &|i, part| loads[i].scaled(part));
        ends.into_iter().map(|end| Some(end?.positions)).collect()
    }

    /// How the shapes of these postures are reached from rest; `None` where no path was found.
    pub fn how_reached(&mut self, postures: &[FramePosture<'_>]) -> Vec<Option<Reachability>> {
        let reached = self.are_reached_from_rest(postures).into_iter().zip(postures);
        let each = reached.map(|(is_reached, &(frame, x, positions))| {
            if is_reached {
                return Some(Reachability::LoadPath);
            }
            self.reached_in_turn(frame, x, positions?).then_some(Reachability::OtherWay)
        });
        each.collect()
    }

    /// Whether equilibria lead from the shape of one posture to that of another without a descent from a saddle.
    fn leads_from_neighbour(
        &mut self,
        ((from, x), start): ((&Frame, &DVector<f64>), &[SVector<f64, 2>]),
        ((to, y), end): ((&Frame, &DVector<f64>), &[SVector<f64, 2>]),
    ) -> bool {
        self.displace_bones(from, x);
        self.workspace.start_from(start);
        let (before, after) = (self.tensions_of(x), self.tensions_of(y));
        let mut between = to.clone();
        let arrives = PARTS.iter().all(|&part| {
            for (shift, (a, b)) in between.shifts.iter_mut().zip(from.shifts.iter().zip(&to.shifts)) {
                *shift = a + (b - a) * part;
            }
            self.displace_bones(&between, &(x + (y - x) * part));
            self.tensions = before.iter().zip(&after).map(|(a, b)| a + (b - a) * part).collect();
            self.solves_directly()
        });
        arrives && self.is_at(end)
    }

    /// The shape reached from rest that is nearest to the observations of a frame, by Gauss-Newton for that frame alone from the end of the
    /// load path of `x`. Tensions have a normal prior about `x` with the standard deviation that they have about their levels, other
    /// unknowns with 1. That end itself if the search leads to a shape that is not reached; `None` without an equilibrium from rest.
    pub fn nearest_reached(&mut self, frame: &Frame, x: &DVector<f64>) -> Option<Vec<Point>> {
        let first = self.shapes_from_rest(&[(frame, x, None)]).pop()??;
        let (muscles, sd) = (self.system.contracting().len(), self.link.deviation_sd_n);
        let held = DVector::from_fn(x.len(), |i, _| if i < muscles { sd.powi(-2) } else { 1.0 });
        let Some(begin) = self.linearise(frame, x, Some(&first)) else { return Some(first) };
        let cost = |here: &Linearisation| {
            here.residuals.norm_squared() + (&here.x - x).component_mul(&held).dot(&(&here.x - x))
        };
        let step = |here: &Linearisation, damping: f64| {
            let curvature =
                here.jacobian.tr_mul(&here.jacobian) + DMatrix::from_diagonal(&held) * (1.0 + damping);
            let gradient = here.jacobian.tr_mul(&here.residuals) + (&here.x - x).component_mul(&held);
            TrialStep::newton(curvature, &gradient, f64::INFINITY)
        };
        let here = descend(begin, &NEAREST, cost, step, |here, step| {
            self.linearise(frame, &(&here.x + step), Some(&here.positions))
        })
        .here;
        let is_reached = self.are_reached_from_rest(&[(frame, &here.x, Some(&here.positions))]) == [true];
        Some(if is_reached { here.positions.to_vec() } else { first })
    }

    /// Whether the positions are reached from rest if one muscle, or all but one, pulls before the others.
    fn reached_in_turn(&mut self, frame: &Frame, x: &DVector<f64>, positions: &[SVector<f64, 2>]) -> bool {
        let whole = self.tensions_of(x);
        let muscles = self.system.contracting().to_vec();
        let mut orders = muscles.iter().flat_map(|&m| [(m, true), (m, false)]).map(|(muscle, alone)| {
            let tensions =
                whole.iter().enumerate().map(|(m, f)| if (m == muscle) == alone { *f } else { 0.0 });
            tensions.collect::<Vec<f64>>()
        });
        orders.any(|first| {
            self.displace_bones(frame, x);
            self.workspace.start_from_rest(self.system);
            self.follows_path(&vec![0.0; whole.len()], &first)
                && self.follows_path(&first, &whole)
                && self.is_at(positions)
        })
    }

    /// Changes the tensions from `from` to `to` (N per metre of thickness) in parts of the way. Returns whether every equilibrium was
    /// found, and without a descent from a saddle.
    fn follows_path(&mut self, from: &[f64], to: &[f64]) -> bool {
        PARTS.iter().all(|part| {
            self.tensions = from.iter().zip(to).map(|(a, b)| a + (b - a) * part).collect();
            self.solves_directly()
        })
    }

    fn is_at(&self, positions: &[SVector<f64, 2>]) -> bool {
        largest_distance(self.workspace.positions(), positions) <= SAME_SHAPE_M
    }

    /// Solves from the present shape, and tells whether this needed no descent from a saddle.
    fn solves_directly(&mut self) -> bool {
        let done = self.solve_here();
        done.status == SolveStatus::Converged && done.connection == Connection::Direct
    }
}
