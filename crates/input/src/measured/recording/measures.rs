//! Quantities of a recording by which its plausibility is judged: sizes, and positions of points relative to one another.

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;
use tongue_core::statistics::{grouped, least_by, median};

use super::dynamics::{FEWEST_FRAMES, NamedValue, PointTracks, unnamed};
use super::flat::{median_point, steep_deg};
use super::limits::MOST_CHANNELS;
use super::{AlignedFrame, AlignedRecording, names};

pub(super) struct Measures<'a> {
    pub recording: &'a AlignedRecording,
    /// From front to back.
    pub palate: Option<&'a [Point]>,
    contour: Vec<Option<Point>>,
    sensors: Vec<Option<Point>>,
    /// The sensors that were seen, from the tip backwards.
    coils: Vec<MeasuredCoil<'a>>,
    bones: Vec<Option<Point>>,
    pub motion: PointTracks<'a>,
}

/// A coil on the tongue: its number among the sensors, its name, its median position, m.
type MeasuredCoil<'a> = (usize, &'a str, Point);

pub(super) const MM: f64 = 1e3;
/// Points of a tongue are nearer to its centre, m.
const FAR_M: f64 = 0.15;
pub(super) const ANY: f64 = f64::INFINITY;

/// Mean distance of a line below that of its ends, m; `None` for fewer than two points.
pub(super) fn sag(line: &[Point]) -> Option<f64> {
    let (first, last) = (line.first()?, line.last()?);
    let along = if first.x <= last.x { last - first } else { first - last };
    let below = line.iter().map(|p| along.perp(&(first - p)) / along.norm());
    Some(below.sum::<f64>() / line.len() as f64).filter(|m| m.is_finite())
}

pub(super) fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

impl<'a> Measures<'a> {
    pub fn of(recording: &'a AlignedRecording, palate: Option<&'a [Point]>) -> Self {
        let mut contour: Vec<_> = (0..recording.names().count())
            .map(|p| median_point(recording.positions_over_time(p).map(|(_, mark)| mark.at)))
            .collect();
        let mut sensors = contour.split_off(recording.contour.len());
        let bones = sensors.split_off(recording.sensors.len());
        let all = recording.sensors.iter().zip(&sensors).enumerate();
        let mut coils: Vec<MeasuredCoil<'_>> =
            all.filter_map(|(n, ((name, _), p))| Some((n, name.as_str(), (*p)?))).collect();
        coils.sort_by(|a, b| recording.sensors[a.0].1.total_cmp(&recording.sensors[b.0].1));
        Self { contour, sensors, coils, bones, motion: PointTracks::of(recording), palate, recording }
    }

    pub fn spine_and_hyoid(&self) -> Option<(Point, Point)> {
        let [spine, hyoid] = [MANDIBLE, HYOID].map(|name| self.bones[self.recording.bone(name)?]);
        spine.zip(hyoid)
    }

    /// The median positions of the contour without points that are farther than [`FAR_M`] from their centre, if at least `least` are left.
    pub fn near_contour(&self, least: usize) -> Option<Vec<Point>> {
        let all = self.contour.iter().flatten().copied();
        let centre = median_point(all.clone()).unwrap_or_default();
        let near: Vec<Point> = all.filter(|p| (p - centre).norm() <= FAR_M).collect();
        (near.len() >= least).then_some(near)
    }

    fn ranks(&self) -> Option<Vec<u32>> {
        self.coils.iter().map(|c| names::rank(c.1)).collect()
    }

    pub fn gaps_mm(&self) -> Vec<f64> {
        self.coils.windows(2).map(|w| (w[1].2 - w[0].2).norm() * MM).collect()
    }

    /// The length of the contour and the distance of the bones, or twice the length of the chain of coils.
    pub fn sizes_mm(&self) -> Option<[f64; 2]> {
        match whole_mm(&self.contour) {
            Some(contour) => Some([contour, self.spine_and_hyoid().map(|(a, b)| (a - b).norm() * MM)?]),
            None => whole_mm(&self.sensors).map(|mm| [mm, mm]),
        }
    }

    pub fn step_ms(&self) -> Option<NamedValue> {
        let steps = self.recording.frames.windows(2).map(|w| w[1].time_s - w[0].time_s);
        median(steps).map(|s| unnamed(s * MM))
    }

    /// Longest time between two frames, s, and the time of the first of them.
    pub fn longest_pause_s(&self) -> Option<NamedValue> {
        let pauses = self.recording.frames.windows(2).map(|w| (w[1].time_s - w[0].time_s, w[0].time_s));
        let longest = pauses.max_by(|a, b| a.0.total_cmp(&b.0));
        longest.map(|(pause, at)| (pause, format!("{at:.3} s")))
    }

