//! The curve of tensions that fit equally well: the tensions along it, and below them the errors of the other muscles.

use crate::report::{SolutionCurveRecord, joined};
use tongue_input::measured::muscles::Muscles;

use super::axes::BELOW;
use super::plot::{Axis, Plot};
use super::{Anchor, FontFace, INK, MARGIN, Svg, WIDTH, data};

const LEFT: f64 = 104.0;
/// Heights of the two plots, and the gap between them, px.
const UPPER: f64 = 330.0;
const LOWER: f64 = 170.0;
const BETWEEN: f64 = 40.0;
const NAMES: f64 = 70.0;
const APART: f64 = 26.0;

pub fn solution_curve(named: &SolutionCurveRecord<'_>, reference: &str) -> Svg {
    let (curve, names, [before, after]) = (named.curve, &named.unknowns, named.ends());
    let tension = |p: usize, m: usize| curve.points[p].x[m];
    // Arc length along the curve, N.
    let mut way: Vec<f64> = vec![0.0];
    for p in 1..curve.points.len() {
        let squares: f64 = (0..names.len()).map(|m| (tension(p, m) - tension(p - 1, m)).powi(2)).sum();
        way.push(way[p - 1] + squares.sqrt());
    }
    let summary = curve
        .points
        .get(curve.answer)
        .map_or(String::new(), |p| joined(names.iter().zip(&p.x).map(|(m, t)| format!("{m} {t:.1}")), ", "));
    let met = format!("Tensions along the curve on which the ratios to {reference} are met");
    let count = curve.points.len();
    let description =
        format!("{met}, {count} points; the answer is {summary} N. It ends: {before}; {after}.");
    let (mut svg, top) = Svg::new("Tensions that meet the target equally well", &description, WIDTH);
    let end = way.last().copied().unwrap_or(0.0).max(1e-9);
    let plot = |most: f64, top: f64, height: f64| {
        Plot::linear([LEFT, top], [WIDTH - LEFT - NAMES - MARGIN, height], [0.0, end], [0.0, 1.05 * most])
    };
    let largest = curve.points.iter().flat_map(|p| &p.x).copied().fold(1.0, f64::max);
    let upper = plot(largest, top + MARGIN, UPPER);
    upper.axes(&mut svg, [Axis::Lines, Axis::Named("tension, N per metre")]);
    let rms: Vec<[f64; 2]> =
        way.iter().zip(&curve.points).filter_map(|(x, p)| Some([*x, p.other_rms?])).collect();
    let highest = rms.iter().map(|[_, r]| *r).fold(1e-3, f64::max);
    let lower = plot(highest, upper.corner[1] + UPPER + BETWEEN, LOWER);
    lower.axes(&mut svg, [Axis::Named("way along the curve, N per metre"), Axis::Named("passive RMS")]);
    if let Some(&at) = way.get(curve.answer) {
        let (head, foot) = (upper.place(at, upper.y[1]), lower.place(at, 0.0));
        svg.dashes(&data([[head, foot]]), INK, 1.5);
        svg.text([head[0] + 8.0, head[1] + 14.0], Anchor::Start, FontFace::Plain, "answer");
    }
    let mut labels: Vec<(f64, usize)> = Vec::new();
    for (m, info) in Muscles::built_in().info(names).iter().enumerate() {
        let mut points = way.iter().enumerate().map(|(p, x)| [*x, tension(p, m)]);
        svg.stroke(&upper.path(points.clone()), &info.colour, 3.0);
        labels.extend(points.next_back().map(|[x, y]| (upper.place(x, y)[1], m)));
    }
    svg.stroke(&lower.path(rms), INK, 3.0);
    // Names are placed from the top down, so that none overlaps another.
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    for (y, m) in labels {
        free = y.max(free);
        svg.text([WIDTH - NAMES - MARGIN + 10.0, free], Anchor::Start, FontFace::Bold, &names[m]);
        free += APART;
    }
    svg.finish(lower.corner[1] + LOWER + BELOW)
}
