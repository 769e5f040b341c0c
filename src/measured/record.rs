//! Reading a table of muscle lengths, strictly: whatever is odd is refused with its line and column.

use std::collections::BTreeMap;

use csv::StringRecord;
use serde::Deserialize;

use super::{Error, Vowel};
use crate::muscle::{COUNT, Muscle, PerMuscle};
use crate::suggest;

/// The eight muscle lengths of one subject saying one vowel.
#[derive(Debug, Clone, PartialEq)]
pub struct Lengths {
    /// The subject, e.g. `S2`.
    pub subject: String,
    /// The vowel.
    pub vowel: Vowel,
    /// Straight length from end to end, mm; finite, 10 to 200.
    pub length_mm: PerMuscle<f64>,
}

/// A row of a data file.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: u64,
    /// What the row says.
    pub lengths: Lengths,
}

/// The columns of the file, in the order in which we write them; a file may order them otherwise.
const COLUMNS: [&str; 2 + COUNT] =
    ["subject", "vowel", "GGa_mm", "GGm_mm", "GGp_mm", "SGp_mm", "SGm_mm", "SGa_mm", "HGa_mm", "HGp_mm"];

/// Bounds of a plausible length in mm. The published ones are 20 to 66 mm, so a length in centimetres lies below
/// and a length in micrometres or a slipped decimal point above.
const SHORTEST_MM: f64 = 10.0;
const LONGEST_MM: f64 = 200.0;
/// No length in centimetres is below this, and every length in metres is.
const SHORTEST_CM: f64 = 0.2;

/// A row as it stands in the file, the lengths in mm.
#[derive(Deserialize)]
#[expect(non_snake_case, reason = "these are the names of the columns")]
struct Record {
    subject: String,
    vowel: String,
    GGa_mm: f64,
    GGm_mm: f64,
    GGp_mm: f64,
    SGp_mm: f64,
    SGm_mm: f64,
    SGa_mm: f64,
    HGa_mm: f64,
    HGp_mm: f64,
}

impl Record {
    fn length_mm(&self) -> PerMuscle<f64> {
        Muscle::ALL.map(|m| match m {
            Muscle::GGa => self.GGa_mm,
            Muscle::GGm => self.GGm_mm,
            Muscle::GGp => self.GGp_mm,
            Muscle::SGp => self.SGp_mm,
            Muscle::SGm => self.SGm_mm,
            Muscle::SGa => self.SGa_mm,
            Muscle::HGa => self.HGa_mm,
            Muscle::HGp => self.HGp_mm,
        })
    }
}

/// A place in the table and how to complain about it.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub origin: &'a str,
    pub line: u64,
    pub column: usize,
}

impl<'a> Place<'a> {
    pub fn error(self, what: impl Into<String>, help: impl Into<String>) -> Error {
        let Place { origin, line, column } = self;
        Error::Malformed { origin: origin.to_owned(), line, column, what: what.into(), help: help.into() }
    }

    /// The place of the byte `offset` of `bytes`, for what is wrong before the table can be read as one.
    fn of_byte(origin: &'a str, bytes: &[u8], offset: usize) -> Self {
        let before = bytes.get(..offset).unwrap_or(bytes);
        let line_start = before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        let line = 1 + before.iter().filter(|b| **b == b'\n').count() as u64;
        let column = 1 + before.iter().skip(line_start).filter(|b| **b == b',').count();
        Place { origin, line, column }
    }

    fn at_column(self, column: usize) -> Self {
        Place { column, ..self }
    }
}

/// All rows of the table in `bytes`, in file order; `origin` names it in errors.
pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Vec<Row>, Error> {
    read_each(bytes, origin, &mut Err)
}

