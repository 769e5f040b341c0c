//! Bodies in space from the side, the front and the top; active muscles of a tongue are coloured.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::axes::{Bounds, PlotView};
use super::section::check;
use super::{Anchor, FontFace, INK, LEGEND_ROW, Legend, MARGIN, Px, Svg, TEXT, WIDTH, closed_paths, data};
use crate::report::ReportError;
use crate::report::vtu::most_active;
use crate::surgery::OperationRecord;
use tongue_core::body::{Body, Mesh};
use tongue_core::geometry::Point;

/// Name of a view, and the unit vectors to the right, upwards and towards the viewer.
const VIEWS: [(&str, [Vector3<f64>; 3]); 3] = [
    ("left side", [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, -1.0, 0.0)]),
    ("front", [Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 0.0, 1.0), Vector3::new(-1.0, 0.0, 0.0)]),
    ("top", [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 1.0)]),
];
/// Colours of the groups of muscles of a body, in its order (Tol 2021, "muted" and "light").
const COLOURS: [u32; 11] = [
    0xcc6677, 0x332288, 0xddcc77, 0x117733, 0x88ccee, 0x882255, 0x44aa99, 0x999933, 0xaa4499, 0x77aadd,
    0xee8866,
];
const TISSUE: u32 = 0xd6cdcd;
const SOLID: u32 = 0xcddef0;
/// Muscles with a smaller activation keep the colour of the tissue.
const ACTIVE: f64 = 5e-3;
/// Colours of operated and of removed tissue, of the shape below, and of the operated part of the shape below.
const FILLING: u32 = 0x6e6e6e;
const REMOVED: u32 = 0xc4c4c4;
const UNDER: &str = "#ececec";
const GONE: &str = "#b0b0b0";
const SAMPLE: f64 = 34.0;

/// Draws a body in space over its shape at rest (light), or after surgery over its shape before it. An element has the colour of the most
/// active muscle through it. Positions of all nodes are in m.
pub fn views(
    body: &Body<3>,
    positions: &[Vector3<f64>],
    activations: &[f64],
    title: &str,
    operation: Option<&OperationRecord>,
) -> Result<Svg, ReportError> {
    let before = operation.map(|operation| &operation.before);
    check(&body.mesh, positions, activations)?;
    let groups = body.groups();
    let colour = |m: usize| {
        let group = groups.iter().position(|g| *g == body.muscles[m].group).unwrap_or_default();
        COLOURS[group % COLOURS.len()]
    };
    let of_element = most_active(body, activations);
    // If elements were removed, the indices of the others have changed.
    let is_filled = before.is_some_and(|b| b.body.mesh.hexahedra.len() == body.mesh.hexahedra.len());
    let operated = |element: &usize| before.is_some_and(|b| b.elements.contains(element));
    let faces = body.mesh.outward_quadrilaterals().into_iter().map(|(element, nodes)| {
        let active = of_element[element].filter(|&m| activations[m] > ACTIVE);
        let filled = is_filled && operated(&element);
        (nodes.to_vec(), if filled { FILLING } else { active.map_or(TISSUE, colour) })
    });
    let names = groups.iter().zip(COLOURS.into_iter().cycle()).filter_map(|(g, colour)| {
        let of = body.muscles.iter().zip(activations).filter(|(m, _)| m.group == *g);
        let most = of.clone().map(|(_, a)| *a).fold(0.0, f64::max);
        let least = of.clone().map(|(_, a)| *a).fold(f64::INFINITY, f64::min);
        let strongest = of.clone().find(|(_, a)| **a == most).filter(|_| least < most);
        let name = strongest.map_or(g, |(m, _)| &m.name);
        (most > ACTIVE).then(|| (format!("{name} {most:.2}"), colour))
    });
    let mut drawing = Drawing {
        what: format!("A tongue in space of {} hexahedra", body.mesh.hexahedra.len()),
        faces: faces.collect(),
        positions,
        under_positions: &body.mesh.nodes,
        names: names.collect(),
        sides: true,
        ..Drawing::default()
    };
    if let Some(before) = before {
        let under = before.body.mesh.outward_quadrilaterals().into_iter();
        drawing.under =
            under.map(|(e, nodes)| (nodes.to_vec(), if operated(&e) { GONE } else { UNDER })).collect();
        drawing.under_positions = &before.positions;
        let region = before.elements.iter().map(|&e| before.body.mesh.hexahedra[e]).collect();
        let region = Mesh::<3> { hexahedra: region, ..Mesh::default() };
        let shape = if is_filled { positions } else { &before.positions[..] };
        let corners =
            region.outward_quadrilaterals().into_iter().map(|(_, face)| face.map(|n| (n, shape[n])));
        drawing.outlined = corners.collect();
        let (name, colour) = if is_filled { ("operated", FILLING) } else { ("removed", REMOVED) };
        drawing.names.push((name.to_owned(), colour));
        let places = [
            ("tip before", &before.positions[..], "#ffffff"),
            ("tip after", positions, INK),
            ("tip brought back", &before.made_up, "#ddcc77"),
        ];
        let tip = before.body.tip();
        // A tip that is removed has no place after surgery.
        let shown = if operation.is_some_and(|o| o.tip_after_mm.is_none()) { 1 } else { places.len() };
        let places = places.into_iter().take(shown);
        let tips = places.filter_map(|(name, x, fill)| Some((name, *x.get(tip?)?, fill)));
        drawing.tips = tips.collect();
    }
    Ok(drawing.draw(title))
}

