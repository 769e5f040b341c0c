use nalgebra::SVector;
use tongue_input::measured::muscles::Muscles;

use super::axes::Bounds;
use super::{FontFace, Px, TEXT};

const GAP: f64 = 7.0;
/// Candidate places of a name as parts of its line's length, best first.
const PARTS: [f64; 9] = [0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2, 0.9, 0.1];

pub(super) struct MuscleLabel<'a> {
    pub name: &'a str,
    pub face: FontFace,
    pub line: &'a [Px],
}

fn around(middle: Px, half: Px) -> Bounds {
    Bounds { low: [0, 1].map(|i| middle[i] - half[i]), high: [0, 1].map(|i| middle[i] + half[i]) }
}

fn shared_area(a: &Bounds, b: &Bounds) -> f64 {
    let [width, height] = [0, 1].map(|i| (a.high[i].min(b.high[i]) - a.low[i].max(b.low[i])).max(0.0));
    width * height
}

/// The centre of every name, in the order of the lines; `None` for a line without length. Names avoid each other, the lines, `points` and
/// the outside of the frame (two corners, px) as far as possible.
pub(super) fn place(lines: &[MuscleLabel<'_>], points: &[Px], frame: [Px; 2]) -> Vec<Option<Px>> {
    let frame = Bounds { low: frame[0], high: frame[1] };
    let obstacles: Vec<Px> =
        lines.iter().flat_map(|l| samples(l.line)).chain(points.iter().copied()).collect();
    let mut taken: Vec<Bounds> = Vec::new();
    Vec::from_iter(lines.iter().map(|named| {
        let half = [0.5 * named.face.width(named.name), 0.5 * TEXT];
        let mut best: Option<(f64, Px)> = None;
        for (rank, part) in PARTS.into_iter().enumerate() {
            let Some((on, along)) = point_at(named.line, part) else { continue };
            let across = [-along[1], along[0]];
            let reach = across[0].abs() * half[0] + across[1].abs() * half[1] + GAP;
            for side in [1.0, -1.0] {
                let middle = [0, 1].map(|i| on[i] + side * reach * across[i]);
                let area = around(middle, half);
                let cost = cost(&area, &taken, &obstacles, &frame) + rank as f64;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, middle));
                }
            }
        }
        let (_, middle) = best?;
        taken.push(around(middle, half.map(|h| h + 3.0)));
        Some(middle)
    }))
}

fn cost(area: &Bounds, taken: &[Bounds], obstacles: &[Px], frame: &Bounds) -> f64 {
    let size = (area.high[0] - area.low[0]) * (area.high[1] - area.low[1]);
    let hidden: f64 = taken.iter().map(|t| shared_area(area, t)).sum::<f64>() / size;
    let outside = 1.0 - shared_area(area, frame) / size;
    let crossed = obstacles.iter().filter(|p| area.contains(&SVector::from(**p))).count() as f64;
    1e4 * (hidden + outside) + 4.0 * crossed
}

/// The point at a part of a line's length, and the direction there.
pub(super) fn point_at(line: &[Px], part: f64) -> Option<(Px, Px)> {
    let length = |p: &[Px]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
    let whole: f64 = line.windows(2).map(length).sum();
    let mut left = part * whole;
    for pair in line.windows(2) {
        let own = length(pair);
        if own > 0.0 && left <= own * (1.0 + 1e-9) {
            let along = [0, 1].map(|i| (pair[1][i] - pair[0][i]) / own);
            return Some(([0, 1].map(|i| pair[0][i] + left * along[i]), along));
        }
        left -= own;
    }
    None
}

fn samples(line: &[Px]) -> Vec<Px> {
    Vec::from_iter(line.windows(2).flat_map(|pair: &[Px]| -> Vec<Px> {
        (0..=20)
            .map(|n| f64::from(n) / 20.0)
            .map(|t| [0, 1].map(|i| pair[0][i] + t * (pair[1][i] - pair[0][i])))
            .collect()
    }))
}

pub(in crate::report) fn colours(names: &[String]) -> Vec<String> {
    Muscles::built_in().info(names).iter().map(|m| m.colour.to_lowercase()).collect()
}
