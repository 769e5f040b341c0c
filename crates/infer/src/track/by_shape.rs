//! How the surface in a frame responds to changes of the shape at rest: several frames at once in lanes, and one at a time where lanes do
//! not serve.

use nalgebra::{DMatrix, SVector};

use tongue_core::effect::Configuration;
use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statics::SolveStatus;
use tongue_core::statics::lanes::{Change, Equilibrium, LANES, Load};

use super::frame::{Frame, Posture, Solver, slopes};
use super::mode::{CHUNK, Course, Mode};
use super::shape::{RestShape, STEP};

/// Derivatives of the observations of a frame and of its hidden points by the shape, mm.
pub(super) struct ByShape {
    pub seen: DMatrix<f64>,
    pub hidden: DMatrix<f64>,
}

/// Derivatives of all frames by the shape.
pub(super) fn by_shape(
    mode: &Mode<'_, '_>,
    course: &Course,
    shape: Option<&RestShape>,
) -> Vec<Option<ByShape>> {
    let Some(shape) = shape else { return course.frames.iter().map(|_| None).collect() };
    let numbers: Vec<usize> = (0..course.frames.len()).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let work = |chunk: &&[usize]| -> Vec<Option<ByShape>> {
        let known: Vec<usize> = chunk.iter().copied().filter(|&t| course.here[t].linear.is_some()).collect();
        let x: Vec<_> = known.iter().map(|&t| mode.unknowns(&course.here[t].z, &mode.shared)).collect();
        let from = |t: usize| course.here[t].linear.as_ref().map(|linear| linear.positions.as_slice());
        let postures: Vec<_> = known.iter().zip(&x).map(|(&t, x)| (&course.frames[t], x, from(t))).collect();
        let rates = shape.rates(&mut (mode.solver)(), &postures);
        let mut out: Vec<Option<ByShape>> = chunk.iter().map(|_| None).collect();
        for (t, all) in known.into_iter().zip(rates) {
            let seen = course.frames[t].observations.len();
            out[t - chunk[0]] = all.map(|all| {
                let hidden = all.rows(seen, all.nrows() - seen).into_owned();
                ByShape { seen: all.rows(0, seen).into_owned(), hidden }
            });
        }
        out
    };
    parallel::map(&chunks, work).into_iter().flatten().collect()
}

