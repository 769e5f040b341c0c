//! What is measured of a recording to judge whether it is plausible: sizes, and places of points to one another.

use std::ops::RangeInclusive;

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::statistics::upper_median;

use super::dynamics::Motion;
use super::{AlignedFrame, AlignedRecording, names};

#[derive(Debug)]
pub(super) struct Value {
    pub value: f64,
    pub name: String,
}

pub(super) fn value(value: f64) -> Vec<Value> {
    vec![Value { value, name: String::new() }]
}

pub(super) fn named(value: f64, name: String) -> Vec<Value> {
    vec![Value { value, name }]
}

/// A recording with the median positions of its channels, m, and their motion.
pub(super) struct Measures<'a> {
    pub recording: &'a AlignedRecording,
    contour: Vec<Option<Point>>,
    sensors: Vec<Option<Point>>,
    bones: Vec<Option<Point>>,
    pub motion: Motion<'a>,
}

/// A coil on the tongue: its name, its place behind the tip, and its median position, m.
type Coil<'a> = (&'a str, f64, Point);

pub(super) const FEW: usize = 20;
const MM: f64 = 1e3;

fn middle(points: impl Iterator<Item = Point>) -> Option<Point> {
    let all: Vec<Point> = points.collect();
    let of = |axis: usize| upper_median(all.iter().map(|p| p[axis]));
    Some(Point::new(of(0)?, of(1)?))
}

/// How far a line is on average below that of its ends, m; `None` for fewer than two points.
pub(super) fn sag(line: &[Point]) -> Option<f64> {
    let (first, last) = (line.first()?, line.last()?);
    let along = if first.x <= last.x { last - first } else { first - last };
    let below = line.iter().map(|p| along.perp(&(first - p)) / along.norm());
    Some(below.sum::<f64>() / line.len() as f64).filter(|m| m.is_finite())
}

fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// The steepest line of the bones to the horizontal, degrees.
pub(super) const STEEPEST_BONES_DEG: f64 = 60.0;

pub(super) fn steep_deg(apart: Point) -> f64 {
    apart.y.abs().atan2(apart.x.abs()).to_degrees()
}

impl<'a> Measures<'a> {
    pub fn of(recording: &'a AlignedRecording) -> Self {
        let frames = &recording.frames;
        let medians = |n: usize, of: &dyn Fn(&AlignedFrame, usize) -> Option<Point>| -> Vec<Option<Point>> {
            (0..n).map(|c| middle(frames.iter().filter_map(|f| of(f, c)))).collect()
        };
        Self {
            contour: medians(recording.contour.len(), &|f, c| f.contour[c].map(|m| m.at)),
            sensors: medians(recording.sensors.len(), &|f, c| f.sensors[c].map(|m| m.at)),
            bones: medians(recording.bones.len(), &|f, c| f.bones[c]),
            motion: Motion::of(recording),
            recording,
        }
    }

    fn spine_and_hyoid(&self) -> Option<(Point, Point)> {
        let bone = |name: &str| self.bones[self.recording.bone(name)?];
        bone(MANDIBLE).zip(bone(HYOID))
    }

    /// The contour without points that are far from it.
    fn near_contour(&self) -> Vec<Point> {
        let all = || self.contour.iter().flatten().copied();
        let centre = middle(all()).unwrap_or_default();
        all().filter(|p| (p - centre).norm() <= 0.15).collect()
    }

