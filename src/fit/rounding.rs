//! How far the tensions may move before the targets leave what the rounding of the data allows.

use nalgebra::DVector;

use super::identifiability::{decompose, linearise};
use super::objective::Forward;
use super::uncertainty::rounding_range;

/// Halvings by which the end of a segment is found.
const HALVINGS: usize = 10;

/// A straight segment of tensions through the answer, along one singular direction.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundingSegment {
    /// How strongly the targets answer along it, 1/N.
    pub singular_value: f64,
    /// Unit vector over the active muscles; its largest entry is positive.
    pub direction: Vec<f64>,
    /// Tensions at the end against the direction, N.
    pub from_n: Vec<f64>,
    /// Tensions at the end along the direction, N.
    pub to_n: Vec<f64>,
}

/// For every singular direction of d(target)/d(tension) at `tensions`, how far one can go along it until a fitted value leaves
/// the range that ±0.5 mm on each length allows, or a tension its bounds. Where the answer itself lies outside that range
/// the segment is the answer. `None` where the equilibrium is singular.
pub fn segments(forward: &mut Forward<'_>, tensions: &[f64]) -> Option<Vec<RoundingSegment>> {
    let (jacobian, _) = linearise(forward, tensions)?;
    let (values, directions) = decompose(&jacobian)?;
    let here = DVector::from_column_slice(tensions);
    let out = values.into_iter().zip(directions).map(|(singular_value, direction)| RoundingSegment {
        singular_value,
        from_n: end(forward, &here, &-&direction),
        to_n: end(forward, &here, &direction),
        direction: direction.iter().copied().collect(),
    });
    Some(out.collect())
}

/// The last point along `direction` that is still within bounds and rounding, by bisection: the targets are taken to leave
/// their ranges once and for all.
fn end(forward: &mut Forward<'_>, here: &DVector<f64>, direction: &DVector<f64>) -> Vec<f64> {
    let room = super::identifiability::room(here, direction, forward.settings.upper_bound).max(0.0);
    let at = |way: f64| (here + direction * way).map(|t| t.max(0.0));
    if within(forward, at(room).as_slice()) {
        return at(room).iter().copied().collect();
    }
    let (mut inside, mut outside) = (0.0, room);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if within(forward, at(middle).as_slice()) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    at(inside).iter().copied().collect()
}

fn within(forward: &mut Forward<'_>, tensions: &[f64]) -> bool {
    let Some(lengths) = forward.evaluate(tensions).lengths else { return false };
    let target = forward.target;
    let simulated = target.simulated(&lengths, &forward.rest_lengths());
    target.fitted.iter().all(|m| {
        let (low, high) = rounding_range(target, *m);
        (low..=high).contains(&simulated[m.index()])
    })
}
