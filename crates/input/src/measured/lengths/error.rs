//! Errors of tables of lengths, of looking up rows in them, and of making a target from them.

use std::io;

use serde::Serialize;

use super::{BadLabel, Vowel};
use crate::files::advice;

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
    #[error(transparent)]
    Vowel(#[from] BadLabel),
    /// The table lacks what is asked for, or no target can be made of its rows.
    #[error("{0}")]
    Refused(String),
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
