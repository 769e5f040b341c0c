//! The tongue in motion as one SVG file that plays in a browser (SMIL animation, without scripts or external files).

use std::fmt::Write as _;

use super::axes::BELOW;
use super::body_view::{BodyView, bone};
use super::labels::point_at;
use super::section::{SectionPicture, check, legend};
use super::{Anchor, FontFace, MARGIN, Px, Svg, TEXT, WIDTH};
use crate::report::ReportError;
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;

#[derive(Debug, Clone, PartialEq)]
pub struct AnimationFrame {
    pub time: f64,
    pub positions: Vec<Point>,
    pub tensions: Vec<f64>,
}

/// Draws the motion in real time in a loop, each frame as [`super::tongue`] draws it. A muscle with a tension in any frame is drawn as
/// contracting. Without SMIL the last frame is shown.
///
/// Frames must be evenly spaced in time. If measured points are given (`seen`, m; a list for each frame), they are drawn as dots, and
/// muscles are more opaque the larger their tension is. If `mirrored`, the face looks to the right, as in the recording.
pub fn animation(
    mesh: &Mesh<2>,
    palate: &[Point],
    frames: &[AnimationFrame],
    seen: &[Vec<Point>],
    mirrored: bool,
    title: &str,
) -> Result<Svg, ReportError> {
    let (side, [left, right]) = if mirrored { (-1.0, ["back", "front"]) } else { (1.0, ["front", "back"]) };
    let turned = |points: &[Point]| Vec::from_iter(points.iter().map(|p| Point::from([side * p.x, p.y])));
    let mesh = &Mesh { nodes: turned(&mesh.nodes), ..mesh.clone() };
    let palate = &turned(palate);
    let frames = frames.iter().map(|f| AnimationFrame { positions: turned(&f.positions), ..f.clone() });
    let frames: Vec<AnimationFrame> = frames.collect();
    let seen: Vec<Vec<Point>> = seen.iter().map(|points| turned(points)).collect();
    frames.iter().try_for_each(|f| check(mesh, &f.positions, &f.tensions))?;
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Err(ReportError::NoFrame) };
    let (from_s, to_s, count) = (first.time, last.time, frames.len());
    let duration = (to_s - from_s).max(0.1);
    let moving = format!("Midsagittal section of the tongue moving from {from_s} s to {to_s} s");
    let description = format!("{moving}, {left} to the left; {count} frames.");
    let most: Vec<f64> =
        (0..mesh.muscles.len()).map(|m| frames.iter().map(|f| f.tensions[m]).fold(0.0, f64::max)).collect();
    let strongest = most.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
    let (mut svg, top) = Svg::new(title, &description, WIDTH);
    let shapes = frames.iter().map(|f| f.positions.as_slice());
    let body = BodyView::new(mesh, palate, shapes, top + MARGIN);
    body.draw_rest(&mut svg);
    body.draw_palate(&mut svg, palate);
    // Names keep their distance from the middles of their lines.
    let at_the_end = body.muscles(&last.positions, &most);
    let places = body.label_places(&at_the_end, &body.bones(&last.positions));
    let end = body.view.end();
    let mut arrows = false;
    for (nth, f) in frames.iter().enumerate() {
        let visible = if nth + 1 == frames.len() { "visible" } else { "hidden" };
        let [from, to] = [nth, nth + 1].map(|n| n as f64 / frames.len() as f64);
        let _ = writeln!(
            svg.elements,
            "<g visibility=\"{visible}\"><animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{duration}s\" \
             repeatCount=\"indefinite\" values=\"hidden;visible;hidden\" keyTimes=\"0;{from:.5};{to:.5}\"/>"
        );
        body.draw_tissue(&mut svg, &f.positions);
        let muscles = body.muscles(&f.positions, &most);
        for line in &muscles {
            let is_faded = !seen.is_empty() && line.contracting;
            let part = if is_faded { f.tensions[line.index] / strongest } else { 1.0 };
            let _ = write!(svg.elements, "<g stroke-opacity=\"{:.2}\">", 0.12 + 0.88 * part);
            line.draw(&mut svg);
            svg.elements += "</g>";
            line.draw_arrow(&mut svg);
            arrows |= line.leaves.is_some();
        }
        body.bones(&f.positions).into_iter().for_each(|at| bone(&mut svg, at));
        for ((line, last), place) in muscles.iter().zip(&at_the_end).zip(&places) {
            let Some(at) = place else { continue };
            let [middle, from] = [line, last].map(|line| point_at(&line.seen, 0.5).map(|(p, _)| p));
            let way = middle.zip(from).map_or([0.0; 2], |(a, b)| [a[0] - b[0], a[1] - b[1]]);
            svg.label([at[0] + way[0], at[1] + way[1]], line.face(), &line.name);
        }
        body.draw_dots(&mut svg, seen.get(nth).map_or(&[], Vec::as_slice));
        let at: Px = [end[0] - MARGIN, top + MARGIN + TEXT];
        svg.text(at, Anchor::End, FontFace::Bold, &format!("{:.2} s", f.time));
        svg.elements += "</g>\n";
    }
    let across = format!("{left} \u{2190}\u{2003}x (mm)\u{2003}\u{2192} {right}");
    body.view.axes(&mut svg, [&across, "y (mm)"]);
    let bottom = end[1] + BELOW + MARGIN;
    let section = SectionPicture::new(mesh, &last.positions, &most, palate, title);
    let height = legend(&mut svg, &section, arrows, bottom);
    Ok(svg.finish(bottom + height + MARGIN))
}