impl RestShape {
    /// Derivatives of the residuals of frames, and behind them of the distances of their hidden points, mm, by each direction; `None` for a
    /// frame without an equilibrium at its positions.
    pub(super) fn rates(
        &self,
        solver: &mut Solver<'_>,
        postures: &[Posture<'_>],
    ) -> Vec<Option<DMatrix<f64>>> {
        let in_lanes = postures.chunks(LANES).flat_map(|group| self.rates_of_group(solver, group));
        let found: Vec<Option<DMatrix<f64>>> = in_lanes.collect();
        let alone = |(found, posture): (Option<DMatrix<f64>>, &Posture<'_>)| {
            let rates = found.or_else(|| self.rates_alone(solver, *posture));
            rates.filter(|rates| rates.iter().all(|v| v.is_finite()))
        };
        found.into_iter().zip(postures).map(alone).collect()
    }

    /// As [`RestShape::rates`] for as many frames as there are lanes; `None` too where lanes do not serve.
    fn rates_of_group(&self, solver: &mut Solver<'_>, postures: &[Posture<'_>]) -> Vec<Option<DMatrix<f64>>> {
        let loads: Vec<Load<'_, 2>> = postures.iter().map(|posture| solver.load(*posture)).collect();
        let settings = solver.settings;
        let (Some(group), Some(directions)) = (solver.group(), &self.in_lanes) else {
            return postures.iter().map(|_| None).collect();
        };
        let begin = |((frame, ..), shape): (&Posture<'_>, &Equilibrium<2>)| {
            let is_found = shape.solution.status == SolveStatus::Converged;
            is_found.then(|| Rates::new(frame, &shape.positions, self.count()))
        };
        let mut rates: Vec<Option<Rates>> =
            postures.iter().zip(group.solve(&loads, &settings)).map(begin).collect();
        for (k, direction) in directions.iter().enumerate() {
            for (rates, motion) in rates.iter_mut().zip(group.motions(Change::Rest(direction))) {
                match motion.zip(rates.as_mut()) {
                    Some((motion, rates)) => rates.set(k, |n| motion[n]),
                    None => *rates = None,
                }
            }
        }
        let shapes = group.answers();
        let done = |((rates, (frame, ..)), shape): ((Option<Rates>, &Posture<'_>), &Equilibrium<2>)| {
            rates.map(|rates| self.with_coils(rates, frame, &shape.positions))
        };
        rates.into_iter().zip(postures).zip(shapes).map(done).collect()
    }

    /// As [`RestShape::rates`] for one frame of any body: the factorised stiffness turns the forces of each changed body into motion.
    fn rates_alone(&self, solver: &mut Solver<'_>, (frame, x, from): Posture<'_>) -> Option<DMatrix<f64>> {
        let positions = solver.solve(frame, x, from)?.to_vec();
        let tensions = solver.tensions_of(x);
        let mut rates = Rates::new(frame, &positions, self.count());
        let free: Vec<bool> = {
            let mut free = vec![false; positions.len()];
            solver.system.pattern().nodes().iter().for_each(|&n| free[n] = true);
            free
        };
        let mut response = solver.response()?;
        let (mut before, mut after) =
            (vec![SVector::zeros(); positions.len()], vec![SVector::zeros(); positions.len()]);
        self.system.force(Configuration { positions: &positions, tensions: &tensions }, &mut before);
        for (k, (direction, changed)) in self.prior.directions.iter().zip(&self.changed).enumerate() {
            // Nodes on bone move with the body at rest.
            let moved = |(n, p): (usize, &Point)| if free[n] { *p } else { p + direction[n] * STEP };
            let there: Vec<Point> = positions.iter().enumerate().map(moved).collect();
            changed.force(Configuration { positions: &there, tensions: &tensions }, &mut after);
            response.to_load(|_, load| {
                for (l, (a, b)) in load.iter_mut().zip(after.iter().zip(&before)) {
                    *l += (a - b) / STEP;
                }
            });
            rates.set(k, |n| if free[n] { response.motion()[n] } else { direction[n] });
        }
        Some(self.with_coils(rates, frame, &positions))
    }

    /// The derivatives with those by the directions that move coils along the surface.
    fn with_coils(&self, rates: Rates, frame: &Frame, positions: &[Point]) -> DMatrix<f64> {
        let mut out = rates.out;
        let first = out.ncols() - self.prior.coils.len();
        let hidden = frame.hidden.iter().map(|h| (&h.name, &h.along));
        let rows: Vec<_> = frame.names.iter().zip(&frame.along).chain(hidden).collect();
        for (k, (coil, weights)) in self.prior.coils.iter().enumerate() {
            let motion: Point = weights.iter().map(|(n, w)| positions[*n] * *w).sum();
            for (row, (_, along)) in rows.iter().enumerate().filter(|(_, (name, _))| *name == coil) {
                out[(row, first + k)] = along.channel.checked_sub(1).map_or(0.0, |axis| 1e3 * motion[axis]);
            }
        }
        out
    }
}

/// Derivatives of the observations of a frame and of its hidden points, mm, of which some columns are known.
struct Rates {
    /// For every row, the nodes on which it depends, and the derivative by their positions, in units of a millimetre.
    slopes: Vec<Vec<(usize, Point)>>,
    out: DMatrix<f64>,
}

impl Rates {
    fn new(frame: &Frame, positions: &[Point], columns: usize) -> Self {
        let seen =
            slopes(frame, positions).into_iter().zip(&frame.observations).map(|(s, o)| (s, 1e3 / o.weight));
        let hidden = frame.hidden.iter().map(|h| (h.slope(positions), 1e3));
        let scaled = |(slope, unit): (Vec<(usize, Point)>, f64)| {
            slope.into_iter().map(|(node, s)| (node, s * unit)).collect::<Vec<_>>()
        };
        let slopes: Vec<_> = seen.chain(hidden).map(scaled).collect();
        Self { out: DMatrix::zeros(slopes.len(), columns), slopes }
    }

    /// Sets a column from the motion of every node for a unit of a direction.
    fn set(&mut self, column: usize, motion: impl Fn(usize) -> Point) {
        for (row, slope) in self.slopes.iter().enumerate() {
            self.out[(row, column)] = slope.iter().map(|(n, s)| s.dot(&motion(*n))).sum();
        }
    }
}
