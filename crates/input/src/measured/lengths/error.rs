//! Errors of tables of lengths, of looking up rows in them, and of making a target from them.

use std::io;

use serde::Serialize;

use super::{BadLabel, Vowel};
use crate::files::advice;
use tongue_core::suggest;

#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{origin}:{line}:{column}: {what}; {help}")]
pub struct Malformed {
    /// The file, or another description of where the data came from.
    pub origin: String,
    pub line: u64,
    /// Column of the table (field of the line, not character), from 1.
    pub column: usize,
    pub what: String,
    pub help: String,
}

/// An unusable row, with its subject and vowel if they can be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BrokenRow {
    pub subject: Option<String>,
    pub vowel: Option<Vowel>,
    pub fault: Malformed,
}

/// Why lengths could not be read, looked up or made a target. Each message says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum LengthsError {
    #[error("cannot read {origin}: {source}; {}", advice(source))]
    Unreadable { origin: String, source: io::Error },
    /// The file is not a table of lengths, or the requested row is broken.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    #[error("unknown subject {name:?} in {origin}; {hint}")]
    UnknownSubject { origin: String, name: String, hint: String },
    #[error("{subject} has no row for /{vowel}/ in {origin}; it has {}", Vowel::list(has))]
    MissingRow { origin: String, subject: String, vowel: Vowel, has: Vec<Vowel> },
    #[error("{origin} has no row for /{vowel}/; it has {}", Vowel::list(has))]
    UnknownVowel { origin: String, vowel: Vowel, has: Vec<Vowel> },
    #[error(
        "{subject} has no row for the baseline vowel /{vowel}/ in {origin}; it has {}: choose one of these as \
         the baseline instead",
        Vowel::list(has)
    )]
    MissingBaseline { origin: String, subject: String, vowel: Vowel, has: Vec<Vowel> },
    #[error("the half width of rounding is {mm} mm; give one from 0 to {largest} mm, like 0.5")]
    BadHalfWidth { mm: f64, largest: f64 },
    #[error(transparent)]
    Vowel(#[from] BadLabel),
    #[error(
        "/{vowel}/ of {subject} is the baseline itself, so there is nothing to fit; choose another vowel or \
         another baseline"
    )]
    IsBaseline { subject: String, vowel: Vowel },
    #[error(
        "{muscle} of {subject} is {mm} mm in /{vowel}/ and {baseline_mm} mm in /{baseline}/, but no muscle of a tongue changes its length \
         to less than 0.5 or more than 1.7 times; correct the length that is wrong, or leave it empty"
    )]
    Impossible { muscle: String, subject: String, vowel: Vowel, mm: f64, baseline: Vowel, baseline_mm: f64 },
    #[error(
        "no muscle of {subject} is shorter in /{vowel}/ than in /{baseline}/, so none contracts; name the \
         contracting muscles yourself"
    )]
    NoContraction { subject: String, vowel: Vowel, baseline: Vowel },
    #[error("the list of contracting muscles is empty; name at least one of {}", known.join(", "))]
    NoMuscles { known: Vec<String> },
    #[error("unknown muscle \"{name}\"; {}", suggest::hint(name, known.iter().map(String::as_str)))]
    UnknownMuscle { name: String, known: Vec<String> },
    #[error(
        "{muscle} of {subject} was not measured in both /{vowel}/ and /{baseline}/; choose other muscles"
    )]
    NotMeasured { muscle: String, subject: String, vowel: Vowel, baseline: Vowel },
    #[error("muscle {muscle} is listed twice; name each contracting muscle once")]
    RepeatedMuscle { muscle: String },
    #[error(
        "{reference} of {subject} was not measured in /{vowel}/, but ratios are relative to it; use the stretch target, or add its length"
    )]
    NoReference { reference: String, subject: String, vowel: Vowel },
    /// Only the reference muscle of ratios contracts, and its ratio to itself is always 1.
    #[error(
        "only {reference} contracts in /{vowel}/ of {subject}, and its ratio to itself is always 1, so a ratio target \
         says nothing about it; use the stretch target or name more muscles"
    )]
    NoEquation { reference: String, subject: String, vowel: Vowel },
}

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
