//! Picture of a body in space: its shaded surface with hidden parts removed.

use std::collections::BTreeMap;

use nalgebra::SVector;

use super::axes::{Bounds, View};
use super::section::check;
use super::{Anchor, Entry, Face, INK, LEGEND_ROW, MARGIN, Px, Svg, WIDTH, closed, data, legend};
use crate::report::ReportError;
use tongue_core::body::Mesh;

/// Turn about the vertical and tilt towards the viewer, rad.
const TURN: f64 = 0.5;
const TILT: f64 = 0.35;
/// Direction to the light in the viewer's frame: from the left, above and in front of the body.
const LIGHT: [f64; 3] = [-0.38, 0.62, 0.69];
/// Faces that meet at more than this angle (cosine) have an edge, which is drawn for the body at rest.
const FLAT: f64 = 0.8;
const REST: &str = "#9a9a9a";
const SAMPLE: f64 = 50.0;

/// Draws the surface in parallel projection from the side and a little from above. The deformed body has
/// shaded faces; those that face the viewer are drawn from far to near. The edges of the body at rest are
/// dashed grey lines.
///
/// `positions` has the position of every node, m.
pub fn solid(mesh: &Mesh<3>, positions: &[SVector<f64, 3>], title: &str) -> Result<Svg, ReportError> {
    check(mesh, positions, &vec![0.0; mesh.muscles.len()])?;
    let shown = format!(
        "A body in space seen from the side and a little from above: {} nodes and {} tetrahedra, deformed (shaded) \
         and at rest (edges, dashed).",
        mesh.nodes.len(),
        mesh.cells.len()
    );
    let (mut svg, top) = Svg::new(title, &shown, WIDTH);
    let faces = mesh.outward_faces();
    let [rest, deformed] = [&mesh.nodes[..], positions].map(|x| x.iter().map(seen).collect::<Vec<_>>());
    let flat = |p: &[SVector<f64, 3>]| -> Vec<SVector<f64, 2>> { p.iter().map(|p| p.xy()).collect() };
    let around = Bounds::of(flat(&rest).iter().chain(&flat(&deformed)));
    let around = if mesh.nodes.is_empty() { Bounds { low: [0.0; 2], high: [1e-3; 2] } } else { around };
    let [w, h] = around.size();
    let around = around.outwards(0.06 * w.max(h).max(1e-3), 1e-5).paged();
    let view = View::new(around, [MARGIN, top + MARGIN], WIDTH - 2.0 * MARGIN);
    let place = |p: &SVector<f64, 3>| view.place(&p.xy());

    let edges = edges(&faces, &rest);
    let d = data(edges.iter().map(|pair| pair.map(|n| place(&rest[n]))));
    svg.dashes(&d, REST, 2.0);
    let depth = |face: &[usize]| face.iter().map(|&n| deformed[n].z).sum::<f64>();
    let towards = |face: &&[usize]| area(face, &deformed).z > 0.0;
    let mut order: Vec<&[usize]> = faces.iter().map(<[usize; 3]>::as_slice).filter(towards).collect();
    order.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
    for face in order {
        let colour = shade(&normal(face, &deformed));
        let d = closed([face.iter().map(|&n| place(&deformed[n]))]);
        svg.element(
            "path",
            format_args!("d=\"{d}\" fill=\"{colour}\" stroke=\"#44566b\" stroke-width=\"0.8\" stroke-linejoin=\"round\""),
        );
    }
    let bottom = view.end()[1] + MARGIN;
    scale(&mut svg, &view, bottom);
    directions(&mut svg, [WIDTH - 150.0, top + 120.0]);
    let entries =
        ["deformed", "edges at rest"].map(|name| Entry { sample: SAMPLE + 12.0, face: Face::Plain, name });
    let (places, _) = legend(&mut svg, &entries, [0.45 * WIDTH, WIDTH - MARGIN], bottom);
    if let [a, b] = places[..] {
        svg.rectangle(
            [a[0], a[1] - 10.0],
            [a[0] + SAMPLE, a[1] + 10.0],
            &shade(&SVector::from(LIGHT)),
            Some(INK),
        );
        svg.dashes(&data([[b, [b[0] + SAMPLE, b[1]]]]), REST, 2.0);
    }
    Ok(svg.finish(bottom + LEGEND_ROW + MARGIN))
}

