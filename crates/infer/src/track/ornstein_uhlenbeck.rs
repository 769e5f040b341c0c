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
pub(super) struct OrnsteinUhlenbeck {
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

#[derive(Debug, Clone)]
pub(super) struct Factors {
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
        self.tension(self.middle_n + z * self.level_sd_n.hypot(self.deviation_sd_n)).0
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

#[cfg(test)]
mod tests {

    use super::*;

    #[test]
    fn solutions_images_and_draws_are_those_of_the_whole_matrix() {
        let (n, times, memory) = (2, [0.0, 0.01, 0.03, 0.035], 0.02);
        let mut rng = fastrand::Rng::with_seed(3);
        let mut random =
            |rows: usize, columns: usize| DMatrix::from_fn(rows, columns, |_, _| rng.f64() - 0.5);
        let covariance = DMatrix::identity(n, n) * 0.7 + DMatrix::from_element(n, n, 0.2);
        let curvature: Vec<_> = times.iter().map(|_| random(3, n)).map(|j| j.transpose() * j).collect();
        let chain = OrnsteinUhlenbeck::new(covariance.clone().try_inverse().unwrap(), memory, &times);

        // The covariance of the process, element by element.
        let all = n * times.len();
        let process = DMatrix::from_fn(all, all, |i, j| {
            let apart: f64 = times[i / n] - times[j / n];
            covariance[(i % n, j % n)] * (-apart.abs() / memory).exp()
        });
        let mut whole = process.try_inverse().unwrap();
        let z = random(all, 1);
        let blocks =
            |v: &DMatrix<f64>| (0..times.len()).map(|t| v.rows(t * n, n).into_owned()).collect::<Vec<_>>();
        let image = chain.image(&blocks(&z).iter().map(|b| b.column(0).into_owned()).collect::<Vec<_>>());
        for (a, b) in image.iter().zip(blocks(&(&whole * &z))) {
            assert!((a - b.column(0)).amax() < 1e-9);
        }
        for (t, g) in curvature.iter().enumerate() {
            let mut part = whole.view_mut((t * n, t * n), (n, n));
            part += g;
        }
        let inverse = whole.try_inverse().unwrap();
        let factors = chain.factorise(curvature).unwrap();
        let right = random(all, 3);
        let mut solved = blocks(&right);
        factors.solve(&mut solved);
        for (a, b) in solved.iter().zip(blocks(&(&inverse * right))) {
            assert!((a - b).amax() < 1e-10);
        }
        // Draws made window by window, the last first, are the same bits.
        let whole = blocks(&DMatrix::from_fn(all, 2, |i, j| (i + 3 * j) as f64 * 0.1));
        let mut at_once = whole.clone();
        factors.colour(&mut at_once, 0, None);
        let mut last = whole[2..].to_vec();
        factors.colour(&mut last, 2, None);
        let mut first = whole[..2].to_vec();
        factors.colour(&mut first, 0, Some(&last[0]));
        assert_eq!([first, last].concat(), at_once);
        // The images of unit vectors are a square root of the covariance.
        let mut root = blocks(&DMatrix::identity(all, all));
        factors.colour(&mut root, 0, None);
        let mut square = DMatrix::zeros(all, all);
        for (i, a) in root.iter().enumerate() {
            for (j, b) in root.iter().enumerate() {
                square.view_mut((i * n, j * n), (n, n)).copy_from(&(a * b.transpose()));
            }
        }
        assert!((square - inverse).amax() < 1e-10);
    }

    #[test]
    fn the_slope_is_the_derivative_and_nothing_overflows() {
        let link = Softplus::default();
        for h in [-900.0, -20.0, -1.0, 0.0, 0.5, 8.0, 60.0, 5000.0] {
            let (f, slope) = link.tension(h);
            let difference = (link.tension(h + 1e-4).0 - link.tension(h - 1e-4).0) / 2e-4;
            assert!(f >= 0.0 && (slope - difference).abs() < 1e-6, "{h}: {f} {slope} {difference}");
        }
        assert!((link.tension(0.0).0 - 3.0 * 2f64.ln()).abs() < 1e-12);
        // The width of the prior's 95 % interval.
        assert!((link.prior_quantile(1.96) - link.prior_quantile(-1.96) - 52.7).abs() < 0.1);
        // Its standard deviation, from two million draws of another program.
        assert!((link.prior_sd_n() - 15.62).abs() < 0.02, "{}", link.prior_sd_n());
        assert!((Softplus::of_scale(40.0).tension(16.0).0 - 2.0 * link.tension(8.0).0).abs() < 1e-12);
    }
}
