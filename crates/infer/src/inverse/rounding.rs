//! Ranges of the tensions in which the targets stay within the rounding of the data.

use nalgebra::{DMatrix, DVector};

use tongue_core::observe::Certainty;

use super::directions::decompose;
use super::forward::Forward;
use super::on_target::room;
use super::problem::Problem;

/// Maximum number of evaluations for one end of a segment.
const MOST_TRIES: usize = 12;
/// Convergence at an end: distance of the nearest target from the edge of its range, as a part of half the
/// range.
const AT_EDGE: f64 = 0.01;

/// A straight segment of tensions through the answer, along one singular direction.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundingSegment {
    /// Sensitivity of the targets along it, 1/N.
    pub singular_value: f64,
    /// Unit vector over the active muscles; its largest entry is positive.
    pub direction: Vec<f64>,
    /// Tensions at the end against the direction, N.
    pub from_n: Vec<f64>,
    /// Tensions at the end along the direction, N.
    pub to_n: Vec<f64>,
}

/// For every singular direction of d(target)/d(tension) at `tensions`, the segment along it until a fitted
/// value leaves the range that ±0.5 mm on each length allows, or a tension its bounds. If the answer itself
/// lies outside that range, the segment is the answer. `None` if the equilibrium is singular.
pub fn segments<const D: usize>(
    forward: &mut Forward<'_, D>,
    tensions: &[f64],
) -> Option<Vec<RoundingSegment>> {
    let jacobian = forward.linearise(tensions)?.jacobian;
    let (values, directions) = decompose(&jacobian)?;
    let here = DVector::from_column_slice(tensions);
    let out = values.into_iter().zip(directions).map(|(singular_value, direction)| RoundingSegment {
        singular_value,
        from_n: end(forward, &jacobian, &here, &-&direction),
        to_n: end(forward, &jacobian, &here, &direction),
        direction: direction.iter().copied().collect(),
    });
    Some(out.collect())
}

/// The last point along `direction` within bounds and rounding. The search begins at the end given by the linear model and moves outwards
/// until a limit is exceeded; then it uses false position. The targets are assumed to leave their ranges only once.
fn end<const D: usize>(
    forward: &mut Forward<'_, D>,
    jacobian: &DMatrix<f64>,
    here: &DVector<f64>,
    direction: &DVector<f64>,
) -> Vec<f64> {
    let unknowns = forward.unknowns().to_vec();
    let room = room(here, direction, &unknowns).max(0.0);
    let at = |way: f64| {
        let there = here + direction * way;
        DVector::from_iterator(there.len(), there.iter().zip(&unknowns).map(|(x, u)| x.max(u.lower)))
    };
    let mut inside = (0.0, outside_by(forward, here.as_slice()));
    if inside.1 > 0.0 {
        return here.iter().copied().collect();
    }
    let change = jacobian * direction;
    let linear =
        forward.inverse.observations.iter().zip(change.iter()).filter_map(|(o, slope)| match o.certainty {
            Certainty::Between(low, high) => Some(0.5 * (high - low) / slope.abs()),
            _ => None,
        });
    let mut way = linear.fold(room, f64::min);
    let mut outside: Option<(f64, f64)> = None;
    for _ in 0..MOST_TRIES {
        let by = outside_by(forward, at(way).as_slice());
        if by > 0.0 {
            outside = Some((way, by));
        } else {
            inside = (way, by);
            if way >= room || by > -AT_EDGE {
                break;
            }
        }
        way = match outside {
            None => (2.0 * way).min(room),
            // Without an equilibrium no interpolation is possible.
            Some((far, by)) if by.is_finite() => {
                let part = (AT_EDGE / 2.0 + inside.1) / (inside.1 - by);
                inside.0 + (far - inside.0) * part.clamp(0.05, 0.95)
            }
            Some((far, _)) => 0.5 * (inside.0 + far),
        };
    }
    at(inside.0).iter().copied().collect()
}

/// Largest distance of a fitted value outside its range, as a part of half that range: negative inside,
/// infinite if no equilibrium is found.
fn outside_by<const D: usize>(forward: &mut Forward<'_, D>, tensions: &[f64]) -> f64 {
    if forward.residuals(tensions).is_none() {
        return f64::INFINITY;
    }
    let each = forward.inverse.observations.iter().filter_map(|o| match o.certainty {
        Certainty::Between(low, high) => {
            let half = 0.5 * (high - low);
            Some(((o.observable.value(forward.positions()) - 0.5 * (low + high)).abs() - half) / half)
        }
        _ => None,
    });
    each.fold(f64::NEG_INFINITY, f64::max)
}
