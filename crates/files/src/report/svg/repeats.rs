//! How well the courses of muscles repeat, beside what comes by chance.

use super::plot::{Plot, Scale};
use super::{Anchor, Face, INK, MARGIN, RULE, Svg, TEXT, WIDTH};

/// Height of a row, px, and room for the names of the muscles.
const ROW: f64 = 38.0;
const LEFT: f64 = 100.0;
const CHANCE: &str = "#bdbdbd";
const FOUND: &str = "#08519c";

/// A row for every muscle: its ICC as a dot, and as a bar what 95 % of shifted labels stay below, with a tick at their mean.
pub fn repeats(title: &str, muscles: &[(String, [f64; 3])]) -> Svg {
    let beyond: Vec<&str> =
        muscles.iter().filter(|(_, [icc, _, chance])| icc > chance).map(|(name, _)| name.as_str()).collect();
    let told = format!(
        "Intraclass correlation of courses over repetitions; beyond 95 % of shifted labels: {}.",
        if beyond.is_empty() { "none".to_owned() } else { beyond.join(", ") }
    );
    let (mut svg, top) = Svg::new(title, &told, WIDTH);
    let height = ROW * muscles.len().max(1) as f64;
    let plot = Plot {
        corner: [LEFT, top + MARGIN],
        size: [WIDTH - LEFT - 2.0 * MARGIN, height],
        x: [-0.5, 1.0],
        y: [0.0, muscles.len().max(1) as f64],
        scale: Scale::Linear,
    };
    let foot = top + MARGIN + height;
    for tick in [-0.5, 0.0, 0.5, 1.0] {
        let [x, _] = plot.place(tick, 0.0);
        svg.line([x, top + MARGIN], [x, foot], if tick == 0.0 { INK } else { RULE }, 1.0);
        let text = format!("{tick}").replace('-', "\u{2212}");
        svg.text([x, foot + 20.0], Anchor::Middle, Face::Plain, &text);
    }
    for (nth, (name, [icc, mean, chance])) in muscles.iter().enumerate() {
        let at = |value: f64| plot.place(value, (muscles.len() - nth) as f64 - 0.5);
        let [end, y] = at(*chance);
        svg.rectangle([at(0.0)[0], y - 9.0], [end, y + 9.0], CHANCE, None);
        svg.line([at(*mean)[0], y - 12.0], [at(*mean)[0], y + 12.0], INK, 2.0);
        let [x, _] = at(*icc);
        svg.element("circle", format_args!("cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"9\" fill=\"{FOUND}\""));
        let face = if icc > chance { Face::Bold } else { Face::Plain };
        svg.text([LEFT - 12.0, y], Anchor::End, face, name);
    }
    let lines = [
        "intraclass correlation of courses over repetitions",
        "dot: found; bar and tick: 95 % limit and mean of shifted labels",
    ];
    for (line, text) in lines.iter().enumerate() {
        svg.text([0.5 * WIDTH, foot + 54.0 + 30.0 * line as f64], Anchor::Middle, Face::Plain, text);
    }
    svg.finish(foot + 84.0 + TEXT + MARGIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_muscle_has_a_dot_and_what_is_beyond_chance_is_told() {
        let muscles = [("GGa".to_owned(), [0.9, 0.2, 0.5]), ("<b>".to_owned(), [-0.7, 0.1, 0.4])];
        let text = repeats("a", &muscles).to_string();
        let document = roxmltree::Document::parse(&text).unwrap();
        let dots: Vec<f64> = document
            .descendants()
            .filter(|n| n.tag_name().name() == "circle")
            .map(|n| n.attribute("cx").unwrap().parse().unwrap())
            .collect();
        assert_eq!(dots.len(), 2);
        assert!(dots[1] < dots[0]);
        assert!(text.contains("shifted labels: GGa."));
    }
}
