//! Plausibility of a whole recording: its unit, its rate, exchanged channels, frames out of order.
//!
//! Faults that make an answer worthless are refused with advice; all others are reported and left to the
//! user.

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::statistics::upper_median;

use super::AlignedRecording;
use super::coils::of_coils;
use super::doubt::{Doubt, exchanged_axes};
use super::dynamics::{FEW, of_courses};
use super::map::WITHOUT_BONES;

/// Usual range of the time between frames, s. Times outside it are reported; far outside they are refused.
const USUAL_STEP_S: [f64; 2] = [1.99e-3, 0.2];
const LAST_STEP_S: [f64; 2] = [1e-4, 10.0];
/// Range of the distance between mental spine and hyoid of adults, m, with a margin.
const BONES_M: [f64; 2] = [20e-3, 75e-3];
/// Range of the width of the middle half of a contour and of the distance of neighbouring coils, m.
const CONTOUR_M: [f64; 2] = [10e-3, 200e-3];
const GAP_M: [f64; 2] = [4e-3, 50e-3];
/// A point farther than this from the middle of the others is not on the head, m.
const FAR_M: f64 = 0.15;
/// A contour longer than this factor times the path from neighbour to neighbour is out of order.
const LONGER: f64 = 1.6;

/// A contour that is on average this far below the line of its ends is upside down, m.
const HOLLOW_M: f64 = 5e-3;

/// A contour reaches no farther above the line from the mental spine to the hyoid than the first number times their
/// distance and than the second one times its own length: 1.1 to 1.5 and 0.50 to 0.57 in most bodies. A hyoid near
/// the jaw raises the first alone, a root that is not seen the second alone.
const HIGHEST: [f64; 2] = [1.7, 0.66];
/// Both ends of a contour are not as far above this line, over the distance of the two: the lower end, and the mean of both. It is 0.2
/// and 0.4 in most recordings, and 0.6 and 0.7 to 0.8 where the contour is 15 mm too high.
const HIGHEST_ENDS: [f64; 2] = [0.42, 0.7];

/// All doubts about a recording.
pub fn doubts(seen: &AlignedRecording) -> Vec<Doubt> {
    let middles = Middles::of(seen);
    let mut out = Vec::new();
    out.extend(of_times(seen));
    let usual_step = out.is_empty();
    out.extend(of_labels(seen));
    out.extend(few_points(seen));
    out.extend(of_size(seen, &middles));
    out.extend(far_points(seen, &middles));
    // A shape of the wrong size is not judged further.
    if out.iter().all(|d| !d.refused) {
        out.extend(of_order(seen, &middles));
        out.extend(of_coils(seen, &middles.sensors));
        out.extend(spike(seen, &middles));
        out.extend(of_courses(seen, usual_step));
    }
    out
}

/// How far a line is on average below that of its ends, m; `None` for fewer than two points.
fn sag(line: &[Point]) -> Option<f64> {
    let (first, last) = (line.first()?, line.last()?);
    let along = if first.x <= last.x { last - first } else { first - last };
    let below = line.iter().map(|p| along.perp(&(first - p)) / along.norm());
    Some(below.sum::<f64>() / line.len() as f64).filter(|m| m.is_finite())
}

