//! The frame of a contour. AAA can export the tongue in a frame of each sample, with its origin at the hyoid and its x axis towards the
//! mandible, while the bones stay in the frame of the probe:
//!
//! ```text
//! p' = R(-angle of hyoid to mandible) (p - hyoid)
//! ```
//! The positions of the bones are noisy in every sample, and this noise is in p' but not in p. So second differences in time distinguish
//! the two frames: the smoothest of all `p' + k (p - p')` has k = 1 if the contour is in the frame of each sample, and k = 0 if it is in
//! the frame of the bones. If there are too few frames, the position of the contour above the bones decides.

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::statistics::{least_by, median};

use super::dynamics::bone_slips;
use super::flat::{Flat, Places, STEEPEST_BONES_DEG, median_point, steep_deg};
use super::map::ContourFrame;
use super::{Map, Role};

/// A contour with a larger factor k is in the frame of each sample; CERTAIN_SD standard deviations of k must lie on one side. k is 0.8 to 1
/// there; a probe that shakes lowers it, and makes it negative in other recordings.
const LEAST_FACTOR: f64 = 0.4;
const CERTAIN_SD: f64 = 3.0;
/// Fewest times at which second differences are taken. BLOCK such times form a block; the noise of different blocks is independent.
const FEWEST_TIMES: usize = 20;
const BLOCK: usize = 3;
/// Second differences larger than this number of medians are errors of tracking.
const MOST_MEDIANS: f64 = 4.0;
/// Usual position of the middle of a contour: in front of the hyoid and above the line to the mandible, over the distance of these two; and
/// how far from it the middle may be. It is (0.3, 1.0) in the built-in body and (0.9, 0.9) in a real speaker.
const USUAL_MIDDLE: Point = Point::new(0.6, 0.95);
const MOST_OFF_MIDDLE: f64 = 0.6;
/// How much nearer to the usual position, in distances of the bones, moving it to their frame must bring a contour that is not in it.
const LEAST_GAIN: f64 = 0.5;

pub(super) const NOTE: &str = "its contour is in a frame of each sample (origin at the hyoid, x towards the mandible) and its bones are \
                               not; it was brought back to the frame of the bones; if that is wrong, write contour_frame = \"bones\" \
                               into a map";

/// The frame of each sample: the channels at its origin and on its x axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SampleFrame {
    hyoid: usize,
    mandible: usize,
    /// Whether y points to the right of x: where the face looks to the left, y then still grows upwards.
    reflected: bool,
}

#[derive(Clone, Copy)]
struct Axes {
    origin: Point,
    x: Point,
    y: Point,
}

impl Axes {
    fn to_bones(self, p: Point) -> Point {
        self.origin + self.turned(p)
    }

    fn turned(self, p: Point) -> Point {
        self.x * p.x + self.y * p.y
    }

    fn components(self, d: Point) -> Point {
        Point::new(d.dot(&self.x), d.dot(&self.y))
    }
}

struct Smoothness {
    /// The factor k with which the contour is smoothest, and its standard deviation.
    factor: f64,
    sd: f64,
    /// Median second difference of the contour in the frame of the bones, m.
    rough_m: f64,
}

