//! Published patterns of muscle activation in vowels, from `targets/fang2009_patterns.csv`, and their comparison with fitted tensions.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::built_in_rows;
use super::lengths::Vowel;
use super::muscles::Muscles;

const REFERENCE: &str = include_str!("../../../../targets/fang2009_patterns.csv");

/// Tension above which a muscle counts as active, N per metre of thickness.
pub const ACTIVE_N: f64 = 1e-3;

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct PatternActivity {
    vowel: Vowel,
    group: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Patterns(Vec<PatternActivity>);

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PatternCheck {
    /// Active muscles of the pattern of which a portion has a tension.
    pub found: Vec<String>,
    /// Active muscles of the pattern of which no portion has a tension.
    pub missing: Vec<String>,
    pub unexpected: Vec<String>,
}

impl Patterns {
    /// The patterns of the Japanese vowels by Fang, Fujita, Lu and Dang (2009). Their transversus and verticalis are not among the measured
    /// muscles; GGm is in none of the patterns.
    pub fn reference() -> &'static Self {
        static BUILT_IN: LazyLock<Patterns> = LazyLock::new(|| Patterns(built_in_rows(REFERENCE)));
        &BUILT_IN
    }

    /// The muscles that are active in `vowel`; empty if nothing is published about it.
    pub fn muscles(&self, vowel: &Vowel) -> Vec<&str> {
        self.0.iter().filter(|a| a.vowel == *vowel).map(|a| a.group.as_str()).collect()
    }

    /// Compares the tensions fitted for `vowel` (N per metre of thickness, one for each of `names`) with its pattern; `None` if nothing is
    /// published about the vowel. Muscles in no pattern, and muscles of the pattern without a portion among `names`, are left out. A
    /// pattern counts activation from rest, but a tension the change from a baseline vowel, so a muscle may also be missing because the
    /// baseline uses it as much.
    pub fn check(&self, vowel: &Vowel, names: &[String], tensions: &[f64]) -> Option<PatternCheck> {
        let expected = self.muscles(vowel);
        if expected.is_empty() {
            return None;
        }
        let mut check = PatternCheck { found: Vec::new(), missing: Vec::new(), unexpected: Vec::new() };
        let infos = Muscles::built_in().info(names);
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
