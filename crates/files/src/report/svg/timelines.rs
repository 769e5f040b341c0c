//! Tensions over time with their 95 % intervals, a panel for each muscle, and how well what was seen is met.

use std::fmt::Write as _;

use super::{Anchor, Face, INK, MARGIN, Px, RULE, Svg, TEXT, WIDTH, closed, data};
use tongue_input::measured::recording::Label;

const LEFT: f64 = 150.0;
/// Height of a panel and the gap between panels, px.
const PANEL: f64 = 92.0;
const GAP: f64 = 18.0;
const BAND: &str = "#9ecae1";
const LINE: &str = "#08519c";
const GREY_LINE: &str = "#a0a0a0";
const DOUBTFUL: &str = "#fff0e0";
/// Fill of an interval whose course is not known.
const HATCH: &str = "url(#hatch)";
/// Most labels that are drawn: more would hide the courses.
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
    let ends = [times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0)];
    let time = Times { ends, right: WIDTH - 2.0 * MARGIN };
    let legend = legend(&mut svg, top + MARGIN, doubtful.contains(&true), known.len() < courses.len());
    let shown: Vec<&Label> =
        labels.iter().filter(|l| l.tier != "prompt" && l.to_s >= ends[0] && l.from_s <= ends[1]).collect();
    let shown = if shown.len() > MOST_LABELS { &[][..] } else { &shown[..] };
    let top = legend + if shown.is_empty() { 0.0 } else { 30.0 } + MARGIN;
    let rms: Vec<[f64; 3]> = rms_mm.iter().map(|r| [r.unwrap_or(f64::NAN); 3]).collect();
    let has_rms = rms.iter().any(|r| r[0].is_finite());
    let panels = courses.len() + usize::from(has_rms);
    let foot_of = |nth: usize| top + (PANEL + GAP) * nth as f64 + PANEL;
    let foot = foot_of(panels.max(1) - 1);
    for nth in 0..panels {
        shade(&mut svg, &time, times, doubtful, foot_of(nth));
    }
    for label in shown {
        let [a, b] = [label.from_s, label.to_s].map(|t| time.x(t.clamp(ends[0], ends[1])));
        for x in [a, b] {
            svg.dashes(&data([[[x, top - 8.0], [x, foot]]]), "#9a9a9a", 1.0);
        }
        let fits = Face::Plain.width(&label.name) < b - a;
        let name = if fits { label.name.clone() } else { shortened(&label.name, b - a) };
        svg.text([0.5 * (a + b), top - 22.0], Anchor::Middle, Face::Plain, &name);
    }
    for (nth, course) in courses.iter().enumerate() {
        panel(&mut svg, &time, times, course, ["N/m", if course.known { BAND } else { HATCH }], foot_of(nth));
    }
    if has_rms {
        let name = "RMS".to_owned();
        let line = Timeline { name, known: true, values: rms };
        panel(&mut svg, &time, times, &line, ["mm", "none"], foot_of(panels - 1));
    }
    let step = nice((ends[1] - ends[0]).max(1e-9) / 5.0);
    let mut at = (ends[0] / step).ceil() * step;
    while at <= ends[1] + 1e-9 {
        svg.line([time.x(at), foot], [time.x(at), foot + 6.0], INK, 1.5);
        svg.line([time.x(at), top], [time.x(at), foot], RULE, 0.6);
        svg.text(
            [time.x(at), foot + 22.0],
            Anchor::Middle,
            Face::Plain,
            format!("{at:.3}").trim_end_matches('0').trim_end_matches('.'),
        );
        at += step;
    }
    svg.text([0.5 * (LEFT + time.right), foot + 56.0], Anchor::Middle, Face::Plain, "time (s)");
    svg.finish(foot + 56.0 + TEXT + MARGIN)
}

struct Times {
    ends: [f64; 2],
    right: f64,
}

impl Times {
    fn x(&self, t: f64) -> f64 {
        LEFT + (self.right - LEFT) * (t - self.ends[0]) / (self.ends[1] - self.ends[0]).max(1e-9)
    }
}