/// As [`read`], but what is wrong with a single row goes to `bad`, which may accept it and go on without that row. Of a row that
/// is given twice the first is kept.
pub(super) fn read_each(
    bytes: &[u8],
    origin: &str,
    bad: &mut dyn FnMut(Error) -> Result<(), Error>,
) -> Result<Vec<Row>, Error> {
    let text = plain_text(bytes, origin)?;
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| unexpected(origin, &e))?.clone();
    check_header(&header, place(&header, text, origin))?;

    let mut rows = Vec::new();
    let mut seen = BTreeMap::new();
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(|e| unexpected(origin, &e))? {
        let at = place(&record, text, origin);
        let lengths = match row(&record, &header, at) {
            Ok(lengths) => lengths,
            Err(e) => {
                bad(e)?;
                continue;
            }
        };
        let first = *seen.entry((lengths.subject.clone(), lengths.vowel)).or_insert(at.line);
        if first != at.line {
            bad(at.error(
                format!("{} /{}/ is given twice, here and on line {first}", lengths.subject, lengths.vowel),
                "keep one of the two lines",
            ))?;
            continue;
        }
        rows.push(Row { line: at.line, lengths });
    }
    if rows.is_empty() {
        let end = Place::of_byte(origin, bytes, bytes.len());
        return Err(end.error("the table has a header but no rows", "add a line for each subject and vowel"));
    }
    Ok(rows)
}

/// `bytes` as text, if they are UTF-8 with LF line ends and no byte order mark.
fn plain_text<'a>(bytes: &'a [u8], origin: &str) -> Result<&'a str, Error> {
    let start = Place { origin, line: 1, column: 1 };
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        return Err(start.error(
            "the file starts with a byte order mark (BOM)",
            "save it as \"UTF-8\" without BOM, not as \"CSV UTF-8\"",
        ));
    }
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(start.error("the file is UTF-16", "save it as UTF-8 without byte order mark"));
    }
    let text = str::from_utf8(bytes).map_err(|e| {
        Place::of_byte(origin, bytes, e.valid_up_to())
            .error("the text is not UTF-8", "save the file as UTF-8 (the vowel ɯ may be written u)")
    })?;
    if let Some(at) = text.find('\r') {
        return Err(Place::of_byte(origin, bytes, at).error(
            "the line ends with a carriage return (CRLF, as Windows writes it)",
            "save the file with LF (Unix) line ends, for instance by `tr -d '\\r'`",
        ));
    }
    if text.trim().is_empty() {
        return Err(start.error("the file is empty", format!("the first line must be {}", COLUMNS.join(","))));
    }
    Ok(text)
}

/// Where `record` starts. The CSV reader counts the blank lines that it skips as part of the record after them.
fn place<'a>(record: &StringRecord, text: &str, origin: &'a str) -> Place<'a> {
    let (line, byte) = record.position().map_or((1, 0), |p| (p.line(), p.byte()));
    let from = usize::try_from(byte).ok().and_then(|byte| text.as_bytes().get(byte..)).unwrap_or_default();
    let blank = from.iter().take_while(|b| **b == b'\n').count() as u64;
    Place { origin, line: line + blank, column: 1 }
}

/// An error of the CSV reader that the checks here should have met first.
pub(super) fn unexpected(origin: &str, error: &csv::Error) -> Error {
    let line = error.position().map_or(1, csv::Position::line);
    Place { origin, line, column: 1 }
        .error(error.to_string(), "check that the file is a comma-separated table")
}

