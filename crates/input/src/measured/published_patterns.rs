//! Published activation patterns of vowels, and their comparison with an answer. The data are in
//! `targets/fang2009_patterns.csv`.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::lengths::Vowel;
use super::muscles::Muscles;

const REFERENCE: &str = include_str!("../../../../targets/fang2009_patterns.csv");

/// Tension from which a muscle counts as active, N per metre of thickness.
pub const ACTIVE_N: f64 = 1e-3;

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Active {
    vowel: Vowel,
    /// The muscle, as [`MuscleInfo::group`](super::muscles::MuscleInfo::group) names it.
    group: String,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patterns(Vec<Active>);

/// Comparison of an answer with the published pattern of its vowel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PatternCheck {
    /// Expected muscles of which a portion was found active.
    pub found: Vec<String>,
    /// Expected muscles of which no portion was found active.
    pub missing: Vec<String>,
    pub unexpected: Vec<String>,
}

impl Patterns {
    /// The patterns of the Japanese vowels by Fang, Fujita, Lu and Dang (2009). Transversus and verticalis
    /// are not among the measured muscles; GGm is in none of the patterns.
    pub fn reference() -> Result<Self, csv::Error> {
        csv::Reader::from_reader(REFERENCE.as_bytes()).deserialize().collect::<Result<_, _>>().map(Self)
    }

    /// The muscles that are active in `vowel`; empty if nothing is published about it.
    pub fn of(&self, vowel: &Vowel) -> Vec<&str> {
        self.0.iter().filter(|a| a.vowel == *vowel).map(|a| a.group.as_str()).collect()
    }

    /// Compares tensions (N per metre of thickness, one for each of `names`) fitted for `vowel` with its
    /// pattern; `None` if nothing is published about the vowel. Muscles in no pattern, and expected muscles
    /// without a portion among `names`, are left out. Patterns are activations from rest, but tensions are
    /// changes against a baseline vowel, so a muscle may also be missing because the baseline uses it as
    /// much.
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

    #[test]
    fn the_published_answer_for_a_has_the_published_pattern_and_portions_count_for_their_muscle() {
        let (patterns, muscles) = (Patterns::reference().unwrap(), Muscles::reference().unwrap());
        let all: Vec<String> = muscles.all().iter().map(|m| m.name.clone()).collect();
        let check = |vowel: &str, tensions: &[(usize, f64)]| {
            let mut each = [0.0; 8];
            tensions.iter().for_each(|(m, t)| each[*m] = *t);
            patterns.check(&Vowel::new(vowel).unwrap(), &all, &each, &muscles).unwrap()
        };
        let a = check("a", &[(0, 12.0), (4, 11.5), (6, 4.5)]);
        assert_eq!(a.found, ["GGa", "HG", "SG"]);
        assert!(a.missing.is_empty() && a.unexpected.is_empty());
        let i = check("i", &[(7, 1.0), (2, 0.5 * ACTIVE_N)]);
        assert_eq!(i.missing, ["GGa", "GGp", "SG"]);
        assert_eq!(i.unexpected, ["HG"]);
        assert_eq!(patterns.of(&Vowel::unrounded_u()), ["GGa", "SG"]);
    }

    #[test]
    fn other_vowels_and_muscles_have_no_pattern() {
        let (patterns, muscles) = (Patterns::reference().unwrap(), Muscles::reference().unwrap());
        let schwa = Vowel::new("ə").unwrap();
        assert_eq!(patterns.check(&schwa, &["GGa".to_owned()], &[1.0], &muscles), None);
        let some = ["GGa".to_owned(), "mylohyoid".to_owned()];
        let check = patterns.check(&Vowel::unrounded_u(), &some, &[1.0, 1.0], &muscles).unwrap();
        assert_eq!(check.found, ["GGa"]);
        assert!(check.missing.is_empty() && check.unexpected.is_empty());
    }
}
