//! Picture of the tongue: mesh at rest and deformed, muscles and bones.

use std::ops::Range;

use nalgebra::SVector;
use plotters::backend::SVGBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::CoordTranslate;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingArea;
use plotters::element::{DashedPathElement, PathElement, Rectangle};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor, ShapeStyle, TRANSPARENT};

use super::ReportError;
use super::figure::{self, Canvas, DrawError, INK, MARGIN, Sheet, WIDTH, line, px, stroke};
use crate::body::{Mesh, MuscleChain};

/// The palette of Okabe and Ito (2008), which colour-blind readers can tell apart, in an order that gives the
/// genioglossus warm colours, the styloglossus cool ones and the hyoglossus green and black.
pub(super) const PALETTE: [RGBColor; 8] = [
    RGBColor(0xD5, 0x5E, 0x00), // GGa, vermillion
    RGBColor(0xE6, 0x9F, 0x00), // GGm, orange
    RGBColor(0xF0, 0xE4, 0x42), // GGp, yellow
    RGBColor(0x56, 0xB4, 0xE9), // SGp, sky blue
    RGBColor(0x00, 0x72, 0xB2), // SGm, blue
    RGBColor(0xCC, 0x79, 0xA7), // SGa, reddish purple
    RGBColor(0x00, 0x9E, 0x73), // HGa, bluish green
    RGBColor(0x00, 0x00, 0x00), // HGp, black
];

pub(super) const REST: RGBColor = RGBColor(0xC4, 0xC4, 0xC4);
pub(super) const DEFORMED: RGBColor = RGBColor(0x55, 0x55, 0x55);

const AXIS: i32 = 84;
const AXIS_BELOW: i32 = 76;
const ROW: i32 = 36;
const SAMPLE: i32 = 62;
const COLUMNS: usize = 4;

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws the mesh at rest (light grey) and deformed (dark), its muscles in colour and its bones as SVG text.
///
/// `deformed` holds the position of every node of `mesh`, m; `active` the numbers, in `mesh.muscles`, of the contracting
/// muscles, which are drawn thick and solid. Axes are in mm with equal scales: x grows to the back of the head, y
/// upwards.
///
/// # Errors
/// [`ReportError::NodeCount`] if `deformed` belongs to another mesh, [`ReportError::Position`] for a position that is not
/// finite, [`ReportError::Number`] for a node or a muscle that the mesh does not have.
pub fn tongue(
    mesh: &Mesh<2>,
    deformed: &[SVector<f64, 2>],
    active: &[usize],
    title: &str,
) -> Result<String, ReportError> {
    tongue_at_wall(mesh, deformed, active, &[], title)
}

/// As [`tongue`], with the rigid outline (m) that it meets, if it has points.
///
/// # Errors
/// As [`tongue`].
pub fn tongue_at_wall(
    mesh: &Mesh<2>,
    deformed: &[SVector<f64, 2>],
    active: &[usize],
    wall: &[SVector<f64, 2>],
    title: &str,
) -> Result<String, ReportError> {
    let axes = ["front \u{2190}\u{2003}x (mm)\u{2003}\u{2192} back", "y (mm)"];
    draw(
        mesh,
        deformed,
        active,
        wall,
        title,
        &Words { axes, shown: "Midsagittal section of the tongue, front to the left" },
    )
}

