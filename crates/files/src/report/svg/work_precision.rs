//! Work-precision diagram: error against cost on logarithmic axes, a curve for each method.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use super::plot::{Plot, Scale};
use super::{Entry, Face, INK, MARGIN, Px, Svg, WIDTH, closed, data, legend};
use crate::report::ReportError;

/// Colours of Okabe and Ito (2008) with contrast to white; neighbours in the list differ in lightness too.
const COLOURS: [&str; 7] = [INK, "#e69f00", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"];
/// Maximum number of curves: the number of marker shapes, which distinguish curves without colour.
const MOST_CURVES: usize = 10;

const PLOT: f64 = 520.0;
const LEFT: f64 = 120.0;
const BOTTOM: f64 = 100.0;
const SAMPLE: f64 = 56.0;
/// Half the size of a marker, px.
const MARK: f64 = 9.0;

#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionCurve {
    pub name: String,
    /// Cost and error of each run, joined in this order; points that are not positive and finite are left
    /// out, because the axes are logarithmic.
    pub points: Vec<(f64, f64)>,
}

/// Draws the curves as SVG text. `x` and `y` are the names of the axes with units.
pub fn work_precision(title: &str, x: &str, y: &str, curves: &[PrecisionCurve]) -> Result<Svg, ReportError> {
    let curves: Vec<PrecisionCurve> = curves.iter().map(visible).filter(|c| !c.points.is_empty()).collect();
    if curves.is_empty() || curves.len() > MOST_CURVES {
        return Err(ReportError::Curves { curves: curves.len(), most: MOST_CURVES });
    }
    let (mut svg, top) = Svg::new(title, &description(x, y, &curves), WIDTH);
    let top = top + key(&mut svg, &curves, top) + MARGIN;
    let plot = Plot {
        corner: [LEFT, top],
        size: [WIDTH - LEFT - 2.0 * MARGIN, PLOT],
        x: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.0)),
        y: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.1)),
        scale: Scale::Logarithmic,
    };
    plot.axes(&mut svg, [x, y]);
    curves.iter().enumerate().for_each(|(n, c)| draw(&mut svg, &plot, n, c));
    Ok(svg.finish(top + PLOT + BOTTOM))
}

fn visible(curve: &PrecisionCurve) -> PrecisionCurve {
    let fits = |v: f64| v.is_finite() && v > 0.0;
    let points = curve.points.iter().copied().filter(|p| fits(p.0) && fits(p.1)).collect();
    PrecisionCurve { name: curve.name.clone(), points }
}

fn description(x: &str, y: &str, curves: &[PrecisionCurve]) -> String {
    let told = curves.iter().map(|c| {
        let points: Vec<String> = c.points.iter().map(|p| format!("({:.2e}, {:.2e})", p.0, p.1)).collect();
        format!("{}: {}.", c.name, points.join(" "))
    });
    format!("{y} against {x}. {}", told.collect::<Vec<_>>().join(" "))
}

/// The ends of the whole decades that contain all values.
fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.map(f64::log10).fold(none, |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (low.floor() as i32, high.ceil() as i32);
    [low, high.max(low + 1)].map(|e| 10f64.powi(e))
}

fn draw(svg: &mut Svg, plot: &Plot, number: usize, curve: &PrecisionCurve) {
    let points: Vec<Px> = curve.points.iter().map(|&(x, y)| plot.place(x, y)).collect();
    svg.stroke(&data([points.iter().copied()]), COLOURS[number % COLOURS.len()], 2.0);
    points.into_iter().for_each(|p| mark(svg, number, p));
}

/// The marker of curve `number`, with a shape of its own.
fn mark(svg: &mut Svg, number: usize, [x, y]: Px) {
    let colour = COLOURS[number % COLOURS.len()];
    let spike = |angle: f64, reach: f64| [x + MARK * reach * angle.cos(), y + MARK * reach * angle.sin()];
    let ring = |corners: u32, first: f64, reach: f64| -> Vec<Px> {
        (0..corners).map(|i| spike(first + TAU * f64::from(i) / f64::from(corners), reach)).collect()
    };
    let star = || -> Vec<Px> {
        let reach = |i: u32| if i.is_multiple_of(2) { 1.3 } else { 0.5 };
        (0..10).map(|i| spike(-FRAC_PI_2 + TAU * f64::from(i) / 10.0, reach(i))).collect()
    };
    let (outline, filled) = match number {
        0 => (ring(24, 0.0, 0.9), true),
        1 => (ring(4, FRAC_PI_4, 1.2), true),
        2 => (ring(3, -FRAC_PI_2, 1.3), true),
        3 => (ring(4, 0.0, 1.2), true),
        4 => (ring(3, FRAC_PI_2, 1.3), true),
        5 => (star(), true),
        6 => (ring(24, 0.0, 0.9), false),
        7 => (ring(4, FRAC_PI_4, 1.2), false),
        8 => (ring(3, -FRAC_PI_2, 1.3), false),
        _ => (ring(4, 0.0, 1.2), false),
    };
    let outline = closed([outline]);
    svg.fill(&outline, if filled { colour } else { "#ffffff" });
    svg.stroke(&outline, colour, 2.2);
}

/// The legend above the plot; returns its height.
fn key(svg: &mut Svg, curves: &[PrecisionCurve], top: f64) -> f64 {
    let entries: Vec<Entry<'_>> =
        curves.iter().map(|c| Entry { sample: SAMPLE, face: Face::Plain, name: &c.name }).collect();
    let (places, height) = legend(svg, &entries, [LEFT, WIDTH - MARGIN], top);
    for (number, [x, y]) in places.into_iter().enumerate() {
        svg.line([x, y], [x + SAMPLE - 12.0, y], COLOURS[number % COLOURS.len()], 2.0);
        mark(svg, number, [x + 0.5 * (SAMPLE - 12.0), y]);
    }
    height
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, points: &[(f64, f64)]) -> PrecisionCurve {
        PrecisionCurve { name: name.into(), points: points.to_vec() }
    }

    #[test]
    fn decades_hold_all_values() {
        assert_eq!(decades([3e-5, 0.2].into_iter()), [1e-5, 1.0]);
        assert_eq!(decades([1.0].into_iter()), [1.0, 10.0]);
    }

    #[test]
    fn every_curve_is_in_legend_and_description_and_unplottable_points_are_left_out() {
        let curves = [curve("Newton", &[(1e-4, 1e-2), (2e-4, 0.0)]), curve("<Verlet>", &[(1.0, 1e-3)])];
        let svg = work_precision("T", "time, s", "error, mm", &curves).unwrap().to_string();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let texts: Vec<_> = document.descendants().filter_map(|n| n.text()).map(str::trim).collect();
        for name in ["Newton", "<Verlet>", "time, s", "error, mm"] {
            assert!(texts.contains(&name), "{name}");
        }
        assert!(svg.contains("Newton: (1.00e-4, 1.00e-2)."), "the zero has no place");
        assert!(matches!(work_precision("T", "x", "y", &[]), Err(ReportError::Curves { curves: 0, .. })));
    }
}