/// The doubt about a palate (m, in the frame of the recording) for this recording.
pub fn palate_doubt(seen: &AlignedRecording, palate: &[Point]) -> Option<Doubt> {
    /// A palate that is on average this far below the line of its ends is upside down, m.
    const SAG_M: f64 = 2e-3;
    /// Largest plausible height of a palate above the highest points, m: of a posture, and of speech, which
    /// touches it.
    const HIGHEST_M: f64 = 60e-3;
    const NEAREST_M: f64 = 20e-3;
    /// Largest plausible part of the points beyond it.
    const BEYOND: f64 = 0.2;
    let sag = sag(palate).unwrap_or(0.0);
    if palate.len() >= 3 && sag > SAG_M {
        let mm = sag * 1e3;
        return Some(Doubt::refused(format!(
            "the palate sags by {mm:.0} mm below the line of its ends: it is upside down; change the sign of its y_mm"
        )));
    }
    let points = || seen.frames.iter().flat_map(|f| f.contour.iter().chain(&f.sensors).flatten());
    let below: Vec<f64> = points().filter_map(|m| super::outliers::above(palate, m.at)).collect();
    if below.is_empty() && points().next().is_some() {
        let help = "give it in the frame and the unit of the recording (millimetres)";
        return Some(Doubt::refused(format!("no point of the tongue lies under the palate; {help}")));
    }
    let beyond = below.iter().filter(|by| **by > 3e-3).count();
    if beyond as f64 > BEYOND * below.len() as f64 {
        let percent = 100.0 * beyond as f64 / below.len() as f64;
        return Some(Doubt::refused(format!(
            "{percent:.0} % of the points lie beyond the palate; give it in the frame and the unit of the recording, from front to back"
        )));
    }
    let nearest = below.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
    let limit = if seen.frames.len() < FEW { HIGHEST_M } else { NEAREST_M };
    (nearest < -limit).then(|| Doubt {
        said: format!(
            "the palate lies {:.0} mm above the highest point of the tongue; give it in the frame and the unit of the recording",
            -nearest * 1e3
        ),
        refused: nearest < -HIGHEST_M,
    })
}

/// The first of these recordings whose tongue is of another size than that of the first, with the doubt whether
/// it is of the same speaker.
pub fn other_size(seen: &[&AlignedRecording]) -> Option<(usize, Doubt)> {
    /// Smallest ratio of sizes that is reported: distances of bones and coils vary by a tenth in speech.
    const RATIO: f64 = 1.18;
    // The lengths of the contour and between the bones, or of the chain of coils.
    let sizes = |one: &AlignedRecording| -> Option<[f64; 2]> {
        let middles = Middles::of(one);
        let length = |points: &[Option<Point>]| -> Option<f64> {
            let all = points.iter().copied().collect::<Option<Vec<Point>>>()?;
            Some(all.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>()).filter(|m| *m > 0.0)
        };
        let bones = middles.bone(one, MANDIBLE).zip(middles.bone(one, HYOID));
        match length(&middles.contour) {
            Some(contour) => Some([contour, bones.map(|(a, b)| (a - b).norm())?]),
            None => length(&middles.sensors).map(|m| [m, m]),
        }
    };
    let (first, others) = seen.split_first()?;
    let [of_first, bones] = sizes(first)?;
    others.iter().enumerate().find_map(|(n, other)| {
        let alike = first.contour == other.contour && first.sensors.len() == other.sensors.len();
        let [contour, apart] = sizes(other).filter(|_| alike)?;
        let (a, b) = (contour / of_first, apart / bones);
        (a.min(b) > RATIO || a.max(b) < 1.0 / RATIO).then(|| {
            let said = format!(
                "its tongue is {:.2} times as large as that of {}, as if it were of another speaker; each speaker needs a body of his or \
                 her own, so track them apart",
                (a * b).sqrt(),
                first.name
            );
            (n + 1, Doubt::told(said))
        })
    })
}

/// Median positions of all channels, m.
struct Middles {
    contour: Vec<Option<Point>>,
    sensors: Vec<Option<Point>>,
    bones: Vec<Option<Point>>,
}

impl Middles {
    fn of(seen: &AlignedRecording) -> Self {
        let frames = &seen.frames;
        let marks = |n: usize, of: &dyn Fn(usize, usize) -> Option<Point>| -> Vec<Option<Point>> {
            (0..n).map(|c| middle((0..frames.len()).filter_map(|f| of(f, c)))).collect()
        };
        Self {
            contour: marks(seen.contour.len(), &|f, c| frames[f].contour[c].map(|m| m.at)),
            sensors: marks(seen.sensors.len(), &|f, c| frames[f].sensors[c].map(|m| m.at)),
            bones: marks(seen.bones.len(), &|f, c| frames[f].bones[c]),
        }
    }

