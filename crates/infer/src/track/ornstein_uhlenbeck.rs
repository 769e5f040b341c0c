//! The prior of the states of successive frames, and its block tridiagonal systems.
//!
//! The deviations from the levels are a stationary Ornstein-Uhlenbeck process about zero with precision `P` and time constant `tau`:
//! `z_(t+1) = rho z_t + e`, `e ~ N(0, (1 - rho²) P^-1)`, `rho = exp(-dt / tau)`. Its precision `Q` couples neighbours only, so `Q + G` with
//! a block `G` for each frame is factorised frame by frame (Rauch, Tung and Striebel 1965 in information form). Tensions are a smooth
//! function of unbounded numbers, `F = s ln(1 + exp(h / s))`, so that a slack muscle is not on a bound.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::least_squares::symmetric_cholesky;
use crate::standard_deviations as sd;

/// Smallest interval between frames in time constants; less would lose all digits by rounding.
const NEAREST: f64 = 1e-4;

/// The prior of a recording's states as their precision `Q`.
#[derive(Debug, Clone)]
pub struct OrnsteinUhlenbeck {
    precision: DMatrix<f64>,
    /// For every frame, the factor of the precision in its diagonal block.
    diagonal: Vec<f64>,
    /// For every frame but the last, minus the factor of the precision in the block that couples it to the next.
    off_diagonal: Vec<f64>,
}

impl OrnsteinUhlenbeck {
    /// The prior of states with this precision in each frame and time constant, s (0: frames are independent).
    pub fn new(precision: DMatrix<f64>, memory_s: f64, times: &[f64]) -> Self {
        let mut diagonal = vec![1.0; times.len()];
        let mut off_diagonal = Vec::with_capacity(times.len().saturating_sub(1));
        for (t, pair) in times.windows(2).enumerate() {
            let apart = ((pair[1] - pair[0]) / memory_s).max(NEAREST);
            let kept = if memory_s > 0.0 { (-apart).exp() } else { 0.0 };
            let left = 1.0 / (1.0 - kept * kept);
            diagonal[t] += kept * kept * left;
            diagonal[t + 1] = left;
            off_diagonal.push(kept * left);
        }
        Self { precision, diagonal, off_diagonal }
    }

    /// `Q z`.
    pub fn image(&self, z: &[DVector<f64>]) -> Vec<DVector<f64>> {
        let own: Vec<DVector<f64>> = z.iter().map(|z| &self.precision * z).collect();
        let mut out: Vec<DVector<f64>> = own.iter().zip(&self.diagonal).map(|(o, d)| o * *d).collect();
        for (t, off_diagonal) in self.off_diagonal.iter().enumerate() {
            out[t] -= &own[t + 1] * *off_diagonal;
            out[t + 1] -= &own[t] * *off_diagonal;
        }
        out
    }

    /// `None` where `Q + G` is not positive definite.
    pub fn factorise(&self, curvature: Vec<DMatrix<f64>>) -> Option<Factors> {
        let mut own: Vec<Cholesky<f64, Dyn>> = Vec::with_capacity(curvature.len());
        let mut gains: Vec<DMatrix<f64>> = Vec::with_capacity(self.off_diagonal.len());
        for (t, curvature) in curvature.into_iter().enumerate() {
            let mut block = &self.precision * self.diagonal[t] + curvature;
            if let Some(before) = t.checked_sub(1) {
                block -= &self.precision * (self.off_diagonal[before]) * &gains[before];
            }
            let factor = symmetric_cholesky(&block)?;
            if let Some(off_diagonal) = self.off_diagonal.get(t) {
                gains.push(factor.solve(&(&self.precision * *off_diagonal)));
            }
            own.push(factor);
        }
        Some(Factors { own, gains })
    }
}

/// The factorised `Q + G`.
#[derive(Debug, Clone)]
pub struct Factors {
    /// For every frame, the factor of the diagonal block after elimination of the frames before it.
    own: Vec<Cholesky<f64, Dyn>>,
    /// For every frame but the last, the matrix by which its elimination acts on the next.
    gains: Vec<DMatrix<f64>>,
}

impl Factors {
    /// Solves `(Q + G) x = right` in place; one block of rows for each frame.
    pub fn solve(&self, right: &mut [DMatrix<f64>]) {
        self.forward(right, 0, None);
        self.backward(right, 0, None);
    }

