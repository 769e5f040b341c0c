//! Meaning of the columns of a table of lengths, from their names.

use std::collections::BTreeMap;

use super::dataset::SetAside;
use super::number::TableUnit;
use super::text::clip;
use crate::measured::error::Malformed;
use crate::measured::table::{TableLine, TableLines};
use tongue_core::choice;

/// Names of the column of subjects, preferred names first. Case does not matter, and a space counts as `_`.
const SUBJECT: &str = "subject speaker participant subject_id speaker_id participant_id subj proband sprecher \
                       locuteur sujet sujeto 話者 被験者 発話者";
/// Names of the column of vowels, preferred names first.
const VOWEL: &str = "vowel phoneme phone segment sound label vokal laut voyelle phonème vocal 母音 音素";
/// Names of a column of muscles, which only a table with one row for each muscle has.
const MUSCLE: &str = "muscle muscles muskel 筋 筋肉";
/// Ends of the names of columns of half widths, behind a muscle's name or alone.
const HALF_WIDTH: [&str; 4] = ["half_width", "halfwidth", "error", "uncertainty"];

const BEFORE_UNIT: [char; 9] = [' ', '_', '.', '-', '(', '[', '/', ',', ':'];

const ROWS_SEARCHED: usize = 20;

pub(super) type LengthField = (usize, TableUnit);

pub(super) struct LengthColumn {
    pub muscle: String,
    pub field: usize,
    pub unit: TableUnit,
    pub half_width: Option<LengthField>,
}

