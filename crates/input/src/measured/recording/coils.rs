//! Plausibility of coils on the tongue: their order from the tip, their distances, which way is up.

use tongue_core::geometry::Point;

use super::courses::FEW;
use super::doubts::Doubt;
use super::{Seen, names};

/// Range of the mean distance of neighbouring coils that is usual, m, and largest usual distance of the last
/// one behind the first along the tongue, m: coils are glued 10 to 20 mm apart on its front 60 mm.
const USUAL_GAP_M: [f64; 2] = [9e-3, 28e-3];
const USUAL_LENGTH_M: f64 = 58e-3;
/// A middle coil that is this far below the line of its neighbours and below the first one is reported, m.
const HOLLOW_M: f64 = 2e-3;
/// A coil that is this far in front of the one at the tip is reported, m.
const IN_FRONT_M: f64 = 3e-3;

/// Doubts about coils with these median places.
pub(super) fn of_coils(seen: &Seen, middles: &[Option<Point>]) -> Vec<Doubt> {
    let mut coils: Vec<(&str, f64, Point)> = Vec::new();
    coils.extend(seen.sensors.iter().zip(middles).filter_map(|((n, at), m)| Some((n.as_str(), *at, (*m)?))));
    coils.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (Some(first), Some(last)) = (coils.first(), coils.last()) else { return Vec::new() };
    if coils.len() < 2 {
        return Vec::new();
    }
    let listed = |of: &[(&str, f64, Point)]| of.iter().map(|c| c.0).collect::<Vec<_>>().join(", ");
    let help = "correct their names or numbers in a map";
    let turns = |w: &[(&str, f64, Point)]| (w[1].2 - w[0].2).dot(&(w[2].2 - w[1].2)) < 0.0;
    if let Some(w) = coils.windows(3).find(|w| turns(w)) {
        let what = format!("the coils {} do not lie along the tongue in this order", listed(w));
        return vec![Doubt::refused(format!("{what}: two of them seem to be exchanged; {help}"))];
    }
    let ranks: Vec<u32> = coils.iter().filter_map(|c| names::rank(c.0)).collect();
    let named = ranks.len() == coils.len();
    if first.2.x > last.2.x + IN_FRONT_M || (named && ranks.windows(2).all(|w| w[0] > w[1])) {
        let what = "the coil at the tip lies behind the others";
        return vec![Doubt::refused(format!("{what}; correct back in the map, or {help}"))];
    }
    let mut out = Vec::new();
    if named && ranks.windows(2).any(|w| w[0] > w[1]) {
        out.push(Doubt::told(format!(
            "from the tip backwards the coils lie in the order {}: their names seem to be exchanged; they are taken as they lie",
            listed(&coils)
        )));
    }
    let gaps: Vec<f64> = coils.windows(2).map(|w| (w[1].2 - w[0].2).norm()).collect();
    let length = gaps.iter().sum::<f64>();
    let gap = length / gaps.len() as f64;
    if coils.len() > 2 && (!(USUAL_GAP_M[0]..=USUAL_GAP_M[1]).contains(&gap) || length > USUAL_LENGTH_M) {
        out.push(Doubt::told(format!(
            "its coils lie {:.1} mm apart, {:.0} mm from the first to the last, where 10 to 20 mm on the front 60 mm of a tongue are usual; \
             if that is wrong, correct unit_mm in a map",
            gap * 1e3,
            length * 1e3
        )));
    }
    let judged = if seen.frames.len() < FEW { &[] } else { &coils[1..coils.len() - 1] };
    let hollow = judged.iter().map(|(name, _, p)| {
        let along = last.2 - first.2;
        (along.perp(&(first.2 - p)) / along.norm(), first.2.y - p.y, name)
    });
    let deepest = hollow.max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((depth, _, name)) = deepest.filter(|(depth, below, _)| depth.min(*below) > HOLLOW_M) {
        out.push(Doubt::told(format!(
            "{name} lies {:.0} mm below the line from {} to {}, where a tongue is arched upwards: the recording may be upside down; if so, \
             give the axis that grows upwards in a map, such as up = \"-y\"",
            depth * 1e3,
            first.0,
            last.0
        )));
    }
    out
}