pub fn solid(mesh: &Mesh<3>, positions: &[Vector3<f64>], title: &str) -> Result<Svg, ReportError> {
    check(mesh, positions, &vec![0.0; mesh.muscles.len()])?;
    let (nodes, cells) = (mesh.nodes.len(), mesh.cells.len());
    let drawing = Drawing {
        what: format!("A body in space of {nodes} nodes and {cells} tetrahedra"),
        faces: mesh.outward_faces().iter().map(|nodes| (nodes.to_vec(), SOLID)).collect(),
        positions,
        under_positions: &mesh.nodes,
        ..Drawing::default()
    };
    Ok(drawing.draw(title))
}

/// A surface in parallel projection over another shape, which is light.
#[derive(Default)]
struct Drawing<'a> {
    what: String,
    /// Corners counter-clockwise as seen from outside, and colour.
    faces: Vec<(Vec<usize>, u32)>,
    positions: &'a [Vector3<f64>],
    /// Faces of the shape below with their colours; empty if they are those of `faces`.
    under: Vec<(Vec<usize>, &'static str)>,
    under_positions: &'a [Vector3<f64>],
    names: Vec<(String, u32)>,
    sides: bool,
    /// The faces of the region whose silhouette is drawn: index and position, m, of each corner.
    outlined: Vec<[(usize, Vector3<f64>); 4]>,
    /// Name, position, m, and fill of the tip's places, in the order in which a line joins them.
    tips: Vec<(&'static str, Vector3<f64>, &'static str)>,
}

/// A normal of a face that points out of the body; its length is twice the area of the face.
fn normal(f: &[usize], x: &[Vector3<f64>]) -> Vector3<f64> {
    (x[f[2]] - x[f[0]]).cross(&(x[f[f.len() - 1]] - x[f[1]]))
}

