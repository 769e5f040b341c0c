//! The five vowels of Japanese.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::suggest;

/// A vowel of Japanese, in the order of thesis table 4.4; written by its IPA [`symbol`](Vowel::symbol).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Vowel {
    /// /i/
    #[serde(rename = "i")]
    I,
    /// /e/
    #[serde(rename = "e")]
    E,
    /// /a/
    #[serde(rename = "a")]
    A,
    /// /o/
    #[serde(rename = "o")]
    O,
    /// /ɯ/, the unrounded u; `u` is read as the same.
    #[serde(rename = "ɯ", alias = "u")]
    U,
}

impl Vowel {
    /// Number of vowels.
    pub const COUNT: usize = 5;

    /// All vowels, in the order of thesis table 4.4.
    pub const ALL: [Vowel; Vowel::COUNT] = [Vowel::I, Vowel::E, Vowel::A, Vowel::O, Vowel::U];

    /// The IPA symbol, without slashes.
    pub const fn symbol(self) -> &'static str {
        match self {
            Vowel::I => "i",
            Vowel::E => "e",
            Vowel::A => "a",
            Vowel::O => "o",
            Vowel::U => "ɯ",
        }
    }

    /// Position in [`Vowel::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// `vowels` as a reader sees them in a message: `/i/, /e/`.
    pub(super) fn list(vowels: &[Vowel]) -> String {
        vowels.iter().map(|v| format!("/{v}/")).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Vowel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.symbol())
    }
}

/// A name that is none of the five vowels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown vowel \"{name}\"; {}", suggest::hint(name, Vowel::ALL.map(Vowel::symbol).into_iter().chain(["u"])))]
pub struct UnknownVowel {
    /// What was given.
    pub name: String,
}

impl FromStr for Vowel {
    type Err = UnknownVowel;

    /// Reads `a`, `A` or `/a/`; `u` stands for `ɯ`, which few keyboards have.
    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let trimmed = name.trim();
        let bare = trimmed.strip_prefix('/').and_then(|rest| rest.strip_suffix('/')).unwrap_or(trimmed);
        match bare.to_lowercase().as_str() {
            "u" => Ok(Vowel::U),
            symbol => Vowel::ALL
                .into_iter()
                .find(|v| v.symbol() == symbol)
                .ok_or_else(|| UnknownVowel { name: name.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_a_vowel_is_read() {
        for vowel in Vowel::ALL {
            let symbol = vowel.symbol();
            for spelling in [symbol.to_owned(), symbol.to_uppercase(), format!(" /{symbol}/ ")] {
                assert_eq!(spelling.parse(), Ok(vowel), "{spelling}");
            }
            assert_eq!(Vowel::ALL[vowel.index()], vowel);
        }
        for spelling in ["u", "U", "/u/", "ɯ", "Ɯ"] {
            assert_eq!(spelling.parse(), Ok(Vowel::U), "{spelling}");
        }
    }

    #[test]
    fn unknown_vowel_names_the_nearest_and_the_known() {
        let message = "aa".parse::<Vowel>().unwrap_err().to_string();
        assert_eq!(message, "unknown vowel \"aa\"; did you mean \"a\"? (known: i, e, a, o, ɯ, u)");
        for wrong in ["", "/", "//", "/a", "schwa"] {
            assert!(wrong.parse::<Vowel>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn json_holds_the_symbol() {
        assert_eq!(serde_json::to_string(&Vowel::ALL).unwrap(), r#"["i","e","a","o","ɯ"]"#);
        assert_eq!(serde_json::from_str::<[Vowel; 2]>(r#"["u","ɯ"]"#).unwrap(), [Vowel::U; 2]);
    }
}
