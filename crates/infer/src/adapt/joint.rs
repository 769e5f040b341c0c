//! The rest shape that explains many frames at once. All frames share the displacements of control points, and each frame has its own
//! tensions. The method is Gauss-Newton with the tensions eliminated frame by frame (Golub and Pereyra 1973).

use nalgebra::{DMatrix, DVector, SVector};

use crate::track::{
    ARRIVED, CoursePrior, Followed, Frame, Solver, Tension, TongueSurface, frames, residuals, slopes,
};
use tongue_core::body::Body;
use tongue_core::effect::Configuration;
use tongue_core::parallel;
use tongue_core::system::{Model, System, SystemError};
use tongue_input::measured::recording::Seen;

use super::rest::{Rest, RestError, STEP_M, price_slope};

/// Settings of the search for a joint rest shape.
#[derive(Debug, Clone)]
pub struct JointSettings {
    /// Prior of the tensions.
    pub prior: CoursePrior,
    /// Largest number of rounds.
    pub rounds: usize,
    /// The material.
    pub model: Model,
    /// Numbers of the muscles that contract.
    pub contracting: Vec<usize>,
    /// Displacements of the control points at the start, m.
    pub start: Option<DVector<f64>>,
}

/// A joint rest shape.
#[derive(Debug, Clone)]
pub struct JointFit {
    /// Displacements of the control points, m.
    pub displacements: DVector<f64>,
    /// Scores of the frames, in their order.
    pub scores: Vec<DVector<f64>>,
    /// Covariances of the scores for this rest shape.
    pub covariances: Vec<DMatrix<f64>>,
    /// Root mean square residual over all frames, m.
    pub rms_m: f64,
    /// Cost before and after.
    pub costs: [f64; 2],
    /// Number of rounds done.
    pub rounds: usize,
}

/// Scores and positions (m) from which a frame is solved.
type From = (DVector<f64>, Option<Vec<SVector<f64, 2>>>);

/// A frame after the elimination of its tensions.
struct Reduced {
    x: DVector<f64>,
    positions: Vec<SVector<f64, 2>>,
    /// `JxᵀJx + P`, `JxᵀJd`, `JdᵀJd` and the two gradients.
    xx: DMatrix<f64>,
    xd: DMatrix<f64>,
    dd: DMatrix<f64>,
    gx: DVector<f64>,
    gd: DVector<f64>,
}

/// The body at some displacements, with the data that depend on them alone.
struct Stand {
    system: System<2>,
    surface: TongueSurface,
    followed: Vec<Followed>,
}

struct Problem<'a> {
    rest: &'a Rest<'a>,
    /// Recordings, each with the numbers of the selected frames.
    seen: &'a [(Seen, Vec<usize>)],
    /// Bones that follow the observations; their marks are not displaced.
    followed: &'a [Followed],
    hide: &'a [String],
    settings: &'a JointSettings,
}

impl Problem<'_> {
    fn stand(&self, d: &DVector<f64>) -> Result<(Body<2>, Stand), RestError> {
        let body = self.rest.body(d);
        let wrong = |e: SystemError| RestError::Body(e.to_string());
        let system =
            System::new(&body.mesh, &self.settings.model, &self.settings.contracting).map_err(wrong)?;
        let surface =
            TongueSurface::of(&body).ok_or_else(|| RestError::Body("it has no outline".to_owned()))?;
        Ok((body, Stand { system, surface, followed: self.followed.to_vec() }))
    }

    fn frames(&self, stand: &Stand) -> Vec<Frame> {
        let mut out = Vec::new();
        for (seen, taken) in self.seen {
            let all = frames(seen, &stand.surface, &stand.followed, self.hide);
            out.extend(taken.iter().filter_map(|&t| all.get(t).cloned()));
        }
        out
    }
}

