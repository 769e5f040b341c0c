//! Bar chart of muscle lengths relative to a baseline vowel: figure 4.9 of Kato (2014).

use plotters::backend::SVGBackend;
use plotters::chart::ChartBuilder;
use plotters::coord::CoordTranslate;
use plotters::drawing::DrawingArea;
use plotters::element::{PathElement, Rectangle};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor, TRANSPARENT, WHITE};

use super::ReportError;
use super::figure::{self, Canvas, DrawError, INK, MARGIN, RULE, Sheet, TEXT, WIDTH, px, stroke};

/// Fill of the bars of each series. Dark, light, hollow and black: they differ in grey print as well.
const FILLS: [RGBColor; 4] = [RGBColor(0x00, 0x72, 0xB2), RGBColor(0xE6, 0x9F, 0x00), WHITE, INK];

const LEGEND_ROW: i32 = 40;
const LEGEND_GAP: i32 = 8;
const PLOT: i32 = 420;
const LABELS: i32 = 48;
const AXIS: i32 = 100;
const SAMPLE: i32 = 46;
/// Part of the distance between groups that the bars take.
const FILLED: f64 = 0.78;

/// One bar for each muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend, e.g. `measured`.
    pub name: String,
    /// Length relative to the subject's own length in the baseline, dimensionless; one for each label.
    pub values: Vec<f64>,
}

/// Draws grouped bars that grow from 1.00, upwards for a longer muscle and downwards for a shorter one
/// (Kato 2014, figure 4.9), as SVG text.
///
/// `baseline` is the symbol of the vowel that the lengths are relative to. `labels` name the groups; a label that ends in `*` marks a contracting muscle and is explained in the legend. The
/// vertical axis spans the data in steps of 0.1 where that gives a readable number of steps.
///
/// # Errors
/// [`ReportError::ChartShape`] without labels or with no or more than four series, [`ReportError::SeriesLength`] if a
/// series has not one value for each label, [`ReportError::Ratio`] for a value that is no ratio of lengths.
pub fn changes(
    labels: &[String],
    series: &[Series],
    baseline: &str,
    title: &str,
) -> Result<String, ReportError> {
    check(labels, series)?;
    let entries = legend_entries(series, labels.iter().any(|l| l.ends_with('*')));
    let legend_height = entries.last().map_or(0, |e| e.y) + LEGEND_ROW + 2 * LEGEND_GAP;
    let height = legend_height + PLOT + LABELS + MARGIN;
    let sheet = Sheet { title, description: description(labels, series, baseline), height };
    sheet.draw(|canvas| {
        let (top, below) = canvas.split_vertically(px(legend_height));
        legend(&top, &entries)?;
        bars(&below, labels, series, baseline)
    })
}

fn check(labels: &[String], series: &[Series]) -> Result<(), ReportError> {
    if labels.is_empty() || series.is_empty() || series.len() > FILLS.len() {
        let (labels, series) = (labels.len(), series.len());
        return Err(ReportError::ChartShape { labels, series, most: FILLS.len() });
    }
    for Series { name, values } in series {
        if values.len() != labels.len() {
            let (values, labels) = (values.len(), labels.len());
            return Err(ReportError::SeriesLength { series: name.clone(), values, labels });
        }
        for (&value, label) in values.iter().zip(labels) {
            if !(value > 0.0 && value <= 100.0) {
                return Err(ReportError::Ratio { series: name.clone(), label: label.clone(), value });
            }
        }
    }
    Ok(())
}

/// The numbers of the chart in words.
fn description(labels: &[String], series: &[Series], baseline: &str) -> String {
    let told = series.iter().map(|s| {
        let values: Vec<_> = labels.iter().zip(&s.values).map(|(l, v)| format!("{l} {v:.2}")).collect();
        format!("{}: {}.", s.name, values.join(", "))
    });
    format!("Muscle lengths relative to /{baseline}/. {}", told.collect::<Vec<_>>().join(" "))
}

/// Ends of the vertical axis and the number of steps between them: the data, 1.00 and a little room.
fn axis(series: &[Series]) -> (f64, f64, usize) {
    let values = || series.iter().flat_map(|s| s.values.iter().copied());
    let lowest = values().fold(0.9, f64::min);
    let highest = values().fold(1.1, f64::max);
    // Steps of 1, 2 or 5 tenths, ones, tens: the first that needs at most nine.
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
    let step = steps.into_iter().find(|s| (highest - lowest) / s <= 7.5).unwrap_or(50.0);
    let room = 0.2 * step;
    let first = ((lowest - room) / step).floor().max(0.0);
    let last = ((highest + room) / step).ceil();
    (first * step, last * step, (last - first) as usize)
}

