//! A body in the plane: tissue at rest and deformed, muscles with their names, bones, and the palate if there is one.

use nalgebra::SVector;

use super::axes::{BELOW, Bounds, LEFT, PlotView};
use super::muscle_lines::{arrow, bone, bones, label_places, lines, muscle};
use super::{INK, LEGEND_ROW, LegendEntry, MARGIN, Px, Svg, WIDTH, closed_paths, data, muscle_lines};
use crate::report::ReportError;
use tongue_core::body::Mesh;
use tongue_core::geometry::topology;

pub(super) const REST: &str = "#b4b4b4";
pub(super) const REST_TISSUE: &str = "#f1f1f1";
pub(super) const DEFORMED: &str = "#555555";
pub(super) const EDGES: &str = "#c9c9c9";
pub(super) const PALATE: &str = "#a8a8a8";

const REST_NAME: &str = "rest";
/// A bone that moved by less is drawn as not moved, m.
const MOVED: f64 = 1e-5;
const PALATE_THICKNESS: f64 = 0.0025;
/// Margin around the tissue at rest, as a part of its longest side.
const ROOM: f64 = 0.14;

const SAMPLE: f64 = 62.0;

#[derive(Debug, Clone, Copy)]
pub struct SectionPicture<'a> {
    pub mesh: &'a Mesh<2>,
    pub positions: &'a [SVector<f64, 2>],
    /// N per metre of thickness, for every muscle of the mesh; one above zero is drawn as contracting.
    pub tensions: &'a [f64],
    /// m; empty without a palate.
    pub palate: &'a [SVector<f64, 2>],
    /// Measured points, m, drawn as dots.
    pub seen: &'a [SVector<f64, 2>],
    /// Whether the palate stops the body; otherwise it is drawn for orientation.
    pub contact: bool,
    pub stretch: bool,
    /// Name of the grey shape in the legend; it may be another posture than rest.
    pub grey: &'a str,
    pub title: &'a str,
}

impl<'a> SectionPicture<'a> {
    /// A shape over the body at rest, without measured points, contact or colours of stretch.
    pub fn new(
        mesh: &'a Mesh<2>,
        positions: &'a [SVector<f64, 2>],
        tensions: &'a [f64],
        palate: &'a [SVector<f64, 2>],
        title: &'a str,
    ) -> Self {
        let (contact, stretch, grey) = (false, false, REST_NAME);
        Self { mesh, positions, tensions, palate, seen: &[], contact, stretch, grey, title }
    }
}

/// Draws the tissue at rest (light grey) and deformed (dark), muscles in colour with their names, bones, and the palate in grey.
///
/// Axes are in mm with equal scales: x grows to the back of the head, y upwards. As long as the deformed tissue stays in the view, the view
/// depends only on the tissue at rest, so that pictures of one body have the same axes. A muscle from a bone outside the view has an arrow
/// at the edge. Contracting muscles (tension above zero) are thick and solid.
pub fn tongue(section: &SectionPicture<'_>) -> Result<Svg, ReportError> {
    let SectionPicture { mesh, positions, tensions, palate, seen, contact, stretch, grey, title } = *section;
    check(mesh, positions, tensions)?;
    let (mut svg, top) = Svg::new(title, &description(section), WIDTH);
    let view =
        PlotView::new(picture_bounds(mesh, palate, [positions]), [LEFT, top + MARGIN], WIDTH - LEFT - MARGIN);
    svg.fill(&ring(&view, mesh, &mesh.nodes), REST_TISSUE);
    let colours = stretch.then(|| muscle_lines::fill(&mut svg, &view, mesh, positions)).flatten();
    svg.stroke(&ring(&view, mesh, &mesh.nodes), REST, 2.0);
    svg.stroke(&view.path(positions, tissue_edges(mesh)), EDGES, 1.0);
    svg.stroke(&ring(&view, mesh, positions), DEFORMED, 2.6);
    draw_palate(&mut svg, &view, mesh, palate);
    if grey != REST_NAME {
        places_of_moved_bones(&mut svg, &view, mesh, positions);
    }
    let arrows = muscles(&mut svg, &view, mesh, positions, tensions);
    dots(&mut svg, &view, seen);
    view.axes(&mut svg, ["front \u{2190}\u{2003}x (mm)\u{2003}\u{2192} back", "y (mm)"]);
    let palate = (!palate.is_empty()).then_some(contact);
    let content = LegendContent { grey, tensions, arrows, palate, bones: !mesh.fixed.is_empty() };
    let mut bottom = view.end()[1] + BELOW + MARGIN;
    if let Some(scale) = colours {
        bottom = muscle_lines::legend(&mut svg, scale, LEFT, bottom);
    }
    let height = legend(&mut svg, &content, bottom);
    Ok(svg.finish(bottom + height + MARGIN))
}

