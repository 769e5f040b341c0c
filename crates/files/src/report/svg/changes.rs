//! Grouped bars (muscle lengths relative to a baseline vowel, figure 4.9 of Kato 2014; parts of a whole), and ridges of a posterior.

use super::plot::{Axis, Plot, round_range};
use super::{Anchor, FontFace, INK, LEGEND_ROW, Legend, MARGIN, Svg, WIDTH, closed_paths};
use crate::report::{ReportError, joined, probability};
use tongue_infer::posterior::{Posterior, Quantiles};
use tongue_input::measured::muscles::Muscles;

/// Fill of the bars of each series: dark, light, hollow and black differ in grey print too.
const FILLS: [&str; 4] = ["#0072b2", "#e69f00", "#ffffff", INK];

const PLOT: f64 = 420.0;
const LABELS: f64 = 48.0;
const AXIS: f64 = 100.0;
const SAMPLE: f64 = 46.0;
const FILLED: f64 = 0.78;

#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// One for each label: a length over the subject's own in the baseline, or a part of a whole.
    pub values: Vec<f64>,
}

/// Draws grouped bars that grow from 1.00, as in figure 4.9 of Kato (2014): changes relative to the vowel `baseline`. `labels` name the
/// groups; the legend explains that one which ends in `*` marks a contracting muscle.
pub fn changes(
    labels: &[String],
    series: &[Series],
    baseline: &str,
    title: &str,
) -> Result<Svg, ReportError> {
    let summary = format!("Muscle lengths relative to /{baseline}/.");
    chart(labels, series, (&format!("length relative to /{baseline}/"), 1.0), [title, &summary])
}

/// Draws grouped bars that grow from zero, for parts of a whole; `axis` names what they are parts of.
pub fn parts(labels: &[String], series: &[Series], axis: &str, title: &str) -> Result<Svg, ReportError> {
    chart(labels, series, (axis, 0.0), [title, &format!("{axis}.")])
}

fn chart(
    labels: &[String],
    series: &[Series],
    (axis, base): (&str, f64),
    [title, what]: [&str; 2],
) -> Result<Svg, ReportError> {
    for Series { name, values } in series {
        for (&value, label) in values.iter().zip(labels) {
            if !((value > 0.0 || value == base) && value <= 100.0) {
                return Err(ReportError::BarHeight { series: name.clone(), label: label.clone(), value });
            }
        }
    }
    let summary = series.iter().map(|s| {
        let values = labels.iter().zip(&s.values).map(|(l, v)| format!("{l} {v:.2}"));
        format!("{}: {}.", s.name, joined(values, ", "))
    });
    let (mut svg, top) = Svg::new(title, &format!("{what} {}", joined(summary, " ")), WIDTH);
    let top = top + 0.2 * LEGEND_ROW;
    let mut legend = Legend::new([AXIS, WIDTH - MARGIN], top);
    for (one, fill) in series.iter().zip(FILLS) {
        legend.area(&mut svg, SAMPLE, &one.name, fill);
    }
    if labels.iter().any(|l| l.ends_with('*')) {
        legend.entry(&mut svg, 0.0, "* contracting", |_, _| ());
    }
    let top = top + legend.height() + MARGIN;
    bars(&mut svg, labels, series, (axis, base), top);
    Ok(svg.finish(top + PLOT + LABELS + MARGIN))
}

fn bars(svg: &mut Svg, labels: &[String], series: &[Series], (axis, base): (&str, f64), top: f64) {
    let values = series.iter().flat_map(|s| s.values.iter().copied());
    let (low, high) = (values.clone().fold(base, f64::min), values.fold(base, f64::max));
    // Parts of a whole end at 1, so that their axis needs no margin.
    let room = if base == 0.0 { 0.0 } else { 0.02 };
    let [low, high] = round_range(low.min(base - 0.1) - room, high.max(base + 0.1) + room);
    let groups = labels.len() as f64;
    let plot = Plot::linear([AXIS, top], [WIDTH - MARGIN - AXIS, PLOT], [0.0, groups], [low.max(0.0), high]);
    plot.axes(svg, [Axis::Nothing, Axis::Named(axis)]);
    svg.stroke(&plot.path([[0.0, base], [groups, base]]), INK, 2.0);
    let width = FILLED / series.len() as f64;
    // Half the height of the bar of a value at the base.
    let sliver = 0.006 * (high - low);
    for (nth, (one, fill)) in series.iter().zip(FILLS).enumerate() {
        for (number, &value) in one.values.iter().enumerate() {
            let x = number as f64 + 0.5 * (1.0 - FILLED) + nth as f64 * width;
            let (bottom, tip) =
                if (value - base).abs() < sliver { (base - sliver, base + sliver) } else { (base, value) };
            plot.rectangle(svg, [[x, bottom], [x + width, tip]], fill, Some(INK));
        }
    }
    let is_wide = labels.iter().any(|l| FontFace::Bold.width(l) > plot.size[0] / groups);
    for (number, label) in labels.iter().enumerate() {
        let face = if label.ends_with('*') { FontFace::Bold } else { FontFace::Plain };
        let [x, foot] = plot.place(number as f64 + 0.5, plot.y[0]);
        // If labels are wide, every second one stands lower.
        let row = if is_wide && number % 2 == 1 { 0.75 } else { 0.4 };
        svg.text([x, foot + row * LABELS], Anchor::Middle, face, label);
    }
}

