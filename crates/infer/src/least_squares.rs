//! Damped least squares for a few unknowns (Levenberg 1944, Marquardt 1963).

use nalgebra::{DMatrix, DVector};

/// When a search ends, and how its damping changes.
pub(crate) struct Rule {
    pub steps: usize,
    /// Largest change of an unknown in a step.
    pub longest: f64,
    /// The search ends before a step in which every unknown changes by less than this.
    pub arrived: f64,
    /// Factor of the damping after a step that reduced the cost.
    pub less: f64,
    /// Factor of the damping after a step that did not, and the damping after the first such step.
    pub more: (f64, f64),
    /// The search ends when the damping exceeds this: the steps are then negligible.
    pub most: f64,
}

/// Descends from a point. `normal` gives half of the second derivative of the cost, damped by the given amount, and half of its gradient;
/// `moved` gives the point after a step. Where one of them is `None`, the matrix is not used or the step is not taken.
pub(crate) fn descend<P>(
    mut here: P,
    rule: &Rule,
    cost: impl Fn(&P) -> f64,
    normal: impl Fn(&P, f64) -> Option<(DMatrix<f64>, DVector<f64>)>,
    mut moved: impl FnMut(&P, &DVector<f64>) -> Option<P>,
) -> P {
    let mut damping = 0.0;
    for _ in 0..rule.steps {
        let Some((matrix, gradient)) = normal(&here, damping) else { break };
        let Some(factors) = matrix.cholesky() else { break };
        let mut step = -factors.solve(&gradient);
        let largest = step.amax();
        if largest > rule.longest {
            step *= rule.longest / largest;
        }
        if step.amax() < rule.arrived {
            break;
        }
        match moved(&here, &step).filter(|there| cost(there) < cost(&here)) {
            Some(there) => {
                here = there;
                damping *= rule.less;
            }
            None => {
                damping = (damping * rule.more.0).max(rule.more.1);
                if damping > rule.most {
                    break;
                }
            }
        }
    }
    here
}

/// Residuals in standard deviations; `None` where they cannot be computed.
pub(crate) type Residuals<'a> = dyn Fn(&DVector<f64>) -> Option<DVector<f64>> + 'a;

#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub x: DVector<f64>,
    pub residuals: DVector<f64>,
}

/// Minimises a sum of squares from `start`, with unknowns of the order of 1 and derivatives by differences of size `step`, until the
/// unknowns would move by less than `arrived`; `allowed` says which unknowns are permitted. `None` where the residuals cannot be computed
/// at the start.
pub(crate) fn minimise(
    start: DVector<f64>,
    residuals: &Residuals<'_>,
    allowed: &dyn Fn(&DVector<f64>) -> bool,
    step: f64,
    arrived: f64,
) -> Option<Minimum> {
    let rule = Rule { steps: 60, longest: f64::INFINITY, arrived, less: 0.2, more: (5.0, 0.1), most: 1e6 };
    let at = |x: DVector<f64>| Some(Minimum { residuals: residuals(&x)?, x });
    let normal = |here: &Minimum, damping: f64| {
        let jacobian = by_differences(&here.x, residuals, step)?;
        let mut matrix = jacobian.tr_mul(&jacobian);
        (0..here.x.len()).for_each(|i| matrix[(i, i)] *= 1.0 + damping);
        Some((matrix, jacobian.tr_mul(&here.residuals)))
    };
    let moved = |here: &Minimum, by: &DVector<f64>| at(&here.x + by).filter(|there| allowed(&there.x));
    Some(descend(at(start)?, &rule, |m| m.residuals.norm_squared(), normal, moved))
}

/// The derivative of residuals by the unknowns, by central differences.
pub(crate) fn by_differences(x: &DVector<f64>, residuals: &Residuals<'_>, step: f64) -> Option<DMatrix<f64>> {
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
