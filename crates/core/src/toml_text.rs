//! Values from TOML and JSON, and messages with the line and column of a mistake.

use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error as _};

use crate::choice;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misread {
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    pub problem: String,
}

/// An array of exactly `N` values, of which the TOML reader would ignore further ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exactly<T, const N: usize>(pub [T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Exactly<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::deserialize(deserializer)?;
        let count = values.len();
        let all = values.try_into().map(Self);
        all.map_err(|_| D::Error::custom(format!("there are {count} values in place of exactly {N}")))
    }
}

pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, Misread> {
    toml::from_str(text).map_err(|error| {
        let (line, column) = line_and_column(text, error.span().map_or(0, |span| span.start));
        Misread { line, column, problem: reworded(error.message()) }
    })
}

/// A message of serde or of the TOML reader in words of this program.
pub fn reworded(message: &str) -> String {
    const WORDS: [(&str, &str); 16] = [
        ("invalid type: ", "there is a wrong kind of value, "),
        ("invalid value: ", "there is a wrong value, "),
        ("invalid length ", "there is a wrong number of values, "),
        ("missing field ", "there is no value for "),
        ("duplicate field ", "there are two values for "),
        ("EOF while parsing ", "the text ends too early, within "),
        ("expected value", "there is no value that can be read"),
        ("trailing characters", "there is more text after the end"),
        ("key must be a string", "a name must be in double quotes"),
        ("string values must be quoted", "a word must be in double quotes, and a number must be all digits"),
        ("unexpected key or value", "there is more on the line than one value"),
        ("key with no value", "there is a name without = and a value"),
        ("invalid boolean", "there is a wrong value; it must be true or false"),
        ("duplicate key", "this name is given a second time; keep one of the two"),
        ("invalid unquoted key", "a name of other than letters, digits, _ and - must be in double quotes"),
        ("unexpected character in array", "values between [ and ] must be separated by commas"),
    ];
    let serde = WORDS.iter().find_map(|(of_serde, ours)| Some((message.strip_prefix(of_serde)?, ours)));
    match serde {
        // The TOML reader's expectation is left out, because its words explain nothing.
        Some((rest, ours)) if rest.starts_with(", expected") && !ours.ends_with(' ') => (*ours).to_owned(),
        Some((rest, ours)) => {
            let needed = rest.replace(", expected ", "; needed is ").replace(" as i128", "");
            format!("{ours}{}", needed.replace("needed is f64", "needed is a number"))
        }
        None => message.to_owned(),
    }
}

/// A message of serde, with the nearest known name if it is about an unknown field or variant.
pub fn with_nearest(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().filter(|_| message.starts_with("unknown "));
    match unknown.and_then(|name| choice::nearest(name, quoted)) {
        Some(near) => format!("{message}; did you mean `{near}`?"),
        None => message.to_owned(),
    }
}

/// Line and column in characters, both from 1, of a byte of a text.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let column = before.rsplit('\n').next().map_or(0, |line| line.chars().count());
    (before.matches('\n').count() + 1, column + 1)
}
