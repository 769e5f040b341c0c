//! Figure of a posterior: ridges of the changes.

use super::plot::{Axis, Plot};
use super::{Anchor, Face, INK, MARGIN, Svg, WIDTH, closed};
use tongue_infer::posterior::{Posterior, Quantiles};
use tongue_input::measured::muscles::Muscles;

/// Height of a ridge, px, and the part that the next one leaves free.
const RIDGE: f64 = 84.0;
const FREE: f64 = 62.0;
const NAMES: f64 = 90.0;
const ODDS: f64 = 120.0;
const POINTS: usize = 160;

/// A ridge for every muscle: the density of the change of its tension from the baseline, with a bar over its
/// 95 % interval and a thick one over its 50 % interval.
pub fn ridges(posterior: &Posterior<'_>, posture: usize, title: &str) -> Svg {
    let names = &posterior.density.posterior_model.muscles;
    let changes = |m: usize| posterior.draws.iter().map(move |d| d.change(posture, m)).collect();
    let all: Vec<Vec<f64>> = (0..names.len()).map(changes).collect();
    let spreads: Vec<Quantiles> = all.iter().map(|c| Quantiles::of(c.iter().copied())).collect();
    let told = names
        .iter()
        .zip(&spreads)
        .map(|(n, s)| format!("{n} {:.0} ({:.0} to {:.0})", s.median, s.interval_95[0], s.interval_95[1]));
    let description = format!(
        "By how much more each muscle pulls than in the baseline, N per metre: median and 95 % interval. {}.",
        told.collect::<Vec<_>>().join(", ")
    );
    let (mut svg, top) = Svg::new(title, &description, WIDTH);
    let low = spreads.iter().map(|s| s.interval_95[0]).fold(-10.0, f64::min) * 1.15;
    let high = spreads.iter().map(|s| s.interval_95[1]).fold(10.0, f64::max) * 1.15;
    let (left, right) = (NAMES + MARGIN, WIDTH - ODDS - MARGIN);
    let head = top + 2.0 * MARGIN;
    let height = RIDGE + FREE * (names.len().max(1) - 1) as f64 + MARGIN;
    // The vertical axis counts pixels from the foot.
    let plot = Plot::linear([left, head], [right - left, height], [low, high], [0.0, height]);
    plot.axes(&mut svg, [Axis::Named("change of tension from the baseline, N per metre"), Axis::Nothing]);
    svg.stroke(&plot.upright(0.0), INK, 1.0);
    svg.text([right + 0.5 * ODDS, head], Anchor::Middle, Face::Plain, "P(rises)");
    for (m, info) in Muscles::built_in().of(names).iter().enumerate() {
        let base = height - RIDGE - FREE * m as f64;
        let heights = density(&all[m], low, high);
        let most = heights.iter().copied().fold(1e-12, f64::max);
        let at = |i: usize| low + (high - low) * i as f64 / (POINTS - 1) as f64;
        let curve = heights.iter().enumerate().map(|(i, h)| [at(i), base + 0.92 * RIDGE * h / most]);
        let shape = std::iter::once([low, base]).chain(curve).chain([[high, base]]);
        let shape = closed([shape.map(|[x, y]| plot.place(x, y))]);
        let colour = &info.colour;
        svg.element(
            "path",
            format_args!(
                "d=\"{shape}\" fill=\"{colour}\" fill-opacity=\"0.55\" stroke=\"{INK}\" stroke-width=\"1\""
            ),
        );
        for (ends, width) in [(spreads[m].interval_95, 3.0), (spreads[m].interval_50, 8.0)] {
            svg.stroke(&plot.path(ends.map(|v| [v, base])), INK, width);
        }
        let y = plot.place(low, base)[1] - 14.0;
        svg.text([left - 10.0, y], Anchor::End, Face::Bold, &names[m]);
        let rises = all[m].iter().filter(|c| **c > 0.0).count() as f64 / all[m].len().max(1) as f64;
        svg.text([right + 0.5 * ODDS, y], Anchor::Middle, Face::Plain, &format!("{rises:.2}"));
    }
    svg.finish(head + height + 50.0 + 2.5 * MARGIN)
}

/// Kernel density of values in a range, with a normal kernel of Silverman's width (1986, eq. 3.31).
fn density(values: &[f64], low: f64, high: f64) -> Vec<f64> {
    let n = values.len().max(2) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    let width = (0.9 * sd * n.powf(-0.2)).max(1e-3 * (high - low));
    // Values are counted in narrow bins first, so that the time does not depend on the number of draws.
    let cells = 4 * POINTS;
    let mut counts = vec![0.0; cells];
    for v in values {
        let place = (v - low) / (high - low) * cells as f64;
        if (0.0..cells as f64).contains(&place) {
            counts[place as usize] += 1.0;
        }
    }
    let at = |i: usize| low + (high - low) * i as f64 / (POINTS - 1) as f64;
    let middle = |c: usize| low + (high - low) * (c as f64 + 0.5) / cells as f64;
    let height = |x: f64| -> f64 {
        let each = counts.iter().enumerate().filter(|(_, c)| **c > 0.0);
        each.map(|(c, count)| count * (-0.5 * ((x - middle(c)) / width).powi(2)).exp()).sum()
    };
    (0..POINTS).map(|i| height(at(i))).collect()
}
