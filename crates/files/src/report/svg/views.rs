//! Pictures of bodies in space from the side, the front and the top; of a tongue with the muscles that act in colour.

use nalgebra::Vector3;

use super::axes::{Bounds, View};
use super::section::check;
use super::{Anchor, Entry, Face, INK, LEGEND_ROW, MARGIN, Svg, TEXT, WIDTH, closed, data};
use crate::report::ReportError;
use crate::report::space::most_active;
use tongue_core::body::{Mesh, SpaceBody};
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
const SOLID: [f64; 3] = [205.0, 222.0, 240.0];
const ACTIVE: f64 = 5e-3;
const SAMPLE: f64 = 34.0;

/// Draws a body in space over itself at rest (light). An element has the colour of the most active muscle that runs through it.
/// Positions of all nodes are in m.
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
    let quadrilaterals = body.mesh.outward_quadrilaterals();
    let faces = quadrilaterals.iter().map(|(element, nodes)| {
        let active = of_element[*element].filter(|&m| activations[m] > ACTIVE);
        (nodes.as_slice(), active.map_or(TISSUE, colour))
    });
    let described = format!("A tongue in space of {} hexahedra", body.mesh.hexahedra.len());
    let of_group = |g: &String| {
        let of = body.muscles.iter().zip(activations).filter(|(m, _)| m.group == *g).map(|(m, a)| (m, *a));
        let most = of.clone().map(|(_, a)| a).fold(0.0, f64::max);
        let least = of.clone().map(|(_, a)| a).fold(f64::INFINITY, f64::min);
        let name = match of.clone().find(|(_, a)| *a == most) {
            Some((m, _)) if least < most => m.name.clone(),
            _ => g.clone(),
        };
        (most > ACTIVE).then(|| format!("{name} {most:.2}"))
    };
    let names =
        groups.iter().enumerate().filter_map(|(i, g)| Some((of_group(g)?, COLOURS[i % COLOURS.len()])));
    let (faces, names): (Vec<_>, Vec<_>) = (faces.collect(), names.collect());
    Ok(drawn(&faces, [&body.mesh.nodes, positions], &names, [title, &described]))
}

/// Draws a body of tetrahedra in the same way, in one colour.
pub fn solid(mesh: &Mesh<3>, positions: &[Vector3<f64>], title: &str) -> Result<Svg, ReportError> {
    check(mesh, positions, &vec![0.0; mesh.muscles.len()])?;
    let triangles = mesh.outward_faces();
    let faces: Vec<_> = triangles.iter().map(|nodes| (nodes.as_slice(), SOLID)).collect();
    let (nodes, cells) = (mesh.nodes.len(), mesh.cells.len());
    let described = format!("A body in space of {nodes} nodes and {cells} tetrahedra");
    Ok(drawn(&faces, [&mesh.nodes, positions], &[], [title, &described]))
}