    fn coils(&self) -> Vec<Coil<'_>> {
        let all = self.recording.sensors.iter().zip(&self.sensors);
        let mut coils: Vec<Coil<'_>> =
            all.filter_map(|((n, at), p)| Some((n.as_str(), *at, (*p)?))).collect();
        coils.sort_by(|a, b| a.1.total_cmp(&b.1));
        coils
    }

    fn gaps_mm(&self) -> Vec<f64> {
        self.coils().windows(2).map(|w| (w[1].2 - w[0].2).norm() * MM).collect()
    }

    /// The lengths of the contour and between the bones, or twice that of the chain of coils.
    pub fn sizes_mm(&self) -> Option<[f64; 2]> {
        let whole = |points: &[Option<Point>]| {
            let all = points.iter().copied().collect::<Option<Vec<Point>>>()?;
            Some(length(&all) * MM).filter(|mm| *mm > 0.0)
        };
        match whole(&self.contour) {
            Some(contour) => Some([contour, self.spine_and_hyoid().map(|(a, b)| (a - b).norm() * MM)?]),
            None => whole(&self.sensors).map(|mm| [mm, mm]),
        }
    }

    pub fn is_moving(&self) -> bool {
        self.motion.is_moving()
    }

    pub fn step_ms(&self) -> Vec<Value> {
        let steps = self.recording.frames.windows(2).map(|w| w[1].time_s - w[0].time_s);
        upper_median(steps).map_or_else(Vec::new, |s| value(s * MM))
    }

    /// How many labels lie within the recording, with where both lie.
    pub fn labels_within(&self) -> Vec<Value> {
        let AlignedRecording { frames, labels, .. } = self.recording;
        let (Some(first), Some(last)) = (frames.first().map(|f| f.time_s), frames.last().map(|f| f.time_s))
        else {
            return Vec::new();
        };
        if labels.is_empty() {
            return Vec::new();
        }
        let within = labels.iter().filter(|l| l.to_s >= first && l.from_s <= last).count();
        let ends = labels.iter().fold([ANY, -ANY], |[a, b], l| [l.from_s.min(a), l.to_s.max(b)]);
        let name = format!("{:.3} to {:.3} s and its frames at {first:.3} to {last:.3} s", ends[0], ends[1]);
        named(within as f64, name)
    }

    pub fn most_points(&self) -> Vec<Value> {
        let count = |f: &AlignedFrame| f.contour.iter().chain(&f.sensors).flatten().count();
        self.recording.frames.iter().map(count).max().map_or_else(Vec::new, |n| value(n as f64))
    }

    pub fn most_contour_points(&self) -> Vec<Value> {
        if self.recording.sensors.is_empty() { self.most_points() } else { Vec::new() }
    }

    pub fn bones_apart_mm(&self) -> Vec<Value> {
        let steady = self.spine_and_hyoid().filter(|_| !self.motion.has_slipping_bone());
        steady.map_or_else(Vec::new, |(a, b)| value((a - b).norm() * MM))
    }

    /// The same where the contour has the size of a tongue, so that the unit is right.
    pub fn bones_apart_beside_tongue_mm(&self) -> Vec<Value> {
        const TONGUE_MM: RangeInclusive<f64> = 30.0..=90.0;
        let is_tongue = self.contour_width_mm().iter().any(|w| TONGUE_MM.contains(&w.value));
        if is_tongue { self.bones_apart_mm() } else { Vec::new() }
    }

    /// The diameter that contains half of the points, so that one distant point does not make it large.
    pub fn contour_width_mm(&self) -> Vec<Value> {
        let contour: Vec<Point> = self.contour.iter().flatten().copied().collect();
        let Some(centre) = middle(contour.iter().copied()).filter(|_| contour.len() > 4) else {
            return Vec::new();
        };
        upper_median(contour.iter().map(|p| (p - centre).norm()))
            .map_or_else(Vec::new, |r| value(2.0 * r * MM))
    }

    pub fn largest_gap_mm(&self) -> Vec<Value> {
        self.gaps_mm().into_iter().max_by(f64::total_cmp).map_or_else(Vec::new, value)
    }

    /// The coil that is more than twice as far from its nearest neighbour as all others are from theirs.
    pub fn coil_alone_mm(&self) -> Vec<Value> {
        let coils = self.coils();
        let near = |c: &Coil<'_>, of: &[Coil<'_>]| {
            of.iter().filter(|o| o.0 != c.0).map(|o| (o.2 - c.2).norm() * MM).fold(ANY, f64::min)
        };
        let alone = coils.iter().filter_map(|c| {
            let others: Vec<Coil<'_>> = coils.iter().filter(|o| o.0 != c.0).copied().collect();
            let apart = others.iter().map(|o| near(o, &others)).fold(0.0, f64::max);
            let away = near(c, &coils);
            (apart.is_finite() && (4.0..=30.0).contains(&apart) && away > 2.0 * apart)
                .then(|| named(away, c.0.to_owned()))
        });
        if coils.len() < 3 { Vec::new() } else { alone.flatten().collect() }
    }

    pub fn far_points_mm(&self) -> Vec<Value> {
        let AlignedRecording { contour, sensors, bones, .. } = self.recording;
        let names = contour.iter().chain(sensors.iter().map(|(n, _)| n)).chain(bones);
        let places = self.contour.iter().chain(&self.sensors).chain(&self.bones);
        let all: Vec<(&String, Point)> = names.zip(places).filter_map(|(n, p)| Some((n, (*p)?))).collect();
        let Some(centre) = middle(all.iter().map(|a| a.1)).filter(|_| all.len() >= 4) else {
            return Vec::new();
        };
        all.iter().flat_map(|(n, p)| named((p - centre).norm() * MM, (*n).clone())).collect()
    }

    /// How steep the line from spine to hyoid is, and whether the tongue is arched upwards all the same.
    fn steep_bones(&self) -> Option<(f64, bool)> {
        let (spine, hyoid) = self.spine_and_hyoid().filter(|_| !self.recording.stated.axes)?;
        let contour = self.near_contour();
        let upright = contour.first().zip(contour.last()).is_some_and(|(first, last)| {
            let centre = contour.iter().sum::<Point>() / contour.len() as f64;
            let arch = centre - (first + last) / 2.0;
            arch.y > 3e-3 && arch.y > arch.x.abs()
        });
        Some((steep_deg(hyoid - spine), upright))
    }

    pub fn bones_alone_steep_deg(&self) -> Vec<Value> {
        self.steep_bones().filter(|(_, upright)| *upright).map_or_else(Vec::new, |(deg, _)| value(deg))
    }

    pub fn bones_steep_deg(&self) -> Vec<Value> {
        self.steep_bones().map_or_else(Vec::new, |(deg, _)| value(deg))
    }

    pub fn tongue_above_bones_mm(&self) -> Vec<Value> {
        let Some((spine, hyoid)) = self.spine_and_hyoid() else { return Vec::new() };
        let heights =
            self.near_contour().into_iter().chain(self.sensors.iter().flatten().copied()).map(|p| p.y);
        upper_median(heights).map_or_else(Vec::new, |y| value((y - spine.y.min(hyoid.y)) * MM))
    }

    pub fn spine_behind_hyoid_mm(&self) -> Vec<Value> {
        self.spine_and_hyoid().map_or_else(Vec::new, |(spine, hyoid)| value((spine.x - hyoid.x) * MM))
    }

    /// By how much the ends of a contour are nearer to the wrong bones.
    pub fn root_nearer_to_spine_mm(&self) -> Vec<Value> {
        let contour = self.near_contour();
        let (Some((spine, hyoid)), [first, .., last]) = (self.spine_and_hyoid(), &contour[..]) else {
            return Vec::new();
        };
        let apart = |root: &Point, tip: &Point| (root - hyoid).norm() + (tip - spine).norm();
        let wrong = (apart(first, last) - apart(last, first)) * MM;
        if contour.len() >= 4 { value(wrong) } else { Vec::new() }
    }

    /// The larger of how far the contour reaches above the line of the bones: 1.1 to 1.5 times the distance of these and 0.50 to 0.57 times its
    /// own length in most bodies, where 1.7 and 0.66 are the most. A hyoid near the jaw raises the first alone, a root that is not seen the
    /// second alone, so both must be beyond: the smaller of the two over its limit. Or the same of its ends: the lower one is 0.2 times the
    /// distance of the bones above their line in most recordings and the mean of both 0.4, and 0.6 and 0.7 to 0.8 where the contour is 15 mm
    /// too high.
    pub fn height_over_bones(&self) -> Vec<Value> {
        let contour = self.near_contour();
        let Some((spine, hyoid)) = self.spine_and_hyoid().filter(|_| contour.len() >= 5) else {
            return Vec::new();
        };
        let apart = hyoid - spine;
        let heights = contour.iter().map(|p| apart.perp(&(p - spine)) / apart.norm());
        let height = heights.fold(f64::NEG_INFINITY, f64::max);
        let times = height / apart.norm();
        let end = |p: Option<&Point>| p.map_or(0.0, |p| apart.perp(&(p - spine)) / apart.norm_squared());
        let (a, b) = (end(contour.first()), end(contour.last()));
        let of_ends = (a.min(b) / 0.42).min(0.5 * (a + b) / 0.7);
        let of_top = (times / 1.7).min(height / length(&contour) / 0.66);
        named(of_ends.max(of_top), format!("{times:.1}"))
    }

    /// The length of the contour over that of a path from its outermost point to the nearest that is left, and so on.
    pub fn detour_of_contour(&self) -> Vec<Value> {
        let contour = self.near_contour();
        let mut left = contour.clone();
        let mut path: Vec<Point> = Vec::with_capacity(left.len());
        let centre = contour.iter().sum::<Point>() / contour.len() as f64;
        while !left.is_empty() {
            let off = |p: &Point| path.last().map_or_else(|| -(p - centre).norm(), |last| (p - last).norm());
            let next = (0..left.len()).min_by(|&a, &b| off(&left[a]).total_cmp(&off(&left[b]))).unwrap_or(0);
            path.push(left.swap_remove(next));
        }
        if contour.len() >= 5 { value(length(&contour) / length(&path)) } else { Vec::new() }
    }

    pub fn sag_of_contour_mm(&self) -> Vec<Value> {
        let contour = self.near_contour();
        sag(&contour).filter(|_| contour.len() >= 5).map_or_else(Vec::new, |m| value(m * MM))
    }

    pub fn coils_that_turn(&self) -> Vec<Value> {
        let coils = self.coils();
        let turn = coils.windows(3).find(|w| (w[1].2 - w[0].2).dot(&(w[2].2 - w[1].2)) < 0.0);
        turn.map_or_else(Vec::new, |w| named(1.0, listed(w)))
    }

    /// Whether the names of coils say another order than their places.
    pub fn coils_out_of_rank(&self) -> Vec<Value> {
        let coils = self.coils();
        let ranks: Vec<u32> = coils.iter().filter_map(|c| names::rank(c.0)).collect();
        let wrong = ranks.len() == coils.len() && ranks.windows(2).any(|w| w[0] > w[1]);
        if wrong { named(1.0, listed(&coils)) } else { Vec::new() }
    }

    /// How steep the line between the two farthest coils is, where they are out of order.
    pub fn disordered_coils_steep_deg(&self) -> Vec<Value> {
        let coils = self.coils();
        let disordered = !self.coils_that_turn().is_empty() || !self.coils_out_of_rank().is_empty();
        let pairs = coils.iter().flat_map(|a| coils.iter().map(|b| b.2 - a.2));
        let widest = pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
        if disordered && !self.recording.stated.axes { value(steep_deg(widest)) } else { Vec::new() }
    }

    /// How far the coil at the tip lies behind the last one; endless if all names are in reverse.
    pub fn tip_behind_mm(&self) -> Vec<Value> {
        let coils = self.coils();
        let [first, .., last] = &coils[..] else { return Vec::new() };
        let ranks: Vec<u32> = coils.iter().filter_map(|c| names::rank(c.0)).collect();
        let reversed = ranks.len() == coils.len() && ranks.windows(2).all(|w| w[0] > w[1]);
        value(if reversed { ANY } else { (first.2.x - last.2.x) * MM })
    }

    /// The mean distance of neighbouring coils and that of the first from the last along them.
    fn mean_and_length_mm(&self) -> Option<(f64, f64)> {
        let gaps = self.gaps_mm();
        let length = gaps.iter().sum::<f64>();
        (gaps.len() >= 2 && !self.recording.stated.unit).then_some((length / gaps.len() as f64, length))
    }

    pub fn mean_gap_mm(&self) -> Vec<Value> {
        self.mean_and_length_mm().map_or_else(Vec::new, |(mean, length)| named(mean, format!("{length:.0}")))
    }

    pub fn length_of_coils_mm(&self) -> Vec<Value> {
        self.mean_and_length_mm().map_or_else(Vec::new, |(mean, length)| named(length, format!("{mean:.1}")))
    }

    /// How far the lowest coil lies below the line of the first and the last in at least four fifths of the frames. A retroflex makes one low, but
    /// only for a short time.
    pub fn hollow_mm(&self) -> Vec<Value> {
        const PART: f64 = 0.8;
        let AlignedRecording { frames, sensors, stated, .. } = self.recording;
        let coils = self.coils();
        let [first, inner @ .., last] = &coils[..] else { return Vec::new() };
        if frames.len() < FEW || stated.axes {
            return Vec::new();
        }
        let depth = |[first, p, last]: [Point; 3]| {
            let along = last - first;
            (along.perp(&(first - p)) / along.norm()).min(first.y - p.y)
        };
        let number = |name: &str| sensors.iter().position(|(n, _)| n == name);
        let hollow = inner.iter().filter_map(|(name, _, p)| {
            let numbers = [number(first.0)?, number(name)?, number(last.0)?];
            let places = |f: &AlignedFrame| {
                let [a, b, c] = numbers.map(|n| f.sensors[n].map(|m| m.at));
                Some([a?, b?, c?])
            };
            let depths: Vec<f64> = frames.iter().filter_map(places).map(depth).collect();
            let deep = depths.iter().filter(|d| **d > 0.0).count();
            (deep as f64 > PART * depths.len() as f64).then_some((depth([first.2, *p, last.2]) * MM, name))
        });
        hollow.max_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(Vec::new, |(mm, name)| {
            named(mm, format!("{name} lies {mm:.0} mm below the line from {} to {}", first.0, last.0))
        })
    }

    /// The point over which the way is much longer than past it, in most frames: on a tongue it is longer by less than a tenth.
    pub fn spike_mm(&self) -> Vec<Value> {
        const DETOUR: f64 = 1.45;
        let all = self.recording.contour.iter().zip(&self.contour);
        let points: Vec<(&String, Point)> = all.filter_map(|(n, p)| Some((n, (*p)?))).collect();
        let out = points.windows(3).filter_map(|w| {
            let (before, here, after) = (w[0].1, w[1].1, w[2].1);
            let straight = (after - before).norm();
            let detour = ((here - before).norm() + (after - here).norm()) / straight;
            let away = (after - before).perp(&(here - before)).abs() / straight;
            (detour > DETOUR).then_some((away * MM, w[1].0))
        });
        let most = out.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|_| points.len() >= 5);
        most.map_or_else(Vec::new, |(mm, name)| named(mm, name.clone()))
    }
}

const ANY: f64 = f64::INFINITY;

fn listed(coils: &[Coil<'_>]) -> String {
    coils.iter().map(|c| c.0).collect::<Vec<_>>().join(", ")
}
