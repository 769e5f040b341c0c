//! Picture of a tongue in space from the side, the front and the top, with the muscles that act in colour.

use nalgebra::Vector3;

use super::axes::{Bounds, View};
use super::section::check;
use super::solid::{scale, shaded};
use super::{Anchor, Entry, Face, INK, LEGEND_ROW, MARGIN, Svg, TEXT, WIDTH, closed, legend};
use crate::report::ReportError;
use crate::report::space::most_active;
use tongue_core::body::SpaceBody;
use tongue_core::geometry::Point;

/// From where it is seen: what is across, up, and towards the viewer.
const VIEWS: [(&str, [Vector3<f64>; 3]); 3] = [
    ("side", [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, -1.0, 0.0)]),
    ("front", [Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 0.0, 1.0), Vector3::new(-1.0, 0.0, 0.0)]),
    ("top", [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 1.0)]),
];
/// Colours of the muscles of a body, by their common name, in its order (Tol 2021, "muted" and "light").
const COLOURS: [[f64; 3]; 11] = [
    [204.0, 102.0, 119.0],
    [51.0, 34.0, 136.0],
    [221.0, 204.0, 119.0],
    [17.0, 119.0, 51.0],
    [136.0, 204.0, 238.0],
    [136.0, 34.0, 85.0],
    [68.0, 170.0, 153.0],
    [153.0, 153.0, 51.0],
    [170.0, 68.0, 153.0],
    [119.0, 170.0, 221.0],
    [238.0, 136.0, 102.0],
];
const TISSUE: [f64; 3] = [214.0, 205.0, 205.0];
/// Below this a muscle is not drawn as active.
const ACTIVE: f64 = 5e-3;
const SAMPLE: f64 = 34.0;

/// Draws the surface in parallel projection, of the faces that are turned to the viewer the farthest
/// first, over the body at rest (light). An element has the colour of the most active muscle that runs
/// through it. Positions of all nodes are in m.
pub fn views(
    body: &SpaceBody,
    positions: &[Vector3<f64>],
    activations: &[f64],
    title: &str,
) -> Result<Svg, ReportError> {
    check(&body.mesh, positions, activations)?;
    let groups = body.groups();
    let colour = |m: usize| {
        let group = groups.iter().position(|g| *g == body.muscles[m].group).unwrap_or_default();
        COLOURS[group % COLOURS.len()]
    };
    let of_element = most_active(body, activations);
    let faces = body.mesh.outward_quadrilaterals();
    let shown = format!(
        "A tongue in space of {} hexahedra from the side, the front and the top: deformed, over itself at rest (light).",
        body.mesh.hexahedra.len()
    );
    let (mut svg, top) = Svg::new(title, &shown, WIDTH);
    let rest = &body.mesh.nodes;
    let seen = |p: &Vector3<f64>, [across, up, _]: &[Vector3<f64>; 3]| Point::new(p.dot(across), p.dot(up));
    let in_tissue: Vec<usize> = faces.iter().flat_map(|(_, f)| *f).collect();
    let bounds = VIEWS.map(|(_, axes)| {
        let both = [rest.as_slice(), positions];
        let points: Vec<Point> =
            both.iter().flat_map(|x| in_tissue.iter().map(|&n| seen(&x[n], &axes))).collect();
        Bounds::of(&points).outwards(2e-3, 1e-3)
    });
    let [side, front, above] = bounds.map(|b| b.size());
    let per_m = (WIDTH - 3.0 * MARGIN) / (side[0].max(above[0]) + front[0]);
    let row = top + TEXT + MARGIN;
    let below = row + per_m * side[1].max(front[1]) + TEXT + 2.0 * MARGIN;
    let right = 2.0 * MARGIN + per_m * side[0].max(above[0]);
    let corners = [[MARGIN, row], [right, row], [MARGIN, below]];
    let mut bottom = below;
    for (((name, axes), bounds), corner) in VIEWS.into_iter().zip(bounds).zip(corners) {
        let view = View::new(bounds, corner, per_m * bounds.size()[0]);
        svg.text([corner[0], corner[1] - 0.5 * TEXT], Anchor::Start, Face::Plain, name);
        let outline =
            |f: &[usize; 4], x: &[Vector3<f64>]| closed([f.map(|n| view.place(&seen(&x[n], &axes)))]);
        let normal = |f: &[usize; 4], x: &[Vector3<f64>]| (x[f[2]] - x[f[0]]).cross(&(x[f[3]] - x[f[1]]));
        for (_, f) in faces.iter().filter(|(_, f)| normal(f, rest).dot(&axes[2]) > 0.0) {
            svg.fill(&outline(f, rest), "#ececec");
        }
        let mut towards: Vec<&(usize, [usize; 4])> =
            faces.iter().filter(|(_, f)| normal(f, positions).dot(&axes[2]) > 0.0).collect();
        let depth = |f: &[usize; 4]| f.iter().map(|&n| positions[n].dot(&axes[2])).sum::<f64>();
        towards.sort_by(|a, b| depth(&a.1).total_cmp(&depth(&b.1)));
        for (element, f) in towards {
            let active = of_element[*element].filter(|&m| activations[m] > ACTIVE);
            let n = normal(f, positions).try_normalize(0.0).unwrap_or(axes[2]);
            // Light from above and from the viewer's left.
            let light = n.dot(&((axes[1] - axes[0]) * 0.45 + axes[2] * 0.77));
            let fill = shaded(active.map_or(TISSUE, colour), light);
            let d = outline(f, positions);
            svg.element(
                "path",
                format_args!("d=\"{d}\" fill=\"{fill}\" stroke=\"#4a4a4a\" stroke-width=\"0.7\" stroke-linejoin=\"round\""),
            );
        }
        if name != "front" {
            bottom = view.end()[1] + MARGIN;
        }
        if name == "side" {
            scale(&mut svg, &view, below - TEXT - MARGIN + per_m * above[1] + 2.0 * MARGIN);
        }
    }
    let of_group = |g: &String| {
        let mut of =
            body.muscles.iter().zip(activations).filter(|(m, _)| m.group == *g).map(|(m, a)| (m, *a));
        let most = of.clone().map(|(_, a)| a).fold(0.0, f64::max);
        let least = of.clone().map(|(_, a)| a).fold(f64::INFINITY, f64::min);
        let name = match of.find(|(_, a)| *a == most) {
            Some((m, _)) if least < most => m.name.clone(),
            _ => g.clone(),
        };
        (most > ACTIVE).then(|| format!("{name} {most:.2}"))
    };
    let names: Vec<(usize, String)> =
        groups.iter().enumerate().filter_map(|(i, g)| Some((i, of_group(g)?))).collect();
    let entries: Vec<Entry<'_>> =
        names.iter().map(|(_, name)| Entry { sample: SAMPLE, face: Face::Plain, name }).collect();
    let (places, height) = legend(&mut svg, &entries, [right, WIDTH - MARGIN], below);
    for ([x, y], (group, _)) in places.iter().zip(&names) {
        let fill = shaded(COLOURS[group % COLOURS.len()], 1.0);
        svg.rectangle([*x, y - 10.0], [x + SAMPLE - 10.0, y + 10.0], &fill, Some(INK));
    }
    Ok(svg.finish(bottom.max(below + height) + LEGEND_ROW + 2.0 * MARGIN))
}
