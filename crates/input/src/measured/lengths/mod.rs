//! Tables of measured muscle lengths: any muscles and vowels, in the formats of spreadsheets and statistics programs.
//!
//! ```text
//! bytes -> cells (separator, header) -> columns -> rows -> Dataset (rows, and how the text was understood)
//! ```
//! [`Dataset::from_reader`] has the format.

mod columns;
mod dataset;
pub(in crate::measured) mod number;
pub mod plausibility;
mod read;
pub mod rest_distance;
pub(in crate::measured) mod text;
mod vowel;

pub use super::error::Malformed;
pub use dataset::{BrokenRow, Dataset, HalfWidth, ReadColumn, Reading, Separator, SetAside};
pub use number::{DecimalMark, LONGEST_MM, SHORTEST_MM, TableUnit};
pub use text::{Encoding, LineEnds};
pub use vowel::Vowel;

use super::error::ReadError;

use std::sync::Arc;

use serde::Serialize;

/// Floating-point tolerance, mm, so that 43.1 - 42.1 still counts as a change of exactly 1 mm.
const TOLERANCE_MM: f64 = 1e-9;

#[derive(Debug, Clone, PartialEq)]
pub struct Lengths {
    pub subject: String,
    pub vowel: Vowel,
    pub muscles: Arc<[String]>,
    /// Straight distance between the ends of each muscle, mm, 10 to 200; `None` if it was not measured.
    pub length_mm: Vec<Option<f64>>,
    /// Largest difference between the true and the printed length by rounding, mm.
    pub half_width_mm: Vec<f64>,
}

impl Lengths {
    /// `None` if the length was not measured or the table has no such muscle.
    pub fn length_mm_of(&self, muscle: &str) -> Option<f64> {
        *self.length_mm.get(position_of(&self.muscles, muscle)?)?
    }

    pub fn half_width_mm_of(&self, muscle: &str) -> Option<f64> {
        self.half_width_mm.get(position_of(&self.muscles, muscle)?).copied()
    }

    pub fn measured(&self) -> impl Iterator<Item = (&str, f64)> {
        self.muscles.iter().zip(&self.length_mm).filter_map(|(m, mm)| Some((m.as_str(), (*mm)?)))
    }

    /// Compares each length with that of `baseline` (thesis 4.3.2); `None` if one of the two was not measured. The two rows may come from
    /// tables with different muscles.
    pub fn activation(&self, baseline: &Self) -> Vec<Option<Activation>> {
        Vec::from_iter(self.muscles.iter().map(|name| {
            let change_mm = self.length_mm_of(name)? - baseline.length_mm_of(name)?;
            let rounding_mm = self.half_width_mm_of(name)? + baseline.half_width_mm_of(name)?;
            let uncertain = change_mm.abs() <= rounding_mm + TOLERANCE_MM;
            Some(Activation { change_mm, contracting: change_mm < 0.0, uncertain })
        }))
    }
}

/// Whether a muscle contracts: it is then shorter than in the baseline (thesis 4.3.2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Activation {
    /// Measured minus baseline length, mm; negative if shorter.
    pub change_mm: f64,
    pub contracting: bool,
    /// Whether rounding may have changed the sign: the change is at most the sum of both half widths.
    pub uncertain: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub line: u64,
    pub lengths: Lengths,
}

/// Position of `name` in `names`: the exact match, else the match that differs in case if there is only one.
pub fn position_of(names: &[String], name: &str) -> Option<usize> {
    let folded = name.trim().to_lowercase();
    names.iter().position(|n| n == name).or_else(|| {
        let mut alike = (0..names.len()).filter(|i| names[*i].to_lowercase() == folded);
        alike.next().filter(|_| alike.next().is_none())
    })
}
