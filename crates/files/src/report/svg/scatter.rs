//! Predicted against measured values: a panel for each method, a colour for each muscle.

use super::muscle_lines::colours;
use super::plot::{Plot, Scale};
use super::{Anchor, Entry, Face, INK, MARGIN, Px, Svg, TEXT, legend};

/// Side of a panel, px, and room for its axis and its title.
const SIDE: f64 = 330.0;
const AXIS: f64 = 96.0;
const HEAD: f64 = 3.0 * TEXT;
const FOOT: f64 = 3.0 * TEXT;
const COLUMNS: usize = 3;
const DOT: f64 = 6.5;

/// Predictions of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    pub title: String,
    /// A line below it, such as its error.
    pub line: String,
    /// Number of the muscle, measured and predicted value.
    pub points: Vec<(usize, f64, f64)>,
}

/// Draws `panels` with the same axes and the diagonal of exact predictions.
pub fn scatter(muscles: &[String], panels: &[Scatter], title: &str) -> Svg {
    let values = || panels.iter().flat_map(|p| p.points.iter().flat_map(|&(_, x, y)| [x, y]));
    let low = values().fold(0.95, f64::min) - 0.02;
    let high = values().fold(1.05, f64::max) + 0.02;
    let columns = COLUMNS.min(panels.len().max(1));
    let width = 2.0 * MARGIN + columns as f64 * (SIDE + AXIS);
    let told: Vec<String> = panels.iter().map(|p| format!("{}: {}.", p.title, p.line)).collect();
    let shown = format!("Predicted against measured stretches of passive muscles. {}", told.join(" "));
    let (mut svg, top) = Svg::new(title, &shown, width);
    let paint = colours(muscles);
    let entries: Vec<Entry<'_>> =
        muscles.iter().map(|m| Entry { sample: 26.0, face: Face::Plain, name: m }).collect();
    let (places, height) = legend(&mut svg, &entries, [MARGIN + AXIS, width - MARGIN], top);
    for ([x, y], colour) in places.into_iter().zip(&paint) {
        dot(&mut svg, [x + DOT, y], colour);
    }
    let top = top + height;
    let mut bottom = top;
    for (nth, panel) in panels.iter().enumerate() {
        let left = MARGIN + AXIS + (nth % columns) as f64 * (SIDE + AXIS);
        let above = top + HEAD + (nth / columns) as f64 * (HEAD + SIDE + FOOT);
        let plot = Plot {
            corner: [left, above],
            size: [SIDE, SIDE],
            x: [low, high],
            y: [low, high],
            scale: Scale::Linear,
        };
        svg.text([left, above - 1.9 * TEXT], Anchor::Start, Face::Bold, &panel.title);
        svg.text([left, above - 0.8 * TEXT], Anchor::Start, Face::Plain, &panel.line);
        plot.axes(&mut svg, ["measured stretch", "predicted"]);
        svg.line(plot.place(low, low), plot.place(high, high), INK, 1.2);
        for &(muscle, x, y) in &panel.points {
            dot(&mut svg, plot.place(x, y), paint.get(muscle).map_or(INK, String::as_str));
        }
        bottom = above + SIDE + FOOT;
    }
    svg.finish(bottom + MARGIN)
}

fn dot(svg: &mut Svg, [x, y]: Px, colour: &str) {
    let at = format_args!(
        "cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{DOT}\" fill=\"{colour}\" stroke=\"{INK}\" stroke-width=\"1\""
    );
    svg.element("circle", at);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_predicted_exactly_lies_on_the_diagonal() {
        let muscles = ["GGa", "mine"].map(String::from);
        let panel = |title: &str, points| Scatter { title: title.into(), line: "0.1 RMS".into(), points };
        let panels = [panel("exact", vec![(0, 1.1, 1.1), (1, 0.9, 0.9)]), panel("high", vec![(0, 1.1, 1.3)])];
        let svg = scatter(&muscles, &panels, "Predicted").to_string();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let of = |name: &str| -> Vec<Px> {
            let all = document.descendants().filter(|n| n.has_tag_name("circle"));
            all.map(|n| {
                [format!("{name}x"), format!("{name}y")]
                    .map(|a| n.attribute(a.as_str()).unwrap().parse().unwrap())
            })
            .collect()
        };
        // Two dots of the legend, then those of the panels.
        let dots = of("c");
        assert_eq!(dots.len(), 5);
        assert!((dots[2][0] - dots[3][0] + dots[2][1] - dots[3][1]).abs() < 0.3, "{dots:?}");
        assert!(dots[4][1] < dots[2][1] - 20.0, "higher than measured");
        assert!(svg.contains("exact: 0.1 RMS."));
    }
}
