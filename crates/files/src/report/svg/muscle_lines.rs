//! A body in the plane: its muscles as lines with their names, its bones, and the stretch of its tissue in colours.

use nalgebra::{Matrix2, SVector};

use super::axes::{PlotView, ticks};
use super::labels::{self, MuscleLabel, colours};
use super::plot::{Plot, round_range};
use super::{Anchor, FontFace, INK, MARGIN, Px, Svg, WIDTH, closed_paths};
use tongue_core::body::Mesh;

/// Line widths of contracting muscles, px: of the line, and how much wider its dark edge is.
const CONTRACTING: [f64; 2] = [8.0, 2.5];
const PASSIVE: [f64; 2] = [3.5, 2.0];

pub(super) struct DrawnMuscle<'a> {
    pub name: String,
    pub colour: String,
    pub contracting: bool,
    pub seen: Vec<Px>,
    /// Where the muscle leaves the view: a point inside, and the point at the edge.
    pub leaves: Option<[Px; 2]>,
    pub nodes: &'a [usize],
}

impl DrawnMuscle<'_> {
    pub fn face(&self) -> FontFace {
        if self.contracting { FontFace::Bold } else { FontFace::Plain }
    }
}

/// The muscles of a shape, contracting ones last; the name of a contracting one is followed by its tension.
pub(super) fn lines<'a>(
    view: &PlotView,
    mesh: &'a Mesh<2>,
    positions: &[SVector<f64, 2>],
    tensions: &[f64],
) -> Vec<DrawnMuscle<'a>> {
    let coloured = mesh.muscles.iter().zip(colours(&mesh.muscle_names()));
    let all = coloured.zip(tensions).map(|((muscle, colour), &tension)| {
        let chain: Vec<_> = muscle.nodes.iter().filter_map(|&n| positions.get(n).copied()).collect();
        let (seen, leaves) = view.visible(&chain);
        let contracting = tension > 0.0;
        let name = if contracting { format!("{} {tension:.1}", muscle.name) } else { muscle.name.clone() };
        DrawnMuscle { name, colour, contracting, seen, leaves, nodes: &muscle.nodes }
    });
    let mut all: Vec<DrawnMuscle<'a>> = all.collect();
    all.sort_by_key(|l| l.contracting);
    all
}

pub(super) fn bones(view: &PlotView, mesh: &Mesh<2>, positions: &[SVector<f64, 2>]) -> Vec<Px> {
    let seen = mesh.fixed.iter().filter_map(|&n| positions.get(n)).filter(|p| view.bounds.contains(p));
    seen.map(|p| view.place(p)).collect()
}

/// The centre of every muscle's name, in the order of the lines; contracting muscles choose first.
pub(super) fn label_places(view: &PlotView, lines: &[DrawnMuscle<'_>], bones: &[Px]) -> Vec<Option<Px>> {
    let named: Vec<MuscleLabel<'_>> =
        lines.iter().rev().map(|l| MuscleLabel { name: &l.name, face: l.face(), line: &l.seen }).collect();
    let corner = view.place(&SVector::from([view.bounds.low[0], view.bounds.high[1]]));
    let mut places = labels::place(&named, bones, [corner, view.end()]);
    places.reverse();
    places
}

/// Draws a muscle over a slightly wider dark line, so that light colours have an edge on white paper.
pub(super) fn muscle(svg: &mut Svg, d: &str, colour: &str, contracting: bool) {
    let [width, edge] = widths(contracting);
    for (width, colour) in [(width + edge, INK), (width, colour)] {
        if contracting { svg.stroke(d, colour, width) } else { svg.dashes(d, colour, width) }
    }
}

pub(super) fn widths(contracting: bool) -> [f64; 2] {
    if contracting { CONTRACTING } else { PASSIVE }
}

pub(super) fn arrow(svg: &mut Svg, from: Px, to: Px, colour: &str) {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]).max(1e-9);
    let [u, v] = [way[0] / length, way[1] / length];
    let corner = |along: f64, across: f64| [to[0] + along * u - across * v, to[1] + along * v + across * u];
    let head = closed_paths([[corner(0.0, 0.0), corner(-26.0, 10.0), corner(-26.0, -10.0)]]);
    svg.fill(&head, colour);
    svg.stroke(&head, INK, 1.2);
}

pub(super) fn bone(svg: &mut Svg, [x, y]: Px) {
    svg.rectangle([x - 7.0, y - 7.0], [x + 7.0, y + 7.0], INK, None);
}

/// Steps of viridis, whose lightness grows steadily, also for colour-blind readers.
const COLOURS: [&str; 10] = [
    "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b",
    "#fde725",
];

fn colour(stretch: f64, [low, high]: [f64; 2]) -> &'static str {
    let part = ((stretch - low) / (high - low)).clamp(0.0, 1.0);
    COLOURS[((part * COLOURS.len() as f64) as usize).min(COLOURS.len() - 1)]
}

/// Fills triangles by their largest principal stretch; returns the ends of the scale, or `None` without tissue that has an area at rest.
pub(super) fn fill(
    svg: &mut Svg,
    view: &PlotView,
    mesh: &Mesh<2>,
    positions: &[SVector<f64, 2>],
) -> Option<[f64; 2]> {
    let stretches = mesh.cells.iter().map(|cell| {
        let [now, rest] = [positions, &mesh.nodes]
            .map(|x| Matrix2::from_columns(&[x[cell[1]] - x[cell[0]], x[cell[2]] - x[cell[0]]]));
        Some((now * rest.try_inverse()?).singular_values().max())
    });
    let stretches = stretches.collect::<Option<Vec<f64>>>()?;
    let scale = [1.0, round_range(1.0, stretches.iter().copied().fold(1.01, f64::max))[1]];
    for paint in COLOURS {
        let of = mesh.cells.iter().zip(&stretches).filter(|(_, s)| colour(**s, scale) == paint);
        let d = closed_paths(
            of.map(|(cell, _)| cell.iter().map(|&n| view.place(&positions[n])).collect::<Vec<_>>()),
        );
        // A stroke of the same colour closes the gaps between triangles that rounding leaves.
        svg.element(
            "path",
            format_args!("d=\"{d}\" fill=\"{paint}\" stroke=\"{paint}\" stroke-width=\"0.6\""),
        );
    }
    (!stretches.is_empty()).then_some(scale)
}

/// Draws the legend of the colours from `top` on; returns its lower end.
pub(super) fn legend(svg: &mut Svg, scale: [f64; 2], left: f64, top: f64) -> f64 {
    let parts = COLOURS.len() as f64;
    let size = [WIDTH - MARGIN - 30.0 - left, 22.0];
    let plot = Plot::linear([left, top + 34.0], size, scale, [0.0, 1.0]);
    svg.text([left, top + 14.0], Anchor::Start, FontFace::Plain, "largest stretch of the tissue, to rest");
    for (nth, paint) in COLOURS.iter().enumerate() {
        let [from, to] = [nth, nth + 1].map(|n| scale[0] + (scale[1] - scale[0]) * n as f64 / parts);
        plot.rectangle(svg, [[from, 0.0], [to, 1.0]], paint, Some(INK));
    }
    for level in ticks(scale[0]..=scale[1]) {
        let [x, y] = plot.place(level, 0.0);
        svg.text([x, y + 18.0], Anchor::Middle, FontFace::Plain, &format!("{level:.2}"));
    }
    top + 34.0 + 22.0 + 44.0
}
