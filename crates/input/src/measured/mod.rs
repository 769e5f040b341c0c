//! Measured muscle lengths and recordings, and the targets of fits made from lengths.
//!
//! ```text
//! targets/*.csv -> Dataset -> shortened muscles -> Target (ratios or stretches) -> observations
//! ```
//!
//! The built-in lengths are those of Takano and Honda (2007), printed to 1 mm in table 4.4 of the thesis (Kato 2014).

pub mod curves;
pub mod emg;
mod error;
pub mod lengths;
pub mod muscles;
pub mod published_patterns;
pub mod recording;
mod space_marks;
mod table;
mod target;
pub mod thesis;

pub use error::ReadError;
pub use lengths::{Dataset, Lengths, Vowel};
pub use muscles::ByMuscle;
pub use recording::Recording;
pub use space_marks::{
    LengthMeasure, Marked, SpaceFrame, SpaceMark, is_space_table, read_space_marks, space_marks_from,
};
pub use target::{Target, TargetKind, TargetOptions, reference_muscle};

/// The rows of a built-in table; a damaged one is empty, which tests exclude.
fn built_in_rows<T: serde::de::DeserializeOwned>(table: &str) -> Vec<T> {
    let rows = csv::Reader::from_reader(table.as_bytes()).into_deserialize();
    rows.collect::<Result<_, _>>().unwrap_or_default()
}
