//! Work-precision diagram: error against what it costs, both axes logarithmic, a curve for each method.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::ops::RangeInclusive;

use plotters::element::{PathElement, Polygon};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, FontTransform, RGBColor};

use super::ReportError;
use super::figure::{self, Canvas, DrawError, INK, MARGIN, RULE, Sheet, TEXT, WIDTH, line, px, stroke};

/// Okabe and Ito's (2008) colours that stand out on white; neighbours in the list differ in lightness too.
const COLORS: [RGBColor; 7] = [
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0x56, 0xB4, 0xE9),
];
/// Most curves: as many as there are marker shapes, so that shape alone tells them apart.
const MOST_CURVES: usize = 10;

const LEGEND_ROW: i32 = 36;
const PLOT: i32 = 520;
const LEFT: i32 = 120;
const BOTTOM: i32 = 100;
const SAMPLE: i32 = 56;
/// Half the size of a marker, px.
const MARK: i32 = 9;

/// What one method achieved.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Cost and error of each run, joined in this order; points that are not positive and finite have no place on
    /// logarithmic axes and are left out.
    pub points: Vec<(f64, f64)>,
}

/// Draws the curves as SVG text. `x` and `y` name the axes, units included.
///
/// # Errors
/// [`ReportError::Curves`] without a point to draw or with more than ten curves; [`ReportError::Drawing`] if the drawing
/// library fails.
pub fn work_precision(title: &str, x: &str, y: &str, curves: &[Curve]) -> Result<String, ReportError> {
    let curves: Vec<Curve> = curves.iter().map(visible).filter(|c| !c.points.is_empty()).collect();
    if curves.is_empty() || curves.len() > MOST_CURVES {
        return Err(ReportError::Curves { curves: curves.len(), most: MOST_CURVES });
    }
    let frame = Frame {
        x: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.0)),
        y: decades(curves.iter().flat_map(|c| &c.points).map(|p| p.1)),
        top: legend_places(&curves).last().map_or(0, |p| p.1) + 2 * LEGEND_ROW,
    };
    let sheet = Sheet { title, description: description(x, y, &curves), height: frame.top + PLOT + BOTTOM };
    sheet.draw(|canvas| {
        legend(canvas, &curves)?;
        axes(canvas, &frame, x, y)?;
        curves.iter().enumerate().try_for_each(|(n, c)| draw(canvas, &frame, n, c))
    })
}

fn visible(curve: &Curve) -> Curve {
    let fits = |v: f64| v.is_finite() && v > 0.0;
    let points = curve.points.iter().copied().filter(|p| fits(p.0) && fits(p.1)).collect();
    Curve { name: curve.name.clone(), points }
}

fn description(x: &str, y: &str, curves: &[Curve]) -> String {
    let told = curves.iter().map(|c| {
        let points: Vec<String> = c.points.iter().map(|p| format!("({:.2e}, {:.2e})", p.0, p.1)).collect();
        format!("{}: {}.", c.name, points.join(" "))
    });
    format!("{y} against {x}. {}", told.collect::<Vec<_>>().join(" "))
}

/// The whole decades that hold all values.
fn decades(values: impl Iterator<Item = f64>) -> RangeInclusive<i32> {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.map(f64::log10).fold(none, |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (low.floor() as i32, high.ceil() as i32);
    low..=high.max(low + 1)
}

/// Where the decades lie on the canvas.
struct Frame {
    x: RangeInclusive<i32>,
    y: RangeInclusive<i32>,
    top: i32,
}

impl Frame {
    fn place(&self, (x, y): (f64, f64)) -> (i32, i32) {
        let part = |v: f64, r: &RangeInclusive<i32>| {
            (v.log10() - f64::from(*r.start())) / f64::from(r.end() - r.start())
        };
        let width = f64::from(px(WIDTH - LEFT - 2 * MARGIN));
        let across = f64::from(px(LEFT)) + width * part(x, &self.x);
        let down = f64::from(px(self.top)) + f64::from(px(PLOT)) * (1.0 - part(y, &self.y));
        (across.round() as i32, down.round() as i32)
    }
}

fn axes(canvas: &Canvas, frame: &Frame, x: &str, y: &str) -> Result<(), DrawError> {
    let ten = |e: i32| 10f64.powi(e);
    let (x0, x1, y0, y1) = (*frame.x.start(), *frame.x.end(), *frame.y.start(), *frame.y.end());
    let every = |r: i32| (r / 10 + 1) as usize;
    for e in (x0..=x1).step_by(every(x1 - x0)) {
        let (foot, head) = (frame.place((ten(e), ten(y0))), frame.place((ten(e), ten(y1))));
        canvas.draw(&line(foot, head, stroke(RULE, 10)))?;
        canvas.draw_text(&power(e), &figure::text(HPos::Center), (foot.0, foot.1 + px(26)))?;
    }
    for e in (y0..=y1).step_by(every(y1 - y0)) {
        let (foot, head) = (frame.place((ten(x0), ten(e))), frame.place((ten(x1), ten(e))));
        canvas.draw(&line(foot, head, stroke(RULE, 10)))?;
        canvas.draw_text(&power(e), &figure::text(HPos::Right), (foot.0 - px(10), foot.1))?;
    }
    let corner = frame.place((ten(x0), ten(y0)));
    canvas.draw(&line(corner, frame.place((ten(x1), ten(y0))), stroke(INK, 15)))?;
    canvas.draw(&line(corner, frame.place((ten(x0), ten(y1))), stroke(INK, 15)))?;
    let middle = px(LEFT + (WIDTH - LEFT) / 2);
    canvas.draw_text(&figure::printable(x), &figure::text(HPos::Center), (middle, corner.1 + px(68)))?;
    let upright = figure::text(HPos::Center).transform(FontTransform::Rotate270);
    canvas.draw_text(&figure::printable(y), &upright, (px(MARGIN + 8), px(frame.top + PLOT / 2)))
}

/// `10⁻³`.
fn power(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| c.to_digit(10).map_or('⁻', |d| RAISED[d as usize % 10]));
    format!("10{}", raised.collect::<String>())
}

