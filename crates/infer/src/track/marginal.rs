//! 95 % intervals of each tension by itself.
//!
//! At the smoothed scores the posterior is not normal even where the body answers to tensions in straight lines: a tension cannot be
//! negative, so a muscle that may be slack has a score with a long tail. So every frame's posterior is sampled: the frames around
//! it say of its scores what they say in the smoother, a normal distribution; the frame itself is taken as linear in tensions, not in
//! scores, so that no equilibrium is solved. Hamiltonian Monte Carlo (Neal 2011) in the coordinates in which the normal approximation
//! is round. All frames share one set of random numbers, so that intervals do not jump from frame to frame.
//!
//! Both approximations are a little narrow, each in its own places (the normal one where a muscle may be slack, the sampled one where
//! the frames around do not have normal posteriors), so an interval reaches to the farther of the two ends. How often such
//! intervals hold the truth is measured by a test on simulated recordings.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use tongue_core::random;

use super::frame::Linear;
use super::scores;

/// Draws that count, and those before them.
const DRAWS: usize = 400;
const BURN_IN: usize = 20;
/// Length of a leapfrog step in standard deviations of the normal approximation, and the steps of a draw.
const STRIDE: f64 = 0.4;
const STRIDES: std::ops::Range<usize> = 3..8;
/// Half width of the 95 % interval of a normal distribution in standard deviations.
const TWO_SIDED_95: f64 = 1.959_963_984_540_054;
/// Steps of the table of tensions by score.
const STEP: f64 = 0.01;

/// Lower and upper ends of the 95 % intervals of scores, whose most probable values are `x`, with the covariance of the smoother.
/// The first `muscles` of them are of tensions, the others displacements. `linear` is the frame there; without one nothing was seen in
/// it, and the normal distribution is exact.
pub(super) fn intervals(
    x: &DVector<f64>,
    covariance: &DMatrix<f64>,
    linear: Option<&Linear>,
    muscles: usize,
) -> (Vec<f64>, Vec<f64>) {
    let sd = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    let normal = x.iter().zip(sd.iter()).map(|(g, sd)| (g - TWO_SIDED_95 * sd, g + TWO_SIDED_95 * sd));
    match linear.and_then(|linear| sampled(x, covariance, linear, muscles)) {
        Some(other) => normal.zip(other).map(|(a, b)| (a.0.min(b.0), a.1.max(b.1))).unzip(),
        None => normal.unzip(),
    }
}

/// The ends that draws of the frame's posterior give.
fn sampled(
    x: &DVector<f64>,
    covariance: &DMatrix<f64>,
    linear: &Linear,
    muscles: usize,
) -> Option<Vec<(f64, f64)>> {
    let draws = Posterior::new(x, covariance, linear, muscles)?.sample();
    let quantile = |values: &[f64], part: f64| {
        let at = part * values.len() as f64 - 0.5;
        let below = (at as usize).min(values.len() - 2);
        values[below] + (at - below as f64) * (values[below + 1] - values[below])
    };
    let ends = (0..x.len()).map(|i| {
        let mut values: Vec<f64> = draws.iter().skip(i).step_by(x.len()).copied().collect();
        values.sort_by(f64::total_cmp);
        (quantile(&values, 0.025), quantile(&values, 0.975))
    });
    Some(ends.collect())
}

/// The posterior of a frame's scores, `- ln p = 1/2 dF H dF + b dF + 1/2 (dx - m) P (dx - m)` with `dx` the step of the scores from
/// the most probable ones and `dF` that of the tensions and displacements over their scales.
struct Posterior {
    n: usize,
    /// How many of the scores are of tensions: the first ones.
    muscles: usize,
    x: Vec<f64>,
    here: Vec<f64>,
    /// Matrices row by row.
    by_tension: Vec<f64>,
    pull: Vec<f64>,
    others: Vec<f64>,
    balance: Vec<f64>,
    /// Of the covariance: `dx = L z`.
    factor: Vec<f64>,
    // Scratch.
    step: Vec<f64>,
    more: Vec<f64>,
    slope: Vec<f64>,
    force: Vec<f64>,
}

