//! Bar chart of muscle lengths relative to a baseline vowel: figure 4.9 of Kato (2014).

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
    /// Length over the subject's own length in the baseline, dimensionless; one for each label.
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
    check(labels, series)?;
    let (mut svg, top) = Svg::new(title, &description(labels, series, baseline), WIDTH);
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

fn bars(svg: &mut Svg, labels: &[String], series: &[Series], baseline: &str, top: f64) {
    let values = || series.iter().flat_map(|s| s.values.iter().copied());
    let [low, high] = around(values().fold(0.9, f64::min) - 0.02, values().fold(1.1, f64::max) + 0.02);
    let groups = labels.len() as f64;
    let plot = Plot::linear([AXIS, top], [WIDTH - MARGIN - AXIS, PLOT], [0.0, groups], [low.max(0.0), high]);
    plot.axes(svg, [Axis::Nothing, Axis::Named(&format!("length relative to /{baseline}/"))]);
    svg.stroke(&plot.path([[0.0, 1.0], [groups, 1.0]]), INK, 2.0);
    let width = FILLED / series.len() as f64;
    // A muscle that did not change gets a thin bar at 1.00.
    let sliver = 0.006 * (high - low);
    for (nth, (one, fill)) in series.iter().zip(FILLS).enumerate() {
        for (number, &value) in one.values.iter().enumerate() {
            let x = number as f64 + 0.5 * (1.0 - FILLED) + nth as f64 * width;
            let (bottom, tip) =
                if (value - 1.0).abs() < sliver { (1.0 - sliver, 1.0 + sliver) } else { (1.0, value) };
            plot.rectangle(svg, [[x, bottom], [x + width, tip]], fill, Some(INK));
        }
    }
    for (number, label) in labels.iter().enumerate() {
        let face = if label.ends_with('*') { Face::Bold } else { Face::Plain };
        let [x, foot] = plot.place(number as f64 + 0.5, plot.y[0]);
        svg.text([x, foot + 0.5 * LABELS + 4.0], Anchor::Middle, face, label);
    }
}
