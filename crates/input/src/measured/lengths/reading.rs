//! How the text of a table was understood, for the user to check.

use serde::Serialize;

use super::{DecimalMark, Encoding, LineEnds, Malformed, TableUnit, Vowel};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Separator {
    Comma,
    Semicolon,
    Tab,
}

impl Separator {
    pub(in crate::measured) const ALL: [Separator; 3] =
        [Separator::Comma, Separator::Semicolon, Separator::Tab];

    pub(in crate::measured) const fn byte(self) -> u8 {
        match self {
            Separator::Comma => b',',
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
        }
    }

    pub const fn plural(self) -> &'static str {
        match self {
            Separator::Comma => "commas",
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "from", rename_all = "snake_case")]
pub enum HalfWidth {
    /// A column of the table; `else_mm` holds for its empty cells.
    Column {
        name: String,
        else_mm: f64,
    },
    Given {
        mm: f64,
    },
    Digits {
        mm: f64,
    },
    /// 0.5 mm, because the lengths have more digits than a measurement.
    Default {
        mm: f64,
    },
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadColumn {
    pub muscle: String,
    pub name: String,
    pub column: usize,
    pub unit: TableUnit,
    pub half_width: HalfWidth,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SetAside {
    pub column: usize,
    pub name: String,
    pub why: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reading {
    pub encoding: Encoding,
    pub line_ends: LineEnds,
    pub separator: Separator,
    pub decimal_mark: DecimalMark,
    /// Line of the header, from 1; the lines before it are a title or comments.
    pub header_line: u64,
    pub subject: String,
    pub vowel: String,
    pub columns: Vec<ReadColumn>,
    pub set_aside: Vec<SetAside>,
    /// Lines, from 1, of rows that are ignored because they have no length.
    pub rows_without_lengths: Vec<u64>,
}

/// A row that cannot be used, with its subject and vowel if they can be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BrokenRow {
    pub subject: Option<String>,
    pub vowel: Option<Vowel>,
    pub fault: Malformed,
}
