//! Work-precision diagram: error against cost on logarithmic axes, a curve for each method.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use super::plot::{Axis, Plot};
use super::{INK, Legend, MARGIN, Px, Svg, WIDTH, closed_paths, data};
use crate::report::{ReportError, joined};

/// Colours of Okabe and Ito (2008) that contrast with white; neighbours in the list differ in lightness too.
const COLOURS: [&str; 7] = [INK, "#e69f00", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"];
/// Shapes of markers, which distinguish curves without colour: number of corners, and direction of the first corner, rad.
const SHAPES: [(u32, f64); 5] = [(24, 0.0), (4, FRAC_PI_4), (3, -FRAC_PI_2), (4, 0.0), (3, FRAC_PI_2)];
const MOST_CURVES: usize = 2 * SHAPES.len();

const PLOT: f64 = 520.0;
const LEFT: f64 = 120.0;
const BOTTOM: f64 = 100.0;
const SAMPLE: f64 = 56.0;
const MARK: f64 = 10.5;

#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionCurve {
    pub name: String,
    /// Cost and error of each run, joined in this order; points that are not positive and finite have no place on logarithmic axes.
    pub points: Vec<(f64, f64)>,
}

pub fn work_precision(title: &str, x: &str, y: &str, curves: &[PrecisionCurve]) -> Result<Svg, ReportError> {
    let curves = curves.iter().map(|c| {
        let points =
            c.points.iter().copied().filter(|p| [p.0, p.1].iter().all(|v| v.is_finite() && *v > 0.0));
        (c.name.as_str(), points.collect::<Vec<_>>())
    });
    let curves: Vec<_> = curves.filter(|(_, points)| !points.is_empty()).collect();
    if curves.is_empty() || curves.len() > MOST_CURVES {
        return Err(ReportError::Curves { curves: curves.len(), most: MOST_CURVES });
    }
    let summary = curves.iter().map(|(name, points)| {
        let points = points.iter().map(|p| format!("({:.2e}, {:.2e})", p.0, p.1));
        format!("{name}: {}.", joined(points, " "))
    });
    let described = format!("{y} against {x}. {}", joined(summary, " "));
    let (mut svg, top) = Svg::new(title, &described, WIDTH);
    let mut legend = Legend::new([LEFT, WIDTH - MARGIN], top);
    for (number, (name, _)) in curves.iter().enumerate() {
        legend.entry(&mut svg, SAMPLE, name, |svg, [x, y]| {
            svg.line([x, y], [x + SAMPLE - 12.0, y], COLOURS[number % COLOURS.len()], 2.0);
            mark(svg, number, [x + 0.5 * (SAMPLE - 12.0), y]);
        });
    }
    let all = curves.iter().flat_map(|(_, points)| points);
    let corner = [LEFT, top + legend.height() + MARGIN];
    let edges = [decades(all.clone().map(|p| p.0)), decades(all.map(|p| p.1))];
    let plot = Plot::linear(corner, [WIDTH - LEFT - 2.0 * MARGIN, PLOT], edges[0], edges[1]);
    let plot = Plot { logarithmic: true, ..plot };
    plot.axes(&mut svg, [Axis::Named(x), Axis::Named(y)]);
    for (number, (_, points)) in curves.iter().enumerate() {
        let points: Vec<Px> = points.iter().map(|&(x, y)| plot.place(x.log10(), y.log10())).collect();
        svg.stroke(&data([points.iter().copied()]), COLOURS[number % COLOURS.len()], 2.0);
        points.into_iter().for_each(|p| mark(&mut svg, number, p));
    }
    Ok(svg.finish(plot.corner[1] + PLOT + BOTTOM))
}

/// The logarithms of the powers of ten around these values.
fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.map(f64::log10).fold(none, |(l, h), v| (l.min(v), h.max(v)));
    [low.floor(), high.ceil().max(low.floor() + 1.0)]
}

fn mark(svg: &mut Svg, number: usize, [x, y]: Px) {
    let (corners, first) = SHAPES[number % SHAPES.len()];
    let outline = (0..corners)
        .map(|i| first + TAU * f64::from(i) / f64::from(corners))
        .map(|a| [x + MARK * a.cos(), y + MARK * a.sin()]);
    let (outline, colour) = (closed_paths([outline]), COLOURS[number % COLOURS.len()]);
    svg.fill(&outline, if number < SHAPES.len() { colour } else { "#ffffff" });
    svg.stroke(&outline, colour, 2.2);
}
