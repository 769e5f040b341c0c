//! A rectangle of the sheet with two linear axes.

use std::ops::RangeInclusive;

use super::axes::ticks;
use super::{Anchor, Face, INK, Px, RULE, Svg, data};

/// Positions of values on the sheet.
#[derive(Debug, Clone)]
pub(super) struct Plot {
    /// Upper left corner, px.
    pub corner: Px,
    /// Width and height, px.
    pub size: [f64; 2],
    /// Values at the left and at the right edge; the second may be smaller.
    pub x: [f64; 2],
    /// Values at the lower and at the upper edge; the second may be smaller.
    pub y: [f64; 2],
}

impl Plot {
    /// The position of a pair of values, px, moved to the edge if it is outside.
    pub fn place(&self, x: f64, y: f64) -> Px {
        let part = |v: f64, [from, to]: [f64; 2]| ((v - from) / (to - from)).clamp(0.0, 1.0);
        [
            self.corner[0] + self.size[0] * part(x, self.x),
            self.corner[1] + self.size[1] * (1.0 - part(y, self.y)),
        ]
    }

    /// A chain of pairs of values as the data of a path.
    pub fn path(&self, points: impl IntoIterator<Item = [f64; 2]>) -> String {
        data([points.into_iter().map(|[x, y]| self.place(x, y))])
    }

    /// Lines, numbers and names of both axes.
    pub fn axes(&self, svg: &mut Svg, [x, y]: [&str; 2]) {
        let number = |v: f64| format!("{v}").replace('-', "\u{2212}");
        let range = |[a, b]: [f64; 2]| -> RangeInclusive<f64> { a.min(b)..=a.max(b) };
        let every = |all: Vec<f64>, room: f64| {
            let step = (all.len() as f64 * room).ceil().max(1.0) as usize;
            all.into_iter().step_by(step)
        };
        let [left, bottom] = [self.corner[0], self.corner[1] + self.size[1]];
        for value in every(ticks(range(self.x)), 70.0 / self.size[0]) {
            let [at, _] = self.place(value, self.y[0]);
            svg.line([at, self.corner[1]], [at, bottom], RULE, 1.0);
            svg.text([at, bottom + 20.0], Anchor::Middle, Face::Plain, &number(value));
        }
        for value in every(ticks(range(self.y)), 34.0 / self.size[1]) {
            let [_, at] = self.place(self.x[0], value);
            svg.line([left, at], [left + self.size[0], at], RULE, 1.0);
            svg.text([left - 8.0, at], Anchor::End, Face::Plain, &number(value));
        }
        svg.stroke(&data([[self.corner, [left, bottom], [left + self.size[0], bottom]]]), INK, 1.5);
        svg.text([left + 0.5 * self.size[0], bottom + 50.0], Anchor::Middle, Face::Plain, x);
        svg.upright_text([left - 78.0, self.corner[1] + 0.5 * self.size[1]], y);
    }
}
