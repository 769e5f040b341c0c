//! Contours: the stretch of the tissue as bands of colour.

use nalgebra::{Matrix2, SVector};

use super::axes::{View, ticks};
use super::{Anchor, Face, INK, MARGIN, Px, Svg, WIDTH, closed};
use tongue_core::body::Mesh;

/// Steps of viridis, which becomes steadily lighter and is readable for colour-blind readers.
const COLOURS: [&str; 10] = [
    "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b",
    "#fde725",
];

/// The values between which colours change, ascending.
pub(super) struct Bands(Vec<f64>);

/// Fills the tissue by its largest principal stretch, averaged at every node over its triangles and linear
/// between nodes; `None` if there is no tissue.
pub(super) fn fill(
    svg: &mut Svg,
    view: &View,
    mesh: &Mesh<2>,
    positions: &[SVector<f64, 2>],
) -> Option<Bands> {
    let values = at_nodes(mesh, positions)?;
    let most = values.iter().copied().fold(1.01, f64::max);
    let mut levels = ticks(1.0..=most);
    let step = levels.get(1)? - levels.first()?;
    if levels.last().is_some_and(|l| *l < most) {
        levels.push(levels[0] + step * levels.len() as f64);
    }
    levels.truncate(COLOURS.len() + 1);
    for (nth, band) in levels.windows(2).enumerate() {
        let colour = colour(nth, levels.len() - 1);
        let mut parts = Vec::new();
        for cell in mesh.cells.iter() {
            let corners: Vec<(Px, f64)> =
                cell.iter().map(|&n| (view.place(&positions[n]), values[n])).collect();
            let above = cut(&corners, |v| v - band[0]);
            parts.push(cut(&above, |v| band[1] - v).into_iter().map(|(p, _)| p).collect::<Vec<Px>>());
        }
        let d = closed(parts.into_iter().filter(|p| p.len() > 2));
        // An edge of the same colour closes the gaps between triangles from rounding.
        svg.element(
            "path",
            format_args!("d=\"{d}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0.6\""),
        );
    }
    Some(Bands(levels))
}

/// The colour of a band; the bands span the whole scale.
fn colour(nth: usize, bands: usize) -> &'static str {
    COLOURS[(nth * (COLOURS.len() - 1) / (bands - 1).max(1)).min(COLOURS.len() - 1)]
}

/// Largest principal stretch at every node, 1 if it has no tissue.
fn at_nodes(mesh: &Mesh<2>, positions: &[SVector<f64, 2>]) -> Option<Vec<f64>> {
    let mut sums = vec![(0.0, 0.0); mesh.nodes.len()];
    for cell in mesh.cells.iter() {
        let sides = |x: &[SVector<f64, 2>]| {
            Matrix2::from_columns(&[x[cell[1]] - x[cell[0]], x[cell[2]] - x[cell[0]]])
        };
        let rest = sides(&mesh.nodes);
        let stretch = (sides(positions) * rest.try_inverse()?).singular_values().max();
        let area = rest.determinant().abs();
        for &n in cell {
            sums[n].0 += stretch * area;
            sums[n].1 += area;
        }
    }
    (!mesh.cells.is_empty()).then(|| sums.iter().map(|(s, a)| if *a > 0.0 { s / a } else { 1.0 }).collect())
}

/// The part of a polygon with `side` of the value not negative (Sutherland and Hodgman 1974).
fn cut(polygon: &[(Px, f64)], side: impl Fn(f64) -> f64) -> Vec<(Px, f64)> {
    let mut out = Vec::new();
    for (&(p, v), &(q, w)) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let [a, b] = [side(v), side(w)];
        if a >= 0.0 {
            out.push((p, v));
        }
        if (a < 0.0) != (b < 0.0) {
            let t = a / (a - b);
            out.push(([0, 1].map(|i| p[i] + t * (q[i] - p[i])), v + t * (w - v)));
        }
    }
    out
}

impl Bands {
    /// The legend of the colours, from `top` on; returns its lower end.
    pub fn key(&self, svg: &mut Svg, left: f64, top: f64) -> f64 {
        let bands = self.0.len().saturating_sub(1).max(1);
        let width = (WIDTH - MARGIN - 30.0 - left) / bands as f64;
        svg.text([left, top + 14.0], Anchor::Start, Face::Plain, "largest stretch of the tissue, to rest");
        let (y, height) = (top + 34.0, 22.0);
        for nth in 0..bands {
            let x = left + width * nth as f64;
            svg.rectangle([x, y], [x + width, y + height], colour(nth, bands), Some(INK));
        }
        for (nth, level) in self.0.iter().enumerate() {
            let x = left + width * nth as f64;
            svg.text([x, y + height + 18.0], Anchor::Middle, Face::Plain, &format!("{level:.2}"));
        }
        y + height + 44.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_share_a_triangle_between_them() {
        let triangle = [([0.0, 0.0], 1.0), ([1.0, 0.0], 2.0), ([0.0, 1.0], 1.0)];
        let area = |p: &[(Px, f64)]| -> f64 {
            let next = p.iter().cycle().skip(1);
            p.iter().zip(next).map(|((a, _), (b, _))| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum()
        };
        let low = cut(&triangle, |v| 1.5 - v);
        let high = cut(&triangle, |v| v - 1.5);
        assert!((area(&low) - 0.375).abs() < 1e-12 && (area(&high) - 0.125).abs() < 1e-12);
        assert!(cut(&triangle, |v| v - 3.0).is_empty());
    }
}
