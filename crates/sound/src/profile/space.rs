//! Areas from cross-sections of a tongue in space.
//!
//! A cross-section lies in the plane of a line across the airway and the direction to the side. It is bounded by the surface of the
//! tongue and by the wall, whose cross-section is a parabola of the width and the arch that the tract gives. It reaches from the middle
//! to both sides as far as the tongue is opposite to the wall, at most half of the width. Where a line meets no tongue (larynx, lower
//! teeth) its area is `alpha d^beta`, as in the plane.

use super::walls::Walls;
use super::{Articulation, Point, Profile, ProfileError, Tract, between};

/// Number of strips on each side of a cross-section.
const STRIPS: usize = 50;

/// Distance from a place of the outer wall in the midsagittal plane to the surface of the tongue, m, along a direction in that plane and at a
/// distance to the side, m; negative behind the wall, `None` where no tongue is opposite.
pub type ToTongue<'a> = &'a dyn Fn(Point, Point, f64) -> Option<f64>;

impl Profile {
    /// The areas of a tract with a tongue in space in a posture: `tongue` are the points of its surface in the midsagittal plane from root to
    /// tip, m. Derivatives by the points are not computed.
    ///
    /// # Errors
    /// [`ProfileError`]; [`ProfileError::Bad`] too for a tract without widths.
    pub fn in_space(
        tract: &Tract,
        tongue: &[Point],
        posture: &Articulation,
        to_tongue: ToTongue<'_>,
    ) -> Result<Self, ProfileError> {
        let walls = Walls::new(tract, tongue, posture)?;
        let across = walls.across()?;
        // Area of the cross-section over the distance in the middle, m.
        let mut widths = Vec::with_capacity(across.len());
        for (i, line) in across.iter().enumerate() {
            let middle = line.length();
            let area = if line.ends.iter().any(Option::is_some) {
                let [half_width, arch] = walls.section(i)?;
                let gap = |side: f64| {
                    let wall = arch * (side / half_width).powi(2);
                    to_tongue(line.outer, line.direction, side).map_or(0.0, |tongue| tongue - wall)
                };
                [-1.0, 1.0].iter().map(|sign| one_side(half_width, |side| gap(sign * side))).sum()
            } else {
                let [alpha, beta] = walls.area(i);
                1e-4 * alpha * (middle * 1e2).powf(beta)
            };
            widths.push(area / middle);
        }
        let mut sections = Vec::with_capacity(across.len() + 1);
        for (i, pair) in across.windows(2).enumerate() {
            let width = 0.5 * (widths[i] + widths[i + 1]);
            let crossed = || ProfileError::Crossed(walls.name(i).to_owned(), pair[0].middle());
            let (section, _) = between(&pair[0], &pair[1], |d| [width * d, width]).ok_or_else(crossed)?;
            if section.area_m2 <= 0.0 {
                return Err(crossed());
            }
            sections.push(section);
        }
        sections.extend(tract.lip_sections(posture)?);
        Ok(Self { sections, across, slopes: Vec::new() })
    }
}

/// Area from the middle to where the gap closes, at most to a half width, m2.
fn one_side(half_width: f64, gap: impl Fn(f64) -> f64) -> f64 {
    let strip = half_width / STRIPS as f64;
    let gaps = (0..STRIPS).map(|i| gap((i as f64 + 0.5) * strip));
    gaps.take_while(|gap| *gap > 0.0).sum::<f64>() * strip
}
