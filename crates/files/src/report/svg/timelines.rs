//! Tensions over time with their 95 % intervals, a panel for each muscle, and how well what was seen is met.

use super::plot::{Axis, Plot, around};
use super::{Anchor, Entry, Face, MARGIN, Svg, TEXT, WIDTH, closed};
use tongue_input::measured::recording::Label;

const LEFT: f64 = 150.0;
/// Height of a panel and the gap between panels, px.
const PANEL: f64 = 92.0;
const GAP: f64 = 28.0;
const BAND: &str = "#9ecae1";
const LINE: &str = "#08519c";
const GREY_LINE: &str = "#a0a0a0";
const DOUBTFUL: &str = "#fff0e0";
/// Fill of an interval whose course is not known.
const HATCH: &str = "url(#hatch)";
const MOST_LABELS: usize = 60;

#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    pub name: String,
    /// Whether the course is reliable; otherwise its interval is hatched.
    pub known: bool,
    /// Tension, N per metre of thickness, and the ends of its interval, at each time.
    pub values: Vec<[f64; 3]>,
}

/// Draws courses over common times, s, each on a scale of its own. Times of unreliable frames (`doubtful`) are shaded; below stands the
/// distance of what was seen from what was simulated, mm, above the labels of every tier but the prompt, which is that of a whole recording.
pub fn timelines(
    title: &str,
    times: &[f64],
    doubtful: &[bool],
    rms_mm: &[Option<f64>],
    labels: &[Label],
    courses: &[Timeline],
) -> Svg {
    let known: Vec<&str> = courses.iter().filter(|c| c.known).map(|c| c.name.as_str()).collect();
    let told = format!(
        "Tension over time of {} muscles with 95 % intervals; known courses: {}; the others are hatched.",
        courses.len(),
        if known.is_empty() { "none".to_owned() } else { known.join(", ") }
    );
    let (mut svg, top) = Svg::new(title, &told, WIDTH);
    svg.elements += "<defs><pattern id=\"hatch\" width=\"9\" height=\"9\" patternUnits=\"userSpaceOnUse\" \
        patternTransform=\"rotate(45)\"><rect width=\"9\" height=\"9\" fill=\"#f7f7f7\"/>\
        <line x1=\"0\" y1=\"0\" x2=\"0\" y2=\"9\" stroke=\"#bdbdbd\" stroke-width=\"3\"/></pattern></defs>\n";
    let entry = |fill: &'static str, line: &'static str, name: &'static str| {
        Entry::new(48.0, name, move |svg, [x, y]| {
            svg.rectangle([x, y - 10.0], [x + 40.0, y + 10.0], fill, None);
            svg.line([x, y], [x + 40.0, y], line, 2.5);
        })
    };
    let entries = [
        Some(entry(BAND, LINE, "median tension, 95 % interval")),
        (known.len() < courses.len()).then(|| entry(HATCH, GREY_LINE, "course not known")),
        doubtful.contains(&true).then(|| entry(DOUBTFUL, "none", "frame not trusted")),
    ];
    let top = top + MARGIN;
    let top = top + svg.legend(entries.into_iter().flatten(), [LEFT, WIDTH - MARGIN], top);
    let first = times.first().copied().unwrap_or(0.0);
    let ends = [first, times.last().copied().unwrap_or(1.0).max(first + 1e-9)];
    let shown: Vec<&Label> =
        labels.iter().filter(|l| l.tier != "prompt" && l.to_s >= ends[0] && l.from_s <= ends[1]).collect();
    let shown = if shown.len() > MOST_LABELS { &[][..] } else { &shown[..] };
    let top = top + if shown.is_empty() { 0.0 } else { 30.0 } + MARGIN;
    let rms = Timeline {
        name: "RMS".to_owned(),
        known: true,
        values: rms_mm.iter().map(|r| [r.unwrap_or(f64::NAN); 3]).collect(),
    };
    let has_rms = rms.values.iter().any(|r| r[0].is_finite());
    let panels: Vec<&Timeline> = courses.iter().chain(has_rms.then_some(&rms)).collect();
    let foot = top + (PANEL + GAP) * panels.len().max(1) as f64 - GAP;
    let x = |time: f64| LEFT + (WIDTH - 2.0 * MARGIN - LEFT) * (time - ends[0]) / (ends[1] - ends[0]);
    for label in shown {
        let [a, b] = [label.from_s, label.to_s].map(|t| x(t.clamp(ends[0], ends[1])));
        for x in [a, b] {
            svg.dashes(&super::data([[[x, top - 8.0], [x, foot]]]), "#9a9a9a", 1.0);
        }
        let fits = Face::Plain.width(&label.name) < b - a;
        let name = if fits { label.name.clone() } else { shortened(&label.name, b - a) };
        svg.text([0.5 * (a + b), top - 22.0], Anchor::Middle, Face::Plain, &name);
    }
    for (nth, course) in panels.iter().enumerate() {
        let is_finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
        let most = course.values.iter().filter(|v| is_finite(v)).map(|v| v[2]).fold(1e-3, f64::max);
        let plot = Plot::linear(
            [LEFT, top + (PANEL + GAP) * nth as f64],
            [x(ends[1]) - LEFT, PANEL],
            ends,
            around(0.0, most),
        );
        for i in (0..times.len()).filter(|i| doubtful.get(*i) == Some(&true)) {
            let side =
                |j: Option<usize>| j.and_then(|j| times.get(j)).map_or(times[i], |t| 0.5 * (t + times[i]));
            let [a, b] = [side(i.checked_sub(1)), side(Some(i + 1))];
            plot.rectangle(&mut svg, [[a, plot.y[0]], [b, plot.y[1]]], DOUBTFUL, None);
        }
        let is_rms = nth == courses.len();
        let (band, line) = if course.known { (BAND, LINE) } else { (HATCH, GREY_LINE) };
        let pairs: Vec<(f64, [f64; 3])> = times.iter().copied().zip(course.values.iter().copied()).collect();
        for run in pairs.split(|(_, v)| !is_finite(v)).filter(|run| !run.is_empty()) {
            let along = |end: usize| run.iter().map(move |(t, v)| [*t, v[end]]);
            if !is_rms {
                let outline = along(2).chain(along(1).rev()).map(|[t, v]| plot.place(t, v));
                svg.fill(&closed([outline]), band);
            }
            svg.stroke(&plot.path(along(0)), line, 2.5);
        }
        let is_last = nth + 1 == panels.len();
        plot.axes(&mut svg, [if is_last { Axis::Named("time (s)") } else { Axis::Lines }, Axis::Numbers]);
        let middle = plot.corner[1] + 0.5 * PANEL;
        let face = if course.known { Face::Bold } else { Face::Plain };
        svg.text([MARGIN, middle - 0.6 * TEXT], Anchor::Start, face, &course.name);
        svg.text(
            [MARGIN, middle + 0.6 * TEXT],
            Anchor::Start,
            Face::Plain,
            if is_rms { "mm" } else { "N/m" },
        );
    }
    svg.finish(foot + 56.0 + TEXT + MARGIN)
}

