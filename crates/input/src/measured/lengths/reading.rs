//! How the text of a table was understood, to be looked at.

use serde::Serialize;

use super::{DecimalMark, Encoding, LineEnds, Unit};

/// What stands between the fields of a line.
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
    /// All, the one that is taken where nothing decides between them first.
    pub(super) const ALL: [Separator; 3] = [Separator::Comma, Separator::Semicolon, Separator::Tab];

    /// Its character.
    pub const fn byte(self) -> u8 {
        match self {
            Separator::Comma => b',',
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
        }
    }

    /// What several of them are called.
    pub const fn plural(self) -> &'static str {
        match self {
            Separator::Comma => "commas",
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
        }
    }
}

/// Where the half widths of a muscle's lengths come from.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "from", rename_all = "snake_case")]
pub enum HalfWidth {
    /// A column of the table; where its cell is empty, `else_mm`.
    Column {
        /// Name in the header.
        name: String,
        /// Half width where the column says none, mm.
        else_mm: f64,
    },
    /// The user's word for all lengths.
    Given {
        /// Half width, mm.
        mm: f64,
    },
    /// The digits that the lengths are written with: half of the last one.
    Digits {
        /// Half width, mm.
        mm: f64,
    },
    /// 0.5 mm, as for lengths read off an MR image to 1 mm, because the digits are more than anybody measures.
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
    /// The unit that its name gives.
    pub unit: Unit,
    /// Where its half widths come from.
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
    /// How its characters were written.
    pub encoding: Encoding,
    /// How its lines end.
    pub line_ends: LineEnds,
    /// What stands between fields.
    pub separator: Separator,
    /// What stands before decimals.
    pub decimal_mark: DecimalMark,
    /// Name of the column of subjects.
    pub subject: String,
    /// Name of the column of vowels.
    pub vowel: String,
    /// The muscles' columns, in the order of the table.
    pub columns: Vec<Column>,
    /// Columns that are not used.
    pub set_aside: Vec<SetAside>,
    /// Lines (from 1) of rows in which no length was measured: they count as not there.
    pub rows_without_lengths: Vec<u64>,
}