/// Finds the rest shape that explains the given frames of recordings. `followed` are the bones with their marks, which are defined by the
/// recordings; `hide` are points that are not fitted.
///
/// # Errors
/// [`RestError`] where the body has no equilibrium at the start.
pub fn joint(
    rest: &Rest<'_>,
    seen: &[(Seen, Vec<usize>)],
    followed: &[Followed],
    hide: &[String],
    settings: &JointSettings,
    progress: &dyn Fn(usize),
) -> Result<JointFit, RestError> {
    let problem = Problem { rest, seen, followed, hide, settings };
    let precision = settings.prior.precision();
    let m = settings.prior.mean.len();
    let mut d = settings.start.clone().unwrap_or_else(|| DVector::zeros(rest.unknowns()));
    let (_, stand) = problem.stand(&d)?;
    let list = problem.frames(&stand);
    let starts: Vec<From> = list.iter().map(|_| (settings.prior.mean.clone(), None)).collect();
    let mut here = settle(&stand, &list, &starts, settings, &precision, 12);
    let whole = |frames: &[Option<Settled>], d: &DVector<f64>| {
        frames.iter().flatten().map(|s| s.cost).sum::<f64>() + rest.price(d).norm_squared()
    };
    let mut cost = whole(&here, &d);
    let first = cost;
    let (mut stand, mut list, mut damping, mut rounds) = (stand, list, 0.0, 0);
    for round in 0..settings.rounds {
        rounds = round + 1;
        let reduced = reduce(&problem, &d, &stand, &list, &here, &precision)?;
        let price = rest.price(&d);
        let slope =
            price_slope(rest, &d).ok_or_else(|| RestError::Body("its cells have no area".to_owned()))?;
        let mut matrix = slope.tr_mul(&slope);
        let mut right = -slope.tr_mul(&price);
        for frame in reduced.iter().flatten() {
            let Some(factors) = frame.xx.clone().cholesky() else { continue };
            matrix += &frame.dd - frame.xd.tr_mul(&factors.solve(&frame.xd));
            right -= &frame.gd - frame.xd.tr_mul(&factors.solve(&frame.gx));
        }
        let mut moved = false;
        for _ in 0..6 {
            let mut damped = (&matrix + matrix.transpose()) * 0.5;
            (0..d.len()).for_each(|i| damped[(i, i)] *= 1.0 + damping);
            let Some(factors) = damped.cholesky() else {
                damping = (damping * 5.0).max(0.1);
                continue;
            };
            let step = factors.solve(&right);
            let next = &d + &step;
            if rest.is_believable(&next)
                && let Ok((_, there)) = problem.stand(&next)
            {
                let there_list = problem.frames(&there);
                let starts: Vec<_> = reduced
                    .iter()
                    .map(|f| match f {
                        Some(f) => {
                            let pull = &f.gx + &f.xd * &step;
                            let by =
                                f.xx.clone()
                                    .cholesky()
                                    .map_or_else(|| DVector::zeros(m), |c| -c.solve(&pull));
                            let cut = (1.0 / by.amax().max(1.0)).min(1.0);
                            (&f.x + by * cut, Some(f.positions.clone()))
                        }
                        None => (settings.prior.mean.clone(), None),
                    })
                    .collect();
                let settled = settle(&there, &there_list, &starts, settings, &precision, 3);
                let priced = whole(&settled, &next);
                let lost = here.iter().zip(&settled).any(|(a, b)| a.is_some() && b.is_none());
                if priced < cost && !lost {
                    moved = cost - priced > 1e-4 * cost && step.amax() > 1e-5;
                    (d, here, stand, list, cost) = (next, settled, there, there_list, priced);
                    damping *= 0.2;
                    break;
                }
            }
            damping = (damping * 5.0).max(0.1);
        }
        progress(rounds);
        if !moved {
            break;
        }
    }
    let mut squares = (0.0, 0);
    let (mut scores, mut covariances) = (Vec::new(), Vec::new());
    for (settled, frame) in here.iter().zip(&list) {
        let Some(s) = settled else { continue };
        let r = residuals(frame, &s.positions);
        squares.0 += r.iter().zip(&frame.observations).map(|(r, o)| (r / o.weight).powi(2)).sum::<f64>();
        squares.1 += r.len();
        scores.push(s.x.clone());
        covariances.push(s.covariance.clone());
    }
    if scores.is_empty() {
        return Err(RestError::Body("no frame has an equilibrium with enough points".to_owned()));
    }
    let rms_m = (squares.0 / f64::from(squares.1.max(1) as u32)).sqrt();
    Ok(JointFit {
        displacements: Rest::cleaned(&d),
        scores,
        covariances,
        rms_m,
        costs: [first, cost],
        rounds,
    })
}

/// A frame with the tensions found for a given rest shape.
struct Settled {
    x: DVector<f64>,
    positions: Vec<SVector<f64, 2>>,
    covariance: DMatrix<f64>,
    cost: f64,
}

