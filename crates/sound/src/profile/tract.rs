//! The walls of a tract as data, and their motion.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::Section;
use crate::TractError;

/// A point of the midsagittal plane, m.
pub type ProfilePoint = [f64; 2];

pub(super) fn cross(a: ProfilePoint, b: ProfilePoint) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(super) fn minus(a: ProfilePoint, b: ProfilePoint) -> ProfilePoint {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn mm(p: ProfilePoint) -> String {
    format!("({:.1}, {:.1}) mm", p[0] * 1e3, p[1] * 1e3)
}

/// Where the ray from a point along a way crosses the side between two others: the distance as a multiple of the way, and the part of the
/// side.
pub(super) fn crossing(from: ProfilePoint, way: ProfilePoint, side: [ProfilePoint; 2]) -> Option<(f64, f64)> {
    let (start, side) = (minus(side[0], from), minus(side[1], side[0]));
    let across = cross(way, side);
    let (along, part) = (cross(start, side) / across, cross(start, way) / across);
    (0.0..=1.0).contains(&part).then_some((along, part))
}

/// Largest coordinate of a tract, mm. It limits memory, since lines begin at every step of the outer wall.
const FARTHEST_MM: f64 = 1e3;

/// Largest coefficient and exponent of an area. Those of Heinz and Stevens (1964) are at most 4 and 1.5.
const MOST_ALPHA: f64 = 20.0;
const MOST_BETA: f64 = 3.0;
/// Smallest opening of the lips in a vowel, mm; lips that are nearer make a consonant.
pub const LEAST_OPENING_MM: f64 = 1.0;

/// The walls around a tongue, as in a tract file: lengths in mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tract {
    pub name: String,
    /// The pieces of the outer wall, from the glottis to the edge of the upper teeth.
    pub wall: Vec<Wall>,
    pub larynx: Larynx,
    pub tongue: Tongue,
    pub jaw: Teeth,
    pub lips: Lips,
    pub grid: Grid,
    /// Jaw and lips in vowels, by their labels.
    #[serde(default)]
    pub posture: BTreeMap<String, Articulation>,
}

/// A piece of the outer wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    pub name: String,
    /// The part that carries the piece; without one it is fixed to the skull.
    pub moves_with: Option<Carrier>,
    /// Coefficient of the area at the first and the last point, for distances in cm and areas in cm^2.
    pub alpha: [f64; 2],
    /// Exponent of the area at the first and the last point.
    pub beta: [f64; 2],
    /// Half width of the airway at the first and the last point, mm, which cross-sections of a tongue in space need.
    pub half_width_mm: Option<[f64; 2]>,
    /// Distance by which the wall, a parabola in cross-section, is nearer to the tongue at the half width than in the middle, mm; at the
    /// first and the last point.
    pub arch_mm: Option<[f64; 2]>,
    /// Points of the wall, each with a point towards which the line across the airway runs: `[x, y, toward x, toward y]`, mm.
    pub points_mm: Vec<[f64; 4]>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// The larynx, which follows the hyoid.
    Larynx,
}

/// The front wall of the larynx.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Larynx {
    /// Points from the glottis to the root of the tongue, mm.
    pub front_mm: Vec<[f64; 2]>,
    /// Displacement of the larynx over that of the hyoid.
    pub follows_hyoid: f64,
}

/// Which part of the surface of a tongue is a wall of the tract.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tongue {
    /// The wall begins at the place of the surface at rest that is nearest to this point, mm.
    pub root_mm: [f64; 2],
    /// The wall ends at the place of the surface at rest that is nearest to this point, mm.
    pub tip_mm: [f64; 2],
}

/// The lower teeth and the floor of the mouth before them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Teeth {
    /// Centre of the jaw's rotation, mm.
    pub joint_mm: [f64; 2],
    /// Points from the tip of the tongue to the edge of the lower teeth, mm.
    pub floor_mm: Vec<[f64; 2]>,
}

/// The lips: an ellipse whose height is the opening and whose width is `width_mm + 1.5 (opening - protrusion)` (Mermelstein 1973).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lips {
    /// Length of the tube of lips that are not protruded, mm.
    pub length_mm: f64,
    /// Width if opening and protrusion are equal, mm.
    pub width_mm: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Largest distance between neighbouring lines at the outer wall, mm.
    pub step_mm: f64,
}

/// Posture of jaw, hyoid and lips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Articulation {
    /// Opening angle of the jaw, degrees.
    pub jaw_deg: f64,
    /// Displacement of the hyoid, mm.
    pub hyoid_mm: [f64; 2],
    /// Height of the opening between the lips, mm.
    pub lip_opening_mm: f64,
    /// Protrusion of the lips, mm.
    pub lip_protrusion_mm: f64,
}

impl Default for Articulation {
    fn default() -> Self {
        Self { jaw_deg: 0.0, hyoid_mm: [0.0; 2], lip_opening_mm: 8.0, lip_protrusion_mm: 0.0 }
    }
}