impl Drawing<'_> {
    fn draw(&self, title: &str) -> Svg {
        let (rest, positions) = (self.under_positions, self.positions);
        let below = if self.under.is_empty() { "itself at rest" } else { "itself before surgery" };
        let description =
            format!("{} from the side, the front and the top: deformed, over {below} (light).", self.what);
        let (mut svg, top) = Svg::new(title, &description, WIDTH);
        let seen =
            |p: &Vector3<f64>, [across, up, _]: &[Vector3<f64>; 3]| Point::new(p.dot(across), p.dot(up));
        let on_surface: Vec<usize> = self.faces.iter().flat_map(|(f, _)| f.iter().copied()).collect();
        let size = rest.iter().map(|p| p.amax()).fold(1e-3, f64::max);
        let margin = 0.03 * size;
        let bounds = VIEWS.map(|(_, axes)| {
            let points =
                [rest, positions].into_iter().flat_map(|x| on_surface.iter().map(|&n| seen(&x[n], &axes)));
            let tips = self.tips.iter().map(|(_, p, _)| seen(p, &axes));
            let region = self.outlined.iter().flatten().map(|(_, p)| seen(p, &axes));
            let points: Vec<Point> =
                points.chain(tips).chain(region).chain(on_surface.is_empty().then(Point::zeros)).collect();
            Bounds::of_points(&points).outwards(margin, 0.5 * margin)
        });
        let [side, front, above] = bounds.map(|b| b.size());
        let per_m = (WIDTH - 3.0 * MARGIN) / (side[0].max(above[0]) + front[0]);
        let row = top + TEXT + MARGIN;
        let below = row + per_m * side[1].max(front[1]) + TEXT + 2.0 * MARGIN;
        let right = 2.0 * MARGIN + per_m * side[0].max(above[0]);
        let corners = [[MARGIN, row], [right, row], [MARGIN, below]];
        for (((name, axes), bounds), corner) in VIEWS.into_iter().zip(bounds).zip(corners) {
            let view = PlotView::new(bounds, corner, per_m * bounds.size()[0]);
            svg.text([corner[0], corner[1] - 0.5 * TEXT], Anchor::Start, FontFace::Bold, name);
            let place = |p: &Vector3<f64>| view.place(&seen(p, &axes));
            self.surface(&mut svg, &axes, &place);
            let silhouette = self.silhouette(&axes).map(|edge| edge.map(|p| place(&p)));
            svg.dashes(&data(silhouette), INK, 2.5);
            for pair in self.tips.windows(2) {
                svg.line(place(&pair[0].1), place(&pair[1].1), INK, 3.0);
            }
            for (_, p, fill) in &self.tips {
                svg.dot(place(p), 7.0, fill, INK);
            }
        }
        if self.sides {
            let (far, bottom) = (right + per_m * front[0], below + per_m * above[1]);
            let front = [("right", [right, row], Anchor::Start), ("left", [far, row], Anchor::End)];
            let above =
                [("right", [MARGIN, below], Anchor::Start), ("left", [MARGIN, bottom - TEXT], Anchor::Start)];
            for (side, [x, y], anchor) in front.into_iter().chain(above) {
                svg.text([x, y + 0.5 * TEXT], anchor, FontFace::Plain, side);
            }
        }
        let bottom = below + per_m * above[1];
        scale(&mut svg, side[0], per_m, bottom + MARGIN);
        let mut legend = Legend::new([right, WIDTH - MARGIN], below);
        for (name, colour) in &self.names {
            legend.area(&mut svg, SAMPLE, name, &shade(*colour, 1.0));
        }
        for (name, _, fill) in &self.tips {
            legend.entry(&mut svg, SAMPLE, name, |svg, [x, y]| svg.dot([x + 12.0, y], 7.0, fill, INK));
        }
        svg.finish((bottom + MARGIN).max(below + legend.height()) + LEGEND_ROW + 2.0 * MARGIN)
    }

    /// Draws the shape below, then the faces that are turned to the viewer, the farthest first.
    fn surface(&self, svg: &mut Svg, axes: &[Vector3<f64>; 3], place: &impl Fn(&Vector3<f64>) -> Px) {
        let (rest, positions) = (self.under_positions, self.positions);
        let is_seen = |f: &[usize], x: &[Vector3<f64>]| normal(f, x).dot(&axes[2]) > 0.0;
        let same = self.faces.iter().map(|(f, _)| (f, UNDER)).filter(|_| self.under.is_empty());
        for (f, colour) in
            self.under.iter().map(|(f, colour)| (f, *colour)).chain(same).filter(|(f, _)| is_seen(f, rest))
        {
            svg.fill(&closed_paths([f.iter().map(|&n| place(&rest[n]))]), colour);
        }
        let mut towards: Vec<_> = self.faces.iter().filter(|(f, _)| is_seen(f, positions)).collect();
        let depth = |f: &[usize]| f.iter().map(|&n| positions[n].dot(&axes[2])).sum::<f64>();
        towards.sort_by(|a, b| depth(&a.0).total_cmp(&depth(&b.0)));
        for (f, colour) in towards {
            // The light comes from above and from the viewer's left.
            let normal = normal(f, positions).try_normalize(0.0).unwrap_or(axes[2]);
            let light = normal.dot(&((axes[1] - axes[0]) * 0.45 + axes[2] * 0.77));
            let (d, fill) = (closed_paths([f.iter().map(|&n| place(&positions[n]))]), shade(*colour, light));
            let pen = r##"stroke="#4a4a4a" stroke-width="0.7" stroke-linejoin="round""##;
            svg.path(&d, &format!(r#"fill="{fill}" {pen}"#));
        }
    }

    /// Edges of the outlined region between a face that is turned to the viewer and one that is not.
    fn silhouette(&self, axes: &[Vector3<f64>; 3]) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        let mut edges: BTreeMap<[usize; 2], ([Vector3<f64>; 2], usize)> = BTreeMap::new();
        for face in &self.outlined {
            let [a, b, c, d] = face.map(|(_, p)| p);
            if (c - a).cross(&(d - b)).dot(&axes[2]) > 0.0 {
                for (p, q) in [(0, 1), (1, 2), (2, 3), (3, 0)].map(|(i, j)| (face[i], face[j])) {
                    edges.entry([p.0.min(q.0), p.0.max(q.0)]).or_insert(([p.1, q.1], 0)).1 += 1;
                }
            }
        }
        edges.into_values().filter(|(_, faces)| *faces == 1).map(|(edge, _)| edge)
    }
}

/// A colour, darkened for a face on which the light falls with this cosine.
fn shade(colour: u32, light: f64) -> String {
    let light = 0.6 + 0.4 * light.max(0.0);
    let [r, g, b] = [16, 8, 0].map(|shift| (f64::from(colour >> shift & 0xff) * light.min(1.0)) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Draws a scale bar of a round length, at most a fifth of `width`, m.
fn scale(svg: &mut Svg, width: f64, per_m: f64, top: f64) {
    let tens = 10f64.powf((0.2 * width).log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|s| s * tens).find(|l| *l <= 0.2 * width).unwrap_or(tens);
    let (x, y) = (2.0 * MARGIN, top + 0.5 * LEGEND_ROW);
    let end = x + length * per_m;
    let bars = [[[x, y - 7.0], [x, y + 7.0]], [[x, y], [end, y]], [[end, y - 7.0], [end, y + 7.0]]];
    svg.stroke(&data(bars), INK, 2.0);
    let label = format!("{} mm", (1e6 * length).round() / 1e3);
    svg.text([end + 12.0, y], Anchor::Start, FontFace::Plain, &label);
}
