//! From the walls of a tract in the midsagittal plane to its sections, with exact derivatives by the points
//! of the tongue.
//!
//! Lines across the airway begin at fixed places of the outer wall (larynx, pharynx, velum, palate, teeth)
//! and end where they first cross the inner wall (larynx, tongue, lower teeth). Two neighbouring lines bound
//! a section. Its length is the distance between their midpoints, and its width is the area between the four
//! end points over that length (Maeda 1979), which is right also for lines that are not quite perpendicular
//! to the airway. The area of the cross-section is `alpha d^beta` with the width d in cm (Heinz and Stevens
//! 1965). The lips are a short elliptic tube.

mod tract;
mod walls;

pub use tract::{Articulation, Carrier, Grid, Larynx, Lips, Teeth, Tongue, Tract, Wall};
pub use walls::ToTongue;

use crate::formants::Rate;
use crate::{Section, TractError};

/// A point, m.
pub type ProfilePoint = [f64; 2];

/// A line across the airway.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Across {
    /// Where it begins at the outer wall, m.
    pub outer: ProfilePoint,
    /// Where it meets the inner wall, m.
    pub inner: ProfilePoint,
    /// Direction from the outer wall, of length one.
    direction: ProfilePoint,
    /// Derivatives of its length by the two points of the inner wall between which it ends: number of the
    /// point of the tongue, and derivative.
    ends: [Option<(usize, ProfilePoint)>; 2],
}

impl Across {
    /// Distance across, m.
    fn length(&self) -> f64 {
        let way = minus(self.inner, self.outer);
        way[0].hypot(way[1])
    }

    /// Midpoint, m.
    pub fn middle(&self) -> ProfilePoint {
        [0.5 * (self.outer[0] + self.inner[0]), 0.5 * (self.outer[1] + self.inner[1])]
    }
}

/// Derivatives of a section by the lengths of the two lines that bound it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Slopes {
    area: [f64; 2],
    length: [f64; 2],
}

/// The areas of a tract.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Sections from the glottis to the lips.
    pub sections: Vec<Section>,
    /// The lines that bound all sections except those of the lips.
    pub across: Vec<Across>,
    /// Empty for cross-sections of a tongue in space, which have no derivatives.
    slopes: Vec<Slopes>,
}

impl Profile {
    /// The areas of a tract with a tongue (`tongue`: surface points from root to tip, m) in a posture.
    pub fn new(tract: &Tract, tongue: &[ProfilePoint], posture: &Articulation) -> Result<Self, TractError> {
        let walls = walls::Walls::new(tract, tongue, posture)?;
        let across = walls.across()?;
        let mut sections = Vec::with_capacity(across.len() + 1);
        let mut slopes = Vec::with_capacity(across.len());
        for (i, pair) in across.windows(2).enumerate() {
            let [alpha, beta] = walls.coefficients(i);
            // alpha d^beta with d in cm gives cm^2.
            let (section, slope) = between(&pair[0], &pair[1], |distance: f64| {
                let value = 1e-4 * alpha * (distance * 1e2).powf(beta);
                [value, beta * value / distance]
            })
            .ok_or_else(|| TractError::Crossed(walls.name(i).to_owned(), pair[0].middle()))?;
            sections.push(section);
            slopes.push(slope);
        }
        sections.extend(tract.lip_sections(posture)?);
        Ok(Self { sections, across, slopes })
    }

    /// Distance from the glottis to the lips along the midline, m.
    pub fn length_m(&self) -> f64 {
        self.sections.iter().map(|s| s.length_m).sum()
    }

    /// Converts derivatives by the sections (each by area and by length) to derivatives by the points of the
    /// tongue: calls `part` with the number of a point and the derivative by its position.
    pub fn to_tongue(&self, by_section: &[[f64; 2]], mut part: impl FnMut(usize, ProfilePoint)) {
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

    /// As [`Self::to_tongue`], for the frequency of a formant, Hz/m, from its derivatives by the sections.
    pub fn frequency_to_tongue(&self, rates: &[Rate], part: impl FnMut(usize, ProfilePoint)) {
        let each: Vec<_> = rates.iter().map(|r| [r.frequency_by_area, r.frequency_by_length]).collect();
        self.to_tongue(&each, part);
    }
}

fn cross(a: ProfilePoint, b: ProfilePoint) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn minus(a: ProfilePoint, b: ProfilePoint) -> ProfilePoint {
    [a[0] - b[0], a[1] - b[1]]
}

/// Whether both ends of each line are on the same side of the other, the side to which the airway runs.
fn are_apart(first: &Across, second: &Across) -> bool {
    let sign = cross(minus(second.inner, first.outer), minus(second.outer, first.inner)).signum();
    let side = |line: &Across, p: ProfilePoint| sign * cross(line.direction, minus(p, line.outer));
    side(first, second.inner) > 0.0
        && side(first, second.outer) > 0.0
        && side(second, first.inner) < 0.0
        && side(second, first.outer) < 0.0
}

/// The section between two lines, with an area and its derivative from the distance across; `None` if the lines cross.
fn between(first: &Across, second: &Across, area_of: impl Fn(f64) -> [f64; 2]) -> Option<(Section, Slopes)> {
    let way = minus(second.middle(), first.middle());
    let length = way[0].hypot(way[1]);
    // The corners in order; the sign is the direction in which the airway runs.
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
