//! A vocal tract as a chain of cylinders.

use serde::{Deserialize, Serialize};

/// A short cylinder of the tract. A tract is a list of them from the glottis to the lips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Length along the midline, m.
    pub length_m: f64,
    /// Area of the cross-section, m^2.
    pub area_m2: f64,
}

impl Section {
    /// Whether the sound of the section can be computed: length and area are finite and positive.
    pub fn is_open(&self) -> bool {
        let fine = |v: f64| v.is_finite() && v > 0.0;
        fine(self.length_m) && fine(self.area_m2)
    }
}
