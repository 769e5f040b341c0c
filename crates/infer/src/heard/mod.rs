//! The sound of a tongue: the tract around it, its formants, and their derivatives by every node.
//!
//! [`Airway`] joins the walls of a tract ([`tongue_sound`]) to the surface of a body in the plane. A formant
//! is an [`Observable`](tongue_core::observe::Observable) like a length: it has a value and a gradient by the
//! nodes, from which statics and inference get its derivatives by tensions.

mod airway;
mod formant;
mod in_space;
mod published;

pub use airway::{Airway, AirwayError, Rates, Sound};
pub use formant::{Heard, TRACT_SD};
pub use in_space::SpaceAirway;
pub use published::{MeanVowel, mean_vowels};
pub use tongue_sound::Formant;
pub use tongue_sound::profile::{Articulation, Tract};