/// As much of a name as fits into a width, px.
fn shortened(name: &str, width: f64) -> String {
    let letters = (width / Face::Plain.width("m")) as usize;
    match letters {
        0 | 1 => String::new(),
        _ => name.chars().take(letters - 1).chain(['\u{2026}']).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_courses_are_hatched_and_doubtful_frames_and_labels_are_drawn() {
        let course = |name: &str, known| Timeline {
            name: name.into(),
            known,
            values: vec![[10.0, 5.0, 20.0], [12.0, 6.0, 31.0], [11.0, 5.0, 22.0]],
        };
        let label = Label { tier: "t".into(), name: "a<".into(), from_s: 0.0, to_s: 0.1 };
        let (times, courses) = ([0.0, 0.1, 0.2], [course("GGa", true), course("HGp", false)]);
        let text = timelines(
            "a < b",
            &times,
            &[false, true, false],
            &[Some(0.4), None, Some(0.6)],
            &[label],
            &courses,
        )
        .to_string();
        let document = roxmltree::Document::parse(&text).unwrap();
        let texts: Vec<&str> = document.descendants().filter_map(|n| n.text()).collect();
        for told in ["a<", "N/m", "mm", "RMS", "time (s)", "course not known", "frame not trusted"] {
            assert!(texts.iter().any(|t| t.trim() == told), "{told}: {texts:?}");
        }
        let filled = |fill: &str, name: &str| {
            let is = |n: &roxmltree::Node<'_, '_>| {
                n.tag_name().name() == name && n.attribute("fill") == Some(fill)
            };
            document.descendants().filter(is).count()
        };
        assert_eq!((filled(BAND, "path"), filled(HATCH, "path")), (1, 1));
        assert_eq!(filled(DOUBTFUL, "rect"), 1 + 3, "a sample, and a stripe in each panel");
        assert!(text.contains("known courses: GGa;"));
        let plain = timelines("a", &times, &[], &[], &[], &courses[..1]).to_string();
        assert!(!plain.contains("not trusted") && !plain.contains("RMS"));
    }
}