pub(super) fn dots(svg: &mut Svg, view: &PlotView, seen: &[SVector<f64, 2>]) {
    for p in seen.iter().filter(|p| view.bounds.contains(p)) {
        svg.dot(view.place(p), 6.0, INK, "#ffffff");
    }
}

pub(in crate::report) fn check<const D: usize>(
    mesh: &Mesh<D>,
    deformed: &[SVector<f64, D>],
    tensions: &[f64],
) -> Result<(), ReportError> {
    let count = mesh.nodes.len();
    if deformed.len() != count {
        return Err(ReportError::NodeCount { nodes: count, deformed: deformed.len() });
    }
    for (shape, positions) in [("rest", mesh.nodes.as_slice()), ("deformed", deformed)] {
        for (node, p) in positions.iter().enumerate() {
            if !p.iter().all(|c| c.abs() <= 1e3) {
                return Err(ReportError::Position { shape, node, x: p[0], y: p[1] });
            }
        }
    }
    let named = |what: &dyn Fn() -> String, nodes: &[usize]| match nodes.iter().find(|&&n| n >= count) {
        Some(&number) => Err(ReportError::Number { what: what(), kind: "node", number, count }),
        None => Ok(()),
    };
    for (nth, pair) in mesh.connections.iter().enumerate() {
        named(&|| format!("connection {nth}"), pair)?;
    }
    for muscle in &mesh.muscles {
        named(&|| format!("muscle {}", muscle.name), &muscle.nodes)?;
    }
    named(&|| "the list of fixed nodes".to_owned(), &mesh.fixed)?;
    let (number, count) = (tensions.len(), mesh.muscles.len());
    if number == count {
        return Ok(());
    }
    Err(ReportError::Number { what: "the list of tensions".to_owned(), kind: "muscle", number, count })
}

fn description(section: &SectionPicture<'_>) -> String {
    let mesh = section.mesh;
    let [contracting, passive] = [true, false].map(|contracting| {
        let of = mesh.muscles.iter().zip(section.tensions).filter(|(_, t)| (**t > 0.0) == contracting);
        let names: Vec<_> = of.map(|(m, _)| m.name.as_str()).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    });
    format!(
        "Midsagittal section, front to the left: a mesh of {} nodes and {} triangles at {} (grey) and deformed \
         (dark). Contracting muscles: {contracting}. Passive muscles: {passive}.",
        mesh.nodes.len(),
        mesh.cells.len(),
        section.grey
    )
}

