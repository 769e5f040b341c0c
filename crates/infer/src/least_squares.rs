//! Damped least squares (Levenberg 1944, Marquardt 1963): the one search behind fits, modes, placements and displayed shapes.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// When a search ends, and how its damping changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    /// Largest number of steps, refused ones included.
    pub steps: usize,
    /// The search ends before a step that changes no unknown by more than this.
    pub arrived: f64,
    /// It ends before a step that promises to reduce the cost by less than this ([`TrialStep::promised`]).
    pub promised: f64,
    /// It ends after a step that reduced the cost by less than this part of it.
    pub won: f64,
    /// Damping of the first step.
    pub first: f64,
    /// Smallest damping after a refused step.
    pub least: f64,
    /// The search gives up where the damping is larger than this.
    pub most: f64,
    /// Factor of the damping after a step that was taken and had promised nothing.
    pub less: f64,
    /// Factor of the damping after a refused step, and the factor by which that factor grows with every further step that is refused.
    pub more: (f64, f64),
}

impl Rule {
    /// Undamped steps until one is refused.
    pub const UNDAMPED: Self = Self {
        steps: 60,
        arrived: 0.0,
        promised: 0.0,
        won: 0.0,
        first: 0.0,
        least: 0.1,
        most: f64::INFINITY,
        less: 0.2,
        more: (4.0, 1.0),
    };
}

/// A step that may be taken.
pub(crate) struct TrialStep<S> {
    pub by: S,
    /// Largest change of an unknown.
    pub size: f64,
    /// By how much a quadratic model of the cost decreases with this step, if that is known. A step is then refused that reduces the cost
    /// by less than a thousandth of it, and the damping follows the ratio of the two (Nielsen 1999).
    pub promised: Option<f64>,
    /// Whether the search ends if the step is taken.
    pub is_last: bool,
}

/// Smallest part of the promised decrease with which a step is taken.
const ACCEPTED: f64 = 1e-3;

impl TrialStep<DVector<f64>> {
    /// The step to the minimum of a quadratic model with this damped second derivative and gradient, shortened so that no unknown changes
    /// by more than `longest`.
    pub fn newton(matrix: DMatrix<f64>, gradient: &DVector<f64>, longest: f64) -> Option<Self> {
        let mut by = -matrix.cholesky()?.solve(gradient);
        let largest = by.amax();
        if largest > longest {
            by *= longest / largest;
        }
        Some(Self { size: by.amax(), by, promised: None, is_last: false })
    }
}

/// Where a search ended.
pub(crate) struct Descended<P> {
    pub here: P,
    pub steps: usize,
    /// Whether the search ended by itself, and not because there were too many steps or too much damping.
    pub converged: bool,
}

/// Searches for the least `cost` from the point `here`. `step` gives the step from a point with a damping, `None` where the damped second
/// derivative is not positive definite. `moved` gives the point after a step, `None` where there is none. A step is refused where either
/// is `None` or the cost does not decrease.
pub(crate) fn descend<P, S>(
    mut here: P,
    rule: &Rule,
    cost: impl Fn(&P) -> f64,
    mut step: impl FnMut(&P, f64) -> Option<TrialStep<S>>,
    mut moved: impl FnMut(&P, &S) -> Option<P>,
) -> Descended<P> {
    let (mut damping, mut more, mut steps) = (rule.first, rule.more.0, 0);
    while steps < rule.steps && damping <= rule.most {
        steps += 1;
        let step = step(&here, damping);
        if step.as_ref().is_some_and(|s| {
            s.size <= rule.arrived || s.promised.is_some_and(|promised| promised.abs() < rule.promised)
        }) {
            return Descended { here, steps, converged: true };
        }
        let least =
            |s: &TrialStep<S>| s.promised.map_or(0.0, |p| if p > 0.0 { ACCEPTED * p } else { f64::INFINITY });
        let taken = step.and_then(|step| {
            let there = moved(&here, &step.by)?;
            let won = cost(&here) - cost(&there);
            (won > least(&step)).then_some((there, step, won))
        });
        let Some((there, step, won)) = taken else {
            damping = (damping * more).max(rule.least);
            more *= rule.more.1;
            continue;
        };
        here = there;
        if step.is_last || won < rule.won * cost(&here) {
            return Descended { here, steps, converged: true };
        }
        damping *= step.promised.map_or(rule.less, |p| (1.0 - (2.0 * won / p - 1.0).powi(3)).clamp(0.1, 2.0));
        more = rule.more.0;
    }
    Descended { here, steps, converged: false }
}

/// The Cholesky factor of a matrix that is symmetric but for rounding; `None` where it is not positive definite.
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

/// The least sum of squares that is found from several starts, with unknowns of the order of 1 and derivatives by differences of size
/// `step`. A search ends before the unknowns would move by less than `arrived`; `allowed` says which unknowns are permitted. `None` where
/// the residuals are not finite at any start.
pub(crate) fn minimise(
    starts: impl IntoIterator<Item = DVector<f64>>,
    residuals: &Residuals<'_>,
    allowed: &dyn Fn(&DVector<f64>) -> bool,
    (step, arrived): (f64, f64),
) -> Option<Minimum> {
    let rule = Rule { arrived, more: (5.0, 1.0), most: 1e6, ..Rule::UNDAMPED };
    let finite = |x: &DVector<f64>| residuals(x).filter(|r| r.iter().all(|v| v.is_finite()));
    let at = |x: DVector<f64>| Some(Minimum { residuals: finite(&x)?, x });
    let cost = |here: &Minimum| here.residuals.norm_squared();
    let damped = |here: &Minimum, damping: f64| {
        let jacobian = by_differences(&here.x, &finite, step)?;
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

/// The derivative of residuals by the unknowns, by central differences.
pub(crate) fn by_differences(x: &DVector<f64>, residuals: &Residuals<'_>, step: f64) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(x.len());
    for i in 0..x.len() {
        let [high, low] = [1.0, -1.0].map(|side| {
            let mut moved = x.clone();
            moved[i] += side * step;
            residuals(&moved)
        });
        columns.push((high? - low?) / (2.0 * step));
    }
    Some(DMatrix::from_columns(&columns))
}
