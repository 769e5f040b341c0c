//! Meaning of columns by their names.

use csv::StringRecord;

use super::error::{Malformed, Place};
use super::number::TableUnit;
use super::reading::SetAside;
use super::vowel::{clip, nfc};
use tongue_core::suggest;

/// Names of the column of subjects, the best first; case does not count, and a space counts as `_`.
const SUBJECT: [&str; 12] = [
    "subject",
    "speaker",
    "participant",
    "subject_id",
    "speaker_id",
    "participant_id",
    "subj",
    "proband",
    "sprecher",
    "locuteur",
    "sujet",
    "sujeto",
];
/// Names of the column of vowels, the best first.
const VOWEL: [&str; 11] = [
    "vowel", "phoneme", "phone", "segment", "sound", "label", "vokal", "laut", "voyelle", "phonème", "vocal",
];
/// Names of a column of half widths, behind a muscle's name or alone.
const HALF_WIDTH: [&str; 4] = ["half_width", "halfwidth", "error", "uncertainty"];

/// Characters between a name and its unit.
const BETWEEN: [char; 9] = [' ', '_', '.', '-', '(', '[', '/', ',', ':'];

/// Limit of the number of columns.
const MOST_COLUMNS: usize = 10_000;

/// Column of a muscle's lengths.
pub(super) struct Length {
    pub muscle: String,
    /// Number of the field, from 0.
    pub field: usize,
    pub unit: TableUnit,
    /// Field and unit of its own half widths, if it has any.
    pub half_width: Option<(usize, TableUnit)>,
}

/// Columns of a table; fields count from 0.
pub(super) struct Columns {
    pub subject: usize,
    pub vowel: usize,
    pub lengths: Vec<Length>,
    /// Half widths of all muscles without columns of their own.
    pub half_width: Option<(usize, TableUnit)>,
    pub set_aside: Vec<SetAside>,
}

/// Meaning of a column's name.
enum Meaning {
    /// With the index of the name among its aliases.
    Subject(usize),
    Vowel(usize),
    Length(String, TableUnit),
    HalfWidth(Option<String>, TableUnit),
    Other,
}

/// Number of columns with a known meaning, from which the separator is found.
pub(super) fn understood(header: &StringRecord) -> usize {
    header.iter().take(MOST_COLUMNS).filter(|name| !matches!(meaning(name), Meaning::Other)).count()
}

impl Columns {
    /// Reads the header at the place `at`.
    pub fn of(header: &StringRecord, at: Place<'_>) -> Result<Self, Malformed> {
        if header.len() > MOST_COLUMNS {
            let what = format!("the header has {} columns", header.len());
            return Err(at.error(what, format!("give at most {MOST_COLUMNS}, one a muscle")));
        }
        let (mut subject, mut vowel) = (None::<(usize, usize)>, None::<(usize, usize)>);
        let (mut lengths, mut half_widths) = (Vec::<Length>::new(), Vec::new());
        let mut set_aside = Vec::new();
        let better = |best: &mut Option<(usize, usize)>, rank, field| match best {
            Some((r, f)) if *r == rank => Err(twice(header, *f, field, at)),
            Some((r, _)) if *r < rank => Ok(()),
            _ => {
                *best = Some((rank, field));
                Ok(())
            }
        };
        for (field, name) in header.iter().enumerate() {
            match meaning(name) {
                Meaning::Subject(rank) => better(&mut subject, rank, field)?,
                Meaning::Vowel(rank) => better(&mut vowel, rank, field)?,
                Meaning::Length(muscle, unit) => {
                    if let Some(first) = lengths.iter().find(|l| l.muscle == muscle) {
                        return Err(twice(header, first.field, field, at));
                    }
                    lengths.push(Length { muscle, field, unit, half_width: None });
                }
                Meaning::HalfWidth(muscle, unit) => half_widths.push((muscle, field, unit)),
                Meaning::Other => {}
            }
        }
        let missing: Vec<_> = [
            ("subject", subject.is_none()),
            ("vowel", vowel.is_none()),
            ("a length, like GGa_mm", lengths.is_empty()),
        ]
        .into_iter()
        .filter_map(|(name, missing)| missing.then_some(name))
        .collect();
        let (Some((_, subject)), Some((_, vowel)), false) = (subject, vowel, lengths.is_empty()) else {
            return Err(incomplete(&missing, header, at));
        };
        let mut common = None;
        for (muscle, field, unit) in half_widths {
            let place = match &muscle {
                None => &mut common,
                Some(name) => match lengths.iter_mut().find(|l| l.muscle == *name) {
                    Some(length) => &mut length.half_width,
                    None => continue,
                },
            };
            if let Some((first, _)) = place.replace((field, unit)) {
                return Err(twice(header, first, field, at));
            }
        }
        let used = |field| {
            [subject, vowel].contains(&field)
                || common.is_some_and(|(f, _)| f == field)
                || lengths.iter().any(|l| l.field == field || l.half_width.is_some_and(|(f, _)| f == field))
        };
        for (field, name) in header.iter().enumerate().filter(|(field, _)| !used(*field)) {
            let why = match meaning(name) {
                Meaning::HalfWidth(..) => "half width of a muscle without a column of lengths",
                Meaning::Subject(_) | Meaning::Vowel(_) => "another column says the same",
                _ if name.is_empty() => "no name",
                _ => "no unit of length in its name",
            };
            set_aside.push(SetAside { column: field + 1, name: clip(name), why: why.to_owned() });
        }
        Ok(Self { subject, vowel, lengths, half_width: common, set_aside })
    }
}

