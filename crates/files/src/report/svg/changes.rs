//! Bar chart of muscle lengths relative to a baseline vowel: figure 4.9 of Kato (2014).

use super::{Anchor, Entry, Face, INK, LEGEND_ROW, MARGIN, RULE, Svg, TEXT, WIDTH, legend};
use crate::report::ReportError;

/// Fill of the bars of each series. Dark, light, hollow and black can be distinguished in grey print too.
const FILLS: [&str; 4] = ["#0072b2", "#e69f00", "#ffffff", INK];

const PLOT: f64 = 420.0;
const LABELS: f64 = 48.0;
const AXIS: f64 = 100.0;
const SAMPLE: f64 = 46.0;
/// Part of the distance between groups that bars fill.
const FILLED: f64 = 0.78;

/// A series with one bar for each muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// Length over the subject's own length in the baseline, dimensionless; one for each label.
    pub values: Vec<f64>,
}

/// Draws grouped bars that grow from 1.00, upwards for a longer muscle and downwards for a shorter one
/// (Kato 2014, figure 4.9), as SVG text.
///
/// `baseline` is the symbol of the vowel that the lengths are relative to. `labels` name the groups; a label
/// that ends in `*` marks a contracting muscle and is explained in the legend. The vertical axis spans the
/// data in steps of 0.1 if that gives a readable number of steps.
pub fn changes(
    labels: &[String],
    series: &[Series],
    baseline: &str,
    title: &str,
) -> Result<Svg, ReportError> {
    check(labels, series)?;
    let (mut svg, top) = Svg::new(title, &description(labels, series, baseline), WIDTH);
    let top = top + key(&mut svg, series, labels.iter().any(|l| l.ends_with('*')), top) + MARGIN;
    bars(&mut svg, labels, series, baseline, top);
    Ok(svg.finish(top + PLOT + LABELS + MARGIN))
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

fn description(labels: &[String], series: &[Series], baseline: &str) -> String {
    let told = series.iter().map(|s| {
        let values: Vec<_> = labels.iter().zip(&s.values).map(|(l, v)| format!("{l} {v:.2}")).collect();
        format!("{}: {}.", s.name, values.join(", "))
    });
    format!("Muscle lengths relative to /{baseline}/. {}", told.collect::<Vec<_>>().join(" "))
}

/// Ends of the vertical axis and the number of steps between them: the data, 1.00 and a margin.
fn axis(series: &[Series]) -> (f64, f64, usize) {
    let values = || series.iter().flat_map(|s| s.values.iter().copied());
    let lowest = values().fold(0.9, f64::min);
    let highest = values().fold(1.1, f64::max);
    // The smallest step that needs at most nine of them.
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
    let step = steps.into_iter().find(|s| (highest - lowest) / s <= 7.5).unwrap_or(50.0);
    let room = 0.2 * step;
    let first = ((lowest - room) / step).floor().max(0.0);
    let last = ((highest + room) / step).ceil();
    (first * step, last * step, (last - first) as usize)
}

fn bars(svg: &mut Svg, labels: &[String], series: &[Series], baseline: &str, top: f64) {
    let (low, high, steps) = axis(series);
    let (left, right) = (AXIS, WIDTH - MARGIN);
    let group = (right - left) / labels.len() as f64;
    let y = |value: f64| top + PLOT * (high - value) / (high - low);
    for nth in 0..=steps {
        let value = low + (high - low) * nth as f64 / steps.max(1) as f64;
        svg.line([left, y(value)], [right, y(value)], RULE, 1.0);
        svg.text([left - 10.0, y(value)], Anchor::End, Face::Plain, &format!("{value:.1}"));
    }
    svg.line([left, top], [left, top + PLOT], INK, 1.5);
    svg.upright_text([MARGIN + 8.0, top + 0.5 * PLOT], &format!("length relative to /{baseline}/"));
    svg.line([left, y(1.0)], [right, y(1.0)], INK, 2.0);
    let width = FILLED * group / series.len() as f64;
    // A muscle that did not change gets a thin bar at 1.00.
    let sliver = 0.006 * (high - low);
    for (nth, (one, fill)) in series.iter().zip(FILLS).enumerate() {
        for (number, &value) in one.values.iter().enumerate() {
            let x = left + group * (number as f64 + 0.5 * (1.0 - FILLED)) + nth as f64 * width;
            let (bottom, tip) =
                if (value - 1.0).abs() < sliver { (1.0 - sliver, 1.0 + sliver) } else { (1.0, value) };
            svg.rectangle([x, y(bottom)], [x + width, y(tip)], fill, Some(INK));
        }
    }
    for (number, label) in labels.iter().enumerate() {
        let face = if label.ends_with('*') { Face::Bold } else { Face::Plain };
        let at = [left + group * (number as f64 + 0.5), top + PLOT + 0.5 * LABELS + 4.0];
        svg.text(at, Anchor::Middle, face, label);
    }
}

/// The legend above the plot, clear of the bars; returns its height.
fn key(svg: &mut Svg, series: &[Series], any_active: bool, top: f64) -> f64 {
    let named = series.iter().map(|s| Entry { sample: SAMPLE, face: Face::Plain, name: &s.name });
    let mark = any_active.then_some(Entry { sample: 0.0, face: Face::Bold, name: "* contracting" });
    let entries: Vec<Entry<'_>> = named.chain(mark).collect();
    let (places, height) = legend(svg, &entries, [AXIS, WIDTH - MARGIN], top + 0.2 * LEGEND_ROW);
    let half = 0.5 * TEXT - 2.0;
    for ([x, y], fill) in places.into_iter().zip(FILLS).take(series.len()) {
        svg.rectangle([x, y - half], [x + SAMPLE - 10.0, y + half], fill, Some(INK));
    }
    height + 0.2 * LEGEND_ROW
}
