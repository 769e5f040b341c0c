//! Predicted against measured values: a panel for each method, a colour for each muscle.

use super::muscle_lines::colours;
use super::plot::{Axis, Plot, around};
use super::{Anchor, Entry, Face, INK, MARGIN, Svg, TEXT};

/// Side of a panel, px, and room for its axis and its title.
const SIDE: f64 = 330.0;
const AXIS: f64 = 96.0;
const HEAD: f64 = 3.0 * TEXT;
const FOOT: f64 = 3.0 * TEXT;
const COLUMNS: usize = 3;
const DOT: f64 = 6.5;

#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    pub title: String,
    /// A line below it, such as its error.
    pub line: String,
    pub points: Vec<(usize, f64, f64)>,
}

/// Draws `panels` with the same axes and the diagonal of exact predictions.
pub fn scatter(muscles: &[String], panels: &[Scatter], title: &str) -> Svg {
    let values = || panels.iter().flat_map(|p| p.points.iter().flat_map(|&(_, x, y)| [x, y]));
    let ends = around(values().fold(0.95, f64::min) - 0.02, values().fold(1.05, f64::max) + 0.02);
    let columns = COLUMNS.min(panels.len().max(1));
    let width = 2.0 * MARGIN + columns as f64 * (SIDE + AXIS);
    let told: Vec<String> = panels.iter().map(|p| format!("{}: {}.", p.title, p.line)).collect();
    let shown = format!("Predicted against measured stretches of passive muscles. {}", told.join(" "));
    let (mut svg, top) = Svg::new(title, &shown, width);
    let paint = colours(muscles);
    let entries = muscles
        .iter()
        .zip(&paint)
        .map(|(name, c)| Entry::new(26.0, name, move |svg, [x, y]| svg.dot([x + DOT, y], DOT, c, INK)));
    let top = top + svg.legend(entries, [MARGIN + AXIS, width - MARGIN], top);
    let mut bottom = top;
    for (nth, panel) in panels.iter().enumerate() {
        let left = MARGIN + AXIS + (nth % columns) as f64 * (SIDE + AXIS);
        let above = top + HEAD + (nth / columns) as f64 * (HEAD + SIDE + FOOT);
        let plot = Plot::linear([left, above], [SIDE, SIDE], ends, ends);
        svg.text([left, above - 1.9 * TEXT], Anchor::Start, Face::Bold, &panel.title);
        svg.text([left, above - 0.8 * TEXT], Anchor::Start, Face::Plain, &panel.line);
        plot.axes(&mut svg, [Axis::Named("measured stretch"), Axis::Named("predicted")]);
        svg.stroke(&plot.path(ends.map(|v| [v, v])), INK, 1.2);
        for &(muscle, x, y) in &panel.points {
            svg.dot(plot.place(x, y), DOT, paint.get(muscle).map_or(INK, String::as_str), INK);
        }
        bottom = above + SIDE + FOOT;
    }
    svg.finish(bottom + MARGIN)
}