/// Height of a ridge, px, and the part of it that the next ridge does not overlap.
const RIDGE: f64 = 84.0;
const FREE: f64 = 62.0;
const NAMES: f64 = 90.0;
const ODDS: f64 = 120.0;
const POINTS: usize = 160;

/// Draws for every muscle the density of the change of its tension from the baseline, with bars over its 95 % and its 50 % interval.
pub fn ridges(posterior: &Posterior<'_>, posture: usize, title: &str) -> Svg {
    let names = &posterior.problem.posterior_model.muscles;
    let all: Vec<Vec<f64>> = (0..names.len())
        .map(|m| posterior.draws.iter().map(move |d| d.change(posture, m)).collect())
        .collect();
    let spreads: Vec<Quantiles> = all.iter().map(|c| Quantiles::of(c.iter().copied())).collect();
    let summary = names.iter().zip(&spreads).map(|(name, s)| {
        let (median, [low, high]) = (s.median, s.interval_95);
        format!("{name} {median:.0} ({low:.0} to {high:.0})")
    });
    let what =
        "By how much more each muscle pulls than in the baseline, N per metre: median and 95 % interval";
    let description = format!("{what}. {}.", joined(summary, ", "));
    let (mut svg, top) = Svg::new(title, &description, WIDTH);
    let low = spreads.iter().map(|s| s.interval_95[0]).fold(-10.0, f64::min) * 1.15;
    let high = spreads.iter().map(|s| s.interval_95[1]).fold(10.0, f64::max) * 1.15;
    let (left, right) = (NAMES + MARGIN, WIDTH - ODDS - MARGIN);
    let head = top + 2.0 * MARGIN;
    let height = RIDGE + FREE * (names.len().max(1) - 1) as f64 + MARGIN;
    // The vertical axis is in pixels from the foot of the plot.
    let plot = Plot::linear([left, head], [right - left, height], [low, high], [0.0, height]);
    plot.axes(&mut svg, [Axis::Named("change of tension from the baseline, N per metre"), Axis::Nothing]);
    svg.stroke(&plot.upright(0.0), INK, 1.0);
    svg.text([right + 0.5 * ODDS, head], Anchor::Middle, FontFace::Plain, "P(rises)");
    for (m, info) in Muscles::built_in().info(names).iter().enumerate() {
        let base = height - RIDGE - FREE * m as f64;
        let heights = density(&all[m], low, high);
        let most = heights.iter().copied().fold(1e-12, f64::max);
        let at = |i: usize| low + (high - low) * i as f64 / (POINTS - 1) as f64;
        let curve = heights.iter().enumerate().map(|(i, h)| [at(i), base + 0.92 * RIDGE * h / most]);
        let shape = std::iter::once([low, base]).chain(curve).chain([[high, base]]);
        let shape = closed_paths([shape.map(|[x, y]| plot.place(x, y))]);
        let colour = &info.colour;
        let style = format!(r#"fill="{colour}" fill-opacity="0.55" stroke="{INK}" stroke-width="1""#);
        svg.path(&shape, &style);
        for (ends, width) in [(spreads[m].interval_95, 3.0), (spreads[m].interval_50, 8.0)] {
            svg.stroke(&plot.path(ends.map(|v| [v, base])), INK, width);
        }
        let y = plot.place(low, base)[1] - 14.0;
        svg.text([left - 10.0, y], Anchor::End, FontFace::Bold, &names[m]);
        let rises = all[m].iter().filter(|c| **c > 0.0).count() as f64 / all[m].len().max(1) as f64;
        let rises = if spreads[m].is_fixed() { "fixed".to_owned() } else { probability(rises) };
        svg.text([right + 0.5 * ODDS, y], Anchor::Middle, FontFace::Plain, &rises);
    }
    svg.finish(head + height + 50.0 + 2.5 * MARGIN)
}

/// Kernel density of values at equidistant points of a range, with a normal kernel of Silverman's width (1986, eq. 3.31). It is not
/// normalised.
fn density(values: &[f64], low: f64, high: f64) -> Vec<f64> {
    let n = values.len().max(2) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    let width = (0.9 * sd * n.powf(-0.2)).max(1e-3 * (high - low));
    // Values are counted in narrow bins first, so that the time does not depend on their number.
    let cells = 4 * POINTS;
    let mut counts = vec![0.0; cells];
    for v in values {
        let place = (v - low) / (high - low) * cells as f64;
        if (0.0..cells as f64).contains(&place) {
            counts[place as usize] += 1.0;
        }
    }
    let full = counts.iter().enumerate().filter(|(_, count)| **count > 0.0);
    let full = full.map(|(c, count)| (low + (high - low) * (c as f64 + 0.5) / cells as f64, count));
    Vec::from_iter((0..POINTS).map(|i| {
        let x = low + (high - low) * i as f64 / (POINTS - 1) as f64;
        full.clone().map(|(middle, count)| count * (-0.5 * ((x - middle) / width).powi(2)).exp()).sum()
    }))
}
