//! A body in the plane on a sheet: its outline, the palate, its muscles as lines with their names, its bones, and the stretch of its tissue
//! in colours.

use nalgebra::Matrix2;

use super::axes::{Bounds, LEFT, PlotView, ticks};
use super::labels::{self, DrawnMuscle, colours};
use super::plot::{Plot, round_range};
use super::{Anchor, FontFace, INK, MARGIN, Px, Svg, WIDTH, closed_paths, data};
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;

pub(super) const REST: &str = "#b4b4b4";
pub(super) const REST_TISSUE: &str = "#f1f1f1";
pub(super) const DEFORMED: &str = "#555555";
pub(super) const PALATE: &str = "#a8a8a8";
const EDGES: &str = "#c9c9c9";

/// A bone that moved by less is drawn as not moved, m.
const MOVED: f64 = 1e-5;
const PALATE_THICKNESS: f64 = 0.0025;
/// Margin around the tissue at rest, as a part of its longest side.
const ROOM: f64 = 0.14;

/// A mesh, and the part of the plane in which its shapes are drawn. Positions are those of all nodes, m.
pub(super) struct BodyView<'a> {
    pub mesh: &'a Mesh<2>,
    pub view: PlotView,
    /// The nodes of each outline of the tissue, and its connections.
    outlines: Vec<Vec<usize>>,
    edges: Vec<&'a [usize]>,
}

