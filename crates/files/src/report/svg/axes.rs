//! The view of a part of the plane, with axes in millimetres of equal scale.

use std::ops::RangeInclusive;

use super::{Anchor, FontFace, INK, MARGIN, Px, Svg, data};
use tongue_core::geometry::Point;

/// Room for the numbers and the name of the vertical axis, and of the horizontal axis, px.
pub(super) const LEFT: f64 = 84.0;
pub(super) const BELOW: f64 = 76.0;
const TICK: f64 = 6.0;

/// A rectangle in the plane, m, or on the sheet, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Bounds {
    pub low: Point,
    pub high: Point,
}

impl Bounds {
    /// The bounding rectangle of points, m; its low is above its high if there are none.
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        let none = Self { low: Point::repeat(f64::INFINITY), high: Point::repeat(f64::NEG_INFINITY) };
        points.into_iter().fold(none, |b, p| Self { low: b.low.inf(p), high: b.high.sup(p) })
    }

    pub fn size(&self) -> [f64; 2] {
        [0, 1].map(|i| (self.high[i] - self.low[i]).max(0.0))
    }

    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Extended by `margin` (m) on every side, and from there to the next multiple of `step` (m).
    pub fn outwards(self, margin: f64, step: f64) -> Self {
        Self {
            low: self.low.map(|v| ((v - margin) / step).floor() * step),
            high: self.high.map(|v| ((v + margin) / step).ceil() * step),
        }
    }

    /// Extended to an aspect ratio between 1 : 2 and 4 : 3, so that a figure of any body fits a page.
    pub(crate) fn with_page_proportions(self) -> Self {
        let [w, h] = self.size();
        let (middle, half) =
            (0.5 * (self.low + self.high), 0.5 * Point::new(w.max(0.75 * h), h.max(0.5 * w)));
        Self { low: middle - half, high: middle + half }
    }

    pub fn contains(&self, p: &Point) -> bool {
        (0..2).all(|i| (self.low[i]..=self.high[i]).contains(&p[i]))
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlotView {
    pub bounds: Bounds,
    pub corner: Px,
    /// px/m.
    pub scale: f64,
}

impl PlotView {
    pub fn new(bounds: Bounds, corner: Px, width: f64) -> Self {
        Self { bounds, corner, scale: width / bounds.size()[0].max(1e-9) }
    }

    pub fn end(&self) -> Px {
        let [w, h] = self.bounds.size();
        [self.corner[0] + w * self.scale, self.corner[1] + h * self.scale]
    }

    pub fn place(&self, p: &Point) -> Px {
        [
            self.corner[0] + (p.x - self.bounds.low[0]) * self.scale,
            self.corner[1] + (self.bounds.high[1] - p.y) * self.scale,
        ]
    }

    pub fn chain(&self, positions: &[Point], nodes: &[usize]) -> impl Iterator<Item = Px> {
        nodes.iter().filter_map(|&n| Some(self.place(positions.get(n)?)))
    }

    pub fn axes(&self, svg: &mut Svg, [x, y]: [&str; 2]) {
        let [left, top] = self.corner;
        let [right, bottom] = self.end();
        svg.stroke(&data([[[left, top], [left, bottom], [right, bottom]]]), INK, 1.5);
        let [x_mm, y_mm] = [0, 1].map(|i| 1e3 * self.bounds.low[i]..=1e3 * self.bounds.high[i]);
        for value in ticks(x_mm) {
            let [at, _] = self.place(&Point::new(1e-3 * value, 0.0));
            svg.line([at, bottom], [at, bottom + TICK], INK, 1.5);
            // A number with a sign stays inside the sheet.
            let inside = right + MARGIN - 0.7 * FontFace::Plain.width(&tick(value));
            svg.text([at.min(inside), bottom + 22.0], Anchor::Middle, FontFace::Plain, &tick(value));
        }
        for value in ticks(y_mm) {
            let [_, at] = self.place(&Point::new(0.0, 1e-3 * value));
            svg.line([left - TICK, at], [left, at], INK, 1.5);
            svg.text([left - TICK - 4.0, at], Anchor::End, FontFace::Plain, &tick(value));
        }
        svg.text([0.5 * (left + right), bottom + 54.0], Anchor::Middle, FontFace::Plain, x);
        svg.upright_text([left - LEFT + MARGIN + 8.0, 0.5 * (top + bottom)], y);
    }

    /// The visible part of a chain of points (m), and where it leaves the view if it does: a point inside, and the point at the edge.
    pub fn visible(&self, points: &[Point]) -> (Vec<Px>, Option<[Px; 2]>) {
        let mut seen = Vec::new();
        let mut leaves = None;
        for pair in points.windows(2) {
            let [first, second] = [&pair[0], &pair[1]];
            let exit = |from, to| [self.place(from), self.place(&self.exit(from, to))];
            match [first, second].map(|p| self.bounds.contains(p)) {
                [true, true] => seen.extend([self.place(first), self.place(second)]),
                [true, false] => {
                    leaves = Some(exit(first, second));
                    seen.extend(exit(first, second));
                }
                [false, true] => {
                    let [from, to] = exit(second, first);
                    leaves = Some([from, to]);
                    seen.extend([to, from]);
                }
                [false, false] => {}
            }
        }
        seen.dedup();
        (seen, leaves)
    }

    /// The point, m, at which the line from a visible point to an invisible one meets the edge.
    fn exit(&self, from: &Point, to: &Point) -> Point {
        let way = to - from;
        let [x, y] = [0, 1].map(|i| {
            let edge = if way[i] > 0.0 { self.bounds.high[i] } else { self.bounds.low[i] };
            if way[i] == 0.0 { 1.0 } else { (edge - from[i]) / way[i] }
        });
        from + way * f64::min(x, y).clamp(0.0, 1.0)
    }
}

fn tick(value: f64) -> String {
    format!("{value:.0}").replace('-', "\u{2212}")
}

/// Round numbers in a range, four to eleven of them.
pub(super) fn ticks(range: RangeInclusive<f64>) -> Vec<f64> {
    let (low, high) = range.into_inner();
    let span = (high - low).max(1e-9);
    let tens = 10f64.powf((span / 10.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|s| s * tens).find(|s| span / s <= 10.0);
    let step = step.unwrap_or(10.0 * tens);
    let first = (low / step - 1e-9).ceil() as i64;
    (first..).map(|n| n as f64 * step).take_while(|v| *v <= high + 1e-9 * span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_the_view_ends_at_its_edge() {
        let view = PlotView::new(Bounds { low: Point::zeros(), high: Point::repeat(1.0) }, [0.0, 0.0], 100.0);
        let points = [[2.0, 0.5], [0.5, 0.5], [0.5, 0.25]].map(Point::from);
        let (seen, leaves) = view.visible(&points);
        assert_eq!(seen, [[100.0, 50.0], [50.0, 50.0], [50.0, 75.0]]);
        assert_eq!(leaves, Some([[50.0, 50.0], [100.0, 50.0]]));
        assert_eq!(view.visible(&[[2.0, 2.0], [3.0, 3.0]].map(Point::from)), (vec![], None));
    }
}
