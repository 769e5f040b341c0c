//! How the text of a table was understood, for the user to check.

use serde::Serialize;

use super::{DecimalMark, Encoding, LineEnds, TableUnit};

/// Separator between the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Separator {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tab.
    Tab,
}

impl Separator {
    /// All separators, in the order of preference.
    pub(super) const ALL: [Separator; 3] = [Separator::Comma, Separator::Semicolon, Separator::Tab];

    /// Its character.
    pub const fn byte(self) -> u8 {
        match self {
            Separator::Comma => b',',
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
        }
    }

    /// Its name in the plural.
    pub const fn plural(self) -> &'static str {
        match self {
            Separator::Comma => "commas",
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
        }
    }
}

/// Origin of the half widths of a muscle's lengths.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "from", rename_all = "snake_case")]
pub enum HalfWidth {
    /// A column of the table; for its empty cells, `else_mm`.
    Column {
        /// Name in the header.
        name: String,
        /// Half width for empty cells, mm.
        else_mm: f64,
    },
    /// A value given by the user for all lengths.
    Given {
        /// Half width, mm.
        mm: f64,
    },
    /// Half of the last digit of the lengths.
    Digits {
        /// Half width, mm.
        mm: f64,
    },
    /// 0.5 mm, as for lengths read off an MR image to 1 mm, because the lengths have more digits than a
    /// measurement.
    Default {
        /// Half width, mm.
        mm: f64,
    },
}

/// A muscle's column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// The muscle.
    pub muscle: String,
    /// Name of the column in the header.
    pub name: String,
    /// Number of the column, from 1.
    pub column: usize,
    /// The unit in its name.
    pub unit: TableUnit,
    /// Origin of its half widths.
    pub half_width: HalfWidth,
}

/// A column that is not used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SetAside {
    /// Number of the column, from 1.
    pub column: usize,
    /// Its name in the header.
    pub name: String,
    /// Why it is not used.
    pub why: String,
}

/// How the text of a table was understood.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reading {
    /// Encoding of its characters.
    pub encoding: Encoding,
    /// How its lines end.
    pub line_ends: LineEnds,
    /// Separator of fields.
    pub separator: Separator,
    /// Decimal mark.
    pub decimal_mark: DecimalMark,
    /// Name of the column of subjects.
    pub subject: String,
    /// Name of the column of vowels.
    pub vowel: String,
    /// The muscles' columns, in the order of the table.
    pub columns: Vec<Column>,
    /// Columns that are not used.
    pub set_aside: Vec<SetAside>,
    /// Lines (from 1) of rows without any measured length; these rows are ignored.
    pub rows_without_lengths: Vec<u64>,
}
