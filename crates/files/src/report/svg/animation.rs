//! The tongue in motion as one SVG file that plays in a browser (SMIL animation, without scripts or external
//! files).

use std::fmt::Write as _;

use nalgebra::SVector;

use super::axes::{BELOW, LEFT, View};
use super::labels::point_at;
use super::muscle_lines::{arrow, bone, label_places, lines, widths};
use super::section::{
    AlignedRecording, DEFORMED, REST, REST_TISSUE, check, draw_palate, frame, key, ring, tissue_edges,
};
use super::{Anchor, Face, HALO, INK, MARGIN, Px, Svg, TEXT, WIDTH, escaped, text_attributes};
use crate::report::ReportError;
use tongue_core::body::Mesh;

#[derive(Debug, Clone, PartialEq)]
pub struct AnimationFrame {
    pub time: f64,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, 2>>,
    /// Tension of every muscle of the mesh, N per metre of thickness.
    pub tensions: Vec<f64>,
}

/// Draws the motion in real time in a loop: as [`super::tongue`], with moving tissue and muscles. A muscle
/// with a tension in any frame is drawn as contracting. Without SMIL the last frame is shown.
///
/// Frames must be evenly spaced in time.
pub fn animation(
    mesh: &Mesh<2>,
    palate: &[SVector<f64, 2>],
    frames: &[AnimationFrame],
    title: &str,
) -> Result<Svg, ReportError> {
    animation_of_seen(mesh, palate, frames, &[], false, title)
}

/// As [`animation`], with measured points of each frame as dots (m; one set for each frame, or none), and
/// muscles coloured by their tensions; `mirrored`: the face looks to the right, as in the recording.
pub fn animation_of_seen(
    mesh: &Mesh<2>,
    palate: &[SVector<f64, 2>],
    frames: &[AnimationFrame],
    seen: &[Vec<SVector<f64, 2>>],
    mirrored: bool,
    title: &str,
) -> Result<Svg, ReportError> {
    if !mirrored {
        return drawn(mesh, palate, frames, seen, ["front", "back"], title);
    }
    let over =
        |points: &[SVector<f64, 2>]| points.iter().map(|p| SVector::from([-p.x, p.y])).collect::<Vec<_>>();
    let mesh = Mesh { nodes: over(&mesh.nodes), ..mesh.clone() };
    let one = |f: &AnimationFrame| AnimationFrame { positions: over(&f.positions), ..f.clone() };
    let frames: Vec<AnimationFrame> = frames.iter().map(one).collect();
    let seen: Vec<Vec<_>> = seen.iter().map(|points| over(points)).collect();
    drawn(&mesh, &over(palate), &frames, &seen, ["back", "front"], title)
}

