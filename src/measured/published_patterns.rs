//! Published activation patterns of vowels, and how an answer compares with them. Data, in `targets/fang2009_patterns.csv`.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::lengths::Vowel;
use super::muscles::Muscles;

const REFERENCE: &str = include_str!("../../targets/fang2009_patterns.csv");

/// Tension from which a muscle counts as active, N per metre of thickness.
pub const ACTIVE_N: f64 = 1e-3;

/// A muscle that is active in a vowel.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Active {
    vowel: Vowel,
    /// The muscle, as [`MuscleInfo::group`](super::muscles::MuscleInfo::group) names it.
    group: String,
}

/// Which muscles are active in which vowel.
#[derive(Debug, Clone, PartialEq)]
pub struct Patterns(Vec<Active>);

/// An answer beside the published pattern of its vowel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PatternCheck {
    /// Expected, and at least one portion came out active.
    pub found: Vec<String>,
    /// Expected, but no portion came out active.
    pub missing: Vec<String>,
    /// Not expected, but a portion came out active.
    pub unexpected: Vec<String>,
}

impl Patterns {
    /// What Fang, Fujita, Lu and Dang (2009) report of the Japanese vowels. Transversus and verticalis are not among
    /// the measured muscles; GGm is in none of the patterns.
    ///
    /// # Errors
    /// A damaged table; a test holds that the built-in one is whole.
    pub fn reference() -> Result<Self, csv::Error> {
        csv::Reader::from_reader(REFERENCE.as_bytes()).deserialize().collect::<Result<_, _>>().map(Self)
    }

    /// The muscles that are active in `vowel`: empty where nothing is published of it.
    pub fn of(&self, vowel: &Vowel) -> Vec<&str> {
        self.0.iter().filter(|a| a.vowel == *vowel).map(|a| a.group.as_str()).collect()
    }

    /// Compares tensions (N per metre, one for each of `names`) fitted for `vowel` with its pattern; `None` where nothing is
    /// published of the vowel. Muscles that are in no pattern, and expected ones without a portion among `names`, are left
    /// out. Patterns are activations from rest, the tensions changes against a baseline vowel, so that a missing muscle may
    /// also be one that the baseline uses as much.
    pub fn check(
        &self,
        vowel: &Vowel,
        names: &[String],
        tensions: &[f64],
        muscles: &Muscles,
    ) -> Option<PatternCheck> {
        let expected = self.of(vowel);
        if expected.is_empty() {
            return None;
        }
        let mut check = PatternCheck { found: Vec::new(), missing: Vec::new(), unexpected: Vec::new() };
        let infos = muscles.of(names);
        for group in self.0.iter().map(|a| a.group.as_str()).collect::<BTreeSet<_>>() {
            let mut portions = infos.iter().zip(tensions).filter(|(info, _)| info.group == group).peekable();
            if portions.peek().is_none() {
                continue;
            }
            let active = portions.any(|(_, tension)| *tension > ACTIVE_N);
            match (expected.contains(&group), active) {
                (true, true) => check.found.push(group.to_owned()),
                (true, false) => check.missing.push(group.to_owned()),
                (false, true) => check.unexpected.push(group.to_owned()),
                (false, false) => {}
            }
        }
        Some(check)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::patterns as old;
    use crate::muscle::Muscle;

    fn names(groups: &[old::Group]) -> Vec<String> {
        groups.iter().map(|g| serde_json::to_value(g).unwrap().as_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn every_answer_compares_as_with_the_constants() {
        let (patterns, muscles) = (Patterns::reference().unwrap(), Muscles::reference().unwrap());
        let all = Muscle::ALL.map(|m| m.name().to_owned());
        for vowel in crate::measured::Vowel::ALL {
            let label = Vowel::new(vowel.symbol()).unwrap();
            assert_eq!(patterns.of(&label), names(old::published(vowel)));
            for subset in 0u32..256 {
                let tensions: [f64; 8] =
                    std::array::from_fn(|i| if subset >> i & 1 == 1 { 2e-3 } else { 5e-4 });
                let (new, before) =
                    (patterns.check(&label, &all, &tensions, &muscles), old::check(vowel, &tensions));
                let before = PatternCheck {
                    found: names(&before.found),
                    missing: names(&before.missing),
                    unexpected: names(&before.unexpected),
                };
                assert_eq!(new, Some(before), "{vowel} {subset:08b}");
            }
        }
    }

    #[test]
    fn of_other_vowels_and_muscles_nothing_is_said() {
        let (patterns, muscles) = (Patterns::reference().unwrap(), Muscles::reference().unwrap());
        let schwa = Vowel::new("ə").unwrap();
        assert_eq!(patterns.check(&schwa, &["GGa".to_owned()], &[1.0], &muscles), None);
        let some = ["GGa".to_owned(), "mylohyoid".to_owned()];
        let check = patterns.check(&Vowel::unrounded_u(), &some, &[1.0, 1.0], &muscles).unwrap();
        assert_eq!(check.found, ["GGa"]);
        assert!(check.missing.is_empty() && check.unexpected.is_empty());
    }
}
