//! Differences of tensions between a subject's vowels: a column for every pair of vowels, a row for every muscle.

use super::{Anchor, Face, INK, MARGIN, RULE, Svg, WIDTH};
use tongue_core::statistics::distinct;
use tongue_infer::posterior::Contrast;

/// A row and the names of the muscles, px.
const ROW: f64 = 34.0;
const NAMES: f64 = 70.0;
/// Largest difference that a cell can show, N per metre of thickness.
const SHOWN: f64 = 60.0;

/// Most subjects that are drawn.
pub(crate) const MOST_SUBJECTS: usize = 8;

/// The contrasts of subjects, below each other. In every cell the middle 95 % of the difference of a muscle's tensions and its median, zero in
/// the middle; dark where the sign is sure, grey where it is not.
pub fn contrasts(subjects: &[(&str, Vec<Contrast>)], title: &str) -> Svg {
    let shown = &subjects[..subjects.len().min(MOST_SUBJECTS)];
    let sure = |(subject, all): &(&str, Vec<Contrast>)| {
        let told = |c: &Contrast| {
            format!("{subject} {} {} in /{}/ than in /{}/", c.muscle, word(c), c.posture, c.other)
        };
        all.iter().filter(|c| c.is_decided()).map(told).collect::<Vec<_>>()
    };
    let sure: Vec<String> = shown.iter().flat_map(sure).collect();
    let description = format!(
        "Differences of tensions between vowels, N per metre: 95 % interval and median. Sure: {}.",
        if sure.is_empty() { "none".to_owned() } else { sure.join(", ") }
    );
    let (mut svg, top) = Svg::new(title, &description, WIDTH);
    let mut foot = top;
    for (subject, all) in shown {
        foot = panel(&mut svg, subject, all, foot + 2.5 * MARGIN);
    }
    for (line, text) in [
        format!("N per metre, each column from \u{2212}{SHOWN:.0} to {SHOWN:.0}; line: 95 %, tick: median"),
        "dark: the sign is sure to 95 %".to_owned(),
    ]
    .iter()
    .enumerate()
    {
        svg.text([0.5 * WIDTH, foot + 40.0 + 32.0 * line as f64], Anchor::Middle, Face::Plain, text);
    }
    svg.finish(foot + 72.0 + 2.0 * MARGIN)
}

/// Draws one subject's panel below `top`, px, and returns its lower edge.
fn panel(svg: &mut Svg, subject: &str, all: &[Contrast], top: f64) -> f64 {
    let muscles: Vec<&str> = distinct(all.iter().map(|c| c.muscle.as_str()));
    let pairs: Vec<(&str, &str)> = distinct(all.iter().map(|c| (c.posture.as_str(), c.other.as_str())));
    let left = MARGIN + NAMES;
    let width = (WIDTH - left - MARGIN) / pairs.len().max(1) as f64;
    let head = top + 40.0;
    svg.text([left - 12.0, head - 12.0], Anchor::End, Face::Bold, subject);
    for (row, muscle) in muscles.iter().enumerate() {
        svg.text([left - 12.0, head + ROW * (row as f64 + 0.5) + 8.0], Anchor::End, Face::Plain, muscle);
    }
    let foot = head + ROW * muscles.len() as f64;
    for (column, (first, other)) in pairs.iter().enumerate() {
        let middle = left + width * (column as f64 + 0.5);
        let x = |value: f64| middle + 0.46 * width * (value / SHOWN).clamp(-1.0, 1.0);
        let name = format!("{first} \u{2212} {other}");
        svg.text([middle, head - 12.0], Anchor::Middle, Face::Plain, &name);
        svg.line([middle, head], [middle, foot], RULE, 1.5);
        for c in all.iter().filter(|c| (c.posture.as_str(), c.other.as_str()) == (*first, *other)) {
            let row = muscles.iter().position(|m| *m == c.muscle).unwrap_or(0);
            let y = head + ROW * (row as f64 + 0.5);
            let (colour, thick) = if c.is_decided() { (INK, 6.0) } else { ("#9a9a9a", 3.0) };
            svg.line([x(c.interval_95[0]), y], [x(c.interval_95[1]), y], colour, thick);
            svg.line([x(c.median), y - 9.0], [x(c.median), y + 9.0], colour, 3.0);
        }
    }
    foot
}

fn word(c: &Contrast) -> &'static str {
    if c.probability_more > 0.5 { "harder" } else { "less" }
}
