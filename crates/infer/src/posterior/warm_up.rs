//! What the warm-up of the sampler adapts: the coordinates and the step.

use nalgebra::{DMatrix, DVector};

use tongue_core::random::{normals, seed_of};

/// Acceptance to which the step is adapted.
const WANTED: f64 = 0.8;
/// First and longest step in whitened coordinates.
const FIRST_STEP: f64 = 0.5;
const LONGEST_STEP: f64 = 1.6;

/// Coordinates in which the density is nearly standard normal: `x = centre + spread z`.
#[derive(Debug, Clone)]
pub struct Whitened {
    pub centre: DVector<f64>,
    /// A square root of the covariance.
    pub spread: DMatrix<f64>,
}

impl Whitened {
    pub(super) fn to_scores(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.centre + &self.spread * z
    }

    pub(super) fn scores_of(&self, x: &DVector<f64>) -> DVector<f64> {
        let away = x - &self.centre;
        self.spread.clone().lu().solve(&away).unwrap_or_else(|| DVector::zeros(x.len()))
    }

    /// Draws whose coordinates have this standard deviation, each followed by its mirror image about the centre: coordinates and scores.
    pub(super) fn mirrored_draws(
        &self,
        count: usize,
        spread: f64,
        seed: u64,
    ) -> impl Iterator<Item = (DVector<f64>, DVector<f64>)> {
        (0..count / 2).flat_map(move |i| {
            let mut random = fastrand::Rng::with_seed(seed_of(seed, i));
            let z = normals(self.centre.len(), &mut random) * spread;
            [z.clone(), -z].map(|z| {
                let x = self.to_scores(&z);
                (z, x)
            })
        })
    }

    /// Coordinates learned from visited points and the derivatives of the logarithm of the density there. The covariance `M` in the present
    /// coordinates solves `M B M = A`, with `A` the covariance of the points and `B` that of the derivatives, which is exact for a normal
    /// density (Seyboldt, Carlson and Carpenter 2026). `A` and `B` are shrunk towards one with the weight of as many draws as there are
    /// coordinates. `None` where they are not positive definite.
    pub(super) fn learned(&self, visited: &[&(DVector<f64>, DVector<f64>)]) -> Option<Self> {
        let n = self.centre.len();
        if visited.len() < 10 * n {
            return Some(self.clone());
        }
        let count = visited.len() as f64;
        let centre = visited.iter().map(|(x, _)| x).sum::<DVector<f64>>() / count;
        let slope = visited.iter().map(|(_, g)| g).sum::<DVector<f64>>() / count;
        let inverse = self.spread.clone().try_inverse()?;
        let (mut points, mut slopes) =
            (DMatrix::identity(n, n) * n as f64, DMatrix::identity(n, n) * n as f64);
        for (x, g) in visited {
            let (z, by_z) = (&inverse * (x - &centre), self.spread.tr_mul(&(g - &slope)));
            points.syger(1.0, &z, &z, 1.0);
            slopes.syger(1.0, &by_z, &by_z, 1.0);
        }
        let [points, slopes] = [points, slopes].map(|mut m| {
            m.fill_upper_triangle_with_lower_triangle();
            m / (count + n as f64)
        });
        // With B = C C', M = C'^-1 (C' A C)^(1/2) C^-1.
        let root = slopes.cholesky()?.unpack();
        let eigen = (root.transpose() * points * &root).symmetric_eigen();
        let middle = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
        let middle = &eigen.eigenvectors * middle * eigen.eigenvectors.transpose();
        let left = root.transpose().solve_upper_triangular(&middle)?;
        let learned = root.transpose().solve_upper_triangular(&left.transpose())?;
        let spread = &self.spread * ((&learned + learned.transpose()) * 0.5).cholesky()?.unpack();
        Some(Self { centre, spread })
    }

    /// Coordinates from the centre and the inverse covariance; `None` where this is not positive definite.
    pub fn new(centre: DVector<f64>, precision: DMatrix<f64>) -> Option<Self> {
        let n = centre.len();
        let factor = precision.cholesky()?.unpack();
        let spread = factor.transpose().solve_upper_triangular(&DMatrix::identity(n, n))?;
        Some(Self { centre, spread })
    }
}

/// Dual averaging of the step by Hoffman and Gelman (2014), with their constants.
pub(super) struct DualAveraging {
    pub trial: f64,
    pub found: f64,
    count: f64,
    error: f64,
    mean_ln: f64,
}

impl DualAveraging {
    pub fn new() -> Self {
        Self { trial: FIRST_STEP, found: FIRST_STEP, count: 0.0, error: 0.0, mean_ln: FIRST_STEP.ln() }
    }

    /// Adapts the step to the acceptance of a trajectory with it.
    pub(crate) fn learn(&mut self, acceptance: f64) {
        const GAMMA: f64 = 0.05;
        const DELAY: f64 = 10.0;
        const KAPPA: f64 = 0.75;
        self.count += 1.0;
        let weight = 1.0 / (self.count + DELAY);
        self.error = (1.0 - weight) * self.error + weight * (WANTED - acceptance);
        let ln = ((10.0 * FIRST_STEP).ln() - self.error * self.count.sqrt() / GAMMA)
            .clamp((1e-3_f64).ln(), LONGEST_STEP.ln());
        let part = self.count.powf(-KAPPA);
        self.mean_ln = part * ln + (1.0 - part) * self.mean_ln;
        (self.trial, self.found) = (ln.exp(), self.mean_ln.exp());
    }
}