fn bars(area: &Canvas, labels: &[String], series: &[Series], baseline: &str) -> Result<(), DrawError> {
    let (low, high, steps) = axis(series);
    let groups = labels.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin_left(px(MARGIN))
        .margin_right(px(MARGIN))
        .margin_bottom(px(LABELS + MARGIN))
        .y_label_area_size(px(AXIS - MARGIN))
        .build_cartesian_2d(0.0..groups, low..high)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .disable_x_axis()
        .light_line_style(TRANSPARENT)
        .bold_line_style(stroke(RULE, 10))
        .axis_style(stroke(INK, 15))
        .set_all_tick_mark_size(px(6))
        .y_labels(steps + 1)
        .y_label_offset(px(3))
        .y_label_formatter(&|v| format!("{v:.1}"))
        .y_label_style(figure::text(HPos::Right))
        .axis_desc_style(figure::text(HPos::Center))
        .y_desc(format!("length relative to /{baseline}/"))
        .draw()?;

    chart.draw_series([PathElement::new(vec![(0.0, 1.0), (groups, 1.0)], stroke(INK, 20))])?;
    let width = FILLED / series.len() as f64;
    // A muscle that did not change still shows a bar: a sliver on the line at 1.00.
    let sliver = 0.006 * (high - low);
    for (nth, (one, fill)) in series.iter().zip(FILLS).enumerate() {
        for (group, &value) in one.values.iter().enumerate() {
            let left = group as f64 + 0.5 * (1.0 - FILLED) + nth as f64 * width;
            let (bottom, top) =
                if (value - 1.0).abs() < sliver { (1.0 - sliver, 1.0 + sliver) } else { (1.0, value) };
            draw_bar(chart.plotting_area(), (left, bottom), (left + width, top), fill)?;
        }
    }
    for (group, label) in labels.iter().enumerate() {
        let style =
            if label.ends_with('*') { figure::bold(HPos::Center) } else { figure::text(HPos::Center) };
        let (x, y) = chart.backend_coord(&(group as f64 + 0.5, low));
        let (_, top) = area.get_base_pixel();
        area.draw_text(&figure::printable(label), &style, (x, y - top + px(LABELS / 2 + 4)))?;
    }
    Ok(())
}

/// A filled rectangle with an outline, which is a path because the SVG backend ignores the stroke width of rectangles.
fn draw_bar<C, T>(
    area: &DrawingArea<SVGBackend, C>,
    from: (T, T),
    to: (T, T),
    fill: RGBColor,
) -> Result<(), DrawError>
where
    C: CoordTranslate<From = (T, T)>,
    T: Copy,
{
    area.draw(&Rectangle::new([from, to], fill.filled()))?;
    let around = vec![from, (to.0, from.1), to, (from.0, to.1), from];
    area.draw(&PathElement::new(around, stroke(INK, 12)))
}

/// An entry of the legend: a bar's colour (none for the mark of contracting muscles), its name and its place, px.
struct Entry<'a> {
    fill: Option<RGBColor>,
    name: &'a str,
    x: i32,
    y: i32,
}

/// The entries in as many rows as they need, over the plot, so that they lie on no bar.
fn legend_entries(series: &[Series], any_active: bool) -> Vec<Entry<'_>> {
    let named = series.iter().zip(FILLS).map(|(s, fill)| (Some(fill), s.name.as_str()));
    let (mut x, mut y) = (AXIS, 0);
    let mut entries = Vec::new();
    for (fill, name) in named.chain(any_active.then_some((None, "* contracting"))) {
        let sample = if fill.is_some() { SAMPLE } else { 0 };
        let letters = i32::try_from(name.chars().count()).unwrap_or(WIDTH);
        // Letters of a sans-serif face are 0.55 times as wide as the face is high, on average.
        let width = sample + letters.min(WIDTH) * TEXT * 55 / 100;
        if x > AXIS && x + width > WIDTH - MARGIN {
            (x, y) = (AXIS, y + LEGEND_ROW);
        }
        entries.push(Entry { fill, name, x, y });
        x += width + 2 * MARGIN;
    }
    entries
}

fn legend(area: &Canvas, entries: &[Entry]) -> Result<(), DrawError> {
    for &Entry { fill, name, x, y } in entries {
        let (left, middle) = (px(x), px(y + LEGEND_GAP + LEGEND_ROW / 2));
        let half = px(TEXT / 2 - 2);
        let (style, indent) = match fill {
            Some(fill) => {
                draw_bar(area, (left, middle - half), (left + px(SAMPLE - 10), middle + half), fill)?;
                (figure::text(HPos::Left), px(SAMPLE))
            }
            None => (figure::bold(HPos::Left), 0),
        };
        area.draw_text(&figure::printable(name), &style, (left + indent, middle))?;
    }
    Ok(())
}
