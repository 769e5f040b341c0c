//! What a fit has to hit: measured muscle lengths, which muscles contract, and the numbers to match.
//!
//! ```text
//! targets/*.csv -> Dataset -> activation (who shortened) -> Target (ratios or stretches) -> fit
//! ```
//!
//! Lengths are those of Takano and Honda (2007), printed in table 4.4 of the thesis (Kato 2014) to 1 mm;
//! files of the same format take their place ([`Dataset::from_path`]).

mod activation;
mod dataset;
mod error;
mod kind;
pub mod lengths;
pub mod muscles;
pub mod patterns;
pub mod published;
pub mod published_patterns;
mod record;
pub mod rest_shape;
mod spec;
pub mod thesis;
mod vowel;

pub use activation::{Activation, ROUNDING_MM, activation};
pub use dataset::Dataset;
pub use error::Error;
pub use kind::{TargetKind, UnknownTargetKind};
pub use record::{Lengths, Row};
pub use spec::{Target, TargetOptions};
pub use vowel::{UnknownVowel, Vowel};
