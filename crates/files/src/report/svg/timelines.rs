//! Tensions over time with their 95 % intervals, a panel for each muscle.

use super::{Anchor, Face, INK, MARGIN, Px, RULE, Svg, TEXT, WIDTH, closed, data};

const LEFT: f64 = 150.0;
/// Height of a panel and the gap between panels, px.
const PANEL: f64 = 92.0;
const GAP: f64 = 14.0;
const BAND: &str = "#9ecae1";
const LINE: &str = "#08519c";
const GREY_BAND: &str = "#e2e2e2";
const GREY_LINE: &str = "#a0a0a0";

/// The course of one muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    /// The muscle.
    pub name: String,
    /// Whether the course is reliable; otherwise it is grey.
    pub known: bool,
    /// Tension, N per metre of thickness, and the ends of its interval, at each time.
    pub values: Vec<[f64; 3]>,
}

/// Draws courses over common times, s; all panels have the same scale. Times of unreliable frames
/// (`doubtful`, one for each time) are shaded.
pub fn timelines(title: &str, times: &[f64], doubtful: &[bool], courses: &[Timeline]) -> Svg {
    let known: Vec<&str> = courses.iter().filter(|c| c.known).map(|c| c.name.as_str()).collect();
    let told = format!(
        "Tension over time of {} muscles with 95 % intervals; known courses: {}; the others are grey.",
        courses.len(),
        if known.is_empty() { "none".to_owned() } else { known.join(", ") }
    );
    let (mut svg, top) = Svg::new(title, &told, WIDTH);
    let top = top + MARGIN;
    let ends = [times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0)];
    let span = (ends[1] - ends[0]).max(1e-9);
    let right = WIDTH - 2.0 * MARGIN;
    let x = |t: f64| LEFT + (right - LEFT) * (t - ends[0]) / span;
    let most = courses.iter().flat_map(|c| &c.values).map(|v| v[2]).fold(1.0, f64::max);
    let tick = nice(most / 2.0);
    let height = (most / tick).ceil() * tick;
    for (nth, course) in courses.iter().enumerate() {
        let foot = top + (PANEL + GAP) * nth as f64 + PANEL;
        let place = |t: f64, v: f64| -> Px { [x(t), foot - PANEL * (v / height).clamp(0.0, 1.0)] };
        for (i, _) in doubtful.iter().enumerate().filter(|(_, d)| **d) {
            let side =
                |j: Option<usize>| j.and_then(|j| times.get(j)).map_or(times[i], |t| 0.5 * (t + times[i]));
            let (a, b) = (side(i.checked_sub(1)), side(Some(i + 1)));
            svg.rectangle([x(a), foot - PANEL], [x(b).max(x(a) + 1.0), foot], "#fff0e0", None);
        }
        let (band, line) = if course.known { (BAND, LINE) } else { (GREY_BAND, GREY_LINE) };
        let pairs = || times.iter().zip(&course.values);
        let upper = pairs().map(|(t, v)| place(*t, v[2]));
        let lower: Vec<Px> = pairs().map(|(t, v)| place(*t, v[1])).collect();
        svg.fill(&closed([upper.chain(lower.into_iter().rev()).collect::<Vec<_>>()]), band);
        svg.stroke(&data([pairs().map(|(t, v)| place(*t, v[0])).collect::<Vec<_>>()]), line, 2.5);
        svg.line([LEFT, foot], [right, foot], INK, 1.5);
        svg.line([LEFT, foot - PANEL], [LEFT, foot], INK, 1.5);
        for n in 0..=((height / tick).round() as usize) {
            let value = tick * n as f64;
            let at = place(ends[0], value);
            svg.line([at[0] - 6.0, at[1]], at, INK, 1.5);
            // The lowest number of a panel and the highest of the next would overlap.
            if n % 2 == 0 && (n > 0 || nth + 1 == courses.len()) || (n == 0 && height / tick <= 2.0) {
                svg.text(
                    [at[0] - 10.0, at[1].min(foot - 0.3 * TEXT)],
                    Anchor::End,
                    Face::Plain,
                    &format!("{value}"),
                );
            }
        }
        let face = if course.known { Face::Bold } else { Face::Plain };
        svg.text([MARGIN, foot - 0.5 * PANEL], Anchor::Start, face, &course.name);
    }
    let foot = top + (PANEL + GAP) * courses.len() as f64 - GAP;
    let step = nice(span / 5.0);
    let mut at = (ends[0] / step).ceil() * step;
    while at <= ends[1] + 1e-9 {
        svg.line([x(at), foot], [x(at), foot + 6.0], INK, 1.5);
        svg.line([x(at), top], [x(at), foot], RULE, 0.6);
        svg.text(
            [x(at), foot + 22.0],
            Anchor::Middle,
            Face::Plain,
            format!("{at:.3}").trim_end_matches('0').trim_end_matches('.'),
        );
        at += step;
    }
    svg.text(
        [0.5 * (LEFT + right), foot + 56.0],
        Anchor::Middle,
        Face::Plain,
        "time (s); tension in N per metre of thickness",
    );
    svg.finish(foot + 56.0 + TEXT + MARGIN)
}

/// 1, 2 or 5 times a power of ten, near `v`.
fn nice(v: f64) -> f64 {
    let ten = 10f64.powf(v.max(1e-12).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|n| n * ten).into_iter().find(|n| *n >= v * 0.999).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn courses_that_are_not_known_are_grey_and_doubtful_frames_are_shaded() {
        let course = |name: &str, known| Timeline {
            name: name.into(),
            known,
            values: vec![[10.0, 5.0, 20.0], [12.0, 6.0, 31.0], [11.0, 5.0, 22.0]],
        };
        let svg = timelines(
            "a < b",
            &[0.0, 0.1, 0.2],
            &[false, true, false],
            &[course("GGa", true), course("HGp", false)],
        );
        let text = svg.to_string();
        roxmltree::Document::parse(&text).unwrap();
        for (colour, count) in [(LINE, 1), (GREY_LINE, 1), (BAND, 1), (GREY_BAND, 1), ("#fff0e0", 2)] {
            assert_eq!(text.matches(colour).count(), count, "{colour}");
        }
        assert!(text.contains("known courses: GGa;"));
    }

    #[test]
    fn ticks_are_round_numbers() {
        for (v, n) in [(0.3, 0.5), (7.0, 10.0), (20.0, 20.0), (0.11, 0.2)] {
            assert!((nice(v) - n).abs() < 1e-12, "{v}");
        }
    }
}