/// The bounds of a picture: the tissue at rest with a margin and the palate near it, extended only for shapes that go beyond them.
pub(in crate::report) fn picture_bounds<'a>(
    mesh: &Mesh<2>,
    palate: &[SVector<f64, 2>],
    shapes: impl IntoIterator<Item = &'a [SVector<f64, 2>]>,
) -> Bounds {
    let inside = mesh.in_tissue();
    let all = mesh.cells.is_empty();
    let tissue = |x: &[SVector<f64, 2>]| {
        Bounds::of_points(x.iter().zip(&inside).filter(|(_, t)| all || **t).map(|(p, _)| p))
    };
    if mesh.nodes.is_empty() {
        return Bounds { low: [0.0; 2], high: [1e-3; 2] };
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

pub(super) fn ring(view: &PlotView, mesh: &Mesh<2>, positions: &[SVector<f64, 2>]) -> String {
    let loops = topology::outlines(mesh.cells.iter());
    closed_paths(
        loops.iter().map(|l| Vec::from_iter(l.iter().filter_map(|&n| Some(view.place(positions.get(n)?))))),
    )
}

pub(super) fn tissue_edges(mesh: &Mesh<2>) -> Vec<&[usize]> {
    let inside = mesh.in_tissue();
    let pairs = mesh.connections.iter().map(<[usize; 2]>::as_slice);
    pairs.filter(|pair| mesh.cells.is_empty() || pair.iter().all(|&n| inside[n])).collect()
}

pub(super) fn draw_palate(svg: &mut Svg, view: &PlotView, mesh: &Mesh<2>, outline: &[SVector<f64, 2>]) {
    if outline.len() < 2 {
        return;
    }
    let middle = mesh.nodes.iter().sum::<SVector<f64, 2>>() / mesh.nodes.len().max(1) as f64;
    let turned = |a: &SVector<f64, 2>, b: &SVector<f64, 2>| SVector::from([a.y - b.y, b.x - a.x]);
    let off = outline.windows(2).map(|pair| turned(&pair[0], &pair[1]).dot(&(pair[0] - middle)));
    let side = if off.sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let thick = |pair: &[SVector<f64, 2>]| {
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
    let [low, high] = [view.bounds.low, view.bounds.high];
    let clamp = |p: &SVector<f64, 2>| {
        view.place(&SVector::from([p.x.clamp(low[0], high[0]), p.y.clamp(low[1], high[1])]))
    };
    svg.fill(&closed_paths(corners.iter().map(|c| c.iter().map(clamp).collect::<Vec<_>>())), PALATE);
    svg.stroke(&data([outline.iter().map(clamp)]), DEFORMED, 2.0);
}

/// Draws the muscles (contracting ones last), the bones and the names. Returns whether a muscle leaves the view.
fn muscles(
    svg: &mut Svg,
    view: &PlotView,
    mesh: &Mesh<2>,
    positions: &[SVector<f64, 2>],
    tensions: &[f64],
) -> bool {
    let lines = lines(view, mesh, positions, tensions);
    for line in &lines {
        muscle(svg, &data([line.seen.iter().copied()]), &line.colour, line.contracting);
        if let Some([from, to]) = line.leaves {
            arrow(svg, from, to, &line.colour);
        }
    }
    let bones: Vec<Px> = bones(view, mesh, positions);
    bones.iter().for_each(|at| bone(svg, *at));
    for (line, place) in lines.iter().zip(label_places(view, &lines, &bones)) {
        place.into_iter().for_each(|at| svg.label(at, line.face(), &line.name));
    }
    lines.iter().any(|l| l.leaves.is_some())
}

/// Marks the places at rest of bones that have moved, each with a line to its present place.
fn places_of_moved_bones(svg: &mut Svg, view: &PlotView, mesh: &Mesh<2>, positions: &[SVector<f64, 2>]) {
    for &node in &mesh.fixed {
        let (Some(was), Some(is)) = (mesh.nodes.get(node), positions.get(node)) else { continue };
        if (is - was).norm() > MOVED && view.bounds.contains(was) {
            let [from, to] = [was, is].map(|p| view.place(p));
            svg.line(from, to, INK, 1.5);
            svg.rectangle(
                [from[0] - 7.0, from[1] - 7.0],
                [from[0] + 7.0, from[1] + 7.0],
                "#ffffff",
                Some(INK),
            );
        }
    }
}

pub(super) struct LegendContent<'a> {
    pub grey: &'a str,
    pub tensions: &'a [f64],
    pub arrows: bool,
    /// Whether the palate stops the body; `None` without a palate.
    pub palate: Option<bool>,
    pub bones: bool,
}

pub(super) fn legend(svg: &mut Svg, content: &LegendContent<'_>, top: f64) -> f64 {
    let contracting = content.tensions.iter().any(|t| *t > 0.0);
    let passive = content.tensions.iter().any(|t| *t <= 0.0);
    let line = |[x, y]: Px| data([[[x, y], [x + SAMPLE, y]]]);
    let boxed = |width: f64, fill: &'static str, edge: &'static str| {
        let half = 0.25 * LEGEND_ROW;
        move |svg: &mut Svg, [x, y]: Px| svg.rectangle([x, y - half], [x + width, y + half], fill, Some(edge))
    };
    let muscle = |contracting| move |svg: &mut Svg, at: Px| muscle(svg, &line(at), "#ffffff", contracting);
    let (long, short) = (SAMPLE + 12.0, 36.0);
    let palate = |name| LegendEntry::new(short, name, boxed(24.0, PALATE, DEFORMED));
    let entries = [
        Some(LegendEntry::new(long, content.grey, boxed(SAMPLE, REST_TISSUE, REST))),
        Some(LegendEntry::new(long, "deformed", |svg, at| svg.stroke(&line(at), DEFORMED, 2.6))),
        content.bones.then(|| LegendEntry::new(short, "bone", |svg, [x, y]| bone(svg, [x + 12.0, y]))),
        content.palate.map(|stops| palate(if stops { "palate" } else { "palate, for orientation only" })),
        passive.then(|| LegendEntry::new(long, "passive muscle", muscle(false))),
        content.arrows.then(|| {
            LegendEntry::new(long, "to its bone, out of view", |svg, [x, y]| {
                muscle(false)(svg, [x, y]);
                arrow(svg, [x, y], [x + SAMPLE, y], "#ffffff");
            })
        }),
        contracting.then(|| {
            LegendEntry::new(long, "contracting, with its tension in N per metre of thickness", muscle(true))
        }),
    ];
    svg.legend(entries.into_iter().flatten(), [LEFT, WIDTH - MARGIN], top)
}
