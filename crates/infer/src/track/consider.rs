//! Draws of levels and courses of tensions that include the uncertainty of the shape at rest without fitting it.
//!
//! The problem is linearised once, at the most probable tensions on the placed body. Let `J` be the derivatives by the states `z` of all
//! frames, `D` those by the shared unknowns (`theta`: levels of the muscles, shape at rest, static error), `S` the covariance of the
//! errors and `Q` the precision of the states:
//! ```text
//! A = (J'S^-1 J + Q)^-1 J'S^-1 D        H = P + w sum (D'S^-1 D - D'S^-1 J A)        theta ~ N(-H^-1 g, H^-1)
//! ```
//! Given `theta`, `z` is normal too. Intervals would be too narrow if the most probable shape were searched for together with the
//! tensions of all frames (Neyman and Scott 1948). `w` is less than 1 because the model differs from the recorded tongue.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use tongue_core::parallel;
use tongue_core::random;

use super::by_shape::{ByShape, by_shape};
use super::errors::Kriging;
use super::listen;
use super::mode::{Course, Eliminated, Mode};
use super::shape::RestShape;

/// Largest number of frames whose information about levels and shape is counted in full; more frames together count as this many, because
/// more frames do not make the model more like a tongue. If every frame counted, the step to the most probable shape of some hundred frames
/// would be far longer than the range in which its linearisation holds.
const MOST_FRAMES: usize = 120;
/// Number of draws made at once; the second half of them mirrors the first.
const BATCH: usize = 50;

/// Draws of a recording.
pub(super) struct Draws {
    /// For every frame and muscle the tensions, N per metre of thickness, in the order of the draws.
    pub tensions: Vec<Vec<Vec<f32>>>,
    /// For every frame, the displacements of the bones, in standard deviations.
    pub bones: Vec<Vec<Vec<f32>>>,
    /// For every frame and hidden point, its expected distance from the surface of the most probable shape, mm.
    pub hidden: Vec<Vec<Vec<f32>>>,
    /// For every frame and formant that is told, its change from the most probable one, Hz.
    pub heard: Vec<Vec<Vec<f32>>>,
}

/// A linearised recording.
struct Linear {
    eliminated: Eliminated,
    by_shape: Vec<Option<ByShape>>,
}

/// Draws of all recordings at the mode; `None` where the covariances cannot be factorised.
pub(super) fn draws(
    mode: &Mode<'_, '_>,
    courses: &[Course],
    shape: Option<&RestShape>,
) -> Option<Vec<Draws>> {
    let linear = linearised(mode, courses, shape)?;
    let frames = courses.iter().map(Course::count).sum();
    let judged = Judged::of(mode, (&linear, frames), shape)?;
    let shared = judged.draws(mode)?;
    let each = courses.iter().zip(&linear).enumerate();
    let draws = each.map(|(number, (course, linear))| {
        let heard = listen::rates(mode, course, shape);
        drawn(mode, course, linear, &heard, &shared, number)
    });
    Some(draws.collect())
}

fn linearised(mode: &Mode<'_, '_>, courses: &[Course], shape: Option<&RestShape>) -> Option<Vec<Linear>> {
    let columns = shape.map_or(0, RestShape::count);
    let one = |course: &Course| {
        let by_shape = by_shape(mode, course, shape);
        let more = |t: usize| by_shape[t].as_ref().map(|b| b.seen.clone());
        let eliminated = mode.eliminate(course, &[], &more, columns)?;
        Some(Linear { eliminated, by_shape })
    };
    courses.iter().map(one).collect()
}

/// Information about the shared unknowns (levels, static error, shape) from the frames and the prior.
struct Judged {
    /// From the frames, with full weight.
    curvature: DMatrix<f64>,
    gradient: DVector<f64>,
    /// From the prior.
    prior: DMatrix<f64>,
    pull: DVector<f64>,
    /// From both, with the frames weighted by the trust in them, factorised.
    factor: Cholesky<f64, Dyn>,
    /// The most probable values, relative to those at the mode.
    middle: DVector<f64>,
}

