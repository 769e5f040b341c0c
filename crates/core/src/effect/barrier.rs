//! The barrier that prevents inverted cells and connections of zero length.
//!
//! The thesis's law `1/2 kappa (s - 1)²` is finite for a flat cell (`s = 0`), and a contractile tension `F` has the energy `F l`, which is
//! finite at `l = 0` and has a kink there. At loads far beyond those of muscles the minimum would have inverted cells, or lie in the kink.
//! So below a tenth of its measure or length at rest an element has, besides its law, the barrier of incremental potential contact (Li et
//! al. 2020, eq. 6), scaled by the element's stiffness:
//!
//! ```text
//! b(r) = -(1 - t)² ln t,   t = r / 0.1,   for r < 0.1;   exactly zero above
//! ```
//!
//! It is twice continuously differentiable and infinite at zero, so that the energy has a minimum without inverted cells at every finite
//! load; above the threshold no bit changes. [`crate::statics::Solution::guarded`] counts the elements in which it acts, whose law is not
//! the thesis's.

/// Ratio of measure or length to that at rest below which the barrier acts.
pub const THRESHOLD: f64 = 0.1;

/// Value and first two derivatives of the barrier by the ratio, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    /// `b`; infinite at and below zero.
    pub value: f64,
    /// `db/dr`, negative: it repels.
    pub slope: f64,
    /// `d²b/dr²`, positive.
    pub curvature: f64,
}

/// The barrier at a ratio below `THRESHOLD`.
#[cold]
pub fn barrier(ratio: f64) -> Barrier {
    let t = ratio / THRESHOLD;
    if t.is_nan() || t <= 0.0 {
        return Barrier { value: f64::INFINITY, slope: 0.0, curvature: 0.0 };
    }
    let (left, ln) = (1.0 - t, t.ln());
    Barrier {
        value: -left * left * ln,
        slope: (2.0 * left * ln - left * left / t) / THRESHOLD,
        curvature: (-2.0 * ln + 4.0 * left / t + left * left / (t * t)) / (THRESHOLD * THRESHOLD),
    }
}
