//! Errors of what is read: tables, recordings, maps, and the targets made of them.

use std::io;

use serde::Serialize;

use crate::files::advice;

#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{origin}:{line}:{column}: {what}; {help}")]
pub struct Malformed {
    /// The file, or another name of the source.
    pub origin: String,
    pub line: u64,
    /// Field of the line, not character, from 1.
    pub column: usize,
    pub what: String,
    pub help: String,
}

/// Each message says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file or the requested row is faulty.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// What is asked for is missing, cannot be read, or cannot be made of the data.
    #[error("{0}")]
    Refused(String),
}

impl ReadError {
    pub(super) fn unreadable(origin: &str, error: &io::Error) -> Self {
        Self::Refused(format!("cannot read {origin}: {error}; {}", advice(error)))
    }
}

#[derive(Clone, Copy)]
pub(super) struct SourcePlace<'a> {
    pub origin: &'a str,
    pub line: u64,
    pub column: usize,
}

impl<'a> SourcePlace<'a> {
    pub fn start(origin: &'a str) -> Self {
        Self { origin, line: 1, column: 1 }
    }

    pub fn error(self, what: impl Into<String>, help: impl Into<String>) -> Malformed {
        let SourcePlace { origin, line, column } = self;
        Malformed { origin: origin.to_owned(), line, column, what: what.into(), help: help.into() }
    }

    pub fn at_column(self, column: usize) -> Self {
        SourcePlace { column, ..self }
    }
}