/// What a picture says of itself.
pub(super) struct Words {
    /// Names of the axes.
    pub axes: [&'static str; 2],
    /// What is to be seen, for readers who cannot see it.
    pub shown: &'static str,
}

/// The picture of any flat mesh.
pub(super) fn draw(
    mesh: &Mesh<2>,
    deformed: &[SVector<f64, 2>],
    active: &[usize],
    wall: &[SVector<f64, 2>],
    title: &str,
    words: &Words,
) -> Result<String, ReportError> {
    check(mesh, deformed, active)?;
    let rest = millimetres(&mesh.nodes);
    let deformed = millimetres(deformed);
    let wall = millimetres(wall);
    let view = View::of(rest.iter().chain(&deformed).chain(&wall));
    let rows = mesh.muscles.len().div_ceil(COLUMNS - 1).max(3) + 1;
    let legend_height = ROW * i32::try_from(rows).unwrap_or(1) + 2 * MARGIN;
    let plot_height = view.height + AXIS_BELOW + MARGIN;
    let styles: Vec<_> = mesh
        .muscles
        .iter()
        .enumerate()
        .zip(PALETTE.into_iter().cycle())
        .map(|((number, muscle), color)| Line { muscle, color, active: active.contains(&number) })
        .collect();
    let sheet = Sheet {
        title,
        description: description(mesh, &styles, words.shown),
        height: plot_height + legend_height,
    };
    sheet.draw(|canvas| {
        let (above, below) = canvas.split_vertically(px(plot_height));
        let mut chart = ChartBuilder::on(&above)
            .margin_top(px(MARGIN))
            .margin_right(px(MARGIN))
            .margin_left(px(MARGIN))
            .y_label_area_size(px(AXIS - MARGIN))
            .x_label_area_size(px(AXIS_BELOW))
            .build_cartesian_2d(view.x.clone(), view.y.clone())?;
        axes(&mut chart, words.axes)?;
        shapes(&mut chart, mesh, &rest, &deformed)?;
        if !wall.is_empty() {
            chart.draw_series([PathElement::new(wall, stroke(INK, 60))])?;
        }
        for pulling in [false, true] {
            for style in styles.iter().filter(|s| s.active == pulling) {
                let path = style.muscle.nodes.iter().filter_map(|&n| deformed.get(n).copied()).collect();
                style.draw(chart.plotting_area(), path)?;
            }
        }
        bones(&mut chart, mesh, &deformed)?;
        legend(&below, &styles, rows)
    })
}

/// Every number and position that the drawing relies on.
pub(super) fn check<const D: usize>(
    mesh: &Mesh<D>,
    deformed: &[SVector<f64, D>],
    active: &[usize],
) -> Result<(), ReportError> {
    let count = mesh.nodes.len();
    if deformed.len() != count {
        return Err(ReportError::NodeCount { nodes: count, deformed: deformed.len() });
    }
    for (shape, positions) in [("rest", mesh.nodes.as_slice()), ("deformed", deformed)] {
        for (node, p) in positions.iter().enumerate() {
            if !p.iter().all(|c| c.abs() <= 1e3) {
                return Err(ReportError::Position { shape, node, x: p[0], y: p[1] });
            }
        }
    }
    let named = |what: &dyn Fn() -> String, nodes: &[usize]| match nodes.iter().find(|&&n| n >= count) {
        Some(&number) => Err(ReportError::Number { what: what(), kind: "node", number, count }),
        None => Ok(()),
    };
    for (nth, pair) in mesh.connections.iter().enumerate() {
        named(&|| format!("connection {nth}"), pair)?;
    }
    for muscle in &mesh.muscles {
        named(&|| format!("muscle {}", muscle.name), &muscle.nodes)?;
    }
    named(&|| "the list of fixed nodes".to_owned(), &mesh.fixed)?;
    let count = mesh.muscles.len();
    match active.iter().find(|&&m| m >= count) {
        Some(&number) => {
            let what = "the list of contracting muscles".to_owned();
            Err(ReportError::Number { what, kind: "muscle", number, count })
        }
        None => Ok(()),
    }
}

fn description(mesh: &Mesh<2>, lines: &[Line], shown: &str) -> String {
    let names = |active| {
        let names: Vec<_> =
            lines.iter().filter(|l| l.active == active).map(|l| l.muscle.name.as_str()).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    format!(
        "{shown}: a mesh of {} nodes and {} triangles at rest (grey) and \
         deformed (dark). Contracting muscles: {}. Passive muscles: {}.",
        mesh.nodes.len(),
        mesh.cells.len(),
        names(true),
        names(false)
    )
}

fn millimetres(positions_m: &[SVector<f64, 2>]) -> Vec<(f64, f64)> {
    positions_m.iter().map(|p| (1e3 * p.x, 1e3 * p.y)).collect()
}

/// The part of the plane that is shown.
struct View {
    /// mm.
    x: Range<f64>,
    /// mm.
    y: Range<f64>,
    /// Height of the plot, px, that gives both axes one scale.
    height: i32,
}

impl View {
    /// All points (mm) with a margin. The view is never flatter than 1 : 2 nor higher than 4 : 3, so that a figure of
    /// any body fits a page.
    fn of<'a>(points: impl Iterator<Item = &'a (f64, f64)>) -> Self {
        let start = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        let [x, y] =
            points.fold(start, |[x, y], &(px, py)| [(x.0.min(px), x.1.max(px)), (y.0.min(py), y.1.max(py))]);
        let middle = |(low, high): (f64, f64)| if low <= high { 0.5 * (low + high) } else { 0.0 };
        let size = |(low, high): (f64, f64)| 1.06 * (high - low).max(1.0);
        let width = size(x).max(0.75 * size(y));
        let height = size(y).max(0.5 * width);
        let span = |middle: f64, size: f64| middle - 0.5 * size..middle + 0.5 * size;
        let pixels = f64::from(WIDTH - AXIS - MARGIN);
        Self {
            x: span(middle(x), width),
            y: span(middle(y), height),
            height: (pixels * height / width).round() as i32,
        }
    }
}

fn axes(chart: &mut Chart, [x, y]: [&str; 2]) -> Result<(), DrawError> {
    chart
        .configure_mesh()
        .disable_mesh()
        .light_line_style(TRANSPARENT)
        .axis_style(stroke(INK, 15))
        .set_all_tick_mark_size(px(6))
        .x_labels(10)
        .y_labels(10)
        .y_label_offset(px(3))
        .x_label_formatter(&|v| format!("{v:.0}").replace('-', "\u{2212}"))
        .y_label_formatter(&|v| format!("{v:.0}").replace('-', "\u{2212}"))
        .x_label_style(figure::text(HPos::Center))
        .y_label_style(figure::text(HPos::Right))
        .axis_desc_style(figure::text(HPos::Center))
        .x_desc(x)
        .y_desc(y)
        .draw()
}

/// The connections at rest, and over them those of the deformed mesh; the outlines of the tissue are thicker.
fn shapes(
    chart: &mut Chart,
    mesh: &Mesh<2>,
    rest: &[(f64, f64)],
    deformed: &[(f64, f64)],
) -> Result<(), DrawError> {
    let outline = mesh.surface();
    for (positions, color) in [(rest, REST), (deformed, DEFORMED)] {
        for pair @ &[a, b] in &mesh.connections {
            let width =
                if outline.binary_search_by(|edge| edge.as_slice().cmp(pair)).is_ok() { 26 } else { 12 };
            let path = [a, b].into_iter().filter_map(|n| positions.get(n).copied()).collect::<Vec<_>>();
            chart.draw_series([PathElement::new(path, stroke(color, width))])?;
        }
    }
    Ok(())
}

fn bones(chart: &mut Chart, mesh: &Mesh<2>, deformed: &[(f64, f64)]) -> Result<(), DrawError> {
    let area = chart.plotting_area();
    let (left, top) = area.get_base_pixel();
    let area = area.strip_coord_spec();
    for position in mesh.fixed.iter().filter_map(|&n| deformed.get(n)) {
        let (x, y) = chart.backend_coord(position);
        bone(&area, (x - left, y - top))?;
    }
    Ok(())
}

fn bone(area: &Canvas, (x, y): (i32, i32)) -> Result<(), DrawError> {
    let half = px(7);
    area.draw(&Rectangle::new([(x - half, y - half), (x + half, y + half)], INK.filled()))
}

/// How a muscle is drawn.
struct Line<'a> {
    muscle: &'a MuscleChain,
    color: RGBColor,
    active: bool,
}