impl Tract {
    /// Checks all numbers of the file.
    pub fn check(&self) -> Result<(), TractError> {
        let positive = |key: &str, x: f64| {
            ensure(x.is_finite() && x > 0.0, || format!("{key} is {x}; it must be a positive number"))
        };
        let are_finite = |numbers: &[f64]| !numbers.is_empty() && numbers.iter().all(|x| x.is_finite());
        ensure(!self.wall.is_empty(), || "wall: at least one piece of the outer wall is needed".to_owned())?;
        for Wall { name, alpha, beta, half_width_mm, arch_mm, points_mm, .. } in &self.wall {
            for (key, both, most) in [("alpha", alpha, MOST_ALPHA), ("beta", beta, MOST_BETA)] {
                for &x in both {
                    positive(&format!("{key} of wall `{name}`"), x)?;
                    ensure(x <= most, || {
                        format!(
                            "{key} of wall `{name}` is {x}; it is at most {most}, since areas are in cm^2 and distances in cm"
                        )
                    })?;
                }
            }
            for width in half_width_mm.iter().flatten() {
                positive(&format!("half_width_mm of wall `{name}`"), *width)?;
            }
            let is_arch = arch_mm.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
            ensure(is_arch, || format!("arch_mm of wall `{name}`: two numbers of at least 0 are needed"))?;
            let has_points = are_finite(points_mm.as_flattened());
            ensure(has_points, || {
                format!("points_mm of wall `{name}`: rows of four finite numbers are needed")
            })?;
        }
        let walls = self.wall.iter().flat_map(|w| w.points_mm.as_flattened());
        let points = [self.larynx.front_mm.as_flattened(), self.jaw.floor_mm.as_flattened()];
        let points = points.into_iter().flatten().chain(walls);
        let others = [self.tongue.root_mm, self.tongue.tip_mm, self.jaw.joint_mm];
        if let Some(far) = points.chain(others.as_flattened()).find(|x| x.abs() > FARTHEST_MM) {
            return Err(TractError(format!(
                "a coordinate is {far}; those of a tract are at most {FARTHEST_MM} mm from 0"
            )));
        }
        let (step, least) = (self.grid.step_mm, 0.5);
        positive("grid.step_mm", step)?;
        positive("lips.length_mm", self.lips.length_mm)?;
        positive("lips.width_mm", self.lips.width_mm)?;
        ensure(step >= least, || format!("grid.step_mm is {step}; it must be at least {least}"))?;
        let lists = [("larynx.front_mm", &self.larynx.front_mm), ("jaw.floor_mm", &self.jaw.floor_mm)];
        for (key, list) in lists {
            ensure(are_finite(list.as_flattened()), || {
                format!("{key}: at least one point of two finite numbers is needed")
            })?;
        }
        for (key, point) in ["tongue.root_mm", "tongue.tip_mm", "jaw.joint_mm"].into_iter().zip(others) {
            ensure(are_finite(&point), || format!("{key} must be two finite numbers"))?;
        }
        ensure(self.larynx.follows_hyoid.is_finite(), || {
            "larynx.follows_hyoid must be a finite number".to_owned()
        })
    }

    /// The tract in another frame: `place` moves points, mm, by a similarity that multiplies lengths by `scale`.
    #[must_use]
    pub fn placed(mut self, scale: f64, place: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        for row in self.wall.iter_mut().flat_map(|w| &mut w.points_mm) {
            let ([x, y], [toward_x, toward_y]) = (place([row[0], row[1]]), place([row[2], row[3]]));
            *row = [x, y, toward_x, toward_y];
        }
        self.larynx.front_mm.iter_mut().chain(&mut self.jaw.floor_mm).for_each(|p| *p = place(*p));
        for p in [&mut self.tongue.root_mm, &mut self.tongue.tip_mm, &mut self.jaw.joint_mm] {
            *p = place(*p);
        }
        let of_walls =
            self.wall.iter_mut().flat_map(|w| [&mut w.half_width_mm, &mut w.arch_mm]).flatten().flatten();
        let others = [&mut self.grid.step_mm, &mut self.lips.length_mm, &mut self.lips.width_mm];
        of_walls.chain(others).for_each(|length| *length *= scale);
        self
    }

    /// Moves each point of the outer wall along its line to where that line crosses a traced palate (points in order, mm), if the crossing
    /// is less than `reach_mm` from the point.
    #[must_use]
    pub fn with_palate(mut self, palate: &[[f64; 2]], reach_mm: f64) -> Self {
        for row in self.wall.iter_mut().flat_map(|w| &mut w.points_mm) {
            let (from, to) = ([row[2], row[3]], [row[0], row[1]]);
            let way = minus(to, from);
            let crossings = palate.windows(2).filter_map(|pair| crossing(from, way, [pair[0], pair[1]]));
            let crossings = crossings.map(|(along, _)| along).filter(|along| *along > 0.0);
            let beside = |along: &f64| (along - 1.0).abs() * way[0].hypot(way[1]);
            let nearest = crossings.min_by(|a, b| beside(a).total_cmp(&beside(b)));
            if let Some(along) = nearest.filter(|a| beside(a) < reach_mm) {
                (row[0], row[1]) = (from[0] + along * way[0], from[1] + along * way[1]);
            }
        }
        self
    }

    /// The sections of the lips in a posture, if they are open.
    pub fn lip_sections(&self, posture: &Articulation) -> Result<[Section; 2], TractError> {
        let Articulation { lip_opening_mm: opening, lip_protrusion_mm: protrusion, .. } = *posture;
        let width = self.lips.width_mm + 1.5 * (opening - protrusion);
        let length = self.lips.length_mm + protrusion;
        ensure(opening.is_finite() && opening >= LEAST_OPENING_MM && width > 0.0, || {
            format!(
                "lips with an opening of {opening} mm and a protrusion of {protrusion} mm are closed, or so near to each other that \
                 they make a consonant: there is no vowel (an opening is at least {LEAST_OPENING_MM} mm)"
            )
        })?;
        ensure(length.is_finite() && length > 0.0, || {
            format!(
                "a lip protrusion of {protrusion} mm gives the lips no length; without protrusion they are {} mm long",
                self.lips.length_mm
            )
        })?;
        let section = Section { length_m: 0.5e-3 * length, area_m2: 1e-6 * PI / 4.0 * opening * width };
        Ok([section; 2])
    }
}

pub(super) fn ensure(holds: bool, problem: impl FnOnce() -> String) -> Result<(), TractError> {
    if holds { Ok(()) } else { Err(TractError(problem())) }
}
