//! The effect of each muscle alone: a small picture for each, all with the same axes.

use super::axes::{Bounds, PlotView};
use super::body_view::{BodyView, DEFORMED, bone, picture_bounds};
use super::section::check;
use super::{Anchor, FontFace, INK, LEGEND_ROW, MARGIN, RULE, Svg, TEXT, data};
use crate::report::{ReportError, joined};
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;

const COLUMNS: usize = 4;
const PANEL: f64 = 400.0;
const GAP: f64 = 28.0;
/// Room for the name and two lines of text above a picture, px.
const HEAD: f64 = 4.2 * TEXT;
const GRID: f64 = 0.02;

#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub title: String,
    /// The effect, in at most two short lines.
    pub lines: Vec<String>,
    pub positions: Vec<Point>,
    pub tensions: Vec<f64>,
}

/// Draws shapes of one body side by side, each with the tissue at rest (grey), the contracting muscles and the palate, m.
pub fn panels(mesh: &Mesh<2>, palate: &[Point], panels: &[Panel], title: &str) -> Result<Svg, ReportError> {
    panels.iter().try_for_each(|p| check(mesh, &p.positions, &p.tensions))?;
    let columns = COLUMNS.min(panels.len());
    let width = 2.0 * MARGIN + columns as f64 * (PANEL + GAP) - GAP;
    let summary = joined(panels.iter().map(|p| format!("{}: {}.", p.title, p.lines.join(", "))), " ");
    let description = format!("Midsagittal sections, front to the left, all with the same axes. {summary}");
    let (mut svg, top) = Svg::new(title, &description, width);
    let bounds = picture_bounds(mesh, palate, panels.iter().map(|p| p.positions.as_slice()));
    let mut bottom = top;
    for (nth, panel) in panels.iter().enumerate() {
        let [row, column] = [nth / columns, nth % columns];
        let left = MARGIN + column as f64 * (PANEL + GAP);
        let height = PlotView::new(bounds, [0.0, 0.0], PANEL).end()[1] + HEAD + GAP;
        let upper = top + MARGIN + row as f64 * height;
        let body = BodyView::in_view(mesh, PlotView::new(bounds, [left, upper + HEAD], PANEL));
        svg.text([left, upper + 0.6 * TEXT], Anchor::Start, FontFace::Bold, &panel.title);
        for (line, text) in panel.lines.iter().take(2).enumerate() {
            let y = upper + (1.8 + 1.2 * line as f64) * TEXT;
            svg.text([left, y], Anchor::Start, FontFace::Plain, text);
        }
        draw(&mut svg, &body, palate, panel);
        bottom = body.view.end()[1];
    }
    let y = bottom + MARGIN + 0.5 * LEGEND_ROW;
    let met = if palate.is_empty() { "" } else { "; palate: for orientation, without contact" };
    let note =
        format!("grey: at rest; dark outline: as this muscle pulls; grid of 20 mm; front to the left{met}");
    svg.text([MARGIN, y], Anchor::Start, FontFace::Plain, &note);
    Ok(svg.finish(y + 0.5 * LEGEND_ROW + MARGIN))
}

fn draw(svg: &mut Svg, body: &BodyView<'_>, palate: &[Point], panel: &Panel) {
    let view = &body.view;
    let Bounds { low, high } = view.bounds;
    let point = |x: f64, y: f64| view.place(&Point::from([x, y]));
    let [upright, level] = [0, 1].map(|i| {
        let first = (low[i] / GRID).ceil() as i32;
        (first..).map(|n| f64::from(n) * GRID).take_while(move |v| *v <= high[i])
    });
    let upright = upright.map(|x| [point(x, low[1]), point(x, high[1])]);
    let level = level.map(|y| [point(low[0], y), point(high[0], y)]);
    // In a body much larger than a tongue the grid would be black.
    if (high[0] - low[0]) < 20.0 * GRID {
        svg.stroke(&data(upright.chain(level)), RULE, 1.0);
    }
    body.draw_rest(svg);
    body.draw_palate(svg, palate);
    svg.stroke(&body.outline(&panel.positions), DEFORMED, 3.0);
    for line in body.muscles(&panel.positions, &panel.tensions).iter().filter(|l| l.contracting) {
        line.draw(svg);
        line.draw_arrow(svg);
    }
    body.bones(&panel.positions).into_iter().for_each(|at| bone(svg, at));
    let edge =
        [point(low[0], low[1]), point(high[0], low[1]), point(high[0], high[1]), point(low[0], high[1])];
    svg.stroke(&super::closed_paths([edge]), INK, 1.2);
}