/// `ends` are the names of the left and the right side.
fn drawn(
    mesh: &Mesh<2>,
    palate: &[SVector<f64, 2>],
    frames: &[AnimationFrame],
    seen: &[Vec<SVector<f64, 2>>],
    ends: [&str; 2],
    title: &str,
) -> Result<Svg, ReportError> {
    frames.iter().try_for_each(|f| check(mesh, &f.positions, &f.tensions))?;
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Err(ReportError::NoFrame) };
    let duration = (last.time - first.time).max(0.1);
    let shown = format!(
        "Midsagittal section of the tongue moving from {} s to {} s, {} to the left; {} frames.",
        first.time,
        last.time,
        ends[0],
        frames.len()
    );
    let most: Vec<f64> =
        (0..mesh.muscles.len()).map(|m| frames.iter().map(|f| f.tensions[m]).fold(0.0, f64::max)).collect();
    let (mut svg, top) = Svg::new(title, &shown, WIDTH);
    let shapes = frames.iter().map(|f| f.positions.as_slice());
    let view = View::new(frame(mesh, shapes), [LEFT, top + MARGIN], WIDTH - LEFT - MARGIN);
    svg.fill(&ring(&view, mesh, &mesh.nodes), REST_TISSUE);
    svg.stroke(&ring(&view, mesh, &mesh.nodes), REST, 2.0);
    let end = view.end();
    // Muscles may extend beyond the view. A page may hold several of these pictures.
    let id = title.bytes().fold(0_u32, |hash, byte| hash.wrapping_mul(31).wrapping_add(byte.into()));
    let _ = writeln!(
        svg.elements,
        "<clipPath id=\"view-{id:x}\"><rect x=\"{LEFT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath>\n\
         <g clip-path=\"url(#view-{id:x})\">",
        top + MARGIN,
        end[0] - LEFT,
        end[1] - top - MARGIN
    );
    let strongest = most.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
    let lit = |muscle: usize| {
        let light = |f: &AnimationFrame| format!("{:.2}", 0.12 + 0.88 * f.tensions[muscle] / strongest);
        let values: Vec<String> = frames.iter().map(light).collect();
        format!(
            "<animate attributeName=\"stroke-opacity\" dur=\"{duration}s\" repeatCount=\"indefinite\" values=\"{}\"/>",
            values.join(";")
        )
    };
    let mut moving = |shape: &dyn Fn(&AnimationFrame) -> String,
                      colour: &str,
                      width: f64,
                      dashed: bool,
                      more: &str| {
        let shapes: Vec<String> = frames.iter().map(shape).collect();
        let dashes = if dashed { " stroke-dasharray=\"14 8\"" } else { "" };
        let _ = writeln!(
            svg.elements,
            "<path d=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}>\
             <animate attributeName=\"d\" dur=\"{duration}s\" repeatCount=\"indefinite\" values=\"{}\"/>{more}</path>",
            shapes.last().map_or("", String::as_str),
            shapes.join(";")
        );
    };
    let edges = tissue_edges(mesh);
    moving(&|f| view.path(&f.positions, edges.iter().copied()), "#c9c9c9", 1.0, false, "");
    moving(&|f| ring(&view, mesh, &f.positions), DEFORMED, 2.6, false, "");
    let muscles = lines(&view, mesh, &last.positions, &most);
    for line in &muscles {
        let shape = |f: &AnimationFrame| view.path(&f.positions, [line.nodes]);
        let [width, edge] = widths(line.contracting);
        let muscle = mesh.muscles.iter().position(|m| std::ptr::eq(m.nodes.as_slice(), line.nodes));
        let light = muscle.filter(|_| !seen.is_empty() && line.contracting).map(&lit).unwrap_or_default();
        moving(&shape, INK, width + edge, !line.contracting, &light);
        moving(&shape, &line.colour, width, !line.contracting, &light);
    }
    marks(&mut svg, &view, seen, duration);
    svg.elements += "</g>\n";
    draw_palate(&mut svg, &view, mesh, palate);
    let leaving = muscles.iter().filter_map(|l| l.leaves.map(|ends| (ends, &l.colour)));
    let arrows = leaving.map(|([from, to], colour)| arrow(&mut svg, from, to, colour)).count() > 0;
    let x = format!("{} \u{2190}\u{2003}x (mm)\u{2003}\u{2192} {}", ends[0], ends[1]);
    view.axes(&mut svg, [&x, "y (mm)"]);
    moving_bones(&mut svg, &view, mesh, frames, duration);
    names(&mut svg, &view, mesh, frames, duration, &most);
    times(&mut svg, frames, duration, [end[0] - MARGIN, top + MARGIN + TEXT]);
    let bottom = end[1] + BELOW + MARGIN;
    let palate = (!palate.is_empty()).then_some(false);
    let seen =
        AlignedRecording { grey: "rest", tensions: &most, arrows, palate, bones: !mesh.fixed.is_empty() };
    let height = key(&mut svg, &seen, bottom);
    Ok(svg.finish(bottom + height + MARGIN))
}

/// The names of the muscles, each moving with the middle of its line.
fn names(svg: &mut Svg, view: &View, mesh: &Mesh<2>, frames: &[AnimationFrame], duration: f64, most: &[f64]) {
    let Some(last) = frames.last() else { return };
    let drawn = lines(view, mesh, &last.positions, most);
    let places = label_places(view, &drawn, &[]);
    for (nth, place) in places.into_iter().enumerate() {
        let (line, Some(at)) = (&drawn[nth], place) else { continue };
        let middle = |f: &AnimationFrame| -> Px {
            let chain: Vec<_> = line.nodes.iter().filter_map(|&n| f.positions.get(n).copied()).collect();
            point_at(&view.visible(&chain).0, 0.5).map_or(at, |(p, _)| p)
        };
        let end = middle(last);
        let values = |i: usize| {
            let value = |f: &AnimationFrame| format!("{:.1}", middle(f)[i] - end[i]);
            frames.iter().map(value).collect::<Vec<_>>()
        };
        let ways: Vec<String> =
            values(0).into_iter().zip(values(1)).map(|(x, y)| format!("{x} {y}")).collect();
        let _ = writeln!(
            svg.elements,
            "<text {}{HALO}>{}<animateTransform attributeName=\"transform\" type=\"translate\" dur=\"{duration}s\" \
             repeatCount=\"indefinite\" values=\"{}\"/></text>",
            text_attributes(at, Anchor::Middle, line.face(), TEXT),
            escaped(&super::printable(&line.name)),
            ways.join(";")
        );
    }
}