fn draw(canvas: &Canvas, frame: &Frame, number: usize, curve: &Curve) -> Result<(), DrawError> {
    let color = COLORS[number % COLORS.len()];
    let points: Vec<(i32, i32)> = curve.points.iter().map(|&p| frame.place(p)).collect();
    canvas.draw(&PathElement::new(points.clone(), stroke(color, 20)))?;
    points.into_iter().try_for_each(|p| mark(canvas, number, p))
}

/// The marker of curve `number`: its shape alone tells it from the others.
fn mark(canvas: &Canvas, number: usize, (x, y): (i32, i32)) -> Result<(), DrawError> {
    let color = COLORS[number % COLORS.len()];
    let spike = |angle: f64, reach: f64| {
        let r = f64::from(px(MARK)) * reach;
        (x + (r * angle.cos()).round() as i32, y + (r * angle.sin()).round() as i32)
    };
    let ring = |corners: u32, first: f64, reach: f64| -> Vec<(i32, i32)> {
        (0..=corners).map(|i| spike(first + TAU * f64::from(i) / f64::from(corners), reach)).collect()
    };
    let star = || -> Vec<(i32, i32)> {
        (0..=10)
            .map(|i| spike(-FRAC_PI_2 + TAU * f64::from(i) / 10.0, if i % 2 == 0 { 1.3 } else { 0.5 }))
            .collect()
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
    let fill = if filled { color } else { RGBColor(0xFF, 0xFF, 0xFF) };
    canvas.draw(&Polygon::new(outline.clone(), fill.filled()))?;
    canvas.draw(&PathElement::new(outline, stroke(color, 22)))
}

/// Where the entries of the legend begin, px.
fn legend_places(curves: &[Curve]) -> Vec<(i32, i32)> {
    let (mut x, mut y) = (LEFT, 0);
    let mut places = Vec::new();
    for curve in curves {
        let letters = i32::try_from(curve.name.chars().count()).unwrap_or(WIDTH).min(WIDTH);
        let width = SAMPLE + letters * TEXT * 55 / 100;
        if x > LEFT && x + width > WIDTH - MARGIN {
            (x, y) = (LEFT, y + LEGEND_ROW);
        }
        places.push((x, y));
        x += width + 2 * MARGIN;
    }
    places
}

fn legend(canvas: &Canvas, curves: &[Curve]) -> Result<(), DrawError> {
    for (number, (curve, (x, y))) in curves.iter().zip(legend_places(curves)).enumerate() {
        let (left, middle) = (px(x), px(y + LEGEND_ROW));
        let color = COLORS[number % COLORS.len()];
        canvas.draw(&line((left, middle), (left + px(SAMPLE - 12), middle), stroke(color, 20)))?;
        mark(canvas, number, (left + px((SAMPLE - 12) / 2), middle))?;
        let style = figure::text(HPos::Left);
        canvas.draw_text(&figure::printable(&curve.name), &style, (left + px(SAMPLE), middle))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, points: &[(f64, f64)]) -> Curve {
        Curve { name: name.into(), points: points.to_vec() }
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
        let frame = Frame { x: -2..=2, y: 0..=4, top: 0 };
        let [a, b, c] = [1e-1, 1.0, 1e1].map(|x| frame.place((x, 1e2)));
        assert_eq!(b.0 - a.0, c.0 - b.0);
        assert_eq!(a.1, px(PLOT / 2));
    }

    #[test]
    fn every_curve_is_in_legend_and_description_and_unplottable_points_are_left_out() {
        let curves = [curve("Newton", &[(1e-4, 1e-2), (2e-4, 0.0)]), curve("<Verlet>", &[(1.0, 1e-3)])];
        let svg = work_precision("T", "time, s", "error, mm", &curves).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let texts: Vec<_> = document.descendants().filter_map(|n| n.text()).map(str::trim).collect();
        for name in ["Newton", "<Verlet>", "time, s", "error, mm"] {
            assert!(texts.contains(&name), "{name}");
        }
        assert!(svg.contains("Newton: (1.00e-4, 1.00e-2)."), "the zero has no place");
        assert!(matches!(work_precision("T", "x", "y", &[]), Err(ReportError::Curves { curves: 0, .. })));
    }
}
