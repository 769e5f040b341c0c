//! Damped least squares for a few unknowns, with derivatives by central differences (Levenberg 1944, Marquardt 1963).

use nalgebra::{DMatrix, DVector};

/// Residuals in standard deviations; `None` where they cannot be computed.
pub(super) type Residuals<'a> = dyn Fn(&DVector<f64>) -> Option<DVector<f64>> + 'a;

/// Largest number of steps.
const MOST_STEPS: usize = 60;
/// Damping at which a search ends, because the steps have become negligible.
const MOST_DAMPING: f64 = 1e6;

/// A minimum of the sum of squares.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    /// The unknowns there.
    pub x: DVector<f64>,
    /// The residuals there.
    pub residuals: DVector<f64>,
}

/// Minimises from `start`, with unknowns of the order of 1 and differences of size `step`, until the unknowns move by less than
/// `arrived`; `allowed` says which unknowns are permitted. `None` where the residuals cannot be computed at the start or next to it.
pub(super) fn minimise(
    start: DVector<f64>,
    residuals: &Residuals<'_>,
    allowed: &dyn Fn(&DVector<f64>) -> bool,
    step: f64,
    arrived: f64,
) -> Option<Minimum> {
    let mut here = Minimum { residuals: residuals(&start)?, x: start };
    let mut damping = 0.0;
    for _ in 0..MOST_STEPS {
        let jacobian = by_differences(&here.x, residuals, step)?;
        let mut matrix = jacobian.tr_mul(&jacobian);
        (0..here.x.len()).for_each(|i| matrix[(i, i)] *= 1.0 + damping);
        let Some(factors) = matrix.cholesky() else { break };
        let by = -factors.solve(&jacobian.tr_mul(&here.residuals));
        let next = &here.x + &by;
        let cost = here.residuals.norm_squared();
        match residuals(&next).filter(|r| r.norm_squared() < cost) {
            Some(there) if allowed(&next) => {
                here = Minimum { x: next, residuals: there };
                damping *= 0.2;
            }
            _ => damping = (damping * 5.0).max(0.1),
        }
        if by.amax() < arrived || damping > MOST_DAMPING {
            break;
        }
    }
    Some(here)
}

/// The derivative of residuals by the unknowns.
pub(super) fn by_differences(x: &DVector<f64>, residuals: &Residuals<'_>, step: f64) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(x.len());
    for i in 0..x.len() {
        let at = |side: f64| {
            let mut moved = x.clone();
            moved[i] += side * step;
            residuals(&moved)
        };
        columns.push((at(1.0)? - at(-1.0)?) / (2.0 * step));
    }
    Some(DMatrix::from_columns(&columns))
}