    fn bone(&self, seen: &AlignedRecording, name: &str) -> Option<Point> {
        self.bones[seen.bone(name)?]
    }
}

fn middle(points: impl Iterator<Item = Point>) -> Option<Point> {
    let all: Vec<Point> = points.collect();
    let of = |axis: usize| upper_median(all.iter().map(|p| p[axis]));
    Some(Point::new(of(0)?, of(1)?))
}

/// A time in milliseconds or seconds, for messages.
fn span(s: f64) -> String {
    match s {
        ..1e-5 => format!("{:.1e} ms", s * 1e3),
        ..1.0 => format!("{:.3} ms", s * 1e3).replace(".000", ""),
        _ => format!("{s:.1} s"),
    }
}

fn of_times(seen: &AlignedRecording) -> Option<Doubt> {
    let steps = seen.frames.windows(2).map(|w| w[1].time_s - w[0].time_s);
    let step = upper_median(steps)?;
    let what = format!("its frames are {} apart", span(step));
    let help = "correct rate_hz in the map, or the times, which are in seconds";
    if !step.is_finite() || !(LAST_STEP_S[0]..=LAST_STEP_S[1]).contains(&step) {
        return Some(Doubt::refused(format!("{what}, which is implausible for speech; {help}")));
    }
    let usual = (USUAL_STEP_S[0]..=USUAL_STEP_S[1]).contains(&step);
    (!usual).then(|| Doubt::told(format!("{what}, where 2 to 200 ms are usual; if that is wrong, {help}")))
}

/// Labels of which none lies within the recording.
fn of_labels(seen: &AlignedRecording) -> Option<Doubt> {
    let (first, last) = (seen.frames.first()?.time_s, seen.frames.last()?.time_s);
    let (label, others) = seen.labels.split_first()?;
    let ends = others.iter().fold([label.from_s, label.to_s], |[a, b], l| [a.min(l.from_s), b.max(l.to_s)]);
    let apart = seen.labels.iter().all(|l| l.to_s < first || l.from_s > last);
    apart.then(|| {
        Doubt::told(format!(
            "its labels lie at {:.3} to {:.3} s and its frames at {first:.3} to {last:.3} s, so none is used; give both the same clock",
            ends[0], ends[1]
        ))
    })
}

fn few_points(seen: &AlignedRecording) -> Option<Doubt> {
    let most = seen.frames.iter().map(|f| f.contour.iter().chain(&f.sensors).flatten().count()).max()?;
    let one = if seen.contour.is_empty() { "coil" } else { "point" };
    match most {
        0 => Some(Doubt::refused("no point of the tongue is seen in any frame; correct the map".to_owned())),
        2 if seen.sensors.is_empty() => {
            Some(Doubt::refused("only two points of the contour are seen; give three or more".to_owned()))
        }
        1 => Some(Doubt::refused(format!(
            "only one {one} is seen, which does not determine the shape of a tongue; give three or more (two at least)"
        ))),
        _ => None,
    }
}

