//! Draws of a recording's tensions, window by window, with the uncertainty of the shape at rest, which is not fitted.
//!
//! The draws of a frame follow from those of the frame after it. All draws of a long recording would need 32 kB for each frame, so only the
//! states of the random generators and the coloured noise at the ends of windows are kept, and a window is drawn twice: for the means over
//! the recording, and for the results.
//!
//! The problem is linearised at the most probable tensions on the placed body. With `J` the derivatives by the states `z` of all frames,
//! `D` those by the shared unknowns `theta` (levels, static error, shape at rest), `S` the covariance of the errors and `Q` the precision
//! of the states:
//! ```text
//! A = (J'S^-1 J + Q)^-1 J'S^-1 D        H = P + w sum (D'S^-1 D - D'S^-1 J A)        theta ~ N(-H^-1 g, H^-1)
//! ```
//! Given `theta`, `z` is normal too. If shape and tensions of all frames were maximised together, intervals would be too narrow (Neyman and
//! Scott 1948). `w` is less than 1 because the model differs from the recorded tongue.

use std::ops::Range;

use fastrand::Rng;
use nalgebra::{DMatrix, DVector, stack};

use crate::least_squares::symmetric_cholesky;

use super::eliminate::{Eliminated, LinearProblem, WINDOW, windows};
use super::interval::{Interval, interval};
use super::ornstein_uhlenbeck::Softplus;
use super::smoother::Smoother;
use tongue_core::statistics::mean_and_variance;
use tongue_core::{parallel, random};

/// Draws of a frame; each list runs over the draws.
pub(super) struct FrameDraws {
    /// Tension of every muscle, N per metre of thickness.
    pub tensions: Vec<Vec<f32>>,
    /// Intervals of the tensions, none of which is wider than the prior.
    pub intervals: Vec<Interval>,
    /// Displacements of the bones, in standard deviations; none varies more than its prior.
    pub bones: Vec<Vec<f32>>,
    /// Difference of every formant from the most probable one, Hz; empty without derivatives.
    pub formants: Vec<Vec<f32>>,
}

/// A batch of draws of a frame; a row runs over the draws.
struct DrawnFrame {
    /// Tension of every muscle before the transform.
    tensions: DMatrix<f64>,
    bones: DMatrix<f64>,
    /// Changes of the formants, Hz; without rows if there are no derivatives.
    formants: DMatrix<f64>,
}

impl FrameDraws {
    fn of(batches: &[&DrawnFrame], link: &Softplus) -> Self {
        let rows = |of: fn(&DrawnFrame) -> &DMatrix<f64>| -> Vec<Vec<f64>> {
            let count = of(batches[0]).nrows();
            let row =
                |i| batches.iter().flat_map(|b| of(b).row(i).iter().copied().collect::<Vec<_>>()).collect();
            (0..count).map(row).collect()
        };
        let tensions = |h: Vec<f64>| in_single_precision(h.into_iter().map(|h| link.tension(h).0));
        let each = rows(|b| &b.tensions).into_iter().map(|h| {
            let narrower = no_wider_than(link.prior_sd(), &h).map(tensions);
            let all = tensions(h);
            let interval = interval(narrower.as_ref().unwrap_or(&all)).or_slack(link);
            (all, interval)
        });
        let (tensions, intervals) = each.unzip();
        let bones = rows(|b| &b.bones).into_iter().map(|b| no_wider_than(1.0, &b).unwrap_or(b));
        let [bones, formants] = [bones.collect(), rows(|b| &b.formants)]
            .map(|all: Vec<_>| all.into_iter().map(in_single_precision).collect());
        Self { tensions, intervals, bones, formants }
    }
}

fn in_single_precision(values: impl IntoIterator<Item = f64>) -> Vec<f32> {
    values.into_iter().map(|v| v as f32).collect()
}

/// The values, brought nearer to their mean, so that they have this standard deviation; `None` where theirs is not larger. Data cannot make
/// a tension or a displacement less certain than its prior, but the linear response to a shape that is hardly known is too large.
fn no_wider_than(sd: f64, values: &[f64]) -> Option<Vec<f64>> {
    let (mean, variance) = mean_and_variance(values.iter().copied());
    let part = sd / variance.sqrt();
    (part < 1.0).then(|| values.iter().map(|value| mean + part * (value - mean)).collect())
}

/// Sums or means over frames of every muscle's tension, for each draw.
pub(super) struct Means(pub Vec<Vec<f64>>);

impl Means {
    pub fn zeros(other: &Self) -> Self {
        Self(other.0.iter().map(|draws| vec![0.0; draws.len()]).collect())
    }

