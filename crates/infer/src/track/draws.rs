//! Draws of a recording's tensions, a window of frames after another, with the uncertainty of the shape at rest, which is not fitted.
//!
//! The draws of a frame follow from those of the frame after it. All draws of a long recording would need 32 kB a frame, so only the
//! generators of random numbers and the coloured noise at the ends of the windows are kept, and the draws of a window are made where they
//! are needed: once for the means over the recording, once for the results.
//!
//! The problem is linearised once, at the most probable tensions on the placed body. Let `J` be the derivatives by the states `z` of all
//! frames, `D` those by the shared unknowns (`theta`: levels of the muscles, shape at rest, static error), `S` the covariance of the
//! errors and `Q` the precision of the states:
//! ```text
//! A = (J'S^-1 J + Q)^-1 J'S^-1 D        H = P + w sum (D'S^-1 D - D'S^-1 J A)        theta ~ N(-H^-1 g, H^-1)
//! ```
//! Given `theta`, `z` is normal too. Intervals would be too narrow if the most probable shape were searched for together with the
//! tensions of all frames (Neyman and Scott 1948). `w` is less than 1 because the model differs from the recorded tongue.

use std::ops::Range;

use fastrand::Rng;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::eliminate::{Eliminated, WINDOW, windows};
use super::shape::RestShape;
use super::shape_jacobian::ShapeJacobian;
use super::smoother::{SmoothedRecording, Smoother};
use tongue_core::{parallel, random};

/// Draws of a window of frames.
pub(super) struct WindowDraws {
    /// For every frame and muscle the tensions, N per metre of thickness, in the order of the draws.
    pub tensions: Vec<Vec<Vec<f32>>>,
    /// For every frame, the displacements of the bones, in standard deviations.
    pub bones: Vec<Vec<Vec<f32>>>,
    /// For every frame and hidden point, its expected distance from the surface of the most probable shape, mm.
    pub hidden: Vec<Vec<Vec<f32>>>,
    /// For every frame and formant that is told, its change from the most probable one, Hz.
    pub heard: Vec<Vec<Vec<f32>>>,
}

/// Sums or means over frames of every muscle's tension, one number for each draw.
pub(super) struct Means(pub Vec<Vec<f64>>);

impl Means {
    /// Zeros for as many muscles and draws.
    pub fn zeros(other: &Self) -> Self {
        Self(other.0.iter().map(|draws| vec![0.0; draws.len()]).collect())
    }

    pub fn add(&mut self, tensions: &[Vec<f32>]) {
        for (sums, draws) in self.0.iter_mut().zip(tensions) {
            sums.iter_mut().zip(draws).for_each(|(sum, draw)| *sum += f64::from(*draw));
        }
    }
}

/// What the draws of a recording are made of.
pub(super) struct Sampler<'a, 's> {
    pub mode: &'a Smoother<'a, 's>,
    pub course: &'a SmoothedRecording,
    pub linear: &'a Eliminated<'a, 's>,
    pub by_shape: &'a [Option<ShapeJacobian>],
    /// Derivatives of the formants of every frame.
    pub heard: Vec<Option<DMatrix<f64>>>,
    /// Draws of the shared unknowns.
    pub shared: &'a DMatrix<f64>,
    pub number: usize,
}

#[derive(Clone)]
struct DrawBatch {
    number: usize,
    /// The generator at the beginning of every window, and behind all noise, from where hidden points take their numbers.
    generators: Vec<Rng>,
    hidden: Rng,
    /// The coloured noise of the first frame after every window but the last.
    after: Vec<DMatrix<f64>>,
}

impl Sampler<'_, '_> {
    /// The means over the recording, and then the draws of every window of frames, which `take` gets in the order of time.
    pub fn draw(&self, mut take: impl FnMut(Range<usize>, &WindowDraws, &Means)) {
        let frames = self.course.frames.len();
        let windows = windows(frames);
        let numbers: Vec<usize> = (0..self.shared.ncols() / BATCH).collect();
        let mut batches = parallel::map(&numbers, |&number| self.batch(number, &windows));
        let muscles = self.mode.sizes.muscles;
        let mut means = Means(vec![vec![0.0; if frames > 0 { self.shared.ncols() } else { 0 }]; muscles]);
        let mut only = None;
        let mut spare = batches.clone();
        for window in &windows {
            let draws = self.window(window, &mut spare);
            draws.tensions.iter().for_each(|tensions| means.add(tensions));
            only = Some(draws).filter(|_| windows.len() == 1);
        }
        means.0.iter_mut().flatten().for_each(|sum| *sum /= frames as f64);
        for window in windows {
            let draws = only.take().unwrap_or_else(|| self.window(&window, &mut batches));
            take(window, &draws, &means);
        }
    }