impl Posterior {
    fn new(x: &DVector<f64>, covariance: &DMatrix<f64>, linear: &Linear, muscles: usize) -> Option<Self> {
        let n = x.len();
        let factor = covariance.clone().cholesky()?;
        // What all but this frame says: the precision that is left, and the mean at which both balance at `x`.
        let (j, r) = (&linear.jacobian, &linear.residuals);
        let (curvature, gradient) = (j.tr_mul(j), j.tr_mul(r));
        let others = factor.inverse() - &curvature;
        let others = (&others + others.transpose()) * 0.5;
        let balance = others.clone().cholesky()?.solve(&gradient);
        let (here, slopes): (Vec<f64>, Vec<f64>) =
            x.iter().enumerate().map(|(i, g)| scores::value(*g, i < muscles)).unzip();
        let rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
        let by_tension = DMatrix::from_fn(n, n, |a, b| curvature[(a, b)] / (slopes[a] * slopes[b]));
        let finite = by_tension.iter().all(|v| v.is_finite());
        (finite && n <= MOST).then(|| Self {
            n,
            muscles,
            x: x.iter().copied().collect(),
            here,
            by_tension: rows(&by_tension),
            pull: gradient.iter().zip(&slopes).map(|(g, s)| g / s).collect(),
            others: rows(&others),
            balance: balance.iter().copied().collect(),
            factor: rows(&factor.l()),
            step: vec![0.0; n],
            more: vec![0.0; n],
            slope: vec![0.0; n],
            force: vec![0.0; n],
        })
    }

    /// `- ln p` at `z`, whose derivative is left in `force`.
    fn energy(&mut self, z: &[f64]) -> f64 {
        let n = self.n;
        for i in 0..n {
            self.step[i] = self.factor[i * n..=i * n + i].iter().zip(z).map(|(l, z)| l * z).sum();
            let score = self.x[i] + self.step[i];
            let (value, slope) = if i < self.muscles { tabled(score) } else { (score, 1.0) };
            (self.more[i], self.slope[i]) = (value - self.here[i], slope);
        }
        let mut energy = 0.0;
        let mut by_score = [0.0; MOST];
        for (i, by_score) in by_score.iter_mut().enumerate().take(n) {
            let (mut bent, mut held) = (0.0, 0.0);
            for k in 0..n {
                bent += self.by_tension[i * n + k] * self.more[k];
                held += self.others[i * n + k] * (self.step[k] - self.balance[k]);
            }
            energy +=
                self.more[i] * (0.5 * bent + self.pull[i]) + 0.5 * held * (self.step[i] - self.balance[i]);
            *by_score = self.slope[i] * (bent + self.pull[i]) + held;
        }
        for k in 0..n {
            self.force[k] = (k..n).map(|i| self.factor[i * n + k] * by_score[i]).sum();
        }
        energy
    }

    /// Scores, one draw after the other.
    fn sample(&mut self) -> Vec<f64> {
        let n = self.n;
        let mut rng = fastrand::Rng::with_seed(95);
        let mut normal = move || (random::normal(&mut rng), rng.f64(), rng.usize(STRIDES));
        let mut out = Vec::with_capacity(DRAWS * n);
        let mut z = vec![0.0; n];
        let mut energy = self.energy(&z);
        let mut pull = self.force.clone();
        let (mut next, mut momentum) = (z.clone(), vec![0.0; n]);
        for draw in 0..BURN_IN + DRAWS {
            let (_, chance, strides) = normal();
            momentum.iter_mut().for_each(|p| *p = normal().0);
            let stride = STRIDE * (0.7 + 0.6 * normal().1);
            let kinetic = |p: &[f64]| 0.5 * p.iter().map(|p| p * p).sum::<f64>();
            let before = energy + kinetic(&momentum);
            next.copy_from_slice(&z);
            self.force.copy_from_slice(&pull);
            let mut there = energy;
            for _ in 0..strides {
                momentum.iter_mut().zip(&self.force).for_each(|(p, f)| *p -= 0.5 * stride * f);
                next.iter_mut().zip(&momentum).for_each(|(z, p)| *z += stride * p);
                there = self.energy(&next);
                momentum.iter_mut().zip(&self.force).for_each(|(p, f)| *p -= 0.5 * stride * f);
            }
            if chance.ln() < before - there - kinetic(&momentum) {
                z.copy_from_slice(&next);
                energy = there;
                pull.copy_from_slice(&self.force);
            }
            if draw >= BURN_IN {
                // The step belongs to the last candidate, so it is made anew.
                out.extend((0..n).map(|i| {
                    self.x[i] + self.factor[i * n..=i * n + i].iter().zip(&z).map(|(l, z)| l * z).sum::<f64>()
                }));
            }
        }
        out
    }
}

