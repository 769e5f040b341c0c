//! The walls in a posture, and the lines across the airway between them.

use super::tract::{Articulation, Carrier, ProfilePoint, Tract, cross, crossing, ensure, minus, mm};
use crate::TractError;

/// Largest length of a line across the airway, m.
const REACH_M: f64 = 0.08;
/// Distance behind the outer wall within which an inner wall that has passed through it is found, m.
const BEYOND_M: f64 = 0.01;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Across {
    /// Its beginning at the outer wall, m.
    pub outer: ProfilePoint,
    /// Its end at the inner wall, m.
    pub inner: ProfilePoint,
    /// Unit vector from the outer to the inner wall.
    pub(super) direction: ProfilePoint,
    /// The two points of the inner wall between which the line ends, if they are points of the tongue: number, and derivative of the
    /// line's length by the point's position.
    pub(super) ends: [Option<(usize, ProfilePoint)>; 2],
}

impl Across {
    pub(super) fn length(&self) -> f64 {
        let way = minus(self.inner, self.outer);
        way[0].hypot(way[1])
    }

    pub fn middle(&self) -> ProfilePoint {
        [0.5 * (self.outer[0] + self.inner[0]), 0.5 * (self.outer[1] + self.inner[1])]
    }
}

/// Whether neither line crosses the other: both ends of each lie on the side of the other to which the airway runs.
pub(super) fn are_apart(first: &Across, second: &Across) -> bool {
    let sign = cross(minus(second.inner, first.outer), minus(second.outer, first.inner)).signum();
    let side = |line: &Across, p: ProfilePoint| sign * cross(line.direction, minus(p, line.outer));
    side(first, second.inner) > 0.0
        && side(first, second.outer) > 0.0
        && side(second, first.inner) < 0.0
        && side(second, first.outer) < 0.0
}

/// The place of the outer wall at which a line begins.
pub(super) struct WallStart<'a> {
    pub(super) wall: &'a str,
    at: ProfilePoint,
    toward: ProfilePoint,
    /// alpha, beta, half width, m, and arch, m; the last two are NaN where the tract does not give them.
    pub(super) coefficients: [f64; 4],
}

pub(super) struct Walls<'a> {
    pub(super) tract: &'a Tract,
    /// The place at which each line across begins.
    pub(super) starts: Vec<WallStart<'a>>,
    /// Points of the inner wall in order, m, each with its number among the points of the tongue, if it is one of them.
    inner: Vec<(ProfilePoint, Option<usize>)>,
}

impl<'a> Walls<'a> {
    pub(super) fn new(
        tract: &'a Tract,
        tongue: &[ProfilePoint],
        posture: &Articulation,
    ) -> Result<Self, TractError> {
        let numbers = [posture.jaw_deg, posture.hyoid_mm[0], posture.hyoid_mm[1], posture.lip_protrusion_mm];
        let are_finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        ensure(are_finite(&numbers), || "jaw, hyoid and lips must be finite numbers".to_owned())?;
        let is_surface = tongue.len() >= 2 && are_finite(tongue.as_flattened());
        ensure(is_surface, || "the surface of the tongue needs two finite points or more".to_owned())?;
        let larynx = posture.hyoid_mm.map(|x| x * tract.larynx.follows_hyoid * 1e-3);
        let (sin, cos) = posture.jaw_deg.to_radians().sin_cos();
        let joint = tract.jaw.joint_mm.map(|x| x * 1e-3);
        let floor = tract.jaw.floor_mm.iter().map(|[x, y]| {
            let [x, y] = [x * 1e-3 - joint[0], y * 1e-3 - joint[1]];
            ([joint[0] + cos * x - sin * y, joint[1] + sin * x + cos * y], None)
        });
        let front = tract.larynx.front_mm.iter();
        let front = front.map(|[x, y]| ([x * 1e-3 + larynx[0], y * 1e-3 + larynx[1]], None));
        let tongue = tongue.iter().enumerate().map(|(i, p)| (*p, Some(i)));
        let inner = front.chain(tongue).chain(floor).collect();
        Ok(Self { tract, starts: starts(tract, larynx), inner })
    }

    /// The lines across, from the glottis to the edge of the upper teeth. If lines cross, as in a very wide airway, every direction is
    /// averaged over its neighbours, over one more on each side until no lines cross. If they always cross, the lines have the given
    /// directions.
    pub(super) fn lines_across(&self) -> Result<Vec<Across>, TractError> {
        let ways: Vec<ProfilePoint> = self.starts.iter().map(|start| minus(start.toward, start.at)).collect();
        let given = self.lines(&ways)?;
        let are_all_apart = |lines: &[Across]| lines.windows(2).all(|pair| are_apart(&pair[0], &pair[1]));
        if are_all_apart(&given) {
            return Ok(given);
        }
        let mut averaged = (1..=given.len() / 2).filter_map(|neighbours| {
            let ways: Vec<ProfilePoint> = Vec::from_iter((0..given.len()).map(|i| {
                let near = i.saturating_sub(neighbours)..(i + neighbours + 1).min(given.len());
                given[near].iter().fold([0.0; 2], |sum, line| [0, 1].map(|k| sum[k] + line.direction[k]))
            }));
            self.lines(&ways).ok().filter(|lines| are_all_apart(lines))
        });
        let apart = averaged.next();
        Ok(apart.unwrap_or(given))
    }

