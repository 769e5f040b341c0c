//! From the walls of a tract in the midsagittal plane to its sections, with exact derivatives by the points of the tongue.
//!
//! Lines across the airway begin at fixed places of the outer wall (larynx, pharynx, velum, palate, teeth) and end where they first cross
//! the inner wall (larynx, tongue, lower teeth). Two neighbouring lines bound a section. Its length is the distance between their
//! midpoints, and its width is the area between the four end points over that length (Maeda 1979), which also holds for lines that are not
//! quite perpendicular to the airway. The area of the cross-section is `alpha d^beta` with the width d in cm (Heinz and Stevens 1965). The
//! lips are a short elliptic tube.
//!
//! A cross-section of a tongue in space lies in the plane of a line across the airway and the lateral direction. It is bounded by the
//! surface of the tongue and by the wall, a parabola with the half width and the arch that the tract gives. It reaches from the middle to
//! both sides as far as the tongue is opposite to the wall, at most to the half width. Where a line meets no tongue (larynx, lower teeth)
//! its area is `alpha d^beta`, as in the plane.

mod tract;
mod walls;

pub use tract::{
    Articulation, Carrier, Grid, LEAST_OPENING_MM, Larynx, Lips, ProfilePoint, Teeth, Tongue, Tract, Wall,
};
use tract::{cross, minus, mm};
use walls::{Across, Walls, are_apart};

use crate::{Section, TractError};

/// Number of strips on each side of a cross-section.
const STRIPS: usize = 50;

/// Distance from a place of the outer wall in the midsagittal plane to the surface of the tongue, m, along a direction in that plane and
/// at a lateral distance, m; negative where the tongue has passed through the wall, `None` where no tongue is opposite.
pub type ToTongue<'a> = &'a dyn Fn(ProfilePoint, ProfilePoint, f64) -> Option<f64>;

/// Derivatives of a section by the lengths of the two lines that bound it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Slopes {
    area: [f64; 2],
    length: [f64; 2],
}

/// The sections of a tract in a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Sections from the glottis to the lips.
    pub sections: Vec<Section>,
    /// The lines that bound all sections except those of the lips.
    pub across: Vec<Across>,
    /// Empty for a tongue in space, whose sections have no derivatives.
    slopes: Vec<Slopes>,
}

impl Profile {
    /// The sections of a tract around a tongue in the plane; `tongue` has its surface points from root to tip, m.
    pub fn new(tract: &Tract, tongue: &[ProfilePoint], posture: &Articulation) -> Result<Self, TractError> {
        let walls = Walls::new(tract, tongue, posture)?;
        let across = walls.lines_across()?;
        Self::with_areas(&walls, across, posture, |i, distance| {
            let [a, b] = [i, i + 1].map(|line| walls.starts[line].coefficients);
            let [alpha, beta] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            // alpha d^beta with d in cm gives cm^2.
            let value = 1e-4 * alpha * (distance * 1e2).powf(beta);
            [value, beta * value / distance]
        })
    }

    /// The sections of a tract around a tongue in space; `tongue` has its surface points in the midsagittal plane from root to tip, m.
    /// Derivatives by these points are not computed.
    ///
    /// # Errors
    /// [`TractError`], also for a tract without widths.
    pub fn in_space(
        tract: &Tract,
        tongue: &[ProfilePoint],
        posture: &Articulation,
        to_tongue: ToTongue<'_>,
    ) -> Result<Self, TractError> {
        let walls = Walls::new(tract, tongue, posture)?;
        let across = walls.lines_across()?;
        // Area of each cross-section over its distance across in the midsagittal plane, m.
        let mut widths = Vec::with_capacity(across.len());
        for (line, start) in across.iter().zip(&walls.starts) {
            let (middle, [alpha, beta, half_width, arch]) = (line.length(), start.coefficients);
            let area = if line.ends == [None; 2] {
                1e-4 * alpha * (middle * 1e2).powf(beta)
            } else if half_width.is_finite() && arch.is_finite() {
                let gap = |side: f64| {
                    let wall = arch * (side / half_width).powi(2);
                    to_tongue(line.outer, line.direction, side).map_or(0.0, |tongue| tongue - wall)
                };
                [-1.0, 1.0].iter().map(|sign| one_side(half_width, |side| gap(sign * side))).sum()
            } else {
                return Err(TractError(format!(
                    "wall `{}` has no half_width_mm and arch_mm, which cross-sections of a tongue in space need; add both to the tract",
                    start.wall
                )));
            };
            widths.push(area / middle);
        }
        let profile = Self::with_areas(&walls, across, posture, |i, distance| {
            let width = 0.5 * (widths[i] + widths[i + 1]);
            [width * distance, width]
        })?;
        Ok(Self { slopes: Vec::new(), ..profile })
    }

