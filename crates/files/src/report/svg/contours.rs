//! The stretch of the tissue in colours.

use nalgebra::{Matrix2, SVector};

use super::axes::{View, ticks};
use super::plot::{Plot, around};
use super::{Anchor, Face, INK, MARGIN, Svg, WIDTH, closed};
use tongue_core::body::Mesh;

/// Steps of viridis, which becomes steadily lighter and is readable for colour-blind readers.
const COLOURS: [&str; 10] = [
    "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b",
    "#fde725",
];

fn colour(stretch: f64, [low, high]: [f64; 2]) -> &'static str {
    let part = ((stretch - low) / (high - low)).clamp(0.0, 1.0);
    COLOURS[((part * COLOURS.len() as f64) as usize).min(COLOURS.len() - 1)]
}

/// Fills every triangle of the tissue by its largest principal stretch, and returns the ends of the scale of colours; `None` if there is
/// no tissue.
pub(super) fn fill(
    svg: &mut Svg,
    view: &View,
    mesh: &Mesh<2>,
    positions: &[SVector<f64, 2>],
) -> Option<[f64; 2]> {
    let stretch = |cell: &[usize]| {
        let sides = |x: &[SVector<f64, 2>]| {
            Matrix2::from_columns(&[x[cell[1]] - x[cell[0]], x[cell[2]] - x[cell[0]]])
        };
        Some((sides(positions) * sides(&mesh.nodes).try_inverse()?).singular_values().max())
    };
    let stretches = mesh.cells.iter().map(stretch).collect::<Option<Vec<f64>>>()?;
    let scale = [1.0, around(1.0, stretches.iter().copied().fold(1.01, f64::max))[1]];
    for paint in COLOURS {
        let of = mesh.cells.iter().zip(&stretches).filter(|(_, s)| colour(**s, scale) == paint);
        let d =
            closed(of.map(|(cell, _)| cell.iter().map(|&n| view.place(&positions[n])).collect::<Vec<_>>()));
        // An edge of the same colour closes the gaps between triangles from rounding.
        svg.element(
            "path",
            format_args!("d=\"{d}\" fill=\"{paint}\" stroke=\"{paint}\" stroke-width=\"0.6\""),
        );
    }
    (!stretches.is_empty()).then_some(scale)
}

/// The legend of the colours, from `top` on; returns its lower end.
pub(super) fn key(svg: &mut Svg, scale: [f64; 2], left: f64, top: f64) -> f64 {
    let parts = COLOURS.len() as f64;
    let size = [WIDTH - MARGIN - 30.0 - left, 22.0];
    let plot = Plot::linear([left, top + 34.0], size, scale, [0.0, 1.0]);
    svg.text([left, top + 14.0], Anchor::Start, Face::Plain, "largest stretch of the tissue, to rest");
    for (nth, paint) in COLOURS.iter().enumerate() {
        let [from, to] = [nth, nth + 1].map(|n| scale[0] + (scale[1] - scale[0]) * n as f64 / parts);
        plot.rectangle(svg, [[from, 0.0], [to, 1.0]], paint, Some(INK));
    }
    for level in ticks(scale[0]..=scale[1]) {
        let [x, y] = plot.place(level, 0.0);
        svg.text([x, y + 18.0], Anchor::Middle, Face::Plain, &format!("{level:.2}"));
    }
    top + 34.0 + 22.0 + 44.0
}