    /// Forward elimination in a window of frames from `from` on; `before` is the block of the frame before it.
    pub fn forward(&self, right: &mut [DMatrix<f64>], from: usize, before: Option<&DMatrix<f64>>) {
        for t in 0..right.len() {
            if let Some(before) = t.checked_sub(1).map(|t| &right[t]).or(before) {
                let carried = self.gains[from + t - 1].tr_mul(before);
                right[t] += carried;
            }
        }
    }

    /// Back substitution in a window; `after` is the solution of the frame after it.
    pub fn backward(&self, right: &mut [DMatrix<f64>], from: usize, after: Option<&DMatrix<f64>>) {
        for t in (0..right.len()).rev() {
            self.own[from + t].solve_mut(&mut right[t]);
            self.carry_back(right, (from, t), after);
        }
    }

    /// Turns standard normal numbers of a window into draws of `N(0, (Q + G)^-1)` in place; `after` are those of the frame after it.
    pub fn colour(&self, normals: &mut [DMatrix<f64>], from: usize, after: Option<&DMatrix<f64>>) {
        for t in (0..normals.len()).rev() {
            self.own[from + t].l_dirty().tr_solve_lower_triangular_mut(&mut normals[t]);
            self.carry_back(normals, (from, t), after);
        }
    }

    /// Adds the contribution of the next block.
    fn carry_back(
        &self,
        blocks: &mut [DMatrix<f64>],
        (from, t): (usize, usize),
        after: Option<&DMatrix<f64>>,
    ) {
        if let Some(next) = blocks.get(t + 1).or(after) {
            let carried = &self.gains[from + t] * next;
            blocks[t] += carried;
        }
    }
}

/// Transform of tensions and their prior: `h = middle + M + e(t)` with `M ~ N(0, level²)` shared by all frames and `e` an
/// Ornstein-Uhlenbeck process. Independent priors of the frames would treat the mean of all frames as known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softplus {
    /// The constant `s` at which the exponential turns into a straight line, N per metre of thickness.
    pub bend_n: f64,
    /// Prior mean of `h`, N/m.
    pub middle_n: f64,
    pub level_sd_n: f64,
    /// Standard deviation of `e`, N/m; in JSON `course_sd_n`.
    pub deviation_sd_n: f64,
}

impl Default for Softplus {
    fn default() -> Self {
        Self::of_scale(sd::TENSION_N)
    }
}

impl Softplus {
    /// A transform in proportion to a scale of the tensions, N/m; the default is 20 N/m.
    pub fn of_scale(scale_n: f64) -> Self {
        let by = scale_n / sd::TENSION_N;
        Self {
            bend_n: sd::BEND_N * by,
            middle_n: sd::LEVEL_MIDDLE_N * by,
            level_sd_n: sd::LEVEL_N * by,
            deviation_sd_n: sd::COURSE_N * by,
        }
    }

    pub fn scale_n(&self) -> f64 {
        sd::TENSION_N * self.bend_n / sd::BEND_N
    }

    /// Tension, N/m, and its derivative by `h`.
    pub fn tension(&self, h: f64) -> (f64, f64) {
        let t = h / self.bend_n;
        // ln(1 + e^t) without overflow.
        let value = t.max(0.0) + (-t.abs()).exp().ln_1p();
        (self.bend_n * value, 1.0 / (1.0 + (-t).exp()))
    }

    /// Tension at `h = 0`, N/m, below which a muscle cannot be distinguished from a slack one.
    pub fn slack_n(&self) -> f64 {
        self.tension(0.0).0
    }

    /// Prior quantile of a tension, N/m; `z` is the standard normal quantile of the same probability.
    pub fn prior_quantile(&self, z: f64) -> f64 {
        self.tension(self.middle_n + z * self.prior_sd()).0
    }

    /// Prior standard deviation of `h`, N/m.
    pub fn prior_sd(&self) -> f64 {
        self.level_sd_n.hypot(self.deviation_sd_n)
    }

    /// Prior standard deviation of a tension, N/m.
    pub fn prior_sd_n(&self) -> f64 {
        let moment = |power: i32| {
            let grid = (-60..=60).map(|i| 0.1 * f64::from(i)).map(|z| (z, (-0.5 * z * z).exp()));
            let (sum, all) =
                grid.fold((0.0, 0.0), |(s, a), (z, w)| (s + w * self.prior_quantile(z).powi(power), a + w));
            sum / all
        };
        (moment(2) - moment(1).powi(2)).sqrt()
    }
}