/// Coordinates of the viewer: right, up, and towards the viewer, m.
fn seen(p: &SVector<f64, 3>) -> SVector<f64, 3> {
    let (across, deep) = (p.x * TURN.cos() - p.y * TURN.sin(), p.x * TURN.sin() + p.y * TURN.cos());
    let [up, towards] = [p.z * TILT.cos() + deep * TILT.sin(), p.z * TILT.sin() - deep * TILT.cos()];
    SVector::from([across, up, towards])
}

/// Twice the area of a face along its normal.
fn area(face: &[usize], x: &[SVector<f64, 3>]) -> SVector<f64, 3> {
    (x[face[1]] - x[face[0]]).cross(&(x[face[2]] - x[face[0]]))
}

fn normal(face: &[usize], x: &[SVector<f64, 3>]) -> SVector<f64, 3> {
    area(face, x).try_normalize(0.0).unwrap_or_else(SVector::z)
}

fn shade(normal: &SVector<f64, 3>) -> String {
    shaded([205.0, 222.0, 240.0], normal.dot(&SVector::from(LIGHT)))
}

/// A colour, 0 to 255, of a face that looks into the light by so much, from 0 to 1.
pub(super) fn shaded(colour: [f64; 3], light: f64) -> String {
    let light = 0.6 + 0.4 * light.max(0.0);
    let [r, g, b] = colour.map(|c: f64| (c * light.min(1.0)) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn edges(faces: &[[usize; 3]], x: &[SVector<f64, 3>]) -> Vec<[usize; 2]> {
    let mut meeting: BTreeMap<[usize; 2], Vec<SVector<f64, 3>>> = BTreeMap::new();
    for face in faces {
        let n = normal(face, x);
        for (&a, &b) in face.iter().zip(face.iter().cycle().skip(1)) {
            meeting.entry([a.min(b), a.max(b)]).or_default().push(n);
        }
    }
    let bent = |n: &[SVector<f64, 3>]| n.len() != 2 || n[0].dot(&n[1]) < FLAT;
    meeting.into_iter().filter(|(_, n)| bent(n)).map(|(pair, _)| pair).collect()
}

pub(super) fn scale(svg: &mut Svg, view: &View, top: f64) {
    let fifth = 0.2 * view.bounds.size()[0];
    let tens = 10f64.powf(fifth.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|s| s * tens).find(|l| *l <= fifth).unwrap_or(tens);
    let (x, y) = (2.0 * MARGIN, top + 0.5 * LEGEND_ROW);
    let end = x + length * view.scale;
    svg.stroke(
        &data([[[x, y - 7.0], [x, y + 7.0]], [[x, y], [end, y]], [[end, y - 7.0], [end, y + 7.0]]]),
        INK,
        2.0,
    );
    let mm = 1e3 * length;
    svg.text([end + 12.0, y], Anchor::Start, Face::Plain, &format!("{mm} mm"));
}

fn directions(svg: &mut Svg, from: Px) {
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let way = seen(&SVector::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 }));
        let end = |length: f64| [from[0] + length * way.x, from[1] - length * way.y];
        svg.line(from, end(70.0), INK, 2.0);
        svg.text(end(88.0), Anchor::Middle, Face::Plain, name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_shows_three_sides_and_twelve_edges() {
        let mesh = tongue_core::body::solid::block([1.0, 1.0, 1.0], [2, 2, 2]);
        let edges = edges(&mesh.outward_faces(), &mesh.nodes);
        assert_eq!(edges.len(), 12 * 2, "each of two connections");
        let svg = solid(&mesh, &mesh.nodes, "block").unwrap().to_string();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let filled = document.descendants().filter(|n| n.attribute("stroke-width") == Some("0.8"));
        let faces: Vec<&str> = filled.filter_map(|n| n.attribute("fill")).collect();
        assert_eq!(faces.len(), mesh.surface().len() / 2, "three of six sides are turned to the viewer");
        let colours: std::collections::BTreeSet<&str> = faces.iter().copied().collect();
        assert_eq!(colours.len(), 3, "{colours:?}");
    }
}
