//! The tongue in motion as one SVG file that plays in a browser (SMIL animation; no script, nothing loaded).

use std::fmt::Write as _;

use nalgebra::SVector;
use plotters::style::RGBColor;

use super::ReportError;
use super::figure::{INK, MARGIN, TEXT, WIDTH, escaped, printable};
use super::picture::{DEFORMED, PALETTE, REST, check};
use crate::body::Mesh;

/// Height of the line of text below the picture, px.
const CAPTION: i32 = 2 * TEXT;

/// One moment of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, 2>>,
}

/// Draws the motion in real time, again and again: the mesh at rest (light grey) and moving (dark), contracting muscles
/// (`active`, numbers in `mesh.muscles`) thick and in colour. Where SMIL is not played the last frame is shown.
///
/// Frames must be evenly spaced in time.
///
/// # Errors
/// As [`super::tongue`] for each frame; [`ReportError::NoFrame`] without any.
pub fn animation(
    mesh: &Mesh<2>,
    frames: &[Frame],
    active: &[usize],
    title: &str,
) -> Result<String, ReportError> {
    frames.iter().try_for_each(|f| check(mesh, &f.positions, active))?;
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Err(ReportError::NoFrame) };
    let duration = (last.time - first.time).max(0.1);
    let view = View::of(mesh, frames);
    let height = view.height + f64::from(CAPTION);
    let title = escaped(&printable(title));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{WIDTH}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {WIDTH} {height:.0}\">\n<title>{title}</title>\n\
         <desc>Midsagittal section of the tongue moving from {} s to {} s, front to the left; {} frames.</desc>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        first.time,
        last.time,
        frames.len()
    );
    let edges: Vec<&[usize]> = mesh.connections.iter().map(<[usize; 2]>::as_slice).collect();
    let _ = writeln!(
        svg,
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\"/>",
        view.path(&mesh.nodes, &edges),
        hex(REST)
    );
    moving(&mut svg, &view, frames, duration, &edges, DEFORMED, 1.2);
    for (number, muscle) in mesh.muscles.iter().enumerate().filter(|(n, _)| active.contains(n)) {
        let line = [muscle.nodes.as_slice()];
        moving(&mut svg, &view, frames, duration, &line, INK, 8.0);
        moving(&mut svg, &view, frames, duration, &line, PALETTE[number % PALETTE.len()], 6.0);
    }
    caption(&mut svg, frames, duration, &title, view.height + f64::from(TEXT));
    svg += "</svg>\n";
    Ok(svg)
}

fn moving(
    svg: &mut String,
    view: &View,
    frames: &[Frame],
    duration: f64,
    lines: &[&[usize]],
    color: RGBColor,
    width: f64,
) {
    let shapes: Vec<String> = frames.iter().map(|f| view.path(&f.positions, lines)).collect();
    let _ = writeln!(
        svg,
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\">\
         <animate attributeName=\"d\" dur=\"{duration}s\" repeatCount=\"indefinite\" values=\"{}\"/></path>",
        shapes.last().map_or("", String::as_str),
        hex(color),
        shapes.join(";")
    );
}

/// The title, and the time of each frame while it is shown.
fn caption(svg: &mut String, frames: &[Frame], duration: f64, title: &str, y: f64) {
    let text = |x: i32, anchor: &str, visibility: &str, content: &str| {
        format!(
            "<text x=\"{x}\" y=\"{y:.0}\" font-family=\"sans-serif\" font-size=\"{TEXT}\" fill=\"{}\" \
             text-anchor=\"{anchor}\" dominant-baseline=\"middle\" visibility=\"{visibility}\">{content}</text>\n",
            hex(INK),
        )
    };
    *svg += &text(MARGIN, "start", "inherit", title);
    let count = frames.len();
    for (nth, frame) in frames.iter().enumerate() {
        let shown: Vec<&str> = (0..count).map(|i| if i == nth { "visible" } else { "hidden" }).collect();
        let content = format!(
            "{:.2} s<animate attributeName=\"visibility\" calcMode=\"discrete\" dur=\"{duration}s\" \
             repeatCount=\"indefinite\" values=\"{}\"/>",
            frame.time,
            shown.join(";")
        );
        *svg += &text(WIDTH - MARGIN, "end", if nth + 1 == count { "visible" } else { "hidden" }, &content);
    }
}

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

/// From metres to pixels, everything that ever moves in view, y upwards.
struct View {
    left: f64,
    top: f64,
    /// Pixels per metre.
    scale: f64,
    /// px.
    height: f64,
}

impl View {
    fn of(mesh: &Mesh<2>, frames: &[Frame]) -> Self {
        let all = || mesh.nodes.iter().chain(frames.iter().flat_map(|f| &f.positions));
        let low = all().fold([f64::INFINITY; 2], |[x, y], p| [x.min(p.x), y.min(p.y)]);
        let high = all().fold([f64::NEG_INFINITY; 2], |[x, y], p| [x.max(p.x), y.max(p.y)]);
        let margin = f64::from(MARGIN);
        let scale = (f64::from(WIDTH) - 2.0 * margin) / (high[0] - low[0]).max(1e-6);
        Self {
            left: low[0] - margin / scale,
            top: high[1] + margin / scale,
            scale,
            height: (high[1] - low[1]).max(0.0) * scale + 2.0 * margin,
        }
    }

    /// Chains of nodes as path data, tenths of a pixel.
    fn path(&self, positions: &[SVector<f64, 2>], lines: &[&[usize]]) -> String {
        let mut out = String::new();
        for line in lines {
            for (nth, p) in line.iter().filter_map(|&n| positions.get(n)).enumerate() {
                let command = if nth == 0 { 'M' } else { 'L' };
                let (x, y) = ((p.x - self.left) * self.scale, (self.top - p.y) * self.scale);
                let _ = write!(out, "{command}{x:.1} {y:.1}");
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Cells, MuscleChain};

    #[test]
    fn every_frame_is_there_and_the_last_one_shows_where_nothing_moves() {
        let mut cells = Cells::new();
        cells.push(&[0, 1, 2]);
        let nodes = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(SVector::from).to_vec();
        let muscles = vec![MuscleChain { name: "GGa".into(), nodes: vec![0, 1] }];
        let connections = vec![[0, 1], [0, 2], [1, 2]];
        let mesh = Mesh { nodes: nodes.clone(), cells, connections, muscles, fixed: vec![0] };
        let frames: Vec<Frame> = (0..3)
            .map(|i| {
                let mut positions = nodes.clone();
                positions[1].x -= 0.1 * f64::from(i);
                Frame { time: f64::from(i), positions }
            })
            .collect();
        let svg = animation(&mesh, &frames, &[0], "a < b").unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let animated: Vec<_> =
            document.descendants().filter(|n| n.attribute("attributeName") == Some("d")).collect();
        assert_eq!(animated.len(), 3, "the mesh, and a muscle with its edge");
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
        assert!(matches!(animation(&mesh, &[], &[0], ""), Err(ReportError::NoFrame)));
    }
}