impl Judged {
    /// From linearised recordings with data in so many frames.
    fn of(
        mode: &Mode<'_, '_>,
        (linear, frames): (&[Linear], usize),
        shape: Option<&RestShape>,
    ) -> Option<Self> {
        let (m, k, s) = (mode.sizes.muscles, mode.sizes.knots, shape.map_or(0, RestShape::count));
        let all = m + k + s;
        let mut curvature = DMatrix::zeros(all, all);
        let mut gradient = DVector::zeros(all);
        for one in linear {
            curvature += &one.eliminated.curvature;
            gradient += &one.eliminated.gradient;
        }
        let mut prior = DMatrix::zeros(all, all);
        prior.view_mut((0, 0), (m + k, m + k)).copy_from(&mode.shared_precision);
        let mut pull = DVector::zeros(all);
        pull.rows_mut(0, m + k).copy_from(&(&mode.shared_precision * &mode.shared));
        if let Some(shape) = shape {
            prior.view_mut((m + k, m + k), (s, s)).copy_from(&shape.prior.precision);
            pull.rows_mut(m + k, s).copy_from(&shape.prior.gradient);
        }
        // The static error belongs to the errors, so its prior has the same reduced weight when the shape is estimated.
        let trust = mode.settings.trust;
        let of_frames = trust * (MOST_FRAMES as f64 / frames.max(1) as f64).min(1.0);
        let judged = |i: usize| if (m..m + k).contains(&i) { trust } else { 1.0 };
        let weighed = DMatrix::from_fn(all, all, |i, j| prior[(i, j)] * (judged(i) * judged(j)).sqrt());
        let h = weighed + &curvature * of_frames;
        let g = DVector::from_fn(all, |i, _| pull[i] * judged(i)) + &gradient * of_frames;
        let factor = ((&h + h.transpose()) * 0.5).cholesky()?;
        let middle = -factor.solve(&g);
        Some(Self { curvature, gradient, prior, pull, factor, middle })
    }

    /// Draws of the shared unknowns relative to the mode, one column each.
    fn draws(&self, mode: &Mode<'_, '_>) -> Option<DMatrix<f64>> {
        let Self { curvature, gradient, prior, pull, factor, middle } = self;
        let (m, k, all) = (mode.sizes.muscles, mode.sizes.knots, middle.len());
        // Given levels and shape, the static error is drawn again with the full weight of the frames.
        let of_error = (curvature.view((m, m), (k, k)) + prior.view((m, m), (k, k))).into_owned();
        let error = if k > 0 { Some(((&of_error + of_error.transpose()) * 0.5).cholesky()?) } else { None };
        let batches = mode.settings.draws.div_ceil(BATCH).max(1);
        let mut out = DMatrix::zeros(all, batches * BATCH);
        for batch in 0..batches {
            let mut random = fastrand::Rng::with_seed(random::seed_of(mode.settings.seed, batch));
            for draw in 0..BATCH / 2 {
                let mut by = random::normals(all, &mut random);
                factor.l_dirty().tr_solve_lower_triangular_mut(&mut by);
                let mut by_error = random::normals(k, &mut random);
                if let Some(error) = &error {
                    error.l_dirty().tr_solve_lower_triangular_mut(&mut by_error);
                }
                for (half, sign) in [(0, 1.0), (BATCH / 2, -1.0)] {
                    let mut theta = middle + &by * sign;
                    if let Some(error) = &error {
                        theta.rows_mut(m, k).fill(0.0);
                        let pulled = curvature * &theta + gradient + pull;
                        let at = -error.solve(&pulled.rows(m, k).into_owned()) + &by_error * sign;
                        theta.rows_mut(m, k).copy_from(&at);
                    }
                    out.column_mut(batch * BATCH + half + draw).copy_from(&theta);
                }
            }
        }
        Some(out)
    }
}

/// The kriging coefficients for the hidden points of a frame.
fn krigings(mode: &Mode<'_, '_>, course: &Course, t: usize) -> Vec<Kriging> {
    let (frame, Some(errors)) = (&course.frames[t], course.errors[t].as_ref()) else { return Vec::new() };
    frame.hidden.iter().map(|h| mode.knots.kriging(&frame.along, errors, &h.along)).collect()
}

