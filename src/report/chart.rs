//! Bar chart of muscle lengths relative to the reference vowel /ɯ/: figure 4.9 of Kato (2014).

use plotters::chart::ChartBuilder;
use plotters::element::Rectangle;
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor, ShapeStyle, TRANSPARENT, WHITE};

use super::ReportError;
use super::figure::{self, Canvas, DrawError, INK, MARGIN, RULE, Sheet, TEXT, WIDTH, px, stroke};

/// Fill and outline of the bars of each series. Dark, light and hollow: they differ in grey print as well.
const STYLES: [(RGBColor, RGBColor); 4] = [
    (RGBColor(0x00, 0x72, 0xB2), INK),
    (RGBColor(0xE6, 0x9F, 0x00), INK),
    (WHITE, INK),
    (RGBColor(0x99, 0x99, 0x99), INK),
];

const LEGEND: i32 = 52;
const PLOT: i32 = 420;
const LABELS: i32 = 48;
const AXIS: i32 = 100;
/// Part of the distance between groups that the bars take.
const FILLED: f64 = 0.78;

/// One bar for each muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend, e.g. `measured`.
    pub name: String,
    /// Length relative to the subject's own length in /ɯ/, dimensionless; one for each label.
    pub values: Vec<f64>,
}

/// Draws grouped bars that grow from 1.00, upwards for a longer muscle and downwards for a shorter one
/// (Kato 2014, figure 4.9), as SVG text.
///
/// `labels` name the groups; a label that ends in `*` marks a contracting muscle and is explained in the legend. The
/// vertical axis spans the data in steps of 0.1 where that gives a readable number of steps.
///
/// # Errors
/// [`ReportError::ChartShape`] without labels or with no or more than four series, [`ReportError::SeriesLength`] if a
/// series has not one value for each label, [`ReportError::Ratio`] for a value that is no ratio of lengths.
pub fn changes(labels: &[String], series: &[Series], title: &str) -> Result<String, ReportError> {
    check(labels, series)?;
    let sheet =
        Sheet { title, description: description(labels, series), height: LEGEND + PLOT + LABELS + MARGIN };
    sheet.draw(|canvas| {
        let (top, below) = canvas.split_vertically(px(LEGEND));
        legend(&top, series, labels.iter().any(|l| l.ends_with('*')))?;
        bars(&below, labels, series)
    })
}

fn check(labels: &[String], series: &[Series]) -> Result<(), ReportError> {
    if labels.is_empty() || series.is_empty() || series.len() > STYLES.len() {
        let (labels, series) = (labels.len(), series.len());
        return Err(ReportError::ChartShape { labels, series, most: STYLES.len() });
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
fn description(labels: &[String], series: &[Series]) -> String {
    let told = series.iter().map(|s| {
        let values: Vec<_> = labels.iter().zip(&s.values).map(|(l, v)| format!("{l} {v:.2}")).collect();
        format!("{}: {}.", s.name, values.join(", "))
    });
    format!("Muscle lengths relative to /ɯ/. {}", told.collect::<Vec<_>>().join(" "))
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

fn bars(area: &Canvas, labels: &[String], series: &[Series]) -> Result<(), DrawError> {
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
        .y_label_formatter(&|v| format!("{v:.1}"))
        .y_label_style(figure::text(HPos::Right))
        .axis_desc_style(figure::text(HPos::Center))
        .y_desc("length relative to /ɯ/")
        .draw()?;

    let width = FILLED / series.len() as f64;
    for (nth, (one, (fill, outline))) in series.iter().zip(STYLES).enumerate() {
        for (group, &value) in one.values.iter().enumerate() {
            let left = group as f64 + 0.5 * (1.0 - FILLED) + nth as f64 * width;
            let corners = [(left, 1.0), (left + width, value)];
            chart.draw_series([
                Rectangle::new(corners, fill.filled()),
                Rectangle::new(corners, stroke(outline, 10)),
            ])?;
        }
    }
    chart.draw_series([plotters::element::PathElement::new(
        vec![(0.0, 1.0), (groups, 1.0)],
        stroke(INK, 20),
    )])?;
    for (group, label) in labels.iter().enumerate() {
        let style =
            if label.ends_with('*') { figure::bold(HPos::Center) } else { figure::text(HPos::Center) };
        let (x, y) = chart.backend_coord(&(group as f64 + 0.5, low));
        let (_, top) = area.get_base_pixel();
        area.draw_text(&figure::printable(label), &style, (x, y - top + px(LABELS / 2 + 4)))?;
    }
    Ok(())
}

/// One row over the plot, so that it lies on no bar.
fn legend(area: &Canvas, series: &[Series], any_active: bool) -> Result<(), DrawError> {
    let entries = series.len() + usize::from(any_active);
    let room = px(WIDTH - AXIS - MARGIN) / i32::try_from(entries).unwrap_or(1);
    let middle = px(LEGEND / 2);
    let mut left = px(AXIS);
    for (one, (fill, outline)) in series.iter().zip(STYLES) {
        let half = px(TEXT / 2 - 2);
        let corners = [(left, middle - half), (left + px(36), middle + half)];
        let styles: [ShapeStyle; 2] = [fill.filled(), stroke(outline, 10)];
        for style in styles {
            area.draw(&Rectangle::new(corners, style))?;
        }
        area.draw_text(&figure::printable(&one.name), &figure::text(HPos::Left), (left + px(46), middle))?;
        left += room;
    }
    if any_active {
        area.draw_text("* contracting", &figure::bold(HPos::Left), (left, middle))?;
    }
    Ok(())
}