impl Line<'_> {
    /// Draws the path over a slightly wider dark one, which gives the light colours an edge on white paper.
    fn draw<C: CoordTranslate>(
        &self,
        area: &DrawingArea<SVGBackend, C>,
        path: Vec<C::From>,
    ) -> Result<(), DrawError>
    where
        C::From: Clone,
    {
        let widths = if self.active { [105, 80] } else { [60, 40] };
        for (width, color) in widths.into_iter().zip([INK, self.color]) {
            let style: ShapeStyle = stroke(color, width);
            if self.active {
                area.draw(&PathElement::new(path.clone(), style))?;
            } else {
                area.draw(&DashedPathElement::new(path.clone(), px(14), px(8), style))?;
            }
        }
        Ok(())
    }
}

/// Columns under the plot: the muscles, then the two shapes and the bones; below them what the lines mean.
fn legend(area: &Canvas, lines: &[Line], rows: usize) -> Result<(), DrawError> {
    let per_column = rows - 1;
    let width = (WIDTH - AXIS - MARGIN) / 4;
    let row = |nth: usize| px(MARGIN + ROW / 2) + px(ROW) * (nth as i32);
    let column = |nth: usize| px(AXIS + width * nth as i32);
    for (nth, style) in lines.iter().enumerate() {
        let (x, y) = (column(nth / per_column), row(nth % per_column));
        style.draw(area, vec![(x, y), (x + px(SAMPLE), y)])?;
        let font = if style.active { figure::bold(HPos::Left) } else { figure::text(HPos::Left) };
        area.draw_text(&figure::printable(&style.muscle.name), &font, (x + px(SAMPLE + 12), y))?;
    }
    let last = column(lines.len().div_ceil(per_column));
    let samples = [("rest", Some(REST)), ("deformed", Some(DEFORMED)), ("bone", None)];
    let samples = samples.into_iter().filter(|(_, color)| color.is_some() || !lines.is_empty());
    for (nth, (name, color)) in samples.enumerate() {
        let y = row(nth);
        match color {
            Some(color) => area.draw(&line((last, y), (last + px(SAMPLE), y), stroke(color, 20)))?,
            None => bone(area, (last + px(SAMPLE / 2), y))?,
        }
        area.draw_text(name, &figure::text(HPos::Left), (last + px(SAMPLE + 12), y))?;
    }
    if lines.is_empty() {
        return Ok(());
    }
    let note = "thick: contracting muscle; thin and dashed: passive muscle";
    area.draw_text(note, &figure::text(HPos::Left), (px(AXIS), row(per_column)))
}
