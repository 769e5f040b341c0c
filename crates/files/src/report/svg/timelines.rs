//! Tensions over time with their 95 % intervals, a panel for each muscle, and the distance of measured from simulated points.

use super::plot::{Axis, Plot, round_range};
use super::{Anchor, FontFace, Legend, MARGIN, Svg, TEXT, WIDTH, closed_paths};
use crate::report::{RecordingResult, names_or_none};
use tongue_infer::track::CourseSummary;

const LEFT: f64 = 150.0;
/// Height of a panel, and gap between panels, px.
const PANEL: f64 = 92.0;
const GAP: f64 = 28.0;
const BAND: &str = "#9ecae1";
const LINE: &str = "#08519c";
const GREY_LINE: &str = "#a0a0a0";
const DOUBTFUL: &str = "#fff0e0";
const HATCH: &str = "url(#hatch)";

/// Name, unit, whether the course is known (otherwise the interval is hatched), and at each time value and ends of the interval.
struct TimelinePanel<'a>(&'a str, &'static str, bool, Vec<[f64; 3]>);

/// Draws the tensions of a recording, each on its own scale, and below them the distance of measured from simulated points, mm. Frames that
/// cannot be trusted are shaded. Labels stand above, except those of the prompt, which belongs to a whole recording.
pub fn timelines(one: &RecordingResult, courses: &[CourseSummary]) -> Svg {
    let frames = &one.tracked.frames;
    let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
    let known: Vec<&str> = courses.iter().filter(|c| c.known).map(|c| c.muscle.as_str()).collect();
    let (count, names) = (courses.len(), names_or_none(&known));
    let what = format!("Tension over time of {count} muscles with 95 % intervals");
    let summary = format!("{what}; known courses: {names}; the others are hatched.");
    let (mut svg, top) = Svg::new(&one.seen.name, &summary, WIDTH);
    svg.elements += "<defs><pattern id=\"hatch\" width=\"9\" height=\"9\" patternUnits=\"userSpaceOnUse\" \
        patternTransform=\"rotate(45)\"><rect width=\"9\" height=\"9\" fill=\"#f7f7f7\"/>\
        <line x1=\"0\" y1=\"0\" x2=\"0\" y2=\"9\" stroke=\"#bdbdbd\" stroke-width=\"3\"/></pattern></defs>\n";
    let top = top + MARGIN;
    let mut legend = Legend::new([LEFT, WIDTH - MARGIN], top);
    for (is_there, fill, line, name) in [
        (true, BAND, LINE, "median tension, 95 % interval"),
        (known.len() < courses.len(), HATCH, GREY_LINE, "course not known"),
        (frames.iter().any(|f| !f.status.is_trusted()), DOUBTFUL, "none", "frame not trusted"),
    ] {
        if is_there {
            legend.entry(&mut svg, 48.0, name, |svg, [x, y]| {
                svg.rectangle([x, y - 10.0], [x + 40.0, y + 10.0], fill, None);
                svg.line([x, y], [x + 40.0, y], line, 2.5);
            });
        }
    }
    let top = top + legend.height();
    let first = times.first().copied().unwrap_or(0.0);
    let ends = [first, times.last().copied().unwrap_or(1.0).max(first + 1e-9)];
    let shown = one.shown_labels();
    let top = top + if shown.is_empty() { 0.0 } else { 30.0 } + MARGIN;
    let mut panels: Vec<TimelinePanel<'_>> = Vec::new();
    for (i, course) in courses.iter().enumerate() {
        let values = frames.iter().map(|f| [f.tensions[i].median, f.tensions[i].low, f.tensions[i].high]);
        panels.push(TimelinePanel(&course.muscle, "N/m", course.known, values.collect()));
    }
    if frames.iter().any(|f| f.rms_m.is_some()) {
        let values = frames.iter().map(|f| [f.rms_m.map_or(f64::NAN, |r| 1e3 * r); 3]);
        panels.push(TimelinePanel("RMS", "mm", true, values.collect()));
    }
    let foot = top + (PANEL + GAP) * panels.len().max(1) as f64 - GAP;
    let x = |time: f64| LEFT + (WIDTH - 2.0 * MARGIN - LEFT) * (time - ends[0]) / (ends[1] - ends[0]);
    for label in shown {
        let [a, b] = [label.from_s, label.to_s].map(|t| x(t.clamp(ends[0], ends[1])));
        for x in [a, b] {
            svg.dashes(&super::data([[[x, top - 8.0], [x, foot]]]), "#9a9a9a", 1.0);
        }
        let name = shorten(&label.name, b - a);
        svg.text([0.5 * (a + b), top - 22.0], Anchor::Middle, FontFace::Plain, &name);
    }
    for (nth, TimelinePanel(name, unit, is_known, values)) in panels.iter().enumerate() {
        let most =
            values.iter().filter(|v| v.iter().all(|x| x.is_finite())).map(|v| v[2]).fold(1e-3, f64::max);
        let (corner, size) = ([LEFT, top + (PANEL + GAP) * nth as f64], [x(ends[1]) - LEFT, PANEL]);
        let plot = Plot::linear(corner, size, ends, round_range(0.0, most));
        for i in (0..times.len()).filter(|i| !frames[*i].status.is_trusted()) {
            let neighbours = [i.checked_sub(1).map(|before| times[before]), times.get(i + 1).copied()];
            let [a, b] = neighbours.map(|other| other.map_or(times[i], |t| 0.5 * (t + times[i])));
            plot.rectangle(&mut svg, [[a, plot.y[0]], [b, plot.y[1]]], DOUBTFUL, None);
        }
        let is_rms = nth == courses.len();
        let (band, line) = if *is_known { (BAND, LINE) } else { (HATCH, GREY_LINE) };
        let pairs: Vec<(f64, [f64; 3])> = times.iter().copied().zip(values.iter().copied()).collect();
        for run in pairs.split(|(_, v)| !v.iter().all(|x| x.is_finite())).filter(|run| !run.is_empty()) {
            let along = |end: usize| run.iter().map(move |(t, v)| [*t, v[end]]);
            if !is_rms {
                let outline = along(2).chain(along(1).rev()).map(|[t, v]| plot.place(t, v));
                svg.fill(&closed_paths([outline]), band);
            }
            svg.stroke(&plot.path(along(0)), line, 2.5);
        }
        let is_last = nth + 1 == panels.len();
        plot.axes(&mut svg, [if is_last { Axis::Named("time (s)") } else { Axis::Lines }, Axis::Numbers]);
        let middle = plot.corner[1] + 0.5 * PANEL;
        let face = if *is_known { FontFace::Bold } else { FontFace::Plain };
        svg.text([MARGIN, middle - 0.6 * TEXT], Anchor::Start, face, name);
        svg.text([MARGIN, middle + 0.6 * TEXT], Anchor::Start, FontFace::Plain, unit);
    }
    svg.finish(foot + 56.0 + TEXT + MARGIN)
}

/// As much of a name as fits into a width, px.
fn shorten(name: &str, width: f64) -> String {
    let letters = (width / FontFace::Plain.width("m")) as usize;
    match letters {
        _ if FontFace::Plain.width(name) < width => name.to_owned(),
        0 | 1 => String::new(),
        _ => name.chars().take(letters - 1).chain(['\u{2026}']).collect(),
    }
}