fn moving_bones(svg: &mut Svg, view: &View, mesh: &Mesh<2>, frames: &[AnimationFrame], duration: f64) {
    let Some(last) = frames.last() else { return };
    for &node in &mesh.fixed {
        let Some(end) = last.positions.get(node).filter(|p| view.bounds.contains(p)) else { continue };
        let at = view.place(end);
        let way = |f: &AnimationFrame| {
            let here = f.positions.get(node).map_or(at, |p| view.place(p));
            format!("{:.1} {:.1}", here[0] - at[0], here[1] - at[1])
        };
        let ways: Vec<String> = frames.iter().map(way).collect();
        if ways.iter().all(|w| *w == ways[0]) {
            bone(svg, at);
            continue;
        }
        svg.elements += "<g>";
        bone(svg, at);
        let _ = writeln!(
            svg.elements,
            "<animateTransform attributeName=\"transform\" type=\"translate\" dur=\"{duration}s\" \
             repeatCount=\"indefinite\" values=\"{}\"/></g>",
            ways.join(";")
        );
    }
}

fn marks(svg: &mut Svg, view: &View, seen: &[Vec<SVector<f64, 2>>], duration: f64) {
    for (nth, points) in seen.iter().enumerate() {
        let shown: Vec<&str> = (0..seen.len()).map(|i| if i == nth { "visible" } else { "hidden" }).collect();
        let at = if nth + 1 == seen.len() { "visible" } else { "hidden" };
        let _ = write!(
            svg.elements,
            "<g fill=\"{SEEN}\" stroke=\"#ffffff\" stroke-width=\"1.5\" visibility=\"{at}\">"
        );
        for [x, y] in points.iter().map(|p| view.place(p)) {
            let _ = write!(svg.elements, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\"/>");
        }
        let _ = writeln!(
            svg.elements,
            "<animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{duration}s\" repeatCount=\"indefinite\" values=\"{}\"/></g>",
            shown.join(";")
        );
    }
}

/// Colour of measured points.
const SEEN: &str = "#111111";

/// The time of each frame, shown during the frame.
fn times(svg: &mut Svg, frames: &[AnimationFrame], duration: f64, at: Px) {
    let count = frames.len();
    for (nth, frame) in frames.iter().enumerate() {
        let shown: Vec<&str> = (0..count).map(|i| if i == nth { "visible" } else { "hidden" }).collect();
        let _ = writeln!(
            svg.elements,
            "<text {} visibility=\"{}\">{:.2} s<animate attributeName=\"visibility\" calcMode=\"discrete\" \
             dur=\"{duration}s\" repeatCount=\"indefinite\" values=\"{}\"/></text>",
            text_attributes(at, Anchor::End, Face::Bold, TEXT),
            if nth + 1 == count { "visible" } else { "hidden" },
            frame.time,
            shown.join(";")
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tongue_core::body::{Cells, MuscleChain};

    #[test]
    fn every_frame_is_there_and_the_last_one_shows_without_animation() {
        let mut cells = Cells::new();
        cells.push(&[0, 1, 2]);
        let nodes = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(SVector::from).to_vec();
        let muscles = vec![MuscleChain { name: "GGa".into(), nodes: vec![0, 1] }];
        let connections = vec![[0, 1], [0, 2], [1, 2]];
        let mesh = Mesh {
            nodes: nodes.clone(),
            cells,
            connections,
            muscles,
            fixed: vec![0],
            continuum: None,
            hexahedra: Vec::new(),
        };
        let frames: Vec<AnimationFrame> = (0..3)
            .map(|i| {
                let mut positions = nodes.clone();
                positions[1].x -= 0.1 * f64::from(i);
                AnimationFrame { time: f64::from(i), positions, tensions: vec![f64::from(i)] }
            })
            .collect();
        let svg = animation(&mesh, &[], &frames, "a < b").unwrap().to_string();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let animated: Vec<_> =
            document.descendants().filter(|n| n.attribute("attributeName") == Some("d")).collect();
        assert_eq!(animated.len(), 4, "the mesh and its edge, and a muscle with its edge");
        for a in animated {
            let values: Vec<_> = a.attribute("values").unwrap().split(';').collect();
            assert_eq!(values.len(), 3);
            assert_ne!(values[0], values[2]);
            assert_eq!(a.parent().unwrap().attribute("d"), values.last().copied());
        }
        let visible: Vec<_> = document
            .descendants()
            .filter(|n| n.attribute("visibility") == Some("visible"))
            .map(|n| n.text().unwrap())
            .collect();
        assert_eq!(visible, ["2.00 s"]);
        assert!(matches!(animation(&mesh, &[], &[], ""), Err(ReportError::NoFrame)));
    }
}