    pub fn add(&mut self, tensions: &[Vec<f32>]) {
        for (sums, draws) in self.0.iter_mut().zip(tensions) {
            sums.iter_mut().zip(draws).for_each(|(sum, draw)| *sum += f64::from(*draw));
        }
    }
}

pub(super) struct Sampler<'a> {
    pub linear: &'a Eliminated<'a>,
    pub formant_jacobians: Vec<Option<DMatrix<f64>>>,
    pub shared: &'a DMatrix<f64>,
    pub number: usize,
}

struct DrawBatch {
    number: usize,
    /// The generator at the beginning of every window.
    generators: Vec<Rng>,
    /// Coloured noise of the first frame after every window but the last.
    after: Vec<DMatrix<f64>>,
}

impl Sampler<'_> {
    /// Computes the means over the recording, and then the draws of every window in order of time for `take`.
    pub fn draw(&self, mut take: impl FnMut(Range<usize>, &[FrameDraws], &Means)) {
        let frames = self.linear.problem.recording.frames.len();
        let windows = windows(frames);
        let numbers: Vec<usize> = (0..self.shared.ncols() / BATCH).collect();
        let batches = parallel::map(&numbers, |&number| self.batch(number, &windows));
        let muscles = self.linear.problem.smoother.sizes.muscles;
        let mut means = Means(vec![vec![0.0; if frames > 0 { self.shared.ncols() } else { 0 }]; muscles]);
        let mut only = None;
        for window in &windows {
            let draws = self.window(window, &batches);
            draws.iter().for_each(|draws| means.add(&draws.tensions));
            only = Some(draws).filter(|_| windows.len() == 1);
        }
        means.0.iter_mut().flatten().for_each(|sum| *sum /= frames as f64);
        for window in windows {
            let draws = only.take().unwrap_or_else(|| self.window(&window, &batches));
            take(window, &draws, &means);
        }
    }

    fn batch(&self, number: usize, windows: &[Range<usize>]) -> DrawBatch {
        let seed = random::seed_of(!self.linear.problem.smoother.settings.seed, self.number);
        let mut random = Rng::with_seed(random::seed_of(seed, number));
        let mut generators = Vec::with_capacity(windows.len());
        for window in windows {
            generators.push(random.clone());
            // Every normal number takes two uniform ones.
            (0..2 * window.len() * self.linear.problem.smoother.sizes.state() * (BATCH / 2)).for_each(|_| {
                random.f64();
            });
        }
        let mut after: Vec<DMatrix<f64>> = Vec::new();
        for (window, generator) in windows.iter().zip(&generators).skip(1).rev() {
            let noise = self.coloured(window, generator.clone(), after.last());
            after.extend(noise.into_iter().next());
        }
        after.reverse();
        DrawBatch { number, generators, after }
    }

    /// Deviations of the states in a window from their means, for a batch of draws.
    fn coloured(
        &self,
        window: &Range<usize>,
        mut random: Rng,
        after: Option<&DMatrix<f64>>,
    ) -> Vec<DMatrix<f64>> {
        let n = self.linear.problem.smoother.sizes.state();
        let mut noise: Vec<DMatrix<f64>> = Vec::from_iter(window.clone().map(|_| {
            let half = DMatrix::from_fn(n, BATCH / 2, |_, _| random::normal(&mut random));
            stack![half, -&half]
        }));
        self.linear.factors.colour(&mut noise, window.start, after);
        noise
    }

    fn window(&self, window: &Range<usize>, batches: &[DrawBatch]) -> Vec<FrameDraws> {
        let LinearProblem { smoother, recording, .. } = self.linear.problem;
        let (m, bones, link) = (smoother.sizes.muscles, smoother.sizes.bones, smoother.settings.link);
        let linear = self.linear.window(window);
        let nth = window.start / WINDOW;
        let drawn: Vec<Vec<DrawnFrame>> = parallel::map(batches, |batch| {
            let noise = self.coloured(window, batch.generators[nth].clone(), batch.after.get(nth));
            let theta = self.shared.columns(batch.number * BATCH, BATCH).into_owned();
            let frames = window.clone().enumerate().zip(noise).map(|((i, t), noise)| {
                let step = &self.linear.steps[t];
                let mut by = noise - &linear.responses[i] * &theta;
                by.column_iter_mut().for_each(|mut c| c -= step.column(0));
                // Changes of all unknowns of the equilibrium: tensions before the transform, and displacements.
                let mut changes = by.rows(0, m + bones).into_owned();
                let mut levels = changes.rows_mut(0, m);
                levels += theta.rows(0, m);
                let x = smoother.unknowns_of(recording, t);
                DrawnFrame {
                    tensions: DMatrix::from_fn(m, BATCH, |i, d| x[i] + theta[(i, d)] + by[(i, d)]),
                    bones: DMatrix::from_fn(bones, BATCH, |i, d| x[m + i] + by[(m + i, d)]),
                    formants: self.formants(t, &changes, &theta),
                }
            });
            frames.collect()
        });
        let frames: Vec<usize> = (0..drawn.first().map_or(0, Vec::len)).collect();
        parallel::map(&frames, |&i| {
            FrameDraws::of(&drawn.iter().map(|batch| &batch[i]).collect::<Vec<_>>(), &link)
        })
    }

    /// Draws of the changes of a frame's formants, Hz; without rows if there are no derivatives.
    fn formants(&self, t: usize, changes: &DMatrix<f64>, theta: &DMatrix<f64>) -> DMatrix<f64> {
        let Some(rates) = &self.formant_jacobians[t] else { return DMatrix::zeros(0, BATCH) };
        rates * stack![*changes; theta.rows_range(self.linear.problem.smoother.sizes.shared()..)]
    }
}