fn twice(header: &StringRecord, first: usize, second: usize, at: Place<'_>) -> Malformed {
    let name = clip(header.get(second).unwrap_or_default());
    let earlier = header.get(first).unwrap_or_default();
    let what = match earlier == name {
        true => format!("column {name} appears twice, here and as column {}", first + 1),
        false => format!("column {name} says the same as column {} ({})", first + 1, clip(earlier)),
    };
    at.at_column(second + 1).error(what, "keep one of the two")
}

/// The error for missing columns, with columns that may be meant.
fn incomplete(missing: &[&str], header: &StringRecord, at: Place<'_>) -> Malformed {
    let mut what = format!("missing from the header: {}", missing.join(", "));
    let near = missing.iter().filter(|name| !name.contains(' ')).find_map(|name| {
        let near = suggest::nearest(name, header.iter().filter(|h| h.len() > 2))?;
        Some(format!("; is column {:?} meant to be {name}?", clip(near)))
    });
    what.push_str(&near.unwrap_or_default());
    at.at_column(header.len() + 1).error(
        what,
        "it must name, in any order, subject, vowel, and for each muscle its length with the unit, like \
         subject,vowel,GGa_mm,GGm_mm",
    )
}

fn meaning(name: &str) -> Meaning {
    let plain = plain(name);
    let rank = |names: &[&str]| names.iter().position(|n| *n == plain);
    if let Some(rank) = rank(&SUBJECT) {
        return Meaning::Subject(rank);
    }
    if let Some(rank) = rank(&VOWEL) {
        return Meaning::Vowel(rank);
    }
    let Some((quantity, unit)) = quantity(name) else { return Meaning::Other };
    match half_width(quantity) {
        Some("") => Meaning::HalfWidth(None, unit),
        Some(muscle) => Meaning::HalfWidth(Some(nfc(muscle)), unit),
        None => Meaning::Length(nfc(quantity), unit),
    }
}

/// The name in lower case with `_` between words, of the same number of bytes.
fn plain(name: &str) -> String {
    name.to_ascii_lowercase().replace([' ', '.', '-'], "_")
}

/// A name without its unit: `GGa` and mm of `GGa_mm`, `GGa (mm)` and R's `GGa..mm.`.
fn quantity(name: &str) -> Option<(&str, TableUnit)> {
    let name = name.trim_end_matches([')', ']', '.', ' ']);
    let lower = name.to_ascii_lowercase();
    TableUnit::ALL.into_iter().find_map(|unit| {
        let rest = name.get(..lower.strip_suffix(unit.symbol())?.len())?;
        let quantity = rest.trim_end_matches(BETWEEN).trim_start();
        let is_name =
            quantity.len() < rest.len() && !quantity.is_empty() && !quantity.contains(char::is_control);
        is_name.then_some((quantity, unit))
    })
}

/// The muscle of a column of half widths, given its name without the unit; empty for all muscles.
fn half_width(quantity: &str) -> Option<&str> {
    let plain = plain(quantity);
    HALF_WIDTH.into_iter().find_map(|word| {
        let before = quantity.get(..plain.strip_suffix(word)?.len())?;
        let muscle = before.trim_end_matches(BETWEEN);
        (before.is_empty() || muscle.len() < before.len()).then_some(muscle)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_names_determine_their_meaning() {
        let told = |name: &str| match meaning(name) {
            Meaning::Subject(_) => "subject".to_owned(),
            Meaning::Vowel(_) => "vowel".to_owned(),
            Meaning::Length(muscle, unit) => format!("{muscle} in {}", unit.symbol()),
            Meaning::HalfWidth(muscle, unit) => {
                format!("±{} in {}", muscle.unwrap_or_default(), unit.symbol())
            }
            Meaning::Other => "other".to_owned(),
        };
        for (name, is) in [
            ("SUBJECT", "subject"),
            ("Speaker ID", "subject"),
            ("Phoneme", "vowel"),
            ("GGa_mm", "GGa in mm"),
            ("GGa (mm)", "GGa in mm"),
            ("GGa..mm.", "GGa in mm"),
            ("GGa [CM]", "GGa in cm"),
            ("GGa_m", "GGa in m"),
            ("GG_a_mm", "GG_a in mm"),
            ("m. genioglossus ant. [mm]", "m. genioglossus ant in mm"),
            ("舌骨舌筋_mm", "舌骨舌筋 in mm"),
            ("half_width_mm", "± in mm"),
            ("Error (mm)", "± in mm"),
            ("GGa half-width (cm)", "±GGa in cm"),
            ("GGa_error_mm", "±GGa in mm"),
            ("terror_mm", "terror in mm"),
            ("GGa", "other"),
            ("GGm", "other"),
            ("mm", "other"),
            ("_mm", "other"),
            ("", "other"),
            ("age", "other"),
            ("F1_Hz", "other"),
        ] {
            assert_eq!(told(name), is, "{name}");
        }
    }
}