pub(super) struct LengthColumns {
    pub subject: usize,
    pub vowel: usize,
    pub lengths: Vec<LengthColumn>,
    /// The column of half widths for muscles without one of their own.
    pub half_width: Option<LengthField>,
    pub set_aside: Vec<SetAside>,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum ColumnMeaning {
    /// The position of the name in the list of names.
    Subject(usize),
    Vowel(usize),
    Length(String),
    /// Half widths of a muscle's lengths; with an empty name, of all muscles.
    HalfWidth(String),
}

pub(super) fn is_known(name: &str) -> bool {
    meaning(name).is_some()
}

impl LengthColumns {
    pub fn of(cells: &TableLines<'_>) -> Result<Self, Malformed> {
        let mut fields = BTreeMap::<ColumnMeaning, LengthField>::new();
        for (field, name) in cells.header.cells.iter().enumerate() {
            let Some((meaning, unit)) = meaning(name) else { continue };
            if let Some((first, _)) = fields.insert(meaning, (field, unit)) {
                return Err(cells.twice(first, field));
            }
        }
        // Meanings are ordered by position in the list of names, so the first is the preferred one.
        let first =
            |is: fn(&ColumnMeaning) -> bool| fields.iter().find(|(m, _)| is(m)).map(|(_, (field, _))| *field);
        let subject = first(|m| matches!(m, ColumnMeaning::Subject(_)));
        let vowel = first(|m| matches!(m, ColumnMeaning::Vowel(_)));
        let half_width = |muscle: &str| fields.get(&ColumnMeaning::HalfWidth(muscle.to_owned())).copied();
        let length = |(meaning, &(field, unit)): (&ColumnMeaning, &LengthField)| {
            let ColumnMeaning::Length(muscle) = meaning else { return None };
            Some(LengthColumn { muscle: muscle.clone(), field, unit, half_width: half_width(muscle) })
        };
        let mut lengths: Vec<LengthColumn> = fields.iter().filter_map(length).collect();
        lengths.sort_by_key(|length| length.field);
        let of_muscle =
            cells.header.cells.iter().position(|name| MUSCLE.split(' ').any(|n| n == normalised(name)));
        if let Some(field) = of_muscle.filter(|_| lengths.len() < 2) {
            let (name, quoted) = (clip(cells.header.cell(field)), cells.header_quoted());
            let what = format!("column {name} names muscles, so that each has rows of its own; {quoted}");
            let help = "give each muscle a column and each subject and vowel one row, as in subject,vowel,GGa_mm,GGm_mm";
            return Err(cells.header.place(field).error(what, help));
        }
        let (Some(subject), Some(vowel), false) = (subject, vowel, lengths.is_empty()) else {
            let missing = [
                subject.is_none().then_some("subject"),
                vowel.is_none().then_some("vowel"),
                lengths.is_empty().then_some("a length, like GGa_mm"),
            ];
            return Err(incomplete(&missing.into_iter().flatten().collect::<Vec<_>>(), cells));
        };
        let half_width = half_width("");
        let set_aside = cells.header.cells.iter().enumerate().filter_map(|(field, name)| {
            let why = match meaning(name) {
                Some((ColumnMeaning::HalfWidth(_), _)) => {
                    "half width of a muscle without a column of lengths"
                }
                Some(_) => "another column says the same",
                None if name.is_empty() => "no name",
                None => "no unit of length in its name",
            };
            // Spreadsheets leave empty columns without a name behind.
            let is_filled = !name.is_empty() || cells.rows.iter().any(|row| !row.cell(field).is_empty());
            let aside = SetAside { column: field + 1, name: clip(name), why: why.to_owned() };
            let used = field == subject
                || field == vowel
                || half_width.is_some_and(|(f, _)| f == field)
                || lengths.iter().any(|l| l.field == field || l.half_width.is_some_and(|(f, _)| f == field));
            (!used && is_filled).then_some(aside)
        });
        let set_aside = set_aside.collect();
        Ok(Self { subject, vowel, lengths, half_width, set_aside })
    }
}

fn incomplete(missing: &[&str], cells: &TableLines<'_>) -> Malformed {
    let mut what = format!("missing from the header: {}", missing.join(", "));
    let near = missing.iter().filter(|name| !name.contains(' ')).find_map(|name| {
        let near = choice::nearest(name, cells.header.cells.iter().filter(|h| h.len() > 2))?;
        Some(format!("; is column {:?} meant to be {name}?", clip(near)))
    });
    what.push_str(&near.unwrap_or_default());
    if missing.iter().any(|name| name.contains(' ')) {
        let has_numbers = |field: &usize| {
            let starts = |line: &TableLine<'_>| line.cell(*field).starts_with(|c: char| c.is_ascii_digit());
            meaning(cells.header.cell(*field)).is_none() && cells.rows.iter().take(ROWS_SEARCHED).any(starts)
        };
        if let Some(name) = (0..cells.header.cells.len()).find(has_numbers).map(|f| cells.header.cell(f)) {
            what += &format!("; if column {:?} has lengths, its name must end with their unit", clip(name));
        }
    }
    cells.header.place(cells.header.cells.len()).error(
        format!("{what}; {}", cells.header_quoted()),
        "it must name, in any order, subject, vowel, and for each muscle its length with the unit, like \
         subject,vowel,GGa_mm,GGm_mm",
    )
}

/// `None` if the name has no meaning; the unit is millimetres for columns without one.
fn meaning(name: &str) -> Option<(ColumnMeaning, TableUnit)> {
    let plain = normalised(name);
    let rank = |names: &str| names.split(' ').position(|n| n == plain);
    let id = rank(SUBJECT).map(ColumnMeaning::Subject).or_else(|| rank(VOWEL).map(ColumnMeaning::Vowel));
    if let Some(id) = id {
        return Some((id, TableUnit::Mm));
    }
    let (quantity, unit) = quantity(name)?;
    let muscle = half_width(quantity).map(|muscle| ColumnMeaning::HalfWidth(muscle.to_owned()));
    Some((muscle.unwrap_or_else(|| ColumnMeaning::Length(quantity.to_owned())), unit))
}

/// The name in lower case with `_` between words; it has the same number of bytes.
fn normalised(name: &str) -> String {
    name.to_ascii_lowercase().replace([' ', '.', '-'], "_")
}

/// A name without its unit, and the unit: of `GGa_mm`, `GGa (mm)` or R's `GGa..mm.`, `GGa` and millimetres.
fn quantity(name: &str) -> Option<(&str, TableUnit)> {
    let name = name.trim_end_matches([')', ']', '.', ' ']);
    let lower = name.to_ascii_lowercase();
    TableUnit::ALL.into_iter().find_map(|unit| {
        let (symbol, ..) = unit.facts();
        let rest = name.get(..lower.strip_suffix(symbol)?.len())?;
        let quantity = rest.trim_end_matches(BEFORE_UNIT).trim_start();
        let is_name = quantity.len() < rest.len()
            && quantity.contains(char::is_alphabetic)
            && !quantity.contains(char::is_control);
        is_name.then_some((quantity, unit))
    })
}

/// The muscle of a column of half widths from its name without the unit; empty for all muscles.
fn half_width(quantity: &str) -> Option<&str> {
    let plain = normalised(quantity);
    HALF_WIDTH.into_iter().find_map(|word| {
        let before = quantity.get(..plain.strip_suffix(word)?.len())?;
        let muscle = before.trim_end_matches(BEFORE_UNIT);
        (before.is_empty() || muscle.len() < before.len()).then_some(muscle)
    })
}
