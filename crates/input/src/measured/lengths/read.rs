//! Reader of tables of lengths. A fault in a row makes only that row unusable and is reported with line and
//! column.

use std::collections::BTreeMap;
use std::sync::Arc;

use csv::StringRecord;

use super::columns::{self, Columns};
use super::error::{BrokenRow, Malformed, Place};
use super::number::{self, DecimalMark, Numbers, TableUnit};
use super::reading::{Column, HalfWidth, Reading, Separator};
use super::text::{Text, decode};
use super::vowel::{BadLabel, Vowel, clip, nfc};
use super::{Lengths, Row};

/// Limit of the number of rows.
const MOST_ROWS: usize = 200_000;
/// Default half width of a length, mm: that of lengths read off an MR image.
const DEFAULT_HALF_WIDTH_MM: f64 = 0.5;
/// Largest number of decimals of a millimetre that counts as measured; more decimals are a program's.
const MOST_DECIMALS: i32 = 2;

/// Content of a text.
pub(super) struct Table {
    pub muscles: Arc<[String]>,
    pub rows: Vec<Row>,
    pub reading: Reading,
    pub broken: Vec<BrokenRow>,
}

/// The table in `bytes`; `origin` names it in errors.
pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Table, Malformed> {
    let Text { text, encoding, line_ends } = decode(bytes, origin)?;
    let source = Source::of(&text, origin)?;
    let (header, records) = source.records()?;
    let (at, header) = (header.0, with_row_names(header.1, &records, source.separator));
    let columns = Columns::of(&header, at).map_err(|fault| match columns::understood(&header) {
        0 => source.wrong_separator(&header, at).unwrap_or(fault),
        _ => fault,
    })?;
    let name = |field: usize| header.get(field).unwrap_or_default();

    let cells = || records.iter().flat_map(|(_, r)| columns.lengths.iter().map(|l| (l, r.get(l.field))));
    let (mut commas, mut points) = (0, 0);
    for (_, cell) in cells() {
        match cell.and_then(number::mark_of) {
            Some(DecimalMark::Comma) => commas += 1,
            Some(DecimalMark::Point) => points += 1,
            None => {}
        }
    }
    let mark = if commas > points { DecimalMark::Comma } else { DecimalMark::Point };
    let decimals = TableUnit::ALL.map(|unit| {
        let of_unit = cells().filter(|(length, _)| length.unit == unit);
        of_unit.filter_map(|(_, cell)| number::decimals_mm(cell?, mark, unit)).max()
    });
    let otherwise = |unit: TableUnit| by_digits(decimals[unit as usize]);

    let muscles: Arc<[String]> = columns.lengths.iter().map(|l| l.muscle.clone()).collect();
    let half_width = |own: Option<(usize, TableUnit)>, unit| match own.or(columns.half_width) {
        None => otherwise(unit),
        Some((field, _)) => {
            HalfWidth::Column { name: clip(name(field)), else_mm: otherwise(unit).without_column_mm() }
        }
    };
    let mut reading = Reading {
        encoding,
        line_ends,
        separator: source.separator,
        decimal_mark: mark,
        subject: clip(name(columns.subject)),
        vowel: clip(name(columns.vowel)),
        columns: (columns.lengths.iter())
            .map(|l| Column {
                muscle: l.muscle.clone(),
                name: clip(name(l.field)),
                column: l.field + 1,
                unit: l.unit,
                half_width: half_width(l.half_width, l.unit),
            })
            .collect(),
        set_aside: columns.set_aside.clone(),
        rows_without_lengths: Vec::new(),
    };
    // An empty column without a name is an artefact of spreadsheets and not listed.
    reading.set_aside.retain(|s| {
        let filled = |r: &StringRecord| r.get(s.column - 1).is_some_and(|cell| !cell.is_empty());
        !s.name.is_empty() || records.iter().any(|(_, r)| filled(r))
    });

    let has = |label: &str| {
        let written = |r: &StringRecord| r.get(columns.vowel).and_then(|cell| Vowel::as_written(cell).ok());
        records.iter().any(|(_, r)| written(r).is_some_and(|v| v.label() == label))
    };
    let has_both_u = has("u") && has("ɯ");
    let reader = RowReader {
        header: &header,
        columns: &columns,
        mark,
        reading: &reading,
        source: &source,
        has_both_u,
    };
    let (mut rows, mut broken) = (Vec::new(), Vec::new());
    let mut without_lengths = Vec::new();
    let mut seen = BTreeMap::new();
    for (at, record) in &records {
        let lengths = match reader.row(record, *at, &muscles) {
            Ok(lengths) => lengths,
            Err(fault) => {
                broken.push(reader.broken(record, fault));
                continue;
            }
        };
        if lengths.length_mm.iter().all(Option::is_none) {
            without_lengths.push(at.line);
            continue;
        }
        let first = *seen.entry((lengths.subject.clone(), lengths.vowel.clone())).or_insert(at.line);
        if first != at.line {
            let fault = at.error(
                format!("{} /{}/ is given twice, here and on line {first}", lengths.subject, lengths.vowel),
                "keep one of the two lines, or tell repetitions apart, as in a1 and a2",
            );
            // The first of the two rows is used, so this one has no subject or vowel.
            broken.push(BrokenRow { subject: None, vowel: None, fault });
            continue;
        }
        rows.push(Row { line: at.line, lengths });
    }
    reading.rows_without_lengths = without_lengths;
    if rows.is_empty() {
        let end = Place { origin, line: 1 + text.matches('\n').count() as u64, column: 1 };
        return Err(match broken.into_iter().next() {
            Some(row) => row.fault,
            None if !records.is_empty() => end.error(
                "no row has a length",
                "write lengths in millimetres, like 57.8, where they were measured",
            ),
            None => end.error("the table has a header but no rows", "add a line for each subject and vowel"),
        });
    }
    Ok(Table { muscles, rows, reading, broken })
}