fn of_size(seen: &AlignedRecording, middles: &Middles) -> Option<Doubt> {
    let unit = "correct unit_mm in the map, or give a table in millimetres";
    let judge = |what: &str, m: f64, [least, most]: [f64; 2]| {
        let wrong = !(least..=most).contains(&m);
        let (a, b) = (least * 1e3, most * 1e3);
        wrong.then(|| {
            Doubt::refused(format!("{what} {:.3} mm, where {a:.0} to {b:.0} are possible; {unit}", m * 1e3))
        })
    };
    let bones = middles.bone(seen, MANDIBLE).zip(middles.bone(seen, HYOID)).map(|(a, b)| (a - b).norm());
    let contour: Vec<Point> = middles.contour.iter().flatten().copied().collect();
    // The radius contains half of the points, so that one distant point does not make it large.
    let centre = middle(contour.iter().copied());
    let wide = centre.and_then(|c| upper_median(contour.iter().map(|p| (p - c).norm()))).unwrap_or(0.0) * 2.0;
    let coils: Vec<Point> = middles.sensors.iter().flatten().copied().collect();
    let gap = coils.windows(2).map(|w| (w[1] - w[0]).norm()).fold(f64::NAN, f64::max);
    let of_bones = bones.and_then(|m| judge("the mental spine and the hyoid are apart by", m, BONES_M));
    let of_contour =
        || (contour.len() > 4).then(|| judge("half of the contour spans", wide, CONTOUR_M)).flatten();
    let of_coils =
        || (coils.len() > 1).then(|| judge("neighbouring coils are apart by up to", gap, GAP_M)).flatten();
    of_bones.or_else(of_contour).or_else(of_coils)
}

/// Points far from all others.
fn far_points(seen: &AlignedRecording, middles: &Middles) -> Vec<Doubt> {
    let names = seen.contour.iter().chain(seen.sensors.iter().map(|(n, _)| n)).chain(&seen.bones);
    let all: Vec<(&String, Point)> = names
        .zip(middles.contour.iter().chain(&middles.sensors).chain(&middles.bones))
        .filter_map(|(n, m)| Some((n, (*m)?)))
        .collect();
    let Some(centre) = middle(all.iter().map(|(_, p)| *p)) else { return Vec::new() };
    if all.len() < 4 {
        return Vec::new();
    }
    all.iter()
        .filter(|(_, p)| (p - centre).norm() > FAR_M)
        .map(|(name, p)| {
            let mm = (p - centre).norm() * 1e3;
            Doubt::told(format!(
                "{name} lies {mm:.0} mm from the other points, which is too far; correct it, or write \"{name}\" = \"ignore\" into a map"
            ))
        })
        .collect()
}

/// Checks the order of points and bones in the head.
fn of_order(seen: &AlignedRecording, middles: &Middles) -> Vec<Doubt> {
    let mut out = Vec::new();
    let contour: Vec<Point> = middles.contour.iter().flatten().copied().collect();
    let centre = middle(contour.iter().copied()).unwrap_or_default();
    let contour: Vec<Point> = contour.into_iter().filter(|p| (p - centre).norm() <= FAR_M).collect();
    let ends = contour.first().zip(contour.last()).filter(|_| contour.len() >= 4);
    let bones = middles.bone(seen, MANDIBLE).zip(middles.bone(seen, HYOID));
    if let Some((spine, hyoid)) = bones {
        if let Some(doubt) = exchanged_axes(seen, hyoid - spine) {
            return vec![doubt];
        }
        let rear = contour.iter().chain(middles.sensors.iter().flatten()).map(|p| p.y);
        if rear.clone().count() > 0 && upper_median(rear).unwrap_or(0.0) < spine.y.min(hyoid.y) {
            let what = "the tongue lies below the hyoid and the mental spine: the recording is upside down";
            out.push(Doubt::refused(format!(
                "{what}; give the axis that grows upwards in a map, such as up = \"-y\""
            )));
            return out;
        }
        if spine.x > hyoid.x {
            let what = "the mental spine lies behind the hyoid";
            out.push(Doubt::refused(format!("{what}; correct back in the map, or the names of the two")));
            return out;
        }
        if let Some((first, last)) = ends
            && (first - spine).norm() + (last - hyoid).norm() < (first - hyoid).norm() + (last - spine).norm()
        {
            out.push(Doubt::refused(format!(
                "the end of the contour at the root lies by the mental spine and not by the hyoid: the names of these two are wrong, or \
                 contour and bones are not in one frame; correct them, or leave the bones out with a map (--map) of the line {WITHOUT_BONES}"
            )));
        }
    }
    if let Some((spine, hyoid)) = bones.filter(|_| contour.len() >= 5) {
        let apart = hyoid - spine;
        let heights = contour.iter().map(|p| apart.perp(&(p - spine)) / apart.norm());
        let height = heights.fold(f64::NEG_INFINITY, f64::max);
        let length = contour.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        let ends = contour.first().zip(contour.last());
        let ends = ends.map(|(a, b)| [a, b].map(|p| apart.perp(&(p - spine)) / apart.norm_squared()));
        let are_high =
            ends.is_some_and(|[a, b]| a.min(b) > HIGHEST_ENDS[0] && 0.5 * (a + b) > HIGHEST_ENDS[1]);
        if are_high || (height > HIGHEST[0] * apart.norm() && height > HIGHEST[1] * length) {
            let times = height / apart.norm();
            out.push(Doubt::told(format!(
                "the contour reaches {times:.1} times as far above the line from the mental spine to the hyoid as these are apart, and both \
                 of its ends are high: the contour is too high for the bones; correct these, or give both in one frame"
            )));
        }
    }
    if contour.len() >= 5 {
        let length = |p: &[Point]| p.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        if length(&contour) > LONGER * length(&from_neighbour_to_neighbour(&contour)) {
            out.push(Doubt::refused(
                "the points of the contour are not in their order along the tongue; number them from the root to the tip".to_owned(),
            ));
        } else if sag(&contour).is_some_and(|m| m > HOLLOW_M) {
            out.push(Doubt::refused(
                "the contour hangs below the line of its ends, where a tongue is arched upwards: the recording is upside down; give the axis \
                 that grows upwards in a map, such as up = \"-y\""
                    .to_owned(),
            ));
        }
    }
    out
}

