//! An implausible property of a recording, and one that bones and coils share.

use tongue_core::geometry::Point;

use super::AlignedRecording;

/// An implausible property of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// What is wrong and what to do.
    pub said: String,
    /// Whether it makes every answer worthless.
    pub refused: bool,
}

impl Doubt {
    pub(super) fn told(said: String) -> Self {
        Self { said, refused: false }
    }

    pub(super) fn refused(said: String) -> Self {
        Self { said, refused: true }
    }
}

/// The line from the mental spine to the hyoid, and that along the coils, is less steep than this, rad.
const STEEPEST: f64 = 60.0 * std::f64::consts::PI / 180.0;
/// The doubt about points that should lie one behind the other and are apart by this, m, mostly upwards.
pub(super) fn exchanged_axes(seen: &AlignedRecording, apart: Point) -> Option<Doubt> {
    let steep = apart.y.abs() > STEEPEST.tan() * apart.x.abs();
    (steep && !seen.stated.axes).then(|| {
        Doubt::refused(
            "coils or bones that lie one behind the other are recorded one above the other: x and y seem to be exchanged; give back = \
             \"y\" and up = \"x\" in a map, with a minus before an axis that grows the other way"
                .to_owned(),
        )
    })
}
