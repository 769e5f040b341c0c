//! The tensions of many fits: a row for each fit, a column for each muscle, and a dot for each contracting muscle.

use super::labels::colours;
use super::plot::{Axis, Plot, round_range};
use super::{Anchor, FontFace, INK, MARGIN, RULE, Svg, TEXT};
use crate::report::joined;

/// Least width of the labels of the fits, width of a column, gap between columns and height of a row, px.
const NAMES: f64 = 190.0;
const COLUMN: f64 = 150.0;
const GAP: f64 = 36.0;
const ROW: f64 = 34.0;

/// `fits` are the label of each fit and its tension of every muscle, N per metre of thickness; `None` if it has none.
pub fn tensions(muscles: &[String], fits: &[(&str, &[Option<f64>])], title: &str) -> Svg {
    let most = fits.iter().flat_map(|(_, tensions)| tensions.iter().flatten()).copied().fold(1.0, f64::max);
    let summary = fits.iter().map(|(label, tensions)| {
        let all = muscles.iter().zip(*tensions);
        let all = all.filter_map(|(name, t)| Some(format!("{name} {:.1}", (*t)?)));
        format!("{label}: {}.", joined(all, ", "))
    });
    let description = format!("Tensions in N per metre of thickness. {}", joined(summary, " "));
    let names = fits.iter().map(|(label, _)| FontFace::Plain.width(label) + GAP).fold(NAMES, f64::max);
    let width = names + muscles.len() as f64 * (COLUMN + GAP) + 2.0 * MARGIN;
    let (mut svg, top) = Svg::new(title, &description, width);
    let (top, height) = (top + 2.0 * TEXT, fits.len() as f64 * ROW);
    for (nth, (label, _)) in fits.iter().enumerate() {
        let y = top + ROW * (nth as f64 + 0.5);
        svg.text([MARGIN, y], Anchor::Start, FontFace::Plain, label);
        svg.line([MARGIN + names, y], [width - MARGIN, y], RULE, 1.0);
    }
    for (column, (name, colour)) in muscles.iter().zip(colours(muscles)).enumerate() {
        let left = MARGIN + names + column as f64 * (COLUMN + GAP) + 0.5 * GAP;
        // The vertical axis counts rows from the top.
        let plot =
            Plot::linear([left, top], [COLUMN, height], round_range(0.0, most), [fits.len() as f64, 0.0]);
        plot.axes(&mut svg, [Axis::Numbers, Axis::Nothing]);
        svg.text([left + 0.5 * COLUMN, top - TEXT], Anchor::Middle, FontFace::Bold, name);
        for (nth, (_, tensions)) in fits.iter().enumerate() {
            let Some(Some(value)) = tensions.get(column) else { continue };
            svg.dot(plot.place(*value, nth as f64 + 0.5), 6.5, &colour, INK);
        }
    }
    let below = top + height + 56.0;
    svg.text([MARGIN + names, below], Anchor::Start, FontFace::Plain, "tension, N per metre of thickness");
    svg.finish(below + TEXT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_for_each_tension_on_one_scale_and_none_for_a_muscle_at_rest() {
        let muscles = ["GGa", "my own"].map(String::from);
        let fits =
            [("S2 /a/", [Some(10.0), None].as_slice()), ("S2 /i/", [Some(5.0), Some(20.0)].as_slice())];
        let svg = tensions(&muscles, &fits, "Tensions").to_string();
        let circles = svg.split("<circle cx=\"").skip(1);
        let dots: Vec<f64> = circles.map(|dot| dot.split('"').next().unwrap().parse().unwrap()).collect();
        assert_eq!(dots.len(), 3);
        // 5 N/m are a quarter of the largest value, 20 N/m, and so of the column's width.
        assert!((dots[0] - dots[1] - 0.25 * COLUMN).abs() < 0.11);
        assert!((dots[2] - dots[1] - (COLUMN + GAP) - 0.75 * COLUMN).abs() < 0.11);
        assert!(svg.contains("S2 /a/: GGa 10.0."));
    }
}
