//! Figure of a posterior: ridges of the changes.

use super::axes::ticks;
use super::{Anchor, Face, INK, MARGIN, RULE, Svg, WIDTH, closed};
use tongue_infer::posterior::{Posterior, Quantiles};
use tongue_input::measured::muscles::Muscles;

/// Height of a ridge, px, and the part that the next one leaves free.
const RIDGE: f64 = 84.0;
const FREE: f64 = 62.0;
/// Room for the names of muscles and for the probabilities, px.
const NAMES: f64 = 90.0;
const ODDS: f64 = 120.0;
/// Number of points of a curve.
const POINTS: usize = 160;
/// Fill without a colour of its own.
const SHADE: &str = "#bbbbbb";

/// Changes of a muscle from the baseline to a posture in all draws, N per metre of thickness.
fn changes(posterior: &Posterior<'_>, posture: usize, muscle: usize) -> Vec<f64> {
    posterior.draws.iter().map(|d| d.change(posture, muscle)).collect()
}

fn rises(changes: &[f64]) -> f64 {
    changes.iter().filter(|c| **c > 0.0).count() as f64 / changes.len().max(1) as f64
}

/// A ridge for every muscle: the density of the change of its tension from the baseline, with a bar over its
/// 95 % interval and a thick one over its 50 % interval.
pub fn ridges(posterior: &Posterior<'_>, posture: usize, title: &str) -> Svg {
    let names = &posterior.density.ground.muscles;
    let all: Vec<Vec<f64>> = (0..names.len()).map(|m| changes(posterior, posture, m)).collect();
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
    let x = |value: f64| left + (right - left) * (value - low) / (high - low);
    let head = top + 2.0 * MARGIN;
    let foot = head + RIDGE + FREE * (names.len().max(1) - 1) as f64;
    svg.text([right + 0.5 * ODDS, head], Anchor::Middle, Face::Plain, "P(rises)");
    for value in ticks(low..=high) {
        svg.line([x(value), head], [x(value), foot + MARGIN], if value == 0.0 { INK } else { RULE }, 1.0);
        svg.text(
            [x(value), foot + MARGIN + 22.0],
            Anchor::Middle,
            Face::Plain,
            &format!("{value:.0}").replace('-', "\u{2212}"),
        );
    }
    let infos = Muscles::built_in().of(names);
    for (m, name) in names.iter().enumerate() {
        let base = head + RIDGE + FREE * m as f64;
        let heights = density(&all[m], low, high);
        let most = heights.iter().copied().fold(1e-12, f64::max);
        let at = |i: usize| low + (high - low) * i as f64 / (POINTS - 1) as f64;
        let curve = heights.iter().enumerate().map(|(i, h)| [x(at(i)), base - 0.92 * RIDGE * h / most]);
        let shape = std::iter::once([x(low), base]).chain(curve).chain(std::iter::once([x(high), base]));
        let colour = infos.get(m).map_or_else(|| SHADE.to_owned(), |i| i.colour.to_string());
        svg.element(
            "path",
            format_args!(
                "d=\"{}\" fill=\"{colour}\" fill-opacity=\"0.55\" stroke=\"{INK}\" stroke-width=\"1\"",
                closed([shape])
            ),
        );
        let bar = |ends: [f64; 2]| ends.map(|v| [x(v.clamp(low, high)), base]);
        let [a, b] = bar(spreads[m].interval_95);
        svg.line(a, b, INK, 3.0);
        let [a, b] = bar(spreads[m].interval_50);
        svg.line(a, b, INK, 8.0);
        svg.text([left - 10.0, base - 14.0], Anchor::End, Face::Bold, name);
        svg.text(
            [right + 0.5 * ODDS, base - 14.0],
            Anchor::Middle,
            Face::Plain,
            &format!("{:.2}", rises(&all[m])),
        );
    }
    let below = "change of tension from the baseline, N per metre";
    svg.text([0.5 * (left + right), foot + MARGIN + 54.0], Anchor::Middle, Face::Plain, below);
    svg.finish(foot + MARGIN + 54.0 + 2.0 * MARGIN)
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
