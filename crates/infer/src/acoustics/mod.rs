//! The sound of a tongue: the tract around it, its formants, and their derivatives by every node.
//!
//! [`VocalTract`] joins the walls of a tract ([`tongue_sound`]) to the surface of a body in the plane. A formant is an
//! [`Observable`](tongue_core::observe::Observable) with a value and a gradient by the nodes, from which statics and inference get its
//! derivatives by tensions.

mod formant;
mod in_space;
mod vocal_tract;

pub use formant::{FormantFrequency, MeanVowel, TRACT_SD, mean_vowels, nearest_vowel};
pub use in_space::SpaceVocalTract;
pub use tongue_sound::Formant;
pub use tongue_sound::profile::{Articulation, Tract};
pub use vocal_tract::{FormantRates, Sound, VocalTract, VocalTractError};
