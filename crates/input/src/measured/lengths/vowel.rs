use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::ReadError;
use super::text::{LONGEST, clip, fold};

/// The kana of each Japanese vowel (hiragana, katakana and half-width katakana), and its Latin letter.
const KANA: [(&str, &str); 5] =
    [("あアｱ", "a"), ("いイｲ", "i"), ("うウｳ", "ɯ"), ("えエｴ", "e"), ("おオｵ", "o")];

/// The label of a vowel: the text of the table without surrounding spaces and slashes, in Unicode's form NFC (in which letters that look
/// the same are equal), with a Latin letter for the kana of a Japanese vowel. Ordered as text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String")]
pub struct Vowel(String);

impl Vowel {
    /// Reads `a`, `/a/` or `[a]`; `u` stands for `ɯ`, which few keyboards have.
    pub fn new(label: &str) -> Result<Self, ReadError> {
        let vowel: Self = label.parse()?;
        Ok(if vowel.0 == "u" { Self::unrounded_u() } else { vowel })
    }

    /// /ɯ/, the default baseline (thesis 4.3.2).
    pub fn unrounded_u() -> Self {
        Self("ɯ".to_owned())
    }

    pub fn label(&self) -> &str {
        &self.0
    }

    /// Whether two labels are equal but for upper and lower case, and `u` for `ɯ`.
    pub fn is_like(&self, other: &Self) -> bool {
        let [own, other] = [self, other].map(|v| match v.0.to_lowercase() {
            u if u == "u" => "ɯ".to_owned(),
            other => other,
        });
        own == other
    }

    /// The labels as messages have them: `/i/, /e/`.
    pub fn list(vowels: &[Vowel]) -> String {
        match vowels {
            [] => "no row that can be used".to_owned(),
            some => some.iter().map(|v| format!("/{v}/")).collect::<Vec<_>>().join(", "),
        }
    }
}

impl fmt::Display for Vowel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl FromStr for Vowel {
    type Err = ReadError;

    /// Reads a label as [`Vowel::new`] does but keeps `u`, for tables that have both. Without a row in `u`, `u` also finds that in `ɯ`.
    fn from_str(label: &str) -> Result<Self, Self::Err> {
        let folded = fold(label);
        let bare = &*folded;
        let within = |open, close| bare.strip_prefix(open).and_then(|rest| rest.strip_suffix(close));
        let bare = within('/', '/').or_else(|| within('[', ']')).unwrap_or(bare).trim();
        if bare.is_empty() || bare.contains(char::is_control) || bare.chars().nth(LONGEST).is_some() {
            let message = format!("{:?} is not a label of a vowel", clip(label));
            let help = format!("write one of 1 to {LONGEST} printable characters, like a, ɔ or ə");
            return Err(ReadError::Refused(format!("{message}; {help}")));
        }
        let is_one = bare.chars().count() == 1;
        let kana = KANA.iter().find(|(kana, _)| is_one && kana.contains(bare));
        Ok(Self(kana.map_or(bare, |(_, latin)| latin).to_owned()))
    }
}

impl TryFrom<String> for Vowel {
    type Error = ReadError;

    fn try_from(label: String) -> Result<Self, Self::Error> {
        label.parse()
    }
}