impl SampleFrame {
    /// The frame of the contours in recordings of one speaker with the same channels; `None` if it is that of the bones.
    pub fn of(group: &[&Flat<'_>], map: &Map) -> Result<Option<Self>, String> {
        let stated = map.contour_frame;
        let Some(first) = group.first().filter(|_| stated != Some(ContourFrame::Bones)) else {
            return Ok(None);
        };
        let is_stated = stated == Some(ContourFrame::Hyoid);
        let free = first.guessed && !map.stated().axes;
        // AAA's splines have two points on the mandible.
        let mandible = first.recording.channels.iter().position(|c| c == "mandible");
        let ends =
            mandible.into_iter().chain(first.bone(MANDIBLE)).filter(|&m| first.roles[m] != Role::Contour);
        let ends: Vec<usize> = ends.collect();
        let found: Vec<Self> =
            Vec::from_iter(first.bone(HYOID).filter(|_| free).into_iter().flat_map(|hyoid| {
                let pairs = ends.iter().filter(move |m| **m != hyoid).flat_map(|m| [(*m, false), (*m, true)]);
                pairs.map(move |(mandible, reflected)| Self { hyoid, mandible, reflected })
            }));
        if found.is_empty() && is_stated {
            let problem = if free {
                "contour_frame = \"hyoid\" needs the hyoid, and the mandible or the mental spine; name them in the map"
            } else {
                "contour_frame = \"hyoid\" finds the axes itself; take back and up out of the map"
            };
            return Err(problem.to_owned());
        }
        // If the tracking of a bone slips, the recording does not show the frame.
        let bones = first.bone(HYOID).into_iter().chain(ends.iter().copied());
        let steady = group.iter().copied().filter(|flat| is_stated || !bones.clone().any(|c| slips(flat, c)));
        let steady: Vec<&Flat<'_>> = steady.collect();
        let group = steady.as_slice();
        let looks_left = |frame: &Self| frame.typical(group, |axes| axes.x.x).is_some_and(|x| x < 0.0);
        let upright = found.iter().filter(|frame| !frame.reflected || looks_left(frame));
        let upright = upright.filter(|frame| frame.middle(group, true).is_some_and(|m| m.y > 0.0));
        let good = upright.filter(|frame| is_stated || frame.explains(group)).copied();
        Ok(least_by(good, |frame| frame.smoothness(group).map_or(0.0, |s| s.rough_m)))
    }

    fn typical(&self, group: &[&Flat<'_>], of: fn(Axes) -> f64) -> Option<f64> {
        let axes = group.iter().flat_map(|flat| &flat.places).filter_map(|frame| self.axes(frame));
        median(axes.map(of))
    }

    /// Moves contour points to the frame of the bones. In frames that lack a bone they count as not seen.
    pub fn move_to_bones(&self, places: &mut Places, contour: &[usize]) {
        for frame in places {
            let axes = self.axes(frame);
            for &c in contour {
                frame[c] = frame[c].zip(axes).map(|(p, axes)| axes.to_bones(p));
            }
        }
    }

    fn axes(&self, frame: &[Option<Point>]) -> Option<Axes> {
        let (origin, end) = frame[self.hyoid].zip(frame[self.mandible])?;
        let x = (end - origin).try_normalize(f64::EPSILON)?;
        Some(self.along(origin, x))
    }

    fn along(&self, origin: Point, x: Point) -> Axes {
        let y = if self.reflected { Point::new(x.y, -x.x) } else { Point::new(-x.y, x.x) };
        Axes { origin, x, y }
    }

    fn explains(&self, group: &[&Flat<'_>]) -> bool {
        let off = |moved| self.middle(group, moved).map_or(f64::INFINITY, |m| (m - USUAL_MIDDLE).norm());
        let (off, off_as_is) = (off(true), off(false));
        if off > MOST_OFF_MIDDLE {
            return false;
        }
        match self.smoothness(group) {
            Some(s) if s.factor > LEAST_FACTOR.max(CERTAIN_SD * s.sd) => true,
            Some(s) if s.factor + CERTAIN_SD * s.sd < LEAST_FACTOR => false,
            // The tracking of a bone has slipped where the bones lie one above the other.
            _ if self
                .typical(group, |axes| steep_deg(axes.x))
                .is_some_and(|deg| deg > STEEPEST_BONES_DEG) =>
            {
                false
            }
            _ => off_as_is > MOST_OFF_MIDDLE.max(off + LEAST_GAIN),
        }
    }

    /// Position of the middle of the contour in front of the hyoid and above the line to the mandible, over the distance of these two: as
    /// it is or, if `moved`, moved from this frame to that of the bones. It is the mean of the points' median positions; `None` if the end
    /// at the hyoid is in front of the other end.
    fn middle(&self, group: &[&Flat<'_>], moved: bool) -> Option<Point> {
        let first = group.first()?;
        let contour: Vec<Point> = Vec::from_iter(first.contour.iter().filter_map(|&channel| {
            median_point(group.iter().flat_map(|flat| &flat.places).filter_map(|frame| {
                let (axes, p) = (self.axes(frame)?, frame[channel]?);
                let apart = (frame[self.mandible]? - axes.origin).norm();
                let from_hyoid = if moved { axes.turned(p) } else { p - axes.origin };
                let upwards = Axes { y: axes.y * axes.y.y.signum(), ..axes };
                Some(upwards.components(from_hyoid) / apart)
            }))
        }));
        let (a, b) = (contour.first()?, contour.last()?);
        let (root, tip) = if a.norm() < b.norm() { (a, b) } else { (b, a) };
        let middle = contour.iter().sum::<Point>() / contour.len() as f64;
        (root.x < tip.x).then_some(middle)
    }

    /// `None` if there are too few second differences, or if the bones do not move.
    fn smoothness(&self, group: &[&Flat<'_>]) -> Option<Smoothness> {
        let axes: Vec<Vec<Option<Axes>>> =
            group.iter().map(|flat| flat.places.iter().map(|frame| self.axes(frame)).collect()).collect();
        // A constant rotation changes no second difference of positions, so the mean rotation is removed.
        let x = axes.iter().flatten().flatten().map(|a| a.x).sum::<Point>().try_normalize(f64::EPSILON)?;
        let usual = self.along(Point::zeros(), x);
        // For every three frames, the second difference of each contour point and its change by the move to the frame of the bones.
        let mut all: Vec<Vec<(Point, Point)>> = Vec::new();
        for (flat, axes) in group.iter().zip(&axes) {
            let step = median(flat.times.windows(2).map(|t| t[1] - t[0])).unwrap_or(0.0);
            for t in 1..flat.times.len().saturating_sub(1) {
                let uneven = flat.times[t + 1] - 2.0 * flat.times[t] + flat.times[t - 1];
                let (Some(a), Some(b), Some(c)) = (axes[t - 1], axes[t], axes[t + 1]) else { continue };
                if uneven.abs() > 0.5 * step || flat.times[t + 1] - flat.times[t - 1] > 3.0 * step {
                    continue;
                }
                let differences = flat.contour.iter().filter_map(|&i| {
                    let p = [flat.places[t - 1][i]?, flat.places[t][i]?, flat.places[t + 1][i]?];
                    let moved =
                        [a.to_bones(p[0]), b.to_bones(p[1]), c.to_bones(p[2])].map(|q| usual.components(q));
                    Some((second_difference(p), second_difference(moved) - second_difference(p)))
                });
                all.push(differences.collect());
            }
        }
        let typical = |of: fn(&(Point, Point)) -> f64| median(all.iter().flatten().map(of));
        let (most, most_change) =
            (MOST_MEDIANS * typical(|d| d.0.norm())?, MOST_MEDIANS * typical(|d| d.1.norm())?);
        let sums = |block: &[Vec<(Point, Point)>]| {
            let good = block.iter().flatten().filter(|d| d.0.norm() <= most && d.1.norm() <= most_change);
            good.fold((0.0, 0.0), |(a, b), (d, change)| (a - d.dot(change), b + change.norm_squared()))
        };
        let (along, size) = sums(&all);
        if all.len() < FEWEST_TIMES || most_change <= 0.0 || size <= 0.0 {
            return None;
        }
        let factor = along / size;
        let left = all.chunks(BLOCK).map(sums).map(|(a, b)| (a - factor * b).powi(2));
        let sd = left.sum::<f64>().sqrt() / size;
        Some(Smoothness { factor, sd, rough_m: typical(|d| (d.0 + d.1).norm())? })
    }
}

fn second_difference(p: [Point; 3]) -> Point {
    p[0] - p[1] * 2.0 + p[2]
}

fn slips(flat: &Flat<'_>, c: usize) -> bool {
    bone_slips(flat.times.iter().zip(&flat.places).filter_map(|(t, frame)| Some((*t, frame[c]?))))
}
