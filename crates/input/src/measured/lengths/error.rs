//! Errors of tables of lengths and of looking up rows in them.

use std::io;

use serde::Serialize;

use super::Vowel;
use crate::files::advice;

/// A fault of the table, with its place.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{origin}:{line}:{column}: {what}; {help}")]
pub struct Malformed {
    /// File name or other description of where the data came from.
    pub origin: String,
    /// Line in the file, from 1.
    pub line: u64,
    /// Column of the table (field of the line, not character), from 1; for a missing field, its expected
    /// column.
    pub column: usize,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub help: String,
}

/// An unusable row, with its subject and vowel if they can be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BrokenRow {
    /// The subject.
    pub subject: Option<String>,
    /// The vowel.
    pub vowel: Option<Vowel>,
    /// What is wrong.
    pub fault: Malformed,
}

/// Why a table could not be read or looked up. Each message says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "fields without a unit are in the messages")]
pub enum LengthsError {
    /// The file could not be opened or read.
    #[error("cannot read {origin}: {source}; {}", advice(source))]
    Unreadable { origin: String, source: io::Error },
    /// The file is not a table of lengths, or the requested row is broken.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// No row has this subject.
    #[error("unknown subject {name:?} in {origin}; {hint}")]
    UnknownSubject { origin: String, name: String, hint: String },
    /// The subject has rows, but not for this vowel.
    #[error("{subject} has no row for /{vowel}/ in {origin}; it has {}", Vowel::list(has))]
    MissingRow { origin: String, subject: String, vowel: Vowel, has: Vec<Vowel> },
    /// None of the subjects has a row for this vowel.
    #[error("{origin} has no row for /{vowel}/; it has {}", Vowel::list(has))]
    UnknownVowel { origin: String, vowel: Vowel, has: Vec<Vowel> },
    /// The subject has no row for the baseline vowel.
    #[error(
        "{subject} has no row for the baseline vowel /{vowel}/ in {origin}; it has {}: choose one of these as \
         the baseline instead",
        Vowel::list(has)
    )]
    MissingBaseline { origin: String, subject: String, vowel: Vowel, has: Vec<Vowel> },
    /// The half width of rounding is out of range.
    #[error("the half width of rounding is {mm} mm; give one from 0 to {largest} mm, like 0.5")]
    BadHalfWidth {
        /// The given value, mm.
        mm: f64,
        /// The largest allowed value, mm.
        largest: f64,
    },
}

/// A place in the table, from which errors are made.
#[derive(Clone, Copy)]
pub(in crate::measured) struct Place<'a> {
    pub origin: &'a str,
    pub line: u64,
    pub column: usize,
}

impl Place<'_> {
    pub fn error(self, what: impl Into<String>, help: impl Into<String>) -> Malformed {
        let Place { origin, line, column } = self;
        Malformed { origin: origin.to_owned(), line, column, what: what.into(), help: help.into() }
    }

    pub fn at_column(self, column: usize) -> Self {
        Place { column, ..self }
    }
}