/// Draws the legend from `top` on and returns its lower edge, px.
fn legend(svg: &mut Svg, top: f64, doubtful: bool, unknown: bool) -> f64 {
    const SAMPLE: f64 = 40.0;
    let mut at: Px = [LEFT, top + 0.5 * TEXT];
    let mut entry = |svg: &mut Svg, fill: &str, line: Option<&str>, name: &str| {
        let width = SAMPLE + 8.0 + Face::Plain.width(name) + 24.0;
        if at[0] + width > WIDTH - MARGIN && at[0] > LEFT {
            at = [LEFT, at[1] + 1.5 * TEXT];
        }
        if fill != "none" {
            svg.rectangle([at[0], at[1] - 10.0], [at[0] + SAMPLE, at[1] + 10.0], fill, None);
        }
        if let Some(line) = line {
            svg.line(at, [at[0] + SAMPLE, at[1]], line, 2.5);
        }
        svg.text([at[0] + SAMPLE + 8.0, at[1]], Anchor::Start, Face::Plain, name);
        at[0] += width;
    };
    entry(svg, BAND, Some(LINE), "median tension, 95 % interval");
    if unknown {
        entry(svg, HATCH, Some(GREY_LINE), "course not known");
    }
    if doubtful {
        entry(svg, DOUBTFUL, None, "frame not trusted");
    }
    at[1] + TEXT
}

fn shade(svg: &mut Svg, time: &Times, times: &[f64], doubtful: &[bool], foot: f64) {
    for (i, _) in doubtful.iter().enumerate().filter(|(_, d)| **d) {
        let side = |j: Option<usize>| j.and_then(|j| times.get(j)).map_or(times[i], |t| 0.5 * (t + times[i]));
        let (a, b) = (time.x(side(i.checked_sub(1))), time.x(side(Some(i + 1))));
        svg.rectangle([a, foot - PANEL], [b.max(a + 1.0), foot], DOUBTFUL, None);
    }
}

/// One panel with its own scale; times without a number are left out.
fn panel(svg: &mut Svg, time: &Times, times: &[f64], course: &Timeline, [unit, band]: [&str; 2], foot: f64) {
    let seen = |v: &&[f64; 3]| v.iter().all(|x| x.is_finite());
    let most = course.values.iter().filter(seen).map(|v| v[2]).fold(f64::MIN_POSITIVE, f64::max);
    let tick = nice(most / 2.0);
    let height = (most / tick).ceil() * tick;
    let place = |t: f64, v: f64| -> Px { [time.x(t), foot - PANEL * (v / height).clamp(0.0, 1.0)] };
    let pairs: Vec<(f64, [f64; 3])> = times.iter().copied().zip(course.values.iter().copied()).collect();
    for run in pairs.split(|(_, v)| !v.iter().all(|x| x.is_finite())).filter(|run| !run.is_empty()) {
        if band != "none" {
            let upper = run.iter().map(|(t, v)| place(*t, v[2]));
            let lower: Vec<Px> = run.iter().map(|(t, v)| place(*t, v[1])).collect();
            svg.fill(&closed([upper.chain(lower.into_iter().rev()).collect::<Vec<_>>()]), band);
        }
        let line = if course.known { LINE } else { GREY_LINE };
        svg.stroke(&data([run.iter().map(|(t, v)| place(*t, v[0])).collect::<Vec<_>>()]), line, 2.5);
    }
    svg.line([LEFT, foot], [time.right, foot], INK, 1.5);
    svg.line([LEFT, foot - PANEL], [LEFT, foot], INK, 1.5);
    for n in 0..=((height / tick).round() as usize) {
        let at = place(time.ends[0], tick * n as f64);
        svg.line([at[0] - 6.0, at[1]], at, INK, 1.5);
        let mut value = String::new();
        let _ = write!(value, "{}", (tick * n as f64 * 1e6).round() / 1e6);
        svg.text([at[0] - 10.0, at[1].min(foot - 0.3 * TEXT)], Anchor::End, Face::Plain, &value);
    }
    let face = if course.known { Face::Bold } else { Face::Plain };
    svg.text([MARGIN, foot - 0.5 * PANEL - 0.6 * TEXT], Anchor::Start, face, &course.name);
    svg.text([MARGIN, foot - 0.5 * PANEL + 0.6 * TEXT], Anchor::Start, Face::Plain, unit);
}

/// As much of a name as fits into a width, px.
fn shortened(name: &str, width: f64) -> String {
    let letters = (width / Face::Plain.width("m")) as usize;
    match letters {
        0 | 1 => String::new(),
        _ => name.chars().take(letters - 1).chain(['\u{2026}']).collect(),
    }
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

    #[test]
    fn ticks_are_round_numbers() {
        for (v, n) in [(0.3, 0.5), (7.0, 10.0), (20.0, 20.0), (0.11, 0.2)] {
            assert!((nice(v) - n).abs() < 1e-12, "{v}");
        }
    }
}