/// Draws a surface in parallel projection, of the faces that are turned to the viewer the farthest first, over itself at rest (light).
fn drawn(
    faces: &[(&[usize], [f64; 3])],
    [rest, positions]: [&[Vector3<f64>]; 2],
    names: &[(String, [f64; 3])],
    [title, what]: [&str; 2],
) -> Svg {
    let shown =
        format!("{what} from the side, the front and the top: deformed, over itself at rest (light).");
    let (mut svg, top) = Svg::new(title, &shown, WIDTH);
    let seen = |p: &Vector3<f64>, [across, up, _]: &[Vector3<f64>; 3]| Point::new(p.dot(across), p.dot(up));
    let on_surface: Vec<usize> = faces.iter().flat_map(|(f, _)| f.iter().copied()).collect();
    let size = rest.iter().map(|p| p.amax()).fold(1e-3, f64::max);
    let margin = 0.03 * size;
    let bounds = VIEWS.map(|(_, axes)| {
        let points =
            [rest, positions].into_iter().flat_map(|x| on_surface.iter().map(|&n| seen(&x[n], &axes)));
        let points: Vec<Point> = points.chain(on_surface.is_empty().then(Point::zeros)).collect();
        Bounds::of(&points).outwards(margin, 0.5 * margin)
    });
    let [side, front, above] = bounds.map(|b| b.size());
    let per_m = (WIDTH - 3.0 * MARGIN) / (side[0].max(above[0]) + front[0]);
    let row = top + TEXT + MARGIN;
    let below = row + per_m * side[1].max(front[1]) + TEXT + 2.0 * MARGIN;
    let right = 2.0 * MARGIN + per_m * side[0].max(above[0]);
    let corners = [[MARGIN, row], [right, row], [MARGIN, below]];
    for (((name, axes), bounds), corner) in VIEWS.into_iter().zip(bounds).zip(corners) {
        let view = View::new(bounds, corner, per_m * bounds.size()[0]);
        svg.text([corner[0], corner[1] - 0.5 * TEXT], Anchor::Start, Face::Plain, name);
        let outline =
            |f: &[usize], x: &[Vector3<f64>]| closed([f.iter().map(|n| view.place(&seen(&x[*n], &axes)))]);
        let normal = |f: &[usize], x: &[Vector3<f64>]| {
            (x[f[2]] - x[f[0]]).cross(&(x[f[f.len() - 1]] - x[f[1]])).try_normalize(0.0).unwrap_or(axes[2])
        };
        for (f, _) in faces.iter().filter(|(f, _)| normal(f, rest).dot(&axes[2]) > 0.0) {
            svg.fill(&outline(f, rest), "#ececec");
        }
        let mut towards: Vec<_> =
            faces.iter().filter(|(f, _)| normal(f, positions).dot(&axes[2]) > 0.0).collect();
        let depth = |f: &[usize]| f.iter().map(|&n| positions[n].dot(&axes[2])).sum::<f64>();
        towards.sort_by(|a, b| depth(a.0).total_cmp(&depth(b.0)));
        for (f, colour) in towards {
            // Light from above and from the viewer's left.
            let light = normal(f, positions).dot(&((axes[1] - axes[0]) * 0.45 + axes[2] * 0.77));
            let (d, fill) = (outline(f, positions), shaded(*colour, light));
            svg.element(
                "path",
                format_args!("d=\"{d}\" fill=\"{fill}\" stroke=\"#4a4a4a\" stroke-width=\"0.7\" stroke-linejoin=\"round\""),
            );
        }
    }
    let bottom = below + per_m * above[1];
    scale(&mut svg, side[0], per_m, bottom + MARGIN);
    let entries = names.iter().map(|(name, colour)| {
        let fill = shaded(*colour, 1.0);
        Entry::new(SAMPLE, name, move |svg, [x, y]| {
            svg.rectangle([x, y - 10.0], [x + SAMPLE - 10.0, y + 10.0], &fill, Some(INK));
        })
    });
    let height = svg.legend(entries, [right, WIDTH - MARGIN], below);
    svg.finish((bottom + MARGIN).max(below + height) + LEGEND_ROW + 2.0 * MARGIN)
}

/// A colour, 0 to 255, of a face that looks into the light by so much, from 0 to 1.
fn shaded(colour: [f64; 3], light: f64) -> String {
    let light = 0.6 + 0.4 * light.max(0.0);
    let [r, g, b] = colour.map(|c: f64| (c * light.min(1.0)) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A bar of a round length, about a fifth of a width, m, below the pictures.
fn scale(svg: &mut Svg, width: f64, per_m: f64, top: f64) {
    let tens = 10f64.powf((0.2 * width).log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|s| s * tens).find(|l| *l <= 0.2 * width).unwrap_or(tens);
    let (x, y) = (2.0 * MARGIN, top + 0.5 * LEGEND_ROW);
    let end = x + length * per_m;
    let bars = [[[x, y - 7.0], [x, y + 7.0]], [[x, y], [end, y]], [[end, y - 7.0], [end, y + 7.0]]];
    svg.stroke(&data(bars), INK, 2.0);
    svg.text([end + 12.0, y], Anchor::Start, Face::Plain, &format!("{} mm", (1e6 * length).round() / 1e3));
}