/// Finds the tensions of every single frame.
fn settle(
    stand: &Stand,
    list: &[Frame],
    starts: &[From],
    settings: &JointSettings,
    precision: &DMatrix<f64>,
    steps: usize,
) -> Vec<Option<Settled>> {
    let numbers: Vec<usize> = (0..list.len()).collect();
    parallel::map(&numbers, |&t| {
        let mut solver = Solver::new(&stand.system, &stand.followed, Tension::Scores(settings.prior.scale_n));
        solver
            .settle(
                &list[t],
                &starts[t].0,
                starts[t].1.as_deref(),
                &settings.prior,
                precision,
                (steps, ARRIVED),
            )
            .map(|(x, linear, cost)| {
                let normal = linear.jacobian.tr_mul(&linear.jacobian) + precision;
                let covariance = normal.try_inverse().unwrap_or_else(|| settings.prior.covariance.clone());
                Settled { x, positions: linear.positions, covariance, cost }
            })
    })
}

/// Linearises every frame in tensions and displacements. The response of the equilibrium to a displacement is that to the forces of the
/// changed body at the same positions (central differences), through the factorised stiffness.
fn reduce(
    problem: &Problem<'_>,
    d: &DVector<f64>,
    stand: &Stand,
    list: &[Frame],
    here: &[Option<Settled>],
    precision: &DMatrix<f64>,
) -> Result<Vec<Option<Reduced>>, RestError> {
    let settings = problem.settings;
    let sides: Vec<(usize, f64)> = (0..d.len()).flat_map(|k| [(k, 1.0), (k, -1.0)]).collect();
    let changed = parallel::map(&sides, |&(k, side)| {
        let mut moved = d.clone();
        moved[k] += side * STEP_M;
        let (body, stand) = problem.stand(&moved)?;
        let list = problem.frames(&stand);
        Ok((body.mesh.nodes, stand, list))
    });
    let changed = changed.into_iter().collect::<Result<Vec<_>, RestError>>()?;
    let rest_now = stand.system.rest();
    let held: Vec<usize> = {
        let mut free = vec![false; rest_now.len()];
        stand.system.pattern().nodes().iter().for_each(|&n| free[n] = true);
        (0..rest_now.len()).filter(|&n| !free[n]).collect()
    };
    let numbers: Vec<usize> = (0..list.len()).collect();
    Ok(parallel::map(&numbers, |&t| {
        let at = here[t].as_ref()?;
        let frame = &list[t];
        let mut solver = Solver::new(&stand.system, &stand.followed, Tension::Scores(settings.prior.scale_n));
        let linear = solver.linearise(frame, &at.x, Some(&at.positions))?;
        let tensions = solver.tensions_of(&at.x);
        let slopes = slopes(frame, &linear.positions);
        let mut by_rest = DMatrix::zeros(frame.observations.len(), d.len());
        let mut response = solver.response()?;
        let mut forces = [vec![SVector::zeros(); rest_now.len()], vec![SVector::zeros(); rest_now.len()]];
        for k in 0..d.len() {
            let mut values = [DVector::zeros(0), DVector::zeros(0)];
            let mut carried = vec![SVector::<f64, 2>::zeros(); rest_now.len()];
            for side in 0..2 {
                let (nodes, other, frames) = &changed[2 * k + side];
                let mut positions = linear.positions.clone();
                for &n in &held {
                    let by = nodes[n] - rest_now[n];
                    positions[n] += by;
                    carried[n] += by * if side == 0 { 0.5 / STEP_M } else { -0.5 / STEP_M };
                }
                let configuration = Configuration { positions: &positions, tensions: &tensions };
                other.system.force(configuration, &mut forces[side]);
                // The surface is given by distances at rest, so it changes too.
                values[side] = residuals(&frames[t], &linear.positions);
            }
            response.to_load(|_, load| {
                for (l, (a, b)) in load.iter_mut().zip(forces[0].iter().zip(&forces[1])) {
                    *l += (a - b) * (0.5 / STEP_M);
                }
            });
            for (row, slope) in slopes.iter().enumerate() {
                let rate: f64 =
                    slope.iter().map(|(n, s)| s.dot(&(response.motion()[*n] + carried[*n]))).sum();
                by_rest[(row, k)] = rate + (values[0][row] - values[1][row]) * (0.5 / STEP_M);
            }
        }
        let away = &at.x - &settings.prior.mean;
        let (jx, r) = (&linear.jacobian, &linear.residuals);
        Some(Reduced {
            xx: jx.tr_mul(jx) + precision,
            xd: jx.tr_mul(&by_rest),
            dd: by_rest.tr_mul(&by_rest),
            gx: jx.tr_mul(r) + precision * away,
            gd: by_rest.tr_mul(r),
            x: at.x.clone(),
            positions: linear.positions,
        })
    }))
}
