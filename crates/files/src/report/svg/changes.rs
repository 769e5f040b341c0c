//! Bar charts in groups: muscle lengths relative to a baseline vowel (figure 4.9 of Kato 2014), and parts of a whole.

use super::plot::{Axis, Plot, around};
use super::{Anchor, Entry, Face, INK, LEGEND_ROW, MARGIN, Svg, TEXT, WIDTH};
use crate::report::ReportError;

/// Fill of the bars of each series. Dark, light, hollow and black can be distinguished in grey print too.
const FILLS: [&str; 4] = ["#0072b2", "#e69f00", "#ffffff", INK];

const PLOT: f64 = 420.0;
const LABELS: f64 = 48.0;
const AXIS: f64 = 100.0;
const SAMPLE: f64 = 46.0;
const FILLED: f64 = 0.78;

#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// One for each label: a length over the subject's own length in the baseline, or a part of a whole; dimensionless.
    pub values: Vec<f64>,
}

/// Draws grouped bars that grow from 1.00, upwards for a longer muscle and downwards for a shorter one
/// (Kato 2014, figure 4.9), as SVG text.
///
/// `baseline` is the symbol of the vowel that the lengths are relative to. `labels` name the groups; a label
/// that ends in `*` marks a contracting muscle and is explained in the legend.
pub fn changes(
    labels: &[String],
    series: &[Series],
    baseline: &str,
    title: &str,
) -> Result<Svg, ReportError> {
    let told = format!("Muscle lengths relative to /{baseline}/.");
    chart(labels, series, (&format!("length relative to /{baseline}/"), 1.0), [title, &told])
}

/// Draws grouped bars that grow from zero: parts of a whole under the name of their axis.
pub fn parts(labels: &[String], series: &[Series], axis: &str, title: &str) -> Result<Svg, ReportError> {
    chart(labels, series, (axis, 0.0), [title, &format!("{axis}.")])
}

/// Grouped bars from a value `base` of the axis.
fn chart(
    labels: &[String],
    series: &[Series],
    (axis, base): (&str, f64),
    [title, what]: [&str; 2],
) -> Result<Svg, ReportError> {
    check(labels, series, base)?;
    let (mut svg, top) = Svg::new(title, &description(labels, series, what), WIDTH);
    let half = 0.5 * TEXT - 2.0;
    let shown = series.iter().zip(FILLS).map(|(one, fill)| {
        Entry::new(SAMPLE, &one.name, move |svg, [x, y]| {
            svg.rectangle([x, y - half], [x + SAMPLE - 10.0, y + half], fill, Some(INK));
        })
    });
    let contracting = labels.iter().any(|l| l.ends_with('*'));
    let contracting = contracting.then(|| Entry::new(0.0, "* contracting", |_, _| ()));
    let top = top + 0.2 * LEGEND_ROW;
    let top = top + svg.legend(shown.chain(contracting), [AXIS, WIDTH - MARGIN], top) + MARGIN;
    bars(&mut svg, labels, series, (axis, base), top);
    Ok(svg.finish(top + PLOT + LABELS + MARGIN))
}

fn check(labels: &[String], series: &[Series], base: f64) -> Result<(), ReportError> {
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
            if !((value > 0.0 || value == base) && value <= 100.0) {
                return Err(ReportError::Ratio { series: name.clone(), label: label.clone(), value });
            }
        }
    }
    Ok(())
}

fn description(labels: &[String], series: &[Series], what: &str) -> String {
    let told = series.iter().map(|s| {
        let values: Vec<_> = labels.iter().zip(&s.values).map(|(l, v)| format!("{l} {v:.2}")).collect();
        format!("{}: {}.", s.name, values.join(", "))
    });
    format!("{what} {}", told.collect::<Vec<_>>().join(" "))
}

fn bars(svg: &mut Svg, labels: &[String], series: &[Series], (axis, base): (&str, f64), top: f64) {
    let values = || series.iter().flat_map(|s| s.values.iter().copied());
    let (low, high) = (values().fold(base, f64::min), values().fold(base, f64::max));
    // Parts of a whole end at 1.
    let room = if base == 0.0 { 0.0 } else { 0.02 };
    let [low, high] = around(low.min(base - 0.1) - room, high.max(base + 0.1) + room);
    let groups = labels.len() as f64;
    let plot = Plot::linear([AXIS, top], [WIDTH - MARGIN - AXIS, PLOT], [0.0, groups], [low.max(0.0), high]);
    plot.axes(svg, [Axis::Nothing, Axis::Named(axis)]);
    svg.stroke(&plot.path([[0.0, base], [groups, base]]), INK, 2.0);
    let width = FILLED / series.len() as f64;
    // A value at the base gets a thin bar.
    let sliver = 0.006 * (high - low);
    for (nth, (one, fill)) in series.iter().zip(FILLS).enumerate() {
        for (number, &value) in one.values.iter().enumerate() {
            let x = number as f64 + 0.5 * (1.0 - FILLED) + nth as f64 * width;
            let (bottom, tip) =
                if (value - base).abs() < sliver { (base - sliver, base + sliver) } else { (base, value) };
            plot.rectangle(svg, [[x, bottom], [x + width, tip]], fill, Some(INK));
        }
    }
    let is_wide = labels.iter().any(|l| Face::Bold.width(l) > plot.size[0] / groups);
    for (number, label) in labels.iter().enumerate() {
        let face = if label.ends_with('*') { Face::Bold } else { Face::Plain };
        let [x, foot] = plot.place(number as f64 + 0.5, plot.y[0]);
        // Every second one of long labels stands lower.
        let row = if is_wide && number % 2 == 1 { 0.75 } else { 0.4 };
        svg.text([x, foot + row * LABELS], Anchor::Middle, face, label);
    }
}