    /// For each tier the part of its labels of which half lies within the recording or that fill half of it, and as its name the times of its labels and of the frames.
    pub fn labels_within(&self) -> Vec<NamedValue> {
        let AlignedRecording { frames, labels, .. } = self.recording;
        let Some((first, last)) = frames.first().zip(frames.last()) else { return Vec::new() };
        let (first, last) = (first.time_s, last.time_s);
        Vec::from_iter(grouped(labels, |label| &label.tier).into_iter().map(|tier| {
            let within = tier.iter().filter(|l| {
                let overlap = l.to_s.min(last) - l.from_s.max(first);
                overlap >= 0.5 * (l.to_s - l.from_s).min(last - first)
            });
            let within = within.count() as f64 / tier.len() as f64;
            let ends = tier.iter().fold([ANY, -ANY], |[a, b], l| [l.from_s.min(a), l.to_s.max(b)]);
            let name = format!(
                "{:?} lie at {:.3} to {:.3} s and its frames at {first:.3} to {last:.3} s",
                tier[0].tier, ends[0], ends[1]
            );
            (within, name)
        }))
    }

    pub fn most_points(&self) -> Option<NamedValue> {
        self.recording.frames.iter().map(|f| f.points().flatten().count()).max().map(|n| unnamed(n as f64))
    }

    pub fn usual_sd_mm(&self) -> Option<NamedValue> {
        let points = self.recording.frames.iter().flat_map(AlignedFrame::points).flatten();
        median(points.map(|mark| mark.sd)).map(|sd| unnamed(sd * MM))
    }

    pub fn bones_apart_mm(&self) -> Option<NamedValue> {
        let steady = self.spine_and_hyoid().filter(|_| self.motion.slips_of_bones().next().is_none());
        steady.map(|(a, b)| unnamed((a - b).norm() * MM))
    }

    /// How far the hyoid moves against the mental spine between the lowest and the highest tenth of medians of five frames, mm.
    pub fn hyoid_moves_mm(&self) -> Option<NamedValue> {
        let [spine, hyoid] = [self.recording.bone(MANDIBLE)?, self.recording.bone(HYOID)?];
        let seen =
            self.recording.frames.iter().filter_map(|f| Some((f.bones[hyoid]? - f.bones[spine]?) * MM));
        let seen: Vec<Point> = seen.collect();
        (seen.len() >= FEWEST_FRAMES).then(|| {
            let [x, y] = [0, 1].map(|axis| {
                let medians = seen.windows(5).filter_map(|w| median(w.iter().map(|p| p[axis])));
                let mut along: Vec<f64> = medians.collect();
                along.sort_unstable_by(f64::total_cmp);
                along[along.len() * 9 / 10] - along[along.len() / 10]
            });
            unnamed(x.hypot(y))
        })
    }

    /// Diameter of the circle that contains half of the points, which one distant point does not enlarge.
    pub fn contour_width_mm(&self) -> Option<NamedValue> {
        let contour = self.contour.iter().flatten().copied();
        let centre = median_point(contour.clone()).filter(|_| contour.clone().count() > 4)?;
        median(contour.map(|p| (p - centre).norm())).map(|r| unnamed(2.0 * r * MM))
    }

    /// The coil that is more than twice as far from its nearest neighbour as all others are from theirs.
    pub fn coil_alone_mm(&self) -> Option<NamedValue> {
        let coils = &self.coils;
        coils.iter().filter(|_| coils.len() >= 3).find_map(|c| {
            let others: Vec<MeasuredCoil<'_>> = coils.iter().filter(|o| o.0 != c.0).copied().collect();
            let (away, mut apart) = (nearest_mm(c, coils), 0.0);
            // The search ends at the first other coil that is itself far away, so that many coils take little time.
            let is_alone = others.iter().all(|o| {
                apart = f64::max(apart, nearest_mm(o, &others));
                apart <= 30.0 && away > 2.0 * apart
            });
            (is_alone && apart >= 4.0).then(|| (away, c.1.to_owned()))
        })
    }

    pub fn far_points_mm(&self) -> Vec<NamedValue> {
        let places = self.contour.iter().chain(&self.sensors).chain(&self.bones);
        let named = self.recording.names().zip(places);
        let all: Vec<(&String, Point)> = named.filter_map(|(n, p)| Some((n, (*p)?))).collect();
        let centre = median_point(all.iter().map(|a| a.1)).filter(|_| all.len() >= 4);
        let Some(centre) = centre else { return Vec::new() };
        Vec::from_iter(all.iter().map(|(n, p)| ((p - centre).norm() * MM, (*n).clone())))
    }

