//! The smoother: scores of all frames at once, with a prior on each and on how they go on from frame to frame.
//!
//! Prior: a stationary process of Ornstein and Uhlenbeck around `mean` with covariance `C` and memory `tau`,
//! `x_0 ~ N(mean, C)`, `x_(t+1) - mean = rho (x_t - mean) + e`, `e ~ N(0, (1 - rho²) C)`, `rho = exp(-dt / tau)`. Its precision
//! couples neighbours only, so the normal equations are block tridiagonal (Rauch, Tung and Striebel 1965 in the form of information).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What is assumed of the scores of all muscles before anything is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Scale of the half-normal tensions, N per metre of thickness.
    pub scale_n: f64,
    /// Mean of the scores.
    pub mean: DVector<f64>,
    /// Covariance of the scores.
    pub covariance: DMatrix<f64>,
    /// Time over which a score is remembered, s; 0: every frame by itself.
    pub memory_s: f64,
}

/// Frames that follow each other faster than this part of the memory count as so far apart: else their sum has no digits left.
const NEAREST: f64 = 1e-4;

impl Prior {
    /// Independent half-normal tensions of one scale.
    pub fn half_normal(muscles: usize, scale_n: f64, memory_s: f64) -> Self {
        Self {
            scale_n,
            mean: DVector::zeros(muscles),
            covariance: DMatrix::identity(muscles, muscles),
            memory_s,
        }
    }

    /// With so many displacements of bones (over their standard deviation) behind the scores of tensions, independent of all.
    pub(super) fn with_displacements(&self, count: usize) -> Self {
        let n = self.mean.len();
        let mut covariance = self.covariance.clone().resize(n + count, n + count, 0.0);
        (n..n + count).for_each(|i| covariance[(i, i)] = 1.0);
        Self { mean: self.mean.clone().resize_vertically(n + count, 0.0), covariance, ..self.clone() }
    }

    /// The inverse of the covariance.
    pub(crate) fn precision(&self) -> DMatrix<f64> {
        let n = self.mean.len();
        Cholesky::new(self.covariance.clone()).map_or_else(|| DMatrix::identity(n, n), |c| c.inverse())
    }

    /// Correlation of scores `dt` (s) apart.
    fn kept(&self, dt: f64) -> f64 {
        if self.memory_s > 0.0 { (-(dt / self.memory_s).max(NEAREST)).exp() } else { 0.0 }
    }
}

/// The prior of a chain of frames as its precision.
pub(super) struct Chain {
    precision: DMatrix<f64>,
    mean: DVector<f64>,
    /// Of every frame by how much the precision on its diagonal block is multiplied.
    diagonal: Vec<f64>,
    /// Of every frame but the last, by how much minus that of the block beside it.
    beside: Vec<f64>,
}

/// A step of every frame's scores, and their covariances.
pub(super) type Solved = (Vec<DVector<f64>>, Vec<DMatrix<f64>>);

impl Chain {
    pub fn new(prior: &Prior, times: &[f64]) -> Self {
        let mut diagonal = vec![1.0; times.len()];
        let mut beside = Vec::with_capacity(times.len().saturating_sub(1));
        for (t, pair) in times.windows(2).enumerate() {
            let kept = prior.kept(pair[1] - pair[0]);
            let left = 1.0 / (1.0 - kept * kept);
            diagonal[t] += kept * kept * left;
            diagonal[t + 1] = left;
            beside.push(kept * left);
        }
        Self { precision: prior.precision(), mean: prior.mean.clone(), diagonal, beside }
    }

    /// `(x - mean)ᵀ Q (x - mean)`.
    pub fn cost(&self, x: &[DVector<f64>]) -> f64 {
        let away: Vec<DVector<f64>> = x.iter().map(|x| x - &self.mean).collect();
        let images: Vec<DVector<f64>> = away.iter().map(|a| &self.precision * a).collect();
        let own: f64 = (0..x.len()).map(|t| self.diagonal[t] * away[t].dot(&images[t])).sum();
        let pairs: f64 = (0..self.beside.len()).map(|t| self.beside[t] * away[t].dot(&images[t + 1])).sum();
        own - 2.0 * pairs
    }