    /// The state of a batch of draws before the first window.
    fn batch(&self, number: usize, windows: &[Range<usize>]) -> DrawBatch {
        let seed = random::seed_of(!self.mode.settings.seed, self.number);
        let mut random = Rng::with_seed(random::seed_of(seed, number));
        let mut generators = Vec::with_capacity(windows.len());
        for window in windows {
            generators.push(random.clone());
            // Every normal number takes two uniform ones.
            (0..2 * window.len() * self.mode.sizes.state() * (BATCH / 2)).for_each(|_| {
                random.f64();
            });
        }
        let mut after: Vec<DMatrix<f64>> = Vec::new();
        for (window, generator) in windows.iter().zip(&generators).skip(1).rev() {
            let noise = self.coloured(window, generator.clone(), after.last());
            after.extend(noise.into_iter().next());
        }
        after.reverse();
        DrawBatch { number, generators, hidden: random, after }
    }

    /// The deviations of the states from their middles in a window of frames, of a batch of draws.
    fn coloured(
        &self,
        window: &Range<usize>,
        mut random: Rng,
        after: Option<&DMatrix<f64>>,
    ) -> Vec<DMatrix<f64>> {
        let n = self.mode.sizes.state();
        let mut noise: Vec<DMatrix<f64>> = Vec::from_iter(window.clone().map(|_| {
            let mut half = DMatrix::from_fn(n, BATCH / 2, |_, _| random::normal(&mut random));
            half = half.resize_horizontally(BATCH, 0.0);
            let mirrored = -half.columns(0, BATCH / 2).into_owned();
            half.columns_mut(BATCH / 2, BATCH / 2).copy_from(&mirrored);
            half
        }));
        self.linear.factors.colour(&mut noise, window.start, after);
        noise
    }

    fn window(&self, window: &Range<usize>, batches: &mut [DrawBatch]) -> WindowDraws {
        let Self { mode, course, .. } = self;
        let (m, bones, link) = (mode.sizes.muscles, mode.sizes.bones, mode.settings.link);
        let errors_at: Vec<Vec<(DVector<f64>, f64)>> = Vec::from_iter(
            window.clone().map(|t| course.frames[t].hidden.iter().map(|h| mode.knots.at(&h.along)).collect()),
        );
        let linear = self.linear.window(window);
        let nth = window.start / WINDOW;
        let mut all = WindowDraws {
            tensions: vec![vec![Vec::with_capacity(self.shared.ncols()); m]; window.len()],
            bones: vec![vec![Vec::new(); bones]; window.len()],
            hidden: course.frames[window.clone()].iter().map(|f| vec![Vec::new(); f.hidden.len()]).collect(),
            heard: course.frames[window.clone()].iter().map(|f| vec![Vec::new(); f.formants.len()]).collect(),
        };
        let parts = parallel::map(&*batches, |batch| {
            let noise = self.coloured(window, batch.generators[nth].clone(), batch.after.get(nth));
            let mut random = batch.hidden.clone();
            let theta = self.shared.columns(batch.number * BATCH, BATCH).into_owned();
            let mut tensions = Vec::with_capacity(noise.len());
            let (mut moved, mut predicted) =
                (Vec::with_capacity(noise.len()), Vec::with_capacity(noise.len()));
            let mut sounds = Vec::with_capacity(noise.len());
            for ((i, t), noise) in window.clone().enumerate().zip(noise) {
                let step = &self.linear.steps[t];
                let mut by = noise - &linear.answers[i] * &theta;
                by.column_iter_mut().for_each(|mut c| c -= step.column(0));
                let x = mode.unknowns(&course.here[t].z, &mode.shared);
                let value = |i: usize, d: usize| (link.tension(x[i] + theta[(i, d)] + by[(i, d)]).0) as f32;
                tensions.push((0..m).map(|i| (0..BATCH).map(|d| value(i, d)).collect()).collect());
                let of_bones =
                    (0..bones).map(|i| (0..BATCH).map(|d| (x[m + i] + by[(m + i, d)]) as f32).collect());
                moved.push(of_bones.collect());
                sounds.push(sound(mode, self.heard[t].as_ref(), &by, &theta));
                let by_shape = self.by_shape[t].as_ref();
                predicted.push(hidden(mode, course, by_shape, t, &errors_at[i], (&by, &theta), &mut random));
            }
            ([tensions, moved, predicted, sounds], random)
        });
        for ((part, random), batch) in parts.into_iter().zip(batches) {
            batch.hidden = random;
            for (all, part) in
                [&mut all.tensions, &mut all.bones, &mut all.hidden, &mut all.heard].into_iter().zip(part)
            {
                let pairs = all
                    .iter_mut()
                    .zip(part)
                    .flat_map(|(a, b): (&mut Vec<Vec<f32>>, Vec<Vec<f32>>)| a.iter_mut().zip(b));
                pairs.for_each(|(a, b)| a.extend(b));
            }
        }
        all
    }
}

