//! Work-precision diagram: error against cost on logarithmic axes, a curve for each method.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::ops::RangeInclusive;

use super::{Anchor, Entry, Face, INK, MARGIN, Px, RULE, Svg, WIDTH, closed, data, legend};
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

/// The runs of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionCurve {
    /// Name in the legend.
    pub name: String,
    /// Cost and error of each run, joined in this order; points that are not positive and finite are left
    /// out, because the axes are logarithmic.
    pub points: Vec<(f64, f64)>,
}

/// Draws the curves as SVG text. `x` and `y` are the names of the axes with units.
///
/// # Errors
/// [`ReportError::Curves`] without a point to draw or with more than ten curves.
pub fn work_precision(title: &str, x: &str, y: &str, curves: &[PrecisionCurve]) -> Result<Svg, ReportError> {
    let curves: Vec<PrecisionCurve> = curves.iter().map(visible).filter(|c| !c.points.is_empty()).collect();
    if curves.is_empty() || curves.len() > MOST_CURVES {
        return Err(ReportError::Curves { curves: curves.len(), most: MOST_CURVES });
    }
    let (mut svg, top) = Svg::new(title, &description(x, y, &curves), WIDTH);
    let top = top + key(&mut svg, &curves, top) + MARGIN;
    let frame = Frame {
        x: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.0)),
        y: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.1)),
        top,
    };
    axes(&mut svg, &frame, x, y);
    curves.iter().enumerate().for_each(|(n, c)| draw(&mut svg, &frame, n, c));
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

/// The whole decades that contain all values.
fn decades(values: impl Iterator<Item = f64>) -> RangeInclusive<i32> {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.map(f64::log10).fold(none, |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (low.floor() as i32, high.ceil() as i32);
    low..=high.max(low + 1)
}

/// Position of the decades on the sheet.
struct Frame {
    x: RangeInclusive<i32>,
    y: RangeInclusive<i32>,
    top: f64,
}

impl Frame {
    fn place(&self, (x, y): (f64, f64)) -> Px {
        let part = |v: f64, r: &RangeInclusive<i32>| {
            (v.log10() - f64::from(*r.start())) / f64::from(r.end() - r.start())
        };
        let width = WIDTH - LEFT - 2.0 * MARGIN;
        [LEFT + width * part(x, &self.x), self.top + PLOT * (1.0 - part(y, &self.y))]
    }
}

fn axes(svg: &mut Svg, frame: &Frame, x: &str, y: &str) {
    let ten = |e: i32| 10f64.powi(e);
    let (x0, x1, y0, y1) = (*frame.x.start(), *frame.x.end(), *frame.y.start(), *frame.y.end());
    let every = |r: i32| (r / 10 + 1) as usize;
    for e in (x0..=x1).step_by(every(x1 - x0)) {
        let (foot, head) = (frame.place((ten(e), ten(y0))), frame.place((ten(e), ten(y1))));
        svg.line(foot, head, RULE, 1.0);
        svg.text([foot[0], foot[1] + 26.0], Anchor::Middle, Face::Plain, &power(e));
    }
    for e in (y0..=y1).step_by(every(y1 - y0)) {
        let (foot, head) = (frame.place((ten(x0), ten(e))), frame.place((ten(x1), ten(e))));
        svg.line(foot, head, RULE, 1.0);
        svg.text([foot[0] - 10.0, foot[1]], Anchor::End, Face::Plain, &power(e));
    }
    let corner = frame.place((ten(x0), ten(y0)));
    let ends = [frame.place((ten(x0), ten(y1))), corner, frame.place((ten(x1), ten(y0)))];
    svg.stroke(&data([ends]), INK, 1.5);
    svg.text([LEFT + 0.5 * (WIDTH - LEFT), corner[1] + 68.0], Anchor::Middle, Face::Plain, x);
    svg.upright_text([MARGIN + 8.0, frame.top + 0.5 * PLOT], y);
}

/// `10⁻³`.
fn power(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| c.to_digit(10).map_or('⁻', |d| RAISED[d as usize % 10]));
    format!("10{}", raised.collect::<String>())
}

fn draw(svg: &mut Svg, frame: &Frame, number: usize, curve: &PrecisionCurve) {
    let points: Vec<Px> = curve.points.iter().map(|&p| frame.place(p)).collect();
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
    fn decades_hold_all_values_and_powers_are_raised() {
        assert_eq!(decades([3e-5, 0.2].into_iter()), -5..=0);
        assert_eq!(decades([1.0].into_iter()), 0..=1);
        assert_eq!(power(-10), "10⁻¹⁰");
        assert_eq!(power(3), "10³");
    }

    #[test]
    fn equal_ratios_are_equal_distances() {
        let frame = Frame { x: -2..=2, y: 0..=4, top: 0.0 };
        let [a, b, c] = [1e-1, 1.0, 1e1].map(|x| frame.place((x, 1e2)));
        assert!(((b[0] - a[0]) - (c[0] - b[0])).abs() < 1e-9);
        assert!((a[1] - 0.5 * PLOT).abs() < 1e-9);
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