/// A point that stands out of the contour in most frames.
fn spike(seen: &AlignedRecording, middles: &Middles) -> Option<Doubt> {
    /// The way over a point is longer than the straight one by less than a tenth on a tongue.
    const DETOUR: f64 = 1.45;
    const OUT_M: f64 = 6e-3;
    let points =
        seen.contour.iter().zip(&middles.contour).filter_map(|(name, p)| Some((name.as_str(), (*p)?)));
    let points: Vec<(&str, Point)> = points.collect();
    if points.len() < 5 {
        return None;
    }
    let out = |i: usize| {
        let (before, here, after) = (points[i - 1].1, points[i].1, points[i + 1].1);
        let straight = (after - before).norm();
        let detour = ((here - before).norm() + (after - here).norm()) / straight;
        let away = (after - before).perp(&(here - before)).abs() / straight;
        (detour > DETOUR && away > OUT_M).then_some((away, points[i].0))
    };
    let (away, name) = (1..points.len() - 1).filter_map(out).max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Doubt::told(format!(
        "{name} stands out of the contour by {:.0} mm; correct it, or write \"{name}\" = \"ignore\" into a map",
        away * 1e3
    )))
}

/// The points in a greedy path: from the one farthest from their middle to the nearest remaining one, and so
/// on.
fn from_neighbour_to_neighbour(points: &[Point]) -> Vec<Point> {
    let centre = points.iter().sum::<Point>() / points.len() as f64;
    let mut left = points.to_vec();
    let mut out: Vec<Point> = Vec::with_capacity(points.len());
    let mut nearest = |to: &dyn Fn(&Point) -> f64| {
        let n = (0..left.len()).min_by(|&a, &b| to(&left[a]).total_cmp(&to(&left[b])))?;
        Some(left.swap_remove(n))
    };
    let mut next = nearest(&|p| -(p - centre).norm());
    while let Some(point) = next {
        out.push(point);
        next = nearest(&|p| (p - point).norm());
    }
    out
}

#[cfg(test)]
#[path = "plausibility_tests.rs"]
mod tests;