    /// Angle of the line from spine to hyoid to the horizontal, degrees, and whether the tongue is nevertheless arched upwards.
    pub fn steep_bones(&self) -> Option<(NamedValue, bool)> {
        let (spine, hyoid) = self.spine_and_hyoid().filter(|_| !self.recording.stated.axes)?;
        let upright = self.near_contour(1).is_some_and(|contour| {
            let centre = contour.iter().sum::<Point>() / contour.len() as f64;
            let arch = centre - (contour[0] + contour[contour.len() - 1]) / 2.0;
            arch.y > 3e-3 && arch.y > arch.x.abs()
        });
        Some((unnamed(steep_deg(hyoid - spine)), upright))
    }

    pub fn tongue_above_bones_mm(&self) -> Option<NamedValue> {
        let (spine, hyoid) = self.spine_and_hyoid()?;
        let points = self.near_contour(0)?.into_iter().chain(self.sensors.iter().flatten().copied());
        median(points.map(|p| p.y)).map(|y| unnamed((y - spine.y.min(hyoid.y)) * MM))
    }

    /// By how much the ends of the contour would be nearer to the bones if the spine and the hyoid were exchanged.
    pub fn root_nearer_to_spine_mm(&self) -> Option<NamedValue> {
        let ((spine, hyoid), contour) = self.spine_and_hyoid().zip(self.near_contour(4))?;
        let (first, last) = (contour.first()?, contour.last()?);
        let [right, reversed] =
            [(first, last), (last, first)].map(|(root, tip)| (root - hyoid).norm() + (tip - spine).norm());
        Some(unnamed((right - reversed) * MM))
    }

    /// How much too high the contour is for the bones: above 1 if its top or both of its ends are. The name is the height of the top over
    /// the distance of the bones.
    ///
    /// The height of the top is 1.1 to 1.5 times the distance of the bones and 0.50 to 0.57 times the length of the contour in most bodies.
    /// A hyoid near the jaw raises the first alone, a hidden root the second alone, so both limits (1.7 and 0.66) must be exceeded. The
    /// lower end is 0.2 times the distance of the bones above their line in most recordings and the mean of both ends 0.4; in contours that
    /// are 15 mm too high these are 0.6 and 0.7 to 0.8.
    pub fn height_over_bones(&self) -> Option<NamedValue> {
        let ((spine, hyoid), contour) = self.spine_and_hyoid().zip(self.near_contour(5))?;
        let apart = hyoid - spine;
        let heights = contour.iter().map(|p| apart.perp(&(p - spine)) / apart.norm());
        let height = heights.fold(f64::NEG_INFINITY, f64::max);
        let times = height / apart.norm();
        let [a, b] =
            [contour.first()?, contour.last()?].map(|p| apart.perp(&(p - spine)) / apart.norm_squared());
        let of_ends = (a.min(b) / 0.42).min(0.5 * (a + b) / 0.7);
        let of_top = (times / 1.7).min(height / length(&contour) / 0.66);
        Some((of_ends.max(of_top), format!("{times:.1}")))
    }

    /// Neighbouring coils that have exactly the same place in most of the frames that show both.
    pub fn copied_coils(&self) -> Option<NamedValue> {
        let is_copy = |w: &&[MeasuredCoil<'_>]| {
            let both = self.recording.frames.iter().filter_map(|f| f.sensors[w[0].0].zip(f.sensors[w[1].0]));
            let (count, same) =
                both.fold((0, 0), |(n, same), (a, b)| (n + 1, same + usize::from(a.at == b.at)));
            2 * same > count
        };
        self.coils.windows(2).find(is_copy).map(|w| (1.0, listed(w)))
    }

    pub fn coils_that_turn(&self) -> Option<NamedValue> {
        let turn = self.coils.windows(3).find(|w| (w[1].2 - w[0].2).dot(&(w[2].2 - w[1].2)) < 0.0);
        turn.map(|w| (1.0, listed(w)))
    }

    /// The coils, if the ranks in their names have another order than their positions.
    pub fn coils_out_of_rank(&self) -> Option<NamedValue> {
        let wrong = self.ranks()?.windows(2).any(|w| w[0] > w[1]);
        wrong.then(|| (1.0, listed(&self.coils)))
    }

