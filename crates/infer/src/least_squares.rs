//! Damped least squares (Levenberg 1944, Marquardt 1963), by which fits, modes, placements and displayed shapes are found.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// When a search ends, and how its damping changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    /// Largest number of steps, rejected ones included.
    pub max_steps: usize,
    /// Ends the search before a step that changes no unknown by more than this.
    pub step_tolerance: f64,
    /// Ends the search before a step whose predicted decrease of the cost is below this.
    pub decrease_tolerance: f64,
    /// Ends the search after a step that decreased the cost by less than this part of it.
    pub relative_tolerance: f64,
    pub first_damping: f64,
    /// Smallest damping after a rejected step.
    pub least_damping: f64,
    /// Largest damping, above which the search fails.
    pub most_damping: f64,
    /// Factor of the damping after an accepted step without predicted decrease.
    pub damping_decrease: f64,
    /// Factor of the damping after a rejected step, and the growth of that factor with each further rejection.
    pub damping_increase: (f64, f64),
}

impl Rule {
    /// Undamped steps until one is rejected.
    pub const UNDAMPED: Self = Self {
        max_steps: 60,
        step_tolerance: 0.0,
        decrease_tolerance: 0.0,
        relative_tolerance: 0.0,
        first_damping: 0.0,
        least_damping: 0.1,
        most_damping: f64::INFINITY,
        damping_decrease: 0.2,
        damping_increase: (4.0, 1.0),
    };
}

pub(crate) struct TrialStep<S> {
    pub by: S,
    pub size: f64,
    /// Decrease of the cost by a quadratic model, if known. The step is then rejected unless the cost decreases by a thousandth of it, and
    /// the damping follows the ratio of the two (Nielsen 1999).
    pub predicted_decrease: Option<f64>,
    pub is_last: bool,
}

/// Smallest part of the predicted decrease with which a step is accepted.
const ACCEPTED: f64 = 1e-3;

impl TrialStep<DVector<f64>> {
    /// The Newton step for this damped Hessian and gradient, shortened so that no unknown changes by more than `longest`.
    pub fn newton(matrix: DMatrix<f64>, gradient: &DVector<f64>, longest: f64) -> Option<Self> {
        let mut by = -matrix.cholesky()?.solve(gradient);
        let largest = by.amax();
        if largest > longest {
            by *= longest / largest;
        }
        Some(Self { size: by.amax(), by, predicted_decrease: None, is_last: false })
    }
}

pub(crate) struct Descent<P> {
    pub here: P,
    pub steps: usize,
    /// Whether a tolerance or a last step ended the search, not a limit of steps or damping.
    pub converged: bool,
}

/// Minimises `cost` from the point `here`. `step` gives the step from a point with a damping, `None` where the damped Hessian is not
/// positive definite; `moved` gives the point after a step. A step is rejected where either is `None` or the cost does not decrease.
pub(crate) fn descend<P, S>(
    mut here: P,
    rule: &Rule,
    cost: impl Fn(&P) -> f64,
    mut step: impl FnMut(&P, f64) -> Option<TrialStep<S>>,
    mut moved: impl FnMut(&P, &S) -> Option<P>,
) -> Descent<P> {
    let (mut damping, mut more, mut steps) = (rule.first_damping, rule.damping_increase.0, 0);
    while steps < rule.max_steps && damping <= rule.most_damping {
        steps += 1;
        let step = step(&here, damping);
        if step.as_ref().is_some_and(|s| {
            s.size <= rule.step_tolerance
                || s.predicted_decrease.is_some_and(|decrease| decrease.abs() < rule.decrease_tolerance)
        }) {
            return Descent { here, steps, converged: true };
        }
        let least = |s: &TrialStep<S>| {
            s.predicted_decrease.map_or(0.0, |p| if p > 0.0 { ACCEPTED * p } else { f64::INFINITY })
        };
        let taken = step.and_then(|step| {
            let there = moved(&here, &step.by)?;
            let decrease = cost(&here) - cost(&there);
            (decrease > least(&step)).then_some((there, step, decrease))
        });
        let Some((there, step, decrease)) = taken else {
            damping = (damping * more).max(rule.least_damping);
            more *= rule.damping_increase.1;
            continue;
        };
        here = there;
        if step.is_last || decrease < rule.relative_tolerance * cost(&here) {
            return Descent { here, steps, converged: true };
        }
        damping *= step
            .predicted_decrease
            .map_or(rule.damping_decrease, |p| (1.0 - (2.0 * decrease / p - 1.0).powi(3)).clamp(0.1, 2.0));
        more = rule.damping_increase.0;
    }
    Descent { here, steps, converged: false }
}

/// Cholesky factor of a matrix that is symmetric but for rounding; `None` where it is not positive definite.
pub(crate) fn symmetric_cholesky(matrix: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    ((matrix + matrix.transpose()) * 0.5).cholesky()
}

/// Residuals in standard deviations; `None` where they cannot be computed.
pub(crate) type Residuals<'a> = dyn Fn(&DVector<f64>) -> Option<DVector<f64>> + 'a;

#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub x: DVector<f64>,
    pub residuals: DVector<f64>,
}

/// Least sum of squares from several starts, with unknowns of the order of 1 and derivatives by differences of size `step`. A search ends
/// where no unknown would move by more than `step_tolerance`; `allowed` tells which points are permitted. `None` where no start has finite
/// residuals.
pub(crate) fn minimise(
    starts: impl IntoIterator<Item = DVector<f64>>,
    residuals: &Residuals<'_>,
    allowed: &dyn Fn(&DVector<f64>) -> bool,
    (step, step_tolerance): (f64, f64),
) -> Option<Minimum> {
    let rule = Rule { step_tolerance, damping_increase: (5.0, 1.0), most_damping: 1e6, ..Rule::UNDAMPED };
    let finite = |x: &DVector<f64>| residuals(x).filter(|r| r.iter().all(|v| v.is_finite()));
    let at = |x: DVector<f64>| Some(Minimum { residuals: finite(&x)?, x });
    let cost = |here: &Minimum| here.residuals.norm_squared();
    let damped = |here: &Minimum, damping: f64| {
        let jacobian = jacobian_by_differences(&here.x, &finite, step)?;
        let mut matrix = jacobian.tr_mul(&jacobian);
        (0..here.x.len()).for_each(|i| matrix[(i, i)] *= 1.0 + damping);
        TrialStep::newton(matrix, &jacobian.tr_mul(&here.residuals), f64::INFINITY)
    };
    let moved = |here: &Minimum, by: &DVector<f64>| at(&here.x + by).filter(|there| allowed(&there.x));
    starts
        .into_iter()
        .filter_map(|start| Some(descend(at(start)?, &rule, cost, damped, moved).here))
        .min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

pub(crate) fn jacobian_by_differences(
    x: &DVector<f64>,
    residuals: &Residuals<'_>,
    step: f64,
) -> Option<DMatrix<f64>> {
    let columns = (0..x.len()).map(|i| {
        let [high, low] = [1.0, -1.0].map(|side| {
            let mut moved = x.clone();
            moved[i] += side * step;
            residuals(&moved)
        });
        Some((high? - low?) / (2.0 * step))
    });
    Some(DMatrix::from_columns(&columns.collect::<Option<Vec<DVector<f64>>>>()?))
}