/// The half width of lengths with this number of decimals of a millimetre.
fn by_digits(decimals: Option<i32>) -> HalfWidth {
    match decimals {
        Some(n) if n <= MOST_DECIMALS => {
            // Parsed from text, to get exactly the decimal number.
            let mm = format!("5e{}", -n - 1).parse().unwrap_or(DEFAULT_HALF_WIDTH_MM);
            HalfWidth::Digits { mm }
        }
        _ => HalfWidth::Default { mm: DEFAULT_HALF_WIDTH_MM },
    }
}

impl HalfWidth {
    /// The half width if no column gives one, mm.
    pub(super) fn without_column_mm(&self) -> f64 {
        match self {
            HalfWidth::Column { else_mm: mm, .. }
            | HalfWidth::Given { mm }
            | HalfWidth::Digits { mm }
            | HalfWidth::Default { mm } => *mm,
        }
    }
}

/// Handles R's `write.table`, which writes row names without a column name, so that every row has one field
/// more than the header. (With commas as separators the extra field may come from a decimal comma.)
fn with_row_names(
    header: StringRecord,
    records: &[(Place<'_>, StringRecord)],
    separator: Separator,
) -> StringRecord {
    let one_more = |(_, r): &(Place<'_>, StringRecord)| r.len() == header.len() + 1;
    if separator == Separator::Comma || records.is_empty() || !records.iter().all(one_more) {
        return header;
    }
    std::iter::once("").chain(header.iter()).collect()
}

/// The text of a table without the lines in front of it.
struct Source<'a> {
    origin: &'a str,
    body: &'a str,
    /// Number of lines in front of it.
    lines_before: u64,
    separator: Separator,
}

impl<'a> Source<'a> {
    /// Skips comments (`#`) and Excel's `sep=;`, and finds the separator with which most columns of the
    /// header are known.
    fn of(text: &'a str, origin: &'a str) -> Result<Self, Malformed> {
        let mut source = Source { origin, body: text, lines_before: 0, separator: Separator::Comma };
        let mut told = None;
        while let Some((line, rest)) = source.body.split_once('\n') {
            let line = line.trim();
            let sep = line.strip_prefix("sep=").and_then(|sep| match sep {
                "" => Some(Separator::Tab),
                sep => Separator::ALL.into_iter().find(|s| sep.as_bytes() == [s.byte()]),
            });
            if !line.is_empty() && !line.starts_with('#') && sep.is_none() {
                break;
            }
            told = told.or(sep);
            source = Source { body: rest, lines_before: source.lines_before + 1, ..source };
        }
        if source.body.trim().is_empty() {
            let start = Place { origin, line: 1, column: 1 };
            return Err(start.error(
                "the file is empty",
                "begin with a line like subject,vowel,GGa_mm,GGm_mm, then a line for each subject and vowel",
            ));
        }
        source.separator = match told {
            Some(separator) => separator,
            None => source.best_separator(),
        };
        Ok(source)
    }

    fn best_separator(&self) -> Separator {
        let score = |separator: Separator| {
            let mut header = StringRecord::new();
            let read = self.reader(separator).read_record(&mut header);
            read.map_or((0, 0), |_| (columns::understood(&header), header.len()))
        };
        // Of several with the same score the last of the reversed order wins, which is the first of `ALL`.
        Separator::ALL.into_iter().rev().max_by_key(|s| score(*s)).unwrap_or(Separator::Comma)
    }

    fn reader(&self, separator: Separator) -> csv::Reader<&'a [u8]> {
        csv::ReaderBuilder::new()
            .delimiter(separator.byte())
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(self.body.as_bytes())
    }

    /// The header and the rows, each with its place; rows of separators alone do not count.
    #[expect(clippy::type_complexity, reason = "it is taken apart at once")]
    fn records(&self) -> Result<((Place<'a>, StringRecord), Vec<(Place<'a>, StringRecord)>), Malformed> {
        let mut reader = self.reader(self.separator);
        let mut records = Vec::new();
        let mut record = StringRecord::new();
        loop {
            let more = reader.read_record(&mut record).map_err(|e| {
                // Not expected, since lines may have any number of fields.
                let line = e.position().map_or(1, csv::Position::line) + self.lines_before;
                let at = Place { origin: self.origin, line, column: 1 };
                at.error(e.to_string(), "check that the file is a table with a separator between its fields")
            })?;
            if !more {
                break;
            }
            if record.iter().all(str::is_empty) {
                continue;
            }
            let at = self.place(&record);
            if records.len() > MOST_ROWS {
                let what = format!("the table has more than {MOST_ROWS} rows");
                return Err(at.error(what, "give a row for each subject and vowel"));
            }
            records.push((at, record.clone()));
        }
        if records.is_empty() {
            records.push((Place { origin: self.origin, line: 1, column: 1 }, StringRecord::new()));
        }
        let header = records.remove(0);
        Ok((header, records))
    }

    /// The beginning of `record`. The CSV reader counts skipped blank lines as part of the record after them.
    fn place(&self, record: &StringRecord) -> Place<'a> {
        let (line, byte) = record.position().map_or((1, 0), |p| (p.line(), p.byte()));
        let from = usize::try_from(byte).ok().and_then(|byte| self.body.as_bytes().get(byte..));
        let blank = from.unwrap_or_default().iter().take_while(|b| **b == b'\n').count() as u64;
        Place { origin: self.origin, line: self.lines_before + line + blank, column: 1 }
    }

    /// The error for a line that only another separator splits.
    fn wrong_separator(&self, record: &StringRecord, at: Place<'_>) -> Option<Malformed> {
        let only = if record.len() == 1 { record.get(0)? } else { return None };
        let other = Separator::ALL
            .into_iter()
            .find(|s| *s != self.separator && only.as_bytes().contains(&s.byte()))?;
        let what = format!("the fields are separated by {}", other.plural());
        Some(at.error(what, format!("separate them by {}, as in the header", self.separator.plural())))
    }
}

