//! The picture of a body in the plane: tissue at rest and deformed, muscles with their names, bones, and the palate if there is one.

use nalgebra::SVector;

use super::axes::{BELOW, LEFT};
use super::body_view::{BodyView, DEFORMED, PALATE, REST, REST_TISSUE, bone, stretch_legend};
use super::labels::{arrow, muscle};
use super::{LEGEND_ROW, Legend, MARGIN, Px, Svg, WIDTH, data};
use crate::report::{ReportError, names_or_none};
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;

const REST_NAME: &str = "rest";
const SAMPLE: f64 = 62.0;

#[derive(Debug, Clone, Copy)]
pub struct SectionPicture<'a> {
    pub mesh: &'a Mesh<2>,
    pub positions: &'a [Point],
    /// N per metre of thickness, for every muscle of the mesh; one above zero is drawn as contracting.
    pub tensions: &'a [f64],
    /// m; empty without a palate.
    pub palate: &'a [Point],
    /// Measured points, m, drawn as dots.
    pub seen: &'a [Point],
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
        positions: &'a [Point],
        tensions: &'a [f64],
        palate: &'a [Point],
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
    let SectionPicture { mesh, positions, tensions, palate, seen, stretch, grey, title, .. } = *section;
    check(mesh, positions, tensions)?;
    let (mut svg, top) = Svg::new(title, &description(section), WIDTH);
    let body = BodyView::new(mesh, palate, [positions], top + MARGIN);
    svg.fill(&body.outline(&mesh.nodes), REST_TISSUE);
    let scale = stretch.then(|| body.fill_by_stretch(&mut svg, positions)).flatten();
    svg.stroke(&body.outline(&mesh.nodes), REST, 2.0);
    body.draw_tissue(&mut svg, positions);
    body.draw_palate(&mut svg, palate);
    if grey != REST_NAME {
        body.mark_moved_bones(&mut svg, positions);
    }
    let muscles = body.muscles(positions, tensions);
    for muscle in &muscles {
        muscle.draw(&mut svg);
        muscle.draw_arrow(&mut svg);
    }
    let bones = body.bones(positions);
    bones.iter().for_each(|at| bone(&mut svg, *at));
    for (muscle, place) in muscles.iter().zip(body.label_places(&muscles, &bones)) {
        place.into_iter().for_each(|at| svg.label(at, muscle.face(), &muscle.name));
    }
    let arrows = muscles.iter().any(|muscle| muscle.leaves.is_some());
    body.draw_dots(&mut svg, seen);
    body.view.axes(&mut svg, ["front \u{2190}\u{2003}x (mm)\u{2003}\u{2192} back", "y (mm)"]);
    let mut bottom = body.view.end()[1] + BELOW + MARGIN;
    if let Some(scale) = scale {
        bottom = stretch_legend(&mut svg, scale, LEFT, bottom);
    }
    let height = legend(&mut svg, section, arrows, bottom);
    Ok(svg.finish(bottom + height + MARGIN))
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
    let (what, number, count) = ("the list of tensions".to_owned(), tensions.len(), mesh.muscles.len());
    if number == count { Ok(()) } else { Err(ReportError::Number { what, kind: "muscle", number, count }) }
}

fn description(section: &SectionPicture<'_>) -> String {
    let SectionPicture { mesh, grey, .. } = section;
    let [contracting, passive] = [true, false].map(|contracting| {
        let of = mesh.muscles.iter().zip(section.tensions).filter(|(_, t)| (**t > 0.0) == contracting);
        names_or_none(of.map(|(m, _)| &m.name))
    });
    let (nodes, triangles) = (mesh.nodes.len(), mesh.cells.len());
    format!(
        "Midsagittal section, front to the left: a mesh of {nodes} nodes and {triangles} triangles at {grey} (grey) and deformed \
         (dark). Contracting muscles: {contracting}. Passive muscles: {passive}."
    )
}

/// Draws the legend of a picture; `arrows` says whether a muscle leaves the view. Returns its height, px.
pub(super) fn legend(svg: &mut Svg, section: &SectionPicture<'_>, arrows: bool, top: f64) -> f64 {
    let SectionPicture { mesh, tensions, palate, contact, grey, .. } = *section;
    let line = |[x, y]: Px| data([[[x, y], [x + SAMPLE, y]]]);
    let muscle = |contracting| move |svg: &mut Svg, at: Px| muscle(svg, &line(at), "#ffffff", contracting);
    let (long, short, half) = (SAMPLE + 12.0, 36.0, 0.25 * LEGEND_ROW);
    let mut legend = Legend::new([LEFT, WIDTH - MARGIN], top);
    legend.entry(svg, long, grey, |svg, [x, y]| {
        svg.rectangle([x, y - half], [x + SAMPLE, y + half], REST_TISSUE, Some(REST));
    });
    legend.entry(svg, long, "deformed", |svg, at| svg.stroke(&line(at), DEFORMED, 2.6));
    if !mesh.fixed.is_empty() {
        legend.entry(svg, short, "bone", |svg, [x, y]| bone(svg, [x + 12.0, y]));
    }
    if !palate.is_empty() {
        let name = if contact { "palate" } else { "palate, for orientation only" };
        legend.entry(svg, short, name, |svg, [x, y]| {
            svg.rectangle([x, y - half], [x + 24.0, y + half], PALATE, Some(DEFORMED));
        });
    }
    if tensions.iter().any(|t| *t <= 0.0) {
        legend.entry(svg, long, "passive muscle", muscle(false));
    }
    if arrows {
        legend.entry(svg, long, "to its bone, out of view", |svg, [x, y]| {
            muscle(false)(svg, [x, y]);
            arrow(svg, [x, y], [x + SAMPLE, y], "#ffffff");
        });
    }
    if tensions.iter().any(|t| *t > 0.0) {
        let name = "contracting, with its tension in N per metre of thickness";
        legend.entry(svg, long, name, muscle(true));
    }
    legend.height()
}
