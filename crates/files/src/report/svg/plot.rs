//! The rectangle with two axes in which values are plotted, and panels of predicted against measured values.

use super::axes::ticks;
use super::labels::colours;
use super::{Anchor, FontFace, INK, Legend, MARGIN, Px, RULE, Svg, TEXT, data};
use crate::report::joined;

#[derive(Debug, Clone)]
pub(super) struct Plot {
    pub corner: Px,
    pub size: [f64; 2],
    /// Values at the left and at the right edge; the second may be smaller.
    pub x: [f64; 2],
    /// Values at the lower and at the upper edge; the second may be smaller.
    pub y: [f64; 2],
    /// Whether values are logarithms to base ten, which are marked as powers of ten.
    pub logarithmic: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis<'a> {
    /// Lines across the plot, their numbers, and the name of the axis.
    Named(&'a str),
    Numbers,
    Lines,
    Nothing,
}

fn tick_marks(edges: [f64; 2], logarithmic: bool) -> Vec<(f64, String)> {
    let [low, high] = [edges[0].min(edges[1]), edges[0].max(edges[1])];
    if logarithmic {
        return (low as i32..=high as i32).map(|e| (f64::from(e), power(e))).collect();
    }
    let values = ticks(low..=high);
    let step = values.get(1).map_or(1.0, |second| second - values[0]);
    let digits = (-step.log10() - 1e-9).ceil().max(0.0) as usize;
    let labels = values.iter().map(|v| format!("{:.digits$}", v + 0.0).replace('-', "\u{2212}"));
    values.iter().copied().zip(labels).collect()
}

fn power(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| c.to_digit(10).map_or('⁻', |d| RAISED[d as usize % 10]));
    format!("10{}", raised.collect::<String>())
}

/// The smallest range between round numbers that contains these values.
pub(super) fn round_range(low: f64, high: f64) -> [f64; 2] {
    let marks = ticks(low..=high);
    let step = marks.get(1).map_or(1.0, |second| second - marks[0]);
    [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step]
}

impl Plot {
    pub fn linear(corner: Px, size: [f64; 2], x: [f64; 2], y: [f64; 2]) -> Self {
        Self { corner, size, x, y, logarithmic: false }
    }

    /// The position of a pair of values, px; a pair outside is moved to the edge.
    pub fn place(&self, x: f64, y: f64) -> Px {
        let [x, y] =
            [(x, self.x), (y, self.y)].map(|(v, [from, to])| ((v - from) / (to - from)).clamp(0.0, 1.0));
        [self.corner[0] + self.size[0] * x, self.corner[1] + self.size[1] * (1.0 - y)]
    }

    pub fn path(&self, points: impl IntoIterator<Item = [f64; 2]>) -> String {
        data([points.into_iter().map(|[x, y]| self.place(x, y))])
    }

    pub fn upright(&self, x: f64) -> String {
        self.path([[x, self.y[0]], [x, self.y[1]]])
    }

    pub fn rectangle(&self, svg: &mut Svg, [a, b]: [[f64; 2]; 2], fill: &str, edge: Option<&str>) {
        svg.rectangle(self.place(a[0], a[1]), self.place(b[0], b[1]), fill, edge);
    }

    pub fn axes(&self, svg: &mut Svg, [x, y]: [Axis<'_>; 2]) {
        let [left, top] = self.corner;
        let [right, bottom] = [left + self.size[0], top + self.size[1]];
        for (value, label) in every(tick_marks(self.x, self.logarithmic), 70.0 / self.size[0]) {
            let [at, _] = self.place(value, self.y[0]);
            if x != Axis::Nothing {
                svg.line([at, top], [at, bottom], RULE, 1.0);
            }
            if matches!(x, Axis::Named(_) | Axis::Numbers) {
                svg.text([at, bottom + 20.0], Anchor::Middle, FontFace::Plain, &label);
            }
        }
        for (value, label) in every(tick_marks(self.y, self.logarithmic), 34.0 / self.size[1]) {
            let [_, at] = self.place(self.x[0], value);
            if y != Axis::Nothing {
                svg.line([left, at], [right, at], RULE, 1.0);
            }
            if matches!(y, Axis::Named(_) | Axis::Numbers) {
                svg.text([left - 8.0, at], Anchor::End, FontFace::Plain, &label);
            }
        }
        svg.stroke(&data([[self.corner, [left, bottom], [right, bottom]]]), INK, 1.5);
        if let Axis::Named(name) = x {
            svg.text([0.5 * (left + right), bottom + 50.0], Anchor::Middle, FontFace::Plain, name);
        }
        if let Axis::Named(name) = y {
            svg.upright_text([left - 78.0, 0.5 * (top + bottom)], name);
        }
    }
}

fn every(all: Vec<(f64, String)>, room: f64) -> impl Iterator<Item = (f64, String)> {
    let step = (all.len() as f64 * room).ceil().max(1.0) as usize;
    all.into_iter().step_by(step)
}

/// Side of a panel, and room for its axis, its title and its foot, px.
const SIDE: f64 = 330.0;
const AXIS: f64 = 96.0;
const HEAD: f64 = 3.0 * TEXT;
const FOOT: f64 = 3.0 * TEXT;
const COLUMNS: usize = 3;
const DOT: f64 = 6.5;

#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    pub title: String,
    pub line: String,
    /// Index of the muscle, measured and predicted value.
    pub points: Vec<(usize, f64, f64)>,
}

pub fn scatter(muscles: &[String], panels: &[Scatter], title: &str) -> Svg {
    let values = panels.iter().flat_map(|p| p.points.iter().flat_map(|&(_, x, y)| [x, y]));
    let ends = round_range(values.clone().fold(0.95, f64::min) - 0.02, values.fold(1.05, f64::max) + 0.02);
    let columns = COLUMNS.min(panels.len().max(1));
    let width = 2.0 * MARGIN + columns as f64 * (SIDE + AXIS);
    let summary = joined(panels.iter().map(|p| format!("{}: {}.", p.title, p.line)), " ");
    let description = format!("Predicted against measured stretches of passive muscles. {summary}");
    let (mut svg, top) = Svg::new(title, &description, width);
    let paint = colours(muscles);
    let mut legend = Legend::new([MARGIN + AXIS, width - MARGIN], top);
    for (name, colour) in muscles.iter().zip(&paint) {
        legend.entry(&mut svg, 26.0, name, |svg, [x, y]| svg.dot([x + DOT, y], DOT, colour, INK));
    }
    let top = top + legend.height();
    let mut bottom = top;
    for (nth, panel) in panels.iter().enumerate() {
        let left = MARGIN + AXIS + (nth % columns) as f64 * (SIDE + AXIS);
        let above = top + HEAD + (nth / columns) as f64 * (HEAD + SIDE + FOOT);
        let plot = Plot::linear([left, above], [SIDE, SIDE], ends, ends);
        svg.text([left, above - 1.9 * TEXT], Anchor::Start, FontFace::Bold, &panel.title);
        svg.text([left, above - 0.8 * TEXT], Anchor::Start, FontFace::Plain, &panel.line);
        plot.axes(&mut svg, [Axis::Named("measured stretch"), Axis::Named("predicted")]);
        svg.stroke(&plot.path(ends.map(|v| [v, v])), INK, 1.2);
        for &(muscle, x, y) in &panel.points {
            svg.dot(plot.place(x, y), DOT, paint.get(muscle).map_or(INK, String::as_str), INK);
        }
        bottom = above + SIDE + FOOT;
    }
    svg.finish(bottom + MARGIN)
}