/// Columns and settings for reading a row.
struct RowReader<'a> {
    header: &'a StringRecord,
    columns: &'a Columns,
    mark: DecimalMark,
    reading: &'a Reading,
    source: &'a Source<'a>,
    /// Whether the table has rows of both /u/ and /ɯ/, so that `u` does not stand for `ɯ`.
    has_both_u: bool,
}

impl RowReader<'_> {
    fn vowel(&self, label: &str) -> Result<Vowel, BadLabel> {
        if self.has_both_u { Vowel::as_written(label) } else { Vowel::new(label) }
    }

    fn row(
        &self,
        record: &StringRecord,
        at: Place<'_>,
        muscles: &Arc<[String]>,
    ) -> Result<Lengths, Malformed> {
        self.check_shape(record, at)?;
        let (subject_at, vowel_at) =
            (at.at_column(self.columns.subject + 1), at.at_column(self.columns.vowel + 1));
        let cell = |field| record.get(field).unwrap_or_default();
        let subject = nfc(cell(self.columns.subject));
        if subject.is_empty() || subject.contains(char::is_control) {
            let what = format!("the subject is {:?}", clip(&subject));
            return Err(subject_at.error(what, "give it a name of printable characters, like S2"));
        }
        let vowel = self.vowel(cell(self.columns.vowel)).map_err(|e| {
            let what = format!("the vowel is {:?}", e.label);
            vowel_at.error(what, "write a label of 1 to 40 printable characters, like a, ɔ or ə")
        })?;
        let (mut length_mm, mut half_width_mm) = (Vec::new(), Vec::new());
        for (length, column) in self.columns.lengths.iter().zip(&self.reading.columns) {
            let numbers = |field: usize, unit| {
                let column = self.header.get(field).unwrap_or_default();
                (Numbers { column, unit, mark: self.mark }, cell(field), at.at_column(field + 1))
            };
            let (lengths, text, place) = numbers(length.field, length.unit);
            length_mm.push(lengths.length(text, place)?);
            let given = match length.half_width.or(self.columns.half_width) {
                Some((field, unit)) => {
                    let (half_widths, text, place) = numbers(field, unit);
                    half_widths.half_width(text, place)?
                }
                None => None,
            };
            half_width_mm.push(given.unwrap_or(column.half_width.without_column_mm()));
        }
        Ok(Lengths { subject, vowel, muscles: muscles.clone(), length_mm, half_width_mm })
    }

    fn check_shape(&self, record: &StringRecord, at: Place<'_>) -> Result<(), Malformed> {
        let named = self
            .header
            .iter()
            .enumerate()
            .filter(|(_, name)| !name.is_empty())
            .last()
            .map_or(0, |(i, _)| i + 1);
        let at = at.at_column(record.len().min(self.header.len()) + 1);
        let what =
            || format!("the line has {} fields where the header has {}", record.len(), self.header.len());
        if record.iter().skip(self.header.len()).any(|surplus| !surplus.is_empty()) {
            let help = match self.source.separator {
                Separator::Comma => {
                    "take out the surplus; between commas decimals are written with a point, like 57.8"
                }
                _ => "take out the surplus",
            };
            return Err(at.error(what(), help));
        }
        if record.len() < named {
            return Err(self.source.wrong_separator(record, at.at_column(1)).unwrap_or_else(|| {
                at.error(what(), "give every column a value; check for a quotation mark that is never closed")
            }));
        }
        Ok(())
    }

    /// An unusable row, with its subject and vowel if they can be read.
    fn broken(&self, record: &StringRecord, fault: Malformed) -> BrokenRow {
        let cell = |field| record.get(field).filter(|cell: &&str| !cell.is_empty());
        BrokenRow {
            subject: cell(self.columns.subject).map(nfc),
            vowel: cell(self.columns.vowel).and_then(|label| self.vowel(label).ok()),
            fault,
        }
    }
}