/// Draws of the changes of a frame's formants, Hz: by its tensions and displaced bones, and by the shape at rest.
fn sound(
    mode: &Smoother<'_, '_>,
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
    mode: &Smoother<'_, '_>,
    course: &SmoothedRecording,
    by_shape: Option<&ShapeJacobian>,
    t: usize,
    errors: &[(DVector<f64>, f64)],
    (by, theta): (&DMatrix<f64>, &DMatrix<f64>),
    random: &mut Rng,
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
    let mut there = &at.hidden_jacobian * &x;
    if let Some(shape) = by_shape {
        there += &shape.hidden * theta.rows(m + k, theta.nrows() - m - k);
    }
    Vec::from_iter(errors.iter().enumerate().map(|(i, (basis, sd_mm))| {
        let expected = basis.tr_mul(&errors_at);
        (0..x.ncols())
            .map(&mut |d| {
                let error = expected[(0, d)] + sd_mm * random::normal(random);
                (error - there[(i, d)]) as f32
            })
            .collect()
    }))
}

/// Largest number of frames whose information about levels and shape is counted in full; more frames together count as this many, because
/// more frames do not make the model more like a tongue. If every frame counted, the step to the most probable shape of some hundred frames
/// would be far longer than the range in which its linearisation holds.
const MOST_FRAMES: usize = 120;
/// Number of draws made at once; the second half of them mirrors the first.
pub(super) const BATCH: usize = 50;

/// Draws of the shared unknowns relative to the mode, one column each, from all recordings; `None` where the covariances cannot be
/// factorised.
pub(super) fn draws(
    mode: &Smoother<'_, '_>,
    courses: &[SmoothedRecording],
    linear: &[Eliminated<'_, '_>],
    shape: Option<&RestShape>,
) -> Option<DMatrix<f64>> {
    let frames = courses.iter().map(SmoothedRecording::count).sum();
    SharedPosterior::of(mode, (linear, frames), shape)?.draws(mode)
}

/// Information about the shared unknowns (levels, static error, shape) from the frames and the prior.
struct SharedPosterior {
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

impl SharedPosterior {
    /// From linearised recordings with data in so many frames.
    fn of(
        mode: &Smoother<'_, '_>,
        (linear, frames): (&[Eliminated<'_, '_>], usize),
        shape: Option<&RestShape>,
    ) -> Option<Self> {
        let (m, k, s) = (mode.sizes.muscles, mode.sizes.knots, shape.map_or(0, RestShape::count));
        let all = m + k + s;
        let mut curvature = DMatrix::zeros(all, all);
        let mut gradient = DVector::zeros(all);
        for one in linear {
            curvature += &one.curvature;
            gradient += &one.gradient;
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
    fn draws(&self, mode: &Smoother<'_, '_>) -> Option<DMatrix<f64>> {
        let Self { curvature, gradient, prior, pull, factor, middle } = self;
        let (m, k, all) = (mode.sizes.muscles, mode.sizes.knots, middle.len());
        // Given levels and shape, the static error is drawn again with the full weight of the frames.
        let of_error = (curvature.view((m, m), (k, k)) + prior.view((m, m), (k, k))).into_owned();
        let error = if k > 0 { Some(((&of_error + of_error.transpose()) * 0.5).cholesky()?) } else { None };
        let batches = mode.settings.draws.div_ceil(BATCH).max(1);
        let mut out = DMatrix::zeros(all, batches * BATCH);
        for batch in 0..batches {
            let mut random = Rng::with_seed(random::seed_of(mode.settings.seed, batch));
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