fn check_header(header: &StringRecord, at: Place<'_>) -> Result<(), Error> {
    check_separator(header, at)?;
    let mut found = BTreeMap::new();
    for (index, name) in header.iter().enumerate() {
        let at = at.at_column(index + 1);
        if !COLUMNS.contains(&name) {
            let (what, help) = unknown_column(name);
            return Err(at.error(what, help));
        }
        if let Some(first) = found.insert(name, index + 1) {
            return Err(at.error(
                format!("column {name} appears twice, here and as column {first}"),
                "keep one of the two",
            ));
        }
    }
    let missing: Vec<_> = COLUMNS.into_iter().filter(|c| !found.contains_key(c)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(at.at_column(header.len() + 1).error(
        format!("missing from the header: {}", missing.join(", ")),
        format!("it must name, in any order, {}", COLUMNS.join(",")),
    ))
}

fn unknown_column(name: &str) -> (String, String) {
    let (bare, suffix) = name.split_once('_').unwrap_or((name, ""));
    let shown = clip(name);
    let Ok(muscle) = bare.parse::<Muscle>() else {
        return (
            format!("unknown column {shown:?}"),
            format!("{}; rename it or take it out", suggest::hint(&shown, COLUMNS)),
        );
    };
    let what = match suffix {
        "" => format!("column {shown:?} does not say its unit"),
        "cm" | "m" => format!("column {shown:?} is not in millimetres"),
        _ => format!("unknown column {shown:?}"),
    };
    (what, format!("lengths are wanted in mm, in a column named {muscle}_mm"))
}

/// A line that a comma does not split but another separator would.
fn check_separator(record: &StringRecord, at: Place<'_>) -> Result<(), Error> {
    let only = if record.len() == 1 { record.get(0).unwrap_or_default() } else { "" };
    let name = match only.chars().find(|c| matches!(c, ';' | '\t')) {
        Some(';') => "semicolons",
        Some(_) => "tabs",
        None => return Ok(()),
    };
    Err(at.error(
        format!("the fields are separated by {name}"),
        "separate them by commas, and write decimals with a point, like 57.8",
    ))
}

fn row(record: &StringRecord, header: &StringRecord, at: Place<'_>) -> Result<Lengths, Error> {
    check_separator(record, at)?;
    if record.len() != header.len() {
        let at = at.at_column(record.len().min(header.len()) + 1);
        let what = format!("the line has {} fields where the header has {}", record.len(), header.len());
        return Err(if record.len() > header.len() {
            at.error(what, "take out the surplus; decimals are written with a point, like 57.8, not a comma")
        } else {
            at.error(what, "give every column a value; check for a quotation mark that is never closed")
        });
    }
    let column = |name| header.iter().position(|h| h == name).map_or(1, |index| index + 1);

    let parsed = record.deserialize::<Record>(Some(header)).map_err(|e| match not_a_number(&e) {
        Some(index) => number_error(
            header.get(index).unwrap_or_default(),
            record.get(index).unwrap_or_default(),
            at.at_column(index + 1),
        ),
        None => unexpected(at.origin, &e),
    })?;

    if parsed.subject.is_empty() || parsed.subject.contains(char::is_control) {
        return Err(at.at_column(column("subject")).error(
            format!("the subject is {:?}", clip(&parsed.subject)),
            "give it a name of printable characters, like S2",
        ));
    }
    let vowel = clip(&parsed.vowel)
        .parse::<Vowel>()
        .map_err(|e| at.at_column(column("vowel")).error(e.to_string(), "write one of these"))?;
    let length_mm = parsed.length_mm();
    for (name, length) in COLUMNS.into_iter().skip(2).zip(length_mm) {
        check_length(name, length, at.at_column(column(name)))?;
    }
    Ok(Lengths { subject: parsed.subject, vowel, length_mm })
}

/// The field, from 0, that serde could not read as a number.
fn not_a_number(error: &csv::Error) -> Option<usize> {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.field().and_then(|f| usize::try_from(f).ok()),
        _ => None,
    }
}

fn number_error(name: &str, value: &str, at: Place<'_>) -> Error {
    let with_point = value.replace(',', ".");
    if value.is_empty() {
        at.error(format!("{name} is empty"), "write the length in millimetres, like 57.8")
    } else if value.contains(',') && with_point.parse::<f64>().is_ok() {
        at.error(
            format!("{name} is {:?}, with a decimal comma", clip(value)),
            format!("write it with a decimal point: {}", clip(&with_point)),
        )
    } else {
        at.error(
            format!("{name} is {:?}, not a number", clip(value)),
            "write millimetres with a decimal point, like 57.8",
        )
    }
}

fn check_length(name: &str, length: f64, at: Place<'_>) -> Result<(), Error> {
    let (why, help) = if !length.is_finite() {
        ("not finite", "write a measured length in millimetres, like 57.8")
    } else if length <= 0.0 {
        ("not positive", "write a measured length in millimetres, like 57.8")
    } else if length < SHORTEST_CM {
        ("far too short for millimetres: it looks like metres", "multiply the lengths by 1000")
    } else if length < SHORTEST_MM {
        ("too short for millimetres (below 10): it looks like centimetres", "multiply the lengths by 10")
    } else if length > LONGEST_MM {
        ("too long for a tongue muscle (above 200 mm)", "write the length in millimetres, like 57.8")
    } else {
        return Ok(());
    };
    Err(at.error(format!("{name} is {length}, {why}"), help))
}

/// The start of a field, so that a message stays one line whatever the file holds.
fn clip(field: &str) -> String {
    const LONGEST: usize = 40;
    match field.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", field.get(..end).unwrap_or_default()),
        None => field.to_owned(),
    }
}

#[cfg(test)]
#[path = "record_tests.rs"]
mod tests;
