//! Published activation patterns of the Japanese vowels, and how an answer compares with them.

use serde::Serialize;

use super::Vowel;
use crate::muscle::{Muscle, PerMuscle};

/// A muscle as the published patterns name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Group {
    /// Anterior genioglossus.
    GGa,
    /// Posterior genioglossus.
    GGp,
    /// Hyoglossus.
    HG,
    /// Styloglossus.
    SG,
}

impl Group {
    /// The portions measured here that belong to it.
    pub const fn portions(self) -> &'static [Muscle] {
        match self {
            Group::GGa => &[Muscle::GGa],
            Group::GGp => &[Muscle::GGp],
            Group::HG => &[Muscle::HGa, Muscle::HGp],
            Group::SG => &[Muscle::SGp, Muscle::SGm, Muscle::SGa],
        }
    }
}

/// Tension from which a muscle counts as active, N per metre of thickness.
pub const ACTIVE_N: f64 = 1e-3;

/// The muscles that Fang, Fujita, Lu and Dang (2009) report active in a vowel. Transversus and verticalis (in /a/) are not
/// among the measured muscles; GGm is in none of the patterns.
pub const fn published(vowel: Vowel) -> &'static [Group] {
    match vowel {
        Vowel::A | Vowel::O => &[Group::GGa, Group::HG, Group::SG],
        Vowel::I | Vowel::E => &[Group::GGa, Group::GGp, Group::SG],
        Vowel::U => &[Group::GGa, Group::SG],
    }
}

/// An answer beside the published pattern of its vowel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PatternCheck {
    /// Expected, and at least one portion came out active.
    pub found: Vec<Group>,
    /// Expected, but no portion came out active.
    pub missing: Vec<Group>,
    /// Not expected, but a portion came out active.
    pub unexpected: Vec<Group>,
}

/// Compares tensions (N) fitted for `vowel` with its published pattern. Patterns are activations from rest, the tensions
/// changes against a baseline vowel, so that a missing muscle may also be one that the baseline uses as much.
pub fn check(vowel: Vowel, tensions: &PerMuscle<f64>) -> PatternCheck {
    let active = |g: &Group| g.portions().iter().any(|m| tensions[m.index()] > ACTIVE_N);
    let expected = |g: &Group| published(vowel).contains(g);
    let which = |keep: &dyn Fn(&Group) -> bool| -> Vec<Group> {
        [Group::GGa, Group::GGp, Group::HG, Group::SG].into_iter().filter(keep).collect()
    };
    PatternCheck {
        found: which(&|g| expected(g) && active(g)),
        missing: which(&|g| expected(g) && !active(g)),
        unexpected: which(&|g| !expected(g) && active(g)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_answer_for_a_has_the_published_pattern() {
        let mut tensions = [0.0; 8];
        for (m, t) in super::super::published::TENSIONS_A_N {
            tensions[m.index()] = t;
        }
        let check = check(Vowel::A, &tensions);
        assert_eq!(check.found, [Group::GGa, Group::HG, Group::SG]);
        assert!(check.missing.is_empty() && check.unexpected.is_empty());
    }

    #[test]
    fn portions_count_for_their_muscle_and_others_are_unexpected() {
        let mut tensions = [0.0; 8];
        tensions[Muscle::HGp.index()] = 1.0;
        tensions[Muscle::GGp.index()] = 0.5 * ACTIVE_N;
        let check = check(Vowel::I, &tensions);
        assert_eq!(check.missing, [Group::GGa, Group::GGp, Group::SG]);
        assert_eq!(check.unexpected, [Group::HG]);
    }
}