impl<'a> BodyView<'a> {
    /// The view with the bounds of a picture of these shapes over the whole width of a sheet, from `top` on, px.
    pub fn new<'s>(
        mesh: &'a Mesh<2>,
        palate: &[Point],
        shapes: impl IntoIterator<Item = &'s [Point]>,
        top: f64,
    ) -> Self {
        let bounds = picture_bounds(mesh, palate, shapes);
        Self::in_view(mesh, PlotView::new(bounds, [LEFT, top], WIDTH - LEFT - MARGIN))
    }

    pub fn in_view(mesh: &'a Mesh<2>, view: PlotView) -> Self {
        let inside = mesh.in_tissue();
        let pairs = mesh.connections.iter().map(<[usize; 2]>::as_slice);
        let edges = pairs.filter(|pair| mesh.cells.is_empty() || pair.iter().all(|&n| inside[n]));
        Self { mesh, view, outlines: mesh.outlines(), edges: edges.collect() }
    }

    pub fn outline(&self, positions: &[Point]) -> String {
        closed_paths(self.outlines.iter().map(|ring| self.view.chain(positions, ring)))
    }

    pub fn draw_rest(&self, svg: &mut Svg) {
        let outline = self.outline(&self.mesh.nodes);
        svg.fill(&outline, REST_TISSUE);
        svg.stroke(&outline, REST, 2.0);
    }

    pub fn draw_tissue(&self, svg: &mut Svg, positions: &[Point]) {
        svg.stroke(&data(self.edges.iter().map(|pair| self.view.chain(positions, pair))), EDGES, 1.0);
        svg.stroke(&self.outline(positions), DEFORMED, 2.6);
    }

    pub fn draw_palate(&self, svg: &mut Svg, outline: &[Point]) {
        if outline.len() < 2 {
            return;
        }
        let nodes = &self.mesh.nodes;
        let middle = nodes.iter().sum::<Point>() / nodes.len().max(1) as f64;
        let turned = |a: &Point, b: &Point| Point::new(a.y - b.y, b.x - a.x);
        let off = outline.windows(2).map(|pair| turned(&pair[0], &pair[1]).dot(&(pair[0] - middle)));
        let side = if off.sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        let thick = |pair: &[Point]| {
            let across = turned(&pair[0], &pair[1]);
            across * (side * PALATE_THICKNESS / across.norm().max(1e-12))
        };
        let mut corners = Vec::new();
        for pair in outline.windows(2) {
            let t = thick(pair);
            corners.push(vec![pair[0], pair[1], pair[1] + t, pair[0] + t]);
        }
        for three in outline.windows(3) {
            corners.push(vec![three[1], three[1] + thick(&three[1..]), three[1] + thick(&three[..2])]);
        }
        let Bounds { low, high } = self.view.bounds;
        let clamp = |p: &Point| self.view.place(&p.sup(&low).inf(&high));
        svg.fill(&closed_paths(corners.iter().map(|c| c.iter().map(clamp).collect::<Vec<_>>())), PALATE);
        svg.stroke(&data([outline.iter().map(clamp)]), DEFORMED, 2.0);
    }

    pub fn draw_dots(&self, svg: &mut Svg, seen: &[Point]) {
        for p in seen.iter().filter(|p| self.view.bounds.contains(p)) {
            svg.dot(self.view.place(p), 6.0, INK, "#ffffff");
        }
    }

    /// The muscles of a shape, contracting ones last; the name of a contracting one is followed by its tension.
    pub fn muscles(&self, positions: &[Point], tensions: &[f64]) -> Vec<DrawnMuscle> {
        let coloured = self.mesh.muscles.iter().zip(colours(&self.mesh.muscle_names()));
        let all = coloured.zip(tensions).enumerate().map(|(index, ((muscle, colour), &tension))| {
            let chain: Vec<_> = muscle.nodes.iter().filter_map(|&n| positions.get(n).copied()).collect();
            let (seen, leaves) = self.view.visible(&chain);
            let contracting = tension > 0.0;
            let name =
                if contracting { format!("{} {tension:.1}", muscle.name) } else { muscle.name.clone() };
            DrawnMuscle { index, name, colour, contracting, seen, leaves }
        });
        let mut all: Vec<DrawnMuscle> = all.collect();
        all.sort_by_key(|l| l.contracting);
        all
    }

    pub fn bones(&self, positions: &[Point]) -> Vec<Px> {
        let seen = self.mesh.fixed.iter().filter_map(|&n| positions.get(n));
        seen.filter(|p| self.view.bounds.contains(p)).map(|p| self.view.place(p)).collect()
    }

    /// The centre of every muscle's name, in the order of the lines; contracting muscles choose first.
    pub fn label_places(&self, lines: &[DrawnMuscle], bones: &[Px]) -> Vec<Option<Px>> {
        labels::place(lines, bones, &Bounds { low: self.view.corner.into(), high: self.view.end().into() })
    }

    /// Marks the places at rest of bones that have moved, each with a line to its present place.
    pub fn mark_moved_bones(&self, svg: &mut Svg, positions: &[Point]) {
        for &node in &self.mesh.fixed {
            let (Some(was), Some(is)) = (self.mesh.nodes.get(node), positions.get(node)) else { continue };
            if (is - was).norm() > MOVED && self.view.bounds.contains(was) {
                let [from, to] = [was, is].map(|p| self.view.place(p));
                svg.line(from, to, INK, 1.5);
                square(svg, from, "#ffffff", Some(INK));
            }
        }
    }

    /// Fills triangles by their largest principal stretch; returns the ends of the scale, or `None` without tissue that has an area at
    /// rest.
    pub fn fill_by_stretch(&self, svg: &mut Svg, positions: &[Point]) -> Option<[f64; 2]> {
        let mesh = self.mesh;
        let stretches = mesh.cells.iter().map(|cell| {
            let [now, rest] = [positions, &mesh.nodes]
                .map(|x| Matrix2::from_columns(&[x[cell[1]] - x[cell[0]], x[cell[2]] - x[cell[0]]]));
            Some((now * rest.try_inverse()?).singular_values().max())
        });
        let stretches = stretches.collect::<Option<Vec<f64>>>()?;
        let scale = [1.0, round_range(1.0, stretches.iter().copied().fold(1.01, f64::max))[1]];
        for paint in COLOURS {
            let of = mesh.cells.iter().zip(&stretches).filter(|(_, s)| colour(**s, scale) == paint);
            let d = closed_paths(of.map(|(cell, _)| self.view.chain(positions, cell)));
            // A stroke of the same colour closes the gaps between triangles that rounding leaves.
            svg.path(&d, &format!(r#"fill="{paint}" stroke="{paint}" stroke-width="0.6""#));
        }
        (!stretches.is_empty()).then_some(scale)
    }
}

pub(super) fn bone(svg: &mut Svg, at: Px) {
    square(svg, at, INK, None);
}

fn square(svg: &mut Svg, [x, y]: Px, fill: &str, edge: Option<&str>) {
    svg.rectangle([x - 7.0, y - 7.0], [x + 7.0, y + 7.0], fill, edge);
}

/// The bounds of a picture: the tissue at rest with a margin and the palate near it, extended only for shapes that go beyond them.
pub(in crate::report) fn picture_bounds<'a>(
    mesh: &Mesh<2>,
    palate: &[Point],
    shapes: impl IntoIterator<Item = &'a [Point]>,
) -> Bounds {
    let inside = mesh.in_tissue();
    let all = mesh.cells.is_empty();
    let tissue =
        |x: &[Point]| Bounds::of_points(x.iter().zip(&inside).filter(|(_, t)| all || **t).map(|(p, _)| p));
    if mesh.nodes.is_empty() {
        return Bounds { low: Point::zeros(), high: Point::repeat(1e-3) };
    }
    let rest = tissue(&mesh.nodes);
    let [w, h] = rest.size();
    let side = w.max(h).max(1e-3);
    let step = 0.5 * 10f64.powf(side.log10().floor());
    let room = rest.outwards(ROOM * side, step);
    let near = room.outwards(0.2 * side, step);
    let palate =
        Bounds::of_points(palate.iter().filter(|p| near.contains(p))).outwards(PALATE_THICKNESS, step);
    let shapes = shapes.into_iter().map(|x| tissue(x).outwards(0.0, step));
    shapes.fold(room.union(palate), Bounds::union).with_page_proportions()
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

/// Draws the legend of the colours from `top` on; returns its lower end.
pub(super) fn stretch_legend(svg: &mut Svg, scale: [f64; 2], left: f64, top: f64) -> f64 {
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