    /// Angle of the line between the two farthest coils to the horizontal, if coils are out of order.
    pub fn disordered_coils_steep_deg(&self) -> Option<NamedValue> {
        self.coils_that_turn()
            .or_else(|| self.coils_out_of_rank())
            .filter(|_| !self.recording.stated.axes)?;
        let pairs = self.coils.iter().flat_map(|a| self.coils.iter().map(|b| b.2 - a.2));
        pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())).map(|widest| unnamed(steep_deg(widest)))
    }

    /// Distance of the coil at the tip behind the last one; infinite if the ranks of all coils are reversed.
    pub fn tip_behind_mm(&self) -> Option<NamedValue> {
        let [first, .., last] = &self.coils[..] else { return None };
        let reversed = self.ranks().is_some_and(|ranks| ranks.windows(2).all(|w| w[0] > w[1]));
        Some(unnamed(if reversed { ANY } else { (first.2.x - last.2.x) * MM }))
    }

    /// How much too small or too large the chain of coils is: above 1 if neighbours are on average less than 9 mm or more than 28 mm apart,
    /// or the first and the last more than 58 mm.
    pub fn size_of_coils(&self) -> Option<NamedValue> {
        let gaps = self.gaps_mm();
        let length = gaps.iter().sum::<f64>();
        let mean = length / gaps.len() as f64;
        let is_judged = gaps.len() >= 2 && !self.recording.stated.unit;
        let name = format!("{mean:.1} mm apart, {length:.0} mm from the first to the last");
        is_judged.then(|| ((9.0 / mean).max(mean / 28.0).max(length / 58.0), name))
    }

    /// Largest distance of a coil below the line of the first and the last, if it is below in more than four fifths of the frames. A
    /// retroflex lowers one for a short time only.
    pub fn hollow_mm(&self) -> Option<NamedValue> {
        const PART: f64 = 0.8;
        let AlignedRecording { frames, stated, .. } = self.recording;
        let [first, inner @ .., last] = &self.coils[..] else { return None };
        if frames.len() < FEWEST_FRAMES || stated.axes {
            return None;
        }
        let hollow = inner.iter().filter_map(|(number, name, p)| {
            let places = frames.iter().filter_map(|f| {
                let [a, b, c] = [first.0, *number, last.0].map(|n| f.sensors[n].map(|m| m.at));
                Some([a?, b?, c?])
            });
            let depths: Vec<f64> = places.map(depth).collect();
            let deep = depths.iter().filter(|d| **d > 0.0).count();
            (deep as f64 > PART * depths.len() as f64).then_some((depth([first.2, *p, last.2]) * MM, name))
        });
        let (mm, name) = hollow.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((mm, format!("{name} lies {mm:.0} mm below the line from {} to {}", first.1, last.1)))
    }

    /// The point that stands out most from the contour: the way over it is more than 1.45 times as long as past it. On a tongue it is less
    /// than 1.1 times as long.
    pub fn spike_mm(&self) -> Option<NamedValue> {
        const DETOUR: f64 = 1.45;
        let all = self.recording.contour.iter().zip(&self.contour);
        let points: Vec<(&String, Point)> = all.filter_map(|(n, p)| Some((n, (*p)?))).collect();
        let out = points.windows(3).filter(|_| points.len() >= 5).filter_map(|w| {
            let (before, here, after) = (w[0].1, w[1].1, w[2].1);
            let straight = (after - before).norm();
            let detour = ((here - before).norm() + (after - here).norm()) / straight;
            let away = (after - before).perp(&(here - before)).abs() / straight;
            (detour > DETOUR && away < FAR_M).then(|| (away * MM, w[1].0.clone()))
        });
        out.max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The length of a contour over that of a path which begins at its outermost point and always goes on to the nearest remaining one. Of a
/// contour with very many points only every n-th is taken, because the time grows with the square of their number.
pub(super) fn detour(contour: &[Point]) -> f64 {
    let every = contour.len().div_ceil(MOST_CHANNELS).max(1);
    let contour: Vec<Point> = contour.iter().copied().step_by(every).collect();
    let mut left = contour.clone();
    let mut path: Vec<Point> = Vec::with_capacity(left.len());
    let centre = contour.iter().sum::<Point>() / contour.len() as f64;
    while !left.is_empty() {
        let next = least_by(0..left.len(), |&n| match path.last() {
            Some(last) => (left[n] - last).norm(),
            None => -(left[n] - centre).norm(),
        });
        path.push(left.swap_remove(next.unwrap_or(0)));
    }
    length(&contour) / length(&path)
}

fn depth([first, p, last]: [Point; 3]) -> f64 {
    let along = last - first;
    (along.perp(&(first - p)) / along.norm()).min(first.y - p.y)
}

fn nearest_mm(c: &MeasuredCoil<'_>, of: &[MeasuredCoil<'_>]) -> f64 {
    of.iter().filter(|o| o.0 != c.0).map(|o| (o.2 - c.2).norm() * MM).fold(ANY, f64::min)
}

fn whole_mm(points: &[Option<Point>]) -> Option<f64> {
    let all = points.iter().copied().collect::<Option<Vec<Point>>>()?;
    Some(length(&all) * MM).filter(|mm| *mm > 0.0)
}

fn listed(coils: &[MeasuredCoil<'_>]) -> String {
    coils.iter().map(|c| c.1).collect::<Vec<_>>().join(", ")
}