/// Weight of the frames' information about levels and shape, which would be 1 for an exact model. Other speakers' bodies differ in more
/// ways than the shape has directions, and these differences look like levels: with a weight of 0.5 the intervals hold 78 % of half-normal
/// levels, with this one 93 %.
const TRUST: f64 = 0.01;
/// Largest number of frames whose information about levels and shape is counted; more count as this many, because they do not make the
/// model more accurate. Otherwise the step to the most probable shape of some hundred frames would leave the range of the linearisation.
const MOST_FRAMES: usize = 120;
/// Number of draws made at once; the second half mirrors the first.
pub(super) const BATCH: usize = 50;

/// Draws of the shared unknowns (levels, static error, shape) relative to the mode, one column each; `None` if a
/// covariance cannot be factorised.
pub(super) fn draws(smoother: &Smoother<'_>, linear: &[Eliminated<'_>]) -> Option<DMatrix<f64>> {
    let (m, k) = (smoother.sizes.muscles, smoother.sizes.knots);
    let (prior, pull) = smoother.shared_prior(smoother.context.shape.map(|shape| (shape, 1.0, 0.0)));
    let all = pull.len();
    // The information of the frames, with full weight.
    let (mut curvature, mut gradient) = (DMatrix::zeros(all, all), DVector::zeros(all));
    for one in linear {
        curvature += &one.curvature;
        gradient += &one.gradient;
    }
    // The static error is an error, so its prior has the reduced weight too when the shape is estimated.
    let frames: usize = linear.iter().map(|one| one.problem.recording.count()).sum();
    let of_frames = TRUST * (MOST_FRAMES as f64 / frames.max(1) as f64).min(1.0);
    let weight = |i: usize| if (m..m + k).contains(&i) { TRUST } else { 1.0 };
    let weighed = DMatrix::from_fn(all, all, |i, j| prior[(i, j)] * (weight(i) * weight(j)).sqrt());
    let factor = symmetric_cholesky(&(weighed + &curvature * of_frames))?;
    // Most probable values, relative to the mode.
    let middle = -factor.solve(&(DVector::from_fn(all, |i, _| pull[i] * weight(i)) + &gradient * of_frames));
    // For each draw of levels and shape the static error is drawn anew, with the full weight of the frames.
    let of_error = (curvature.view((m, m), (k, k)) + prior.view((m, m), (k, k))).into_owned();
    let error = symmetric_cholesky(&of_error)?;
    let batches = smoother.settings.draws.div_ceil(BATCH).max(1);
    let mut out = DMatrix::zeros(all, batches * BATCH);
    for batch in 0..batches {
        let mut random = Rng::with_seed(random::seed_of(smoother.settings.seed, batch));
        for draw in 0..BATCH / 2 {
            let mut by = random::normals(all, &mut random);
            factor.l_dirty().tr_solve_lower_triangular_mut(&mut by);
            let mut by_error = random::normals(k, &mut random);
            error.l_dirty().tr_solve_lower_triangular_mut(&mut by_error);
            for (half, sign) in [(0, 1.0), (BATCH / 2, -1.0)] {
                let mut theta = &middle + &by * sign;
                theta.rows_mut(m, k).fill(0.0);
                let pulled = &curvature * &theta + &gradient + &pull;
                let at = -error.solve(&pulled.rows(m, k).into_owned()) + &by_error * sign;
                theta.rows_mut(m, k).copy_from(&at);
                out.column_mut(batch * BATCH + half + draw).copy_from(&theta);
            }
        }
    }
    Some(out)
}