/// Most scores of a posterior that is sampled.
const MOST: usize = 32;

/// [`scores::tension`] by a table, to 1e-5.
fn tabled(score: f64) -> (f64, f64) {
    static TABLE: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let count = ((scores::HIGHEST - scores::LOWEST) / STEP).ceil() as usize + 2;
        (0..count).map(|i| scores::tension(scores::LOWEST + STEP * i as f64)).collect()
    });
    let at = (score.clamp(scores::LOWEST, scores::HIGHEST) - scores::LOWEST) / STEP;
    let (below, part) = (at as usize, at.fract());
    let ((t0, s0), (t1, s1)) = (table[below], table[below + 1]);
    (t0 * (1.0 - part) + t1 * part, s0 * (1.0 - part) + s1 * part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_muscle_s_interval_is_that_of_the_whole_posterior() {
        // A tension over its scale of 0.15 ± 0.2: half-normal prior, normal measurement.
        let (measured, sd) = (0.15, 0.2);
        let density = |g: f64| {
            let r = (scores::tension(g).0 - measured) / sd;
            (-0.5 * (r * r + g * g)).exp()
        };
        let grid: Vec<f64> = (0..9000).map(|i| -4.5 + 1e-3 * f64::from(i)).collect();
        let all: f64 = grid.iter().map(|g| density(*g)).sum();
        let quantile = |p: f64| {
            let mut sum = 0.0;
            *grid
                .iter()
                .find(|g| {
                    sum += density(**g);
                    sum >= p * all
                })
                .unwrap()
        };
        let best = grid.iter().copied().max_by(|a, b| density(*a).total_cmp(&density(*b))).unwrap();
        let (z, slope) = scores::tension(best);
        let linear = Linear {
            residuals: DVector::from_element(1, (z - measured) / sd),
            jacobian: DMatrix::from_element(1, 1, slope / sd),
            positions: Vec::new(),
        };
        let covariance = DMatrix::from_element(1, 1, 1.0 / (1.0 + (slope / sd).powi(2)));
        let ends = sampled(&DVector::from_element(1, best), &covariance, &linear, 1).unwrap();
        let (low, high) = (vec![ends[0].0], vec![ends[0].1]);
        assert!((low[0] - quantile(0.025)).abs() < 0.3, "{} {}", low[0], quantile(0.025));
        assert!((high[0] - quantile(0.975)).abs() < 0.15, "{} {}", high[0], quantile(0.975));
        let normal = best - TWO_SIDED_95 * covariance[(0, 0)].sqrt();
        assert!(
            (low[0] - quantile(0.025)).abs() < (normal - quantile(0.025)).abs(),
            "better than the normal one"
        );
    }

    #[test]
    fn the_table_is_the_function() {
        for i in 0..990 {
            let g = scores::LOWEST + 0.01003 * f64::from(i);
            let (table, function) = (tabled(g), scores::tension(g));
            assert!((table.0 - function.0).abs() < 2e-5 && (table.1 - function.1).abs() < 2e-5, "{g}");
        }
    }
}
