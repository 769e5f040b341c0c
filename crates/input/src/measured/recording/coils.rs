//! Plausibility of coils on the tongue: their order from the tip, their distances, which way is up.

use tongue_core::geometry::Point;

use super::doubt::{Doubt, exchanged_axes};
use super::dynamics::FEW;
use super::{AlignedRecording, names};

/// Range of the mean distance of neighbouring coils that is usual, m, and largest usual distance of the last
/// one behind the first along the tongue, m: coils are glued 10 to 20 mm apart on its front 60 mm.
const USUAL_GAP_M: [f64; 2] = [9e-3, 28e-3];
const USUAL_LENGTH_M: f64 = 58e-3;
/// A middle coil is low if it lies this far below the line of its neighbours and below the first coil, m.
const HOLLOW_M: f64 = 2e-3;
/// A coil that is low in this part of the frames is reported. A retroflex makes one low, but only for a short time.
const HOLLOW_PART: f64 = 0.8;
/// A coil that is this far in front of the one at the tip is reported, m.
const IN_FRONT_M: f64 = 3e-3;

/// Doubts about coils with these median places.
pub(super) fn of_coils(seen: &AlignedRecording, middles: &[Option<Point>]) -> Vec<Doubt> {
    let mut coils: Vec<(&str, f64, Point)> = Vec::new();
    coils.extend(seen.sensors.iter().zip(middles).filter_map(|((n, at), m)| Some((n.as_str(), *at, (*m)?))));
    coils.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (Some(first), Some(last)) = (coils.first(), coils.last()) else { return Vec::new() };
    if coils.len() < 2 {
        return Vec::new();
    }
    // The two that are farthest from each other, since those on exchanged axes are out of order.
    let pairs = coils.iter().flat_map(|a| coils.iter().map(|b| b.2 - a.2));
    let widest = pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
    let axes = exchanged_axes(seen, widest);
    let listed = |of: &[(&str, f64, Point)]| of.iter().map(|c| c.0).collect::<Vec<_>>().join(", ");
    let help = "correct their names or numbers in a map";
    let turns = |w: &[(&str, f64, Point)]| (w[1].2 - w[0].2).dot(&(w[2].2 - w[1].2)) < 0.0;
    if let Some(w) = coils.windows(3).find(|w| turns(w)) {
        let what = format!("the coils {} do not lie along the tongue in this order", listed(w));
        let names = || Doubt::refused(format!("{what}: two of them seem to be exchanged; {help}"));
        return vec![axes.unwrap_or_else(names)];
    }
    let ranks: Vec<u32> = coils.iter().filter_map(|c| names::rank(c.0)).collect();
    let named = ranks.len() == coils.len();
    if first.2.x > last.2.x + IN_FRONT_M || (named && ranks.windows(2).all(|w| w[0] > w[1])) {
        let what = "the coil at the tip lies behind the others";
        return vec![Doubt::refused(format!("{what}; correct back in the map, or {help}"))];
    }
    let mut out = Vec::new();
    if named && ranks.windows(2).any(|w| w[0] > w[1]) {
        let order = listed(&coils);
        let names = || {
            Doubt::told(format!(
                "from the tip backwards the coils lie in the order {order}: their names seem to be exchanged; they are taken as they lie"
            ))
        };
        out.push(axes.unwrap_or_else(names));
    }
    let gaps: Vec<f64> = coils.windows(2).map(|w| (w[1].2 - w[0].2).norm()).collect();
    let length = gaps.iter().sum::<f64>();
    let gap = length / gaps.len() as f64;
    if coils.len() > 2
        && !seen.stated.unit
        && (!(USUAL_GAP_M[0]..=USUAL_GAP_M[1]).contains(&gap) || length > USUAL_LENGTH_M)
    {
        out.push(Doubt::refused(format!(
            "its coils lie {:.1} mm apart, {:.0} mm from the first to the last, where 10 to 20 mm on the front 60 mm of a tongue are usual; \
             give unit_mm in a map: the right one, or the same (1 for millimetres) if the coils do lie so",
            gap * 1e3,
            length * 1e3
        )));
    }
    let judged = if seen.frames.len() < FEW || seen.stated.axes { &[] } else { &coils[1..coils.len() - 1] };
    let depth = |[first, p, last]: [Point; 3]| {
        let along = last - first;
        (along.perp(&(first - p)) / along.norm()).min(first.y - p.y)
    };
    let number = |name: &str| seen.sensors.iter().position(|(n, _)| n == name);
    let hollow = judged.iter().filter_map(|(name, _, p)| {
        let numbers = [number(first.0)?, number(name)?, number(last.0)?];
        let at = |f: &super::AlignedFrame| {
            let [a, b, c] = numbers.map(|n| f.sensors[n].map(|m| m.at));
            Some([a?, b?, c?])
        };
        let depths: Vec<f64> = seen.frames.iter().filter_map(at).map(depth).collect();
        let deep = depths.iter().filter(|d| **d > 0.0).count();
        let is_hollow = deep as f64 > HOLLOW_PART * depths.len() as f64;
        is_hollow.then_some((depth([first.2, *p, last.2]), name))
    });
    let deepest = hollow.max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((depth, name)) = deepest.filter(|(depth, _)| *depth > HOLLOW_M) {
        out.push(Doubt::refused(format!(
            "{name} lies {:.0} mm below the line from {} to {} throughout, where a tongue is arched upwards: either the recording is upside \
             down, or the tongue is held hollow, as in a retroflex; say which by up = \"-y\" or up = \"y\" in a map",
            depth * 1e3,
            first.0,
            last.0
        )));
    }
    out
}