    /// The sections between lines across; `area_of` gives the area of a cross-section, m^2, and its derivative by its width, m, from the
    /// number of the section and this width.
    fn with_areas(
        walls: &Walls<'_>,
        across: Vec<Across>,
        posture: &Articulation,
        area_of: impl Fn(usize, f64) -> [f64; 2],
    ) -> Result<Self, TractError> {
        let mut sections = Vec::with_capacity(across.len() + 1);
        let mut slopes = Vec::with_capacity(across.len());
        for (i, pair) in across.windows(2).enumerate() {
            let between = between(&pair[0], &pair[1], |distance| area_of(i, distance));
            let (section, slope) = between
                .filter(|(section, _)| section.area_m2 > 0.0)
                .ok_or_else(|| {
                    TractError(format!(
                        "walls cross: lines across the airway meet at {} before they reach the wall opposite to the {}",
                        mm(pair[0].middle()),
                        walls.starts[i].wall
                    ))
                })?;
            sections.push(section);
            slopes.push(slope);
        }
        sections.extend(walls.tract.lip_sections(posture)?);
        Ok(Self { sections, across, slopes })
    }

    /// Distance from the glottis to the lips along the midline, m.
    pub fn length_m(&self) -> f64 {
        self.sections.iter().map(|s| s.length_m).sum()
    }

    /// Derivatives by the points of the tongue, from those by area and length of each section, as from
    /// [`rates`](crate::formants::rates): calls `part` with the number of a point and the derivative by its position.
    pub fn rates_by_tongue(&self, by_section: &[[f64; 2]], mut part: impl FnMut(usize, ProfilePoint)) {
        let mut by_line = vec![0.0; self.across.len()];
        for (i, (slope, [area, length])) in self.slopes.iter().zip(by_section).enumerate() {
            for end in 0..2 {
                by_line[i + end] += area * slope.area[end] + length * slope.length[end];
            }
        }
        for (line, rate) in self.across.iter().zip(by_line) {
            for (point, by) in line.ends.iter().flatten() {
                part(*point, [rate * by[0], rate * by[1]]);
            }
        }
    }
}

/// The section between two lines, or `None` if they cross; `area_of` gives the area of a cross-section, m^2, and its derivative by its
/// width, m.
fn between(first: &Across, second: &Across, area_of: impl Fn(f64) -> [f64; 2]) -> Option<(Section, Slopes)> {
    let way = minus(second.middle(), first.middle());
    let length = way[0].hypot(way[1]);
    // The sign of the quadrilateral's area depends on the direction of the airway.
    let (diagonal, other) = (minus(second.inner, first.outer), minus(second.outer, first.inner));
    let signed = 0.5 * cross(diagonal, other);
    let sign = signed.signum();
    let area = signed.abs();
    if length.is_nan() || length <= 0.0 || !are_apart(first, second) {
        return None;
    }
    let distance = area / length;
    let [value, by_distance] = area_of(distance);
    let way = [way[0] / length, way[1] / length];
    let mut slopes = Slopes::default();
    for (end, (line, turn)) in [(first, -1.0), (second, 1.0)].into_iter().enumerate() {
        let u = line.direction;
        slopes.length[end] = 0.5 * turn * (way[0] * u[0] + way[1] * u[1]);
        let by_inner = if end == 0 { -cross(diagonal, u) } else { cross(u, other) };
        let area_slope = sign * 0.5 * by_inner;
        slopes.area[end] = by_distance * (area_slope - distance * slopes.length[end]) / length;
    }
    Some((Section { length_m: length, area_m2: value }, slopes))
}

/// Area of a cross-section on one side, m^2: from the midsagittal plane to where the gap closes, at most to `half_width`.
fn one_side(half_width: f64, gap: impl Fn(f64) -> f64) -> f64 {
    let strip = half_width / STRIPS as f64;
    let gaps = (0..STRIPS).map(|i| gap((i as f64 + 0.5) * strip));
    gaps.take_while(|gap| *gap > 0.0).sum::<f64>() * strip
}