    fn lines(&self, ways: &[ProfilePoint]) -> Result<Vec<Across>, TractError> {
        self.starts.iter().zip(ways).map(|(start, way)| self.line(start, *way)).collect()
    }

    /// The line from a place to its first crossing with the inner wall.
    fn line(&self, start: &WallStart<'_>, way: ProfilePoint) -> Result<Across, TractError> {
        let name = start.wall;
        let norm = way[0].hypot(way[1]);
        ensure(norm > 0.0, || {
            format!(
                "a point of wall `{name}` has no direction: the point towards which its line runs is the same"
            )
        })?;
        let u = [way[0] / norm, way[1] / norm];
        let crossings = Vec::from_iter(self.inner.windows(2).filter_map(|pair| {
            let (along, part) = crossing(start.at, u, [pair[0].0, pair[1].0])?;
            Some((along, part, pair))
        }));
        let beyond = crossings.iter().map(|(along, ..)| *along);
        let beyond = beyond.filter(|along| *along <= 0.0 && *along > -BEYOND_M).reduce(f64::min);
        if let Some(deepest) = beyond {
            return Err(TractError(format!(
                "the inner wall (tongue, lower teeth or larynx) touches or passes through the {name} at {}, by {:.1} mm: there is no airway, \
                 so no vowel can be computed",
                mm(start.at),
                -deepest * 1e3
            )));
        }
        let before = crossings.into_iter().filter(|(along, ..)| *along > 0.0 && *along <= REACH_M);
        let nearest = before.min_by(|a, b| a.0.total_cmp(&b.0));
        let (along, part, pair) = nearest.ok_or_else(|| {
            TractError(format!(
                "no inner wall is opposite to the {name} at {}: the line across the airway meets neither larynx, tongue nor lower teeth",
                mm(start.at)
            ))
        })?;
        let [(p, p_number), (q, q_number)] = [pair[0], pair[1]];
        // A displacement of the inner wall moves the crossing by its component along the wall's normal.
        let side = minus(q, p);
        let normal = [-side[1], side[0]];
        let slope = normal[0] * u[0] + normal[1] * u[1];
        let rate = |share: f64| [share * normal[0] / slope, share * normal[1] / slope];
        let inner = [start.at[0] + along * u[0], start.at[1] + along * u[1]];
        let ends = [p_number.map(|n| (n, rate(1.0 - part))), q_number.map(|n| (n, rate(part)))];
        Ok(Across { outer: start.at, inner, direction: u, ends })
    }
}

/// A row of a wall at rest, its shift, the name of its wall, and its coefficients.
type WallRow<'a> = ([f64; 4], ProfilePoint, &'a str, [f64; 4]);

/// Places along the outer wall, at distances of at most the grid's step. Their number does not depend on the posture, so that areas are
/// continuous in the displacement of the larynx.
fn starts<'a>(tract: &'a Tract, larynx: ProfilePoint) -> Vec<WallStart<'a>> {
    let mut rows: Vec<WallRow<'a>> = Vec::new();
    for wall in &tract.wall {
        let shift = if wall.moves_with == Some(Carrier::Larynx) { larynx } else { [0.0; 2] };
        let last = (wall.points_mm.len() - 1).max(1) as f64;
        for (i, row) in wall.points_mm.iter().enumerate() {
            let mix = |[a, b]: [f64; 2]| a + (b - a) * i as f64 / last;
            let section = [wall.half_width_mm, wall.arch_mm]
                .map(|given| given.map_or(f64::NAN, |pair| 1e-3 * mix(pair)));
            let coefficients = [mix(wall.alpha), mix(wall.beta), section[0], section[1]];
            rows.push((row.map(|x| x * 1e-3), shift, &wall.name, coefficients));
        }
    }
    let mut out: Vec<WallStart<'a>> = Vec::new();
    let mut place = |a: &WallRow<'a>, b: &WallRow<'a>, part: f64| {
        // `mix` returns `x` unchanged at `part` 0, because NaN in `y`, the next wall's coefficient, would make the sum NaN.
        let mix = |x: f64, y: f64| if part == 0.0 { x } else { x + (y - x) * part };
        let at = |i: usize| mix(a.0[i] + a.1[i % 2], b.0[i] + b.1[i % 2]);
        let coefficients = [0, 1, 2, 3].map(|i| mix(a.3[i], b.3[i]));
        out.push(WallStart { wall: a.2, at: [at(0), at(1)], toward: [at(2), at(3)], coefficients });
    };
    for pair in rows.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let length = (b.0[0] - a.0[0]).hypot(b.0[1] - a.0[1]);
        let count = (length * 1e3 / tract.grid.step_mm - 1e-6).ceil().max(1.0) as usize;
        (0..count).for_each(|k| place(a, b, k as f64 / count as f64));
    }
    if let Some(last) = rows.last() {
        place(last, last, 0.0);
    }
    out
}