    /// The step to the minimum of the linearised cost: of every frame `curvature` is `JᵀJ` and `gradient` `Jᵀr` at `x`; and the
    /// covariance of every frame's scores there. `None` where rounding left no positive definite matrix.
    pub fn solve(
        &self,
        x: &[DVector<f64>],
        curvature: &[DMatrix<f64>],
        gradient: &[DVector<f64>],
        damping: f64,
    ) -> Option<Solved> {
        let (frames, n) = (x.len(), self.mean.len());
        let away: Vec<DVector<f64>> = x.iter().map(|x| &self.precision * (x - &self.mean)).collect();
        // Forwards: what the frames before leave of each block.
        let mut factors: Vec<Cholesky<f64, Dyn>> = Vec::with_capacity(frames);
        let mut rights: Vec<DVector<f64>> = Vec::with_capacity(frames);
        for t in 0..frames {
            let mut block = &self.precision * self.diagonal[t] + &curvature[t];
            for i in 0..n {
                block[(i, i)] += damping;
            }
            let mut right = -&gradient[t] - &away[t] * self.diagonal[t];
            if t > 0 {
                right += &away[t - 1] * self.beside[t - 1];
                let before = &self.precision * self.beside[t - 1];
                block -= &before * factors[t - 1].solve(&before);
                right += &before * factors[t - 1].solve(&rights[t - 1]);
            }
            if t + 1 < frames {
                right += &away[t + 1] * self.beside[t];
            }
            // Rounding must not make it lopsided.
            let block = (&block + block.transpose()) * 0.5;
            factors.push(Cholesky::new(block)?);
            rights.push(right);
        }
        // Backwards: the step, and the diagonal blocks of the inverse (Takahashi 1973).
        let mut steps = vec![DVector::zeros(n); frames];
        let mut covariances = vec![DMatrix::zeros(n, n); frames];
        for t in (0..frames).rev() {
            let mut right = rights[t].clone();
            let mut covariance = factors[t].inverse();
            if t + 1 < frames {
                let after = &self.precision * self.beside[t];
                right += &after * &steps[t + 1];
                let gain = factors[t].solve(&after);
                covariance += &gain * &covariances[t + 1] * gain.transpose();
            }
            steps[t] = factors[t].solve(&right);
            covariances[t] = (&covariance + covariance.transpose()) * 0.5;
        }
        Some((steps, covariances))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_and_covariances_are_those_of_the_whole_matrix() {
        let (n, times) = (2, [0.0, 0.01, 0.03, 0.035]);
        let mut rng = fastrand::Rng::with_seed(3);
        let mut random =
            |rows: usize, columns: usize| DMatrix::from_fn(rows, columns, |_, _| rng.f64() - 0.5);
        let covariance = DMatrix::identity(n, n) * 0.7 + DMatrix::from_element(n, n, 0.2);
        let prior =
            Prior { scale_n: 20.0, mean: DVector::from_vec(vec![0.3, -0.1]), covariance, memory_s: 0.02 };
        let jacobians: Vec<DMatrix<f64>> = times.iter().map(|_| random(3, n)).collect();
        let residuals: Vec<DVector<f64>> =
            times.iter().map(|_| random(3, 1).column(0).into_owned()).collect();
        let x: Vec<DVector<f64>> = times.iter().map(|_| random(n, 1).column(0).into_owned()).collect();
        let chain = Chain::new(&prior, &times);
        let curvature: Vec<_> = jacobians.iter().map(|j| j.transpose() * j).collect();
        let gradient: Vec<_> = jacobians.iter().zip(&residuals).map(|(j, r)| j.transpose() * r).collect();
        let (steps, covariances) = chain.solve(&x, &curvature, &gradient, 0.0).unwrap();

        // The covariance of the process, entry by entry.
        let all = n * times.len();
        let process = DMatrix::from_fn(all, all, |i, j| {
            let apart: f64 = times[i / n] - times[j / n];
            prior.covariance[(i % n, j % n)] * (-apart.abs() / prior.memory_s).exp()
        });
        let mut precision = process.try_inverse().unwrap();
        let away = DVector::from_fn(all, |i, _| x[i / n][i % n] - prior.mean[i % n]);
        assert!((chain.cost(&x) - away.dot(&(&precision * &away))).abs() < 1e-10);
        let mut right = -&precision * &away;
        for t in 0..times.len() {
            let mut block = precision.view_mut((t * n, t * n), (n, n));
            block += &curvature[t];
            let mut part = right.rows_mut(t * n, n);
            part -= &gradient[t];
        }
        let inverse = precision.try_inverse().unwrap();
        let whole = &inverse * right;
        for t in 0..times.len() {
            assert!((&steps[t] - whole.rows(t * n, n)).amax() < 1e-10);
            assert!((&covariances[t] - inverse.view((t * n, t * n), (n, n))).amax() < 1e-10);
        }
    }
}
