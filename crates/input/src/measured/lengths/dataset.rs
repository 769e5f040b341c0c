//! A table of measured muscle lengths, looked up by subject and vowel, and how its text was understood, for the user to check.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use super::number::LARGEST_HALF_WIDTH_MM;
use super::text::fold;
use super::{DecimalMark, Encoding, Lengths, LineEnds, Malformed, ReadError, Row, TableUnit, Vowel};
use tongue_core::choice;

const MOST_SUBJECTS_LISTED: usize = 12;

/// Measured muscle lengths: at least one usable row, and no subject and vowel twice.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// The path of the table, or the `origin` given to [`Dataset::from_reader`].
    pub origin: String,
    pub muscles: Arc<[String]>,
    pub rows: Vec<Row>,
    pub reading: Reading,
    /// The rows that cannot be used, in the order of the table. Of two rows of one subject and vowel the second is among them.
    pub broken: Vec<BrokenRow>,
    /// The cells that are no lengths, in rows that can be used without them.
    pub bad_cells: Vec<Malformed>,
    pub(super) rows_of_subject: BTreeMap<String, Vec<usize>>,
}

impl Dataset {
    /// The same lengths with the half width `mm`, 0 to 100, for all of them in place of those of the table.
    pub fn with_half_width_mm(mut self, mm: f64) -> Result<Self, ReadError> {
        if !(0.0..=LARGEST_HALF_WIDTH_MM).contains(&mm) {
            let message = format!(
                "the half width of rounding is {mm} mm; give one from 0 to {LARGEST_HALF_WIDTH_MM} mm, like 0.5"
            );
            return Err(ReadError::Refused(message));
        }
        for row in &mut self.rows {
            row.lengths.half_width_mm.fill(mm);
        }
        for column in &mut self.reading.columns {
            column.half_width = HalfWidth::Given { mm };
        }
        Ok(self)
    }

    /// Messages about all rows and cells that are left out, in the order of the table.
    pub fn left_out(&self) -> Vec<String> {
        let rows = self.broken.iter().map(|row| (&row.fault, "row"));
        let mut all: Vec<_> = rows.chain(self.bad_cells.iter().map(|fault| (fault, "cell"))).collect();
        all.sort_by_key(|(fault, _)| (fault.line, fault.column));
        all.into_iter().map(|(fault, what)| format!("{fault} (this {what} is left out)")).collect()
    }

    /// The bad cells of the row of `lengths`, which is one of [`Dataset::rows`].
    pub fn bad_cells_of(&self, lengths: &Lengths) -> impl Iterator<Item = &Malformed> {
        let line = self.rows.iter().find(|row| row.lengths == *lengths).map_or(0, |row| row.line);
        self.bad_cells.iter().filter(move |fault| fault.line == line)
    }

    /// In the order of their first rows.
    pub fn subjects(&self) -> Vec<&str> {
        let mut names: Vec<&String> = self.rows_of_subject.keys().collect();
        names.sort_by_key(|name| self.rows_of_subject[*name].first());
        names.into_iter().map(String::as_str).collect()
    }

    /// In the order of the table.
    pub fn vowels(&self, subject: &str) -> Result<Vec<Vowel>, ReadError> {
        Ok(self.of_subject(subject)?.map(|lengths| lengths.vowel.clone()).collect())
    }

    /// The lengths of `subject` in `vowel`. Upper and lower case of the vowel matter only if they distinguish two rows.
    pub fn row(&self, subject: &str, vowel: &Vowel) -> Result<&Lengths, ReadError> {
        self.find(subject, vowel, "", "")
    }

    /// The row of `subject` in /ɯ/, the baseline of thesis 4.3.2.
    pub fn baseline(&self, subject: &str) -> Result<&Lengths, ReadError> {
        self.baseline_vowel(subject, &Vowel::unrounded_u())
    }

    pub fn baseline_vowel(&self, subject: &str, vowel: &Vowel) -> Result<&Lengths, ReadError> {
        let help = ": choose one of these as the baseline instead";
        self.find(subject, vowel, "the baseline vowel ", help)
    }

    /// `what` comes before the vowel in an error, and `help` at its end.
    fn find(&self, subject: &str, vowel: &Vowel, what: &str, help: &str) -> Result<&Lengths, ReadError> {
        if let Ok(rows) = self.of_subject(subject) {
            let alike: Vec<&Lengths> = rows.filter(|l| l.vowel.is_like(vowel)).collect();
            let same = alike.iter().find(|l| l.vowel == *vowel);
            if let Some(lengths) = same.or(if let [only] = &alike[..] { Some(only) } else { None }) {
                return Ok(lengths);
            }
        }
        let name = fold(subject);
        let mut broken = self.broken.iter().filter(|row| row.subject.as_ref() == Some(&name));
        if let Some(row) = broken.find(|row| row.vowel.as_ref().is_some_and(|v| v.is_like(vowel))) {
            return Err(row.fault.clone().into());
        }
        let (origin, has) = (&self.origin, Vowel::list(&self.vowels(subject)?));
        let message = format!("{subject} has no row for {what}/{vowel}/ in {origin}; it has {has}{help}");
        Err(ReadError::Refused(message))
    }

    pub(super) fn of_subject(&self, subject: &str) -> Result<impl Iterator<Item = &Lengths>, ReadError> {
        let Some(numbers) = self.rows_of_subject.get(&fold(subject)) else {
            let known = self.subjects();
            let (of_subjects, of_vowels) = (&self.reading.subject, &self.reading.vowel);
            let hint = match choice::nearest(subject, known.iter().copied()) {
                _ if self.rows.iter().any(|row| row.lengths.vowel.label() == subject) => {
                    format!("it is in column {of_vowels}; are {of_subjects} and {of_vowels} exchanged?")
                }
                Some(near) if known.len() > MOST_SUBJECTS_LISTED => {
                    format!("did you mean \"{near}\"? (one of {} subjects)", known.len())
                }
                None if known.len() > MOST_SUBJECTS_LISTED => {
                    format!("it has {} other subjects", known.len())
                }
                _ => choice::hint(subject, known.iter().copied()),
            };
            let message = format!("unknown subject {subject:?} in {}; {hint}", self.origin);
            return Err(ReadError::Refused(message));
        };
        Ok(numbers.iter().filter_map(|n| self.rows.get(*n)).map(|row| &row.lengths))
    }
}

/// What separates fields, as its byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Separator {
    Comma = b',',
    Semicolon = b';',
    Tab = b'\t',
}

impl Separator {
    pub(in crate::measured) const ALL: [Separator; 3] =
        [Separator::Comma, Separator::Semicolon, Separator::Tab];

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
    Column { name: String, else_mm: f64 },
    /// From the user, for all lengths.
    Given { mm: f64 },
    /// What the digits of the lengths show.
    Digits { mm: f64 },
    /// 0.5 mm, because the lengths have more digits than a measurement.
    Default { mm: f64 },
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
