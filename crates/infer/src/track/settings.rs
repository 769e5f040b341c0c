//! How recordings are tracked.

use super::errors::Errors;
use super::link::Link;

/// How the tensions of recordings are found.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Prior of the tensions, and how they are parted from what is searched for.
    pub link: Link,
    /// Time over which tensions and slow errors are remembered, s; 0: every frame by itself.
    pub memory_s: f64,
    /// Errors of what is seen.
    pub errors: Errors,
    /// How much of what the frames say of the shape at rest is believed: 1 would be right of a model that is.
    pub trust: f64,
    /// Number of draws.
    pub draws: usize,
    /// Of their random numbers.
    pub seed: u64,
    /// Upper bound of every tension, N per metre of thickness: more than this is told as a bound.
    pub upper_n: f64,
    /// Whether every frame is checked to lie on the branch of equilibria that begins at rest.
    pub branch: bool,
    /// Most rounds of the search for the most probable tensions.
    pub rounds: usize,
}

/// Tensions beyond this part of the scale are told as a bound.
const BOUND: f64 = 5.4;

impl Settings {
    /// For tensions of this scale (usual: 20 N per metre of thickness), remembered for so long (usual: 0.1 s).
    pub fn new(scale_n: f64, memory_s: f64) -> Self {
        Self {
            link: Link::of_scale(scale_n),
            memory_s,
            errors: Errors::default(),
            trust: 0.5,
            draws: 1000,
            seed: 0,
            upper_n: BOUND * scale_n,
            branch: true,
            rounds: 40,
        }
    }
}
