//! A vowel: the tongue in its vocal tract, the vowel chart, the areas and the transfer function.

use super::axes::{BELOW, Bounds, LEFT, PlotView};
use super::body_view::{BodyView, DEFORMED, REST_TISSUE};
use super::plot::{Axis, Plot, round_range};
use super::{Anchor, FontFace, INK, MARGIN, RULE, Svg, TEXT, WIDTH, data};
use crate::report::{AreaRow, ReportError, SoundRecord, joined};
use tongue_core::body::Mesh;
use tongue_core::geometry::Point;
use tongue_infer::acoustics::MeanVowel;

const WALL: &str = "#a04000";
const ACCENT: &str = "#08519c";
const MEAN: &str = "#777777";
const LOWER: f64 = 250.0;
const CHART: f64 = 330.0;

/// Draws a body in the plane with its sound, beside published means of vowels. Positions are those of all nodes, m.
pub fn vowel(
    mesh: &Mesh<2>,
    positions: &[Point],
    sound: &SoundRecord,
    means: &[MeanVowel],
    title: &str,
) -> Result<Svg, ReportError> {
    super::check(mesh, positions, &vec![0.0; mesh.muscles.len()])?;
    let formants = (1..).zip(sound.formants_hz.iter().zip(&sound.bandwidths_hz));
    let formants = formants.map(|(n, (f, b))| format!("F{n} {f:.0} Hz (bandwidth {b:.0} Hz)"));
    let (length, formants) = (sound.tract_length_mm, joined(formants, ", "));
    let description = format!("A tongue in its vocal tract, {length:.0} mm long. Formants: {formants}.");
    let (mut svg, top) = Svg::new(title, &description, WIDTH);
    let top = top + MARGIN;
    let below = tract(&mut svg, (mesh, positions), sound, top).max(chart(&mut svg, sound, means, top));
    let below = below + 2.0 * MARGIN;
    areas(&mut svg, &sound.area_function, below);
    let lower = below + LOWER + BELOW;
    transfer(&mut svg, sound, lower);
    Ok(svg.finish(lower + LOWER + BELOW))
}

/// Draws the midsagittal section; returns its lower end, px.
fn tract(svg: &mut Svg, (mesh, positions): (&Mesh<2>, &[Point]), sound: &SoundRecord, top: f64) -> f64 {
    let across = sound.across_mm.iter();
    let across = across.map(|ends| ends.map(|[x, y]| Point::from([1e-3 * x, 1e-3 * y])).into());
    let (outer, inner): (Vec<Point>, Vec<Point>) = across.unzip();
    let bounds = Bounds::of_points(outer.iter().chain(&inner).chain(positions)).outwards(0.003, 0.01);
    let view = PlotView::new(bounds, [LEFT, top], 0.5 * WIDTH - LEFT - MARGIN);
    let tissue = BodyView::in_view(mesh, view).outline(positions);
    svg.fill(&tissue, REST_TISSUE);
    for (o, i) in outer.iter().zip(&inner) {
        svg.line(view.place(o), view.place(i), RULE, 1.0);
    }
    svg.stroke(&tissue, DEFORMED, 2.6);
    for (wall, colour, width) in [(inner, ACCENT, 2.0), (outer, WALL, 3.0)] {
        svg.stroke(&data([Vec::from_iter(wall.iter().map(|p| view.place(p)))]), colour, width);
    }
    view.axes(svg, ["front \u{2190} x (mm) \u{2192} back", "y (mm)"]);
    view.end()[1] + BELOW
}

/// Draws the first formant against the second one with the axes of phonetics; returns the lower end, px.
fn chart(svg: &mut Svg, sound: &SoundRecord, means: &[MeanVowel], top: f64) -> f64 {
    let heard = [0, 1].map(|i| sound.formants_hz.get(i).copied().unwrap_or(0.0));
    let all = means.iter().map(|m| [m.f1_hz, m.f2_hz]).chain([heard]);
    let (corner, width) = ([0.5 * WIDTH + LEFT + MARGIN, top], 0.5 * WIDTH - LEFT - 3.0 * MARGIN);
    let most_f2 = round_range(600.0, all.clone().map(|f| f[1]).fold(2400.0, f64::max))[1];
    let most_f1 = round_range(200.0, all.map(|f| f[0]).fold(900.0, f64::max))[1];
    let plot = Plot::linear(corner, [width, CHART], [most_f2, 600.0], [most_f1, 200.0]);
    plot.axes(svg, ["F2 (Hz)", "F1 (Hz)"].map(Axis::Named));
    for MeanVowel { vowel, f1_hz: f1, f2_hz: f2 } in means {
        svg.text(plot.place(*f2, *f1), Anchor::Middle, FontFace::Plain, vowel);
    }
    svg.dot(plot.place(heard[1], heard[0]), 9.0, ACCENT, ACCENT);
    let foot = top + CHART + BELOW;
    let left = plot.corner[0] - LEFT + MARGIN;
    svg.dot([left + 9.0, foot], 9.0, ACCENT, ACCENT);
    svg.text([left + 28.0, foot], Anchor::Start, FontFace::Plain, "heard here");
    if !means.is_empty() {
        let note = "letters: published means of men";
        svg.text([left, foot + 1.4 * TEXT], Anchor::Start, FontFace::Plain, note);
    }
    foot + 2.2 * TEXT
}

fn wide(top: f64, x: [f64; 2], y: [f64; 2]) -> Plot {
    let (corner, size) = ([LEFT + MARGIN, top], [WIDTH - LEFT - 3.0 * MARGIN, LOWER]);
    Plot::linear(corner, size, x, y)
}

fn areas(svg: &mut Svg, rows: &[AreaRow], top: f64) {
    let end = |r: &AreaRow| r.from_glottis_mm + 0.5 * r.length_mm;
    let most = rows.iter().map(|r| r.area_cm2).fold(1.0, f64::max);
    let plot = wide(top, [0.0, rows.last().map_or(1.0, end)], round_range(0.0, most));
    let names = ["glottis \u{2190} along the tract (mm) \u{2192} lips", "area (cm²)"];
    plot.axes(svg, names.map(Axis::Named));
    let steps = rows.iter().flat_map(|r| [[end(r) - r.length_mm, r.area_cm2], [end(r), r.area_cm2]]);
    svg.stroke(&plot.path(steps), ACCENT, 2.5);
}

fn transfer(svg: &mut Svg, sound: &SoundRecord, top: f64) {
    let levels = sound.transfer_db.iter().map(|p| p[1]).filter(|v| v.is_finite());
    let (low, high) = levels.fold((0.0_f64, 10.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let plot = wide(top, [0.0, sound.transfer_db.last().map_or(1.0, |p| p[0])], round_range(low, high));
    plot.axes(svg, ["frequency (Hz)", "level (dB)"].map(Axis::Named));
    for f in sound.formants_hz.iter().filter(|f| **f <= plot.x[1]) {
        svg.dashes(&plot.upright(*f), MEAN, 1.5);
    }
    svg.stroke(&plot.path(sound.transfer_db.iter().copied()), INK, 2.5);
}