/// Draws of a recording, given the draws of the shared unknowns.
fn drawn(
    mode: &Mode<'_, '_>,
    course: &Course,
    linear: &Linear,
    heard: &[Option<DMatrix<f64>>],
    shared: &DMatrix<f64>,
    number: usize,
) -> Draws {
    let (m, n) = (mode.sizes.muscles, mode.sizes.state());
    let bones = mode.sizes.bones;
    let frames = course.frames.len();
    let link = mode.settings.link;
    let kriged: Vec<Vec<Kriging>> = (0..frames).map(|t| krigings(mode, course, t)).collect();
    let batches: Vec<usize> = (0..shared.ncols() / BATCH).collect();
    let seed = random::seed_of(!mode.settings.seed, number);
    let one = |&batch: &usize| {
        let mut random = fastrand::Rng::with_seed(random::seed_of(seed, batch));
        let mut noise: Vec<DMatrix<f64>> = (0..frames)
            .map(|_| {
                let mut half = DMatrix::from_fn(n, BATCH / 2, |_, _| random::normal(&mut random));
                half = half.resize_horizontally(BATCH, 0.0);
                let mirrored = -half.columns(0, BATCH / 2).into_owned();
                half.columns_mut(BATCH / 2, BATCH / 2).copy_from(&mirrored);
                half
            })
            .collect();
        linear.eliminated.factors.colour(&mut noise);
        let theta = shared.columns(batch * BATCH, BATCH).into_owned();
        let mut tensions = Vec::with_capacity(frames);
        let (mut moved, mut foretold) = (Vec::with_capacity(frames), Vec::with_capacity(frames));
        let mut sounds = Vec::with_capacity(frames);
        for (t, noise) in noise.into_iter().enumerate() {
            let step = &linear.eliminated.steps[t];
            let mut by = noise - &linear.eliminated.answers[t] * &theta;
            by.column_iter_mut().for_each(|mut c| c -= step.column(0));
            let x = mode.unknowns(&course.here[t].z, &mode.shared);
            let value = |i: usize, d: usize| (link.tension(x[i] + theta[(i, d)] + by[(i, d)]).0) as f32;
            tensions.push((0..m).map(|i| (0..BATCH).map(|d| value(i, d)).collect()).collect());
            let bone = |i: usize| (0..BATCH).map(|d| (x[m + i] + by[(m + i, d)]) as f32).collect();
            moved.push((0..bones).map(bone).collect());
            sounds.push(sound(mode, heard[t].as_ref(), &by, &theta));
            foretold.push(hidden(mode, course, linear, t, &kriged[t], (&by, &theta), &mut random));
        }
        [tensions, moved, foretold, sounds]
    };
    let mut all = Draws {
        tensions: vec![vec![Vec::new(); m]; frames],
        bones: vec![vec![Vec::new(); bones]; frames],
        hidden: course.frames.iter().map(|f| vec![Vec::new(); f.hidden.len()]).collect(),
        heard: course.frames.iter().map(|f| vec![Vec::new(); f.heard.len()]).collect(),
    };
    for part in parallel::map(&batches, one) {
        for (all, part) in
            [&mut all.tensions, &mut all.bones, &mut all.hidden, &mut all.heard].into_iter().zip(part)
        {
            let pairs = all.iter_mut().zip(part).flat_map(|(a, b)| a.iter_mut().zip(b));
            pairs.for_each(|(a, b)| a.extend(b));
        }
    }
    all
}

/// Draws of the changes of a frame's formants, Hz: by its tensions and displaced bones, and by the shape at rest.
fn sound(
    mode: &Mode<'_, '_>,
    rates: Option<&DMatrix<f64>>,
    by: &DMatrix<f64>,
    theta: &DMatrix<f64>,
) -> Vec<Vec<f32>> {
    let (m, b, k) = (mode.sizes.muscles, mode.sizes.bones, mode.sizes.knots);
    let Some(rates) = rates else { return Vec::new() };
    let mut changes = by.rows(0, m + b).into_owned().resize_vertically(rates.ncols(), 0.0);
    let mut levels = changes.rows_mut(0, m);
    levels += theta.rows(0, m);
    changes.rows_mut(m + b, rates.ncols() - m - b).copy_from(&theta.rows(m + k, rates.ncols() - m - b));
    (rates * changes).row_iter().map(|row| row.iter().map(|v| *v as f32).collect()).collect()
}

/// Draws of the expected distances of a frame's hidden points: the motion of the surface less the expected error there.
fn hidden(
    mode: &Mode<'_, '_>,
    course: &Course,
    linear: &Linear,
    t: usize,
    kriged: &[Kriging],
    (by, theta): (&DMatrix<f64>, &DMatrix<f64>),
    random: &mut fastrand::Rng,
) -> Vec<Vec<f32>> {
    let (m, b, k) = (mode.sizes.muscles, mode.sizes.bones, mode.sizes.knots);
    let Some(at) = course.here[t].linear.as_ref() else {
        return vec![Vec::new(); course.frames[t].hidden.len()];
    };
    // Changes of all unknowns of a frame in a draw: tensions before the link, and displacements.
    let mut x = by.rows(0, m + b).into_owned();
    let mut levels = x.rows_mut(0, m);
    levels += theta.rows(0, m);
    let errors_at = {
        let z = course.here[t].z.rows(m + b, k) + mode.shared.rows(m, k);
        let mut all = by.rows(m + b, k) + theta.rows(m, k);
        all.column_iter_mut().for_each(|mut c| c += &z);
        all
    };
    let mut seen = DMatrix::zeros(at.residuals.len(), x.ncols());
    for (row, o) in course.frames[t].observations.iter().enumerate() {
        let unit = 1e3 / o.weight;
        let rate = at.jacobian.row(row) * &x;
        seen.row_mut(row).copy_from(&(rate.add_scalar(at.residuals[row]) * unit));
    }
    let mut there = &at.hidden_jacobian * &x;
    if let Some(shape) = &linear.by_shape[t] {
        let amounts = theta.rows(m + k, theta.nrows() - m - k);
        seen += &shape.seen * amounts;
        there += &shape.hidden * amounts;
    }
    let one = |(i, kriging): (usize, &Kriging)| {
        let expected = kriging.weights.tr_mul(&seen) + kriging.of_knots.tr_mul(&errors_at);
        let mut value = |d: usize| {
            let error = expected[(0, d)] + kriging.sd_mm * random::normal(random);
            (error - there[(i, d)]) as f32
        };
        (0..x.ncols()).map(&mut value).collect()
    };
    kriged.iter().enumerate().map(one).collect()
}
