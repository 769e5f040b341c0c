//! Reader of tables of lengths: cells, header, rows. A fault in a cell makes only that cell unusable.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::columns::{Columns, is_known};
use super::error::{BrokenRow, Malformed};
use super::number::{self, CellFault, DecimalMark, Numbers, TableUnit};
use super::reading::{Column, HalfWidth, Reading};
use super::text::clip;
use super::vowel::{BadLabel, Vowel};
use super::{Lengths, Row};
use crate::measured::table::{Cells, Line};

/// Default half width of a length, mm: that of lengths read off an MR image.
const DEFAULT_HALF_WIDTH_MM: f64 = 0.5;
/// Largest number of decimals of a millimetre that counts as measured; more decimals are a program's.
const MOST_DECIMALS: i32 = 2;

pub(super) struct Table {
    pub muscles: Arc<[String]>,
    pub rows: Vec<Row>,
    pub reading: Reading,
    pub broken: Vec<BrokenRow>,
    pub bad_cells: Vec<Malformed>,
}

/// The table in `bytes`; `origin` names it in errors.
pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Table, Malformed> {
    let wanted = "subject,vowel,GGa_mm,GGm_mm, then a line for each subject and vowel";
    let cells = Cells::read(bytes, origin, wanted, is_known)?;
    let columns = Columns::of(&cells)?;
    let mark = cells.decimal_mark(&columns.lengths.iter().map(|l| l.field).collect::<Vec<_>>());
    let muscles: Arc<[String]> = columns.lengths.iter().map(|l| l.muscle.clone()).collect();
    let name = |field: usize| clip(cells.header.cell(field));
    let by_digits = TableUnit::ALL.map(|unit| half_width_by_digits(&cells, &columns, mark, unit));
    let column = |l: &super::columns::Length| {
        let otherwise = by_digits[l.unit as usize].clone();
        let half_width = match l.half_width.or(columns.half_width) {
            Some((field, _)) => {
                HalfWidth::Column { name: name(field), else_mm: otherwise.without_column_mm() }
            }
            None => otherwise,
        };
        Column {
            muscle: l.muscle.clone(),
            name: name(l.field),
            column: l.field + 1,
            unit: l.unit,
            half_width,
        }
    };
    let written = |row: &Line| Vowel::as_written(row.cell(columns.vowel)).ok();
    let has = |label: &str| cells.rows.iter().any(|row| written(row).is_some_and(|v| v.label() == label));
    let reader = RowReader {
        cells: &cells,
        columns: &columns,
        mark,
        else_mm: columns.lengths.iter().map(|l| by_digits[l.unit as usize].without_column_mm()).collect(),
        has_both_u: has("u") && has("ɯ"),
    };
    let mut table = Table {
        reading: Reading {
            encoding: cells.encoding,
            line_ends: cells.line_ends,
            separator: cells.separator,
            decimal_mark: mark,
            header_line: cells.header.number,
            subject: name(columns.subject),
            vowel: name(columns.vowel),
            columns: columns.lengths.iter().map(column).collect(),
            set_aside: columns.set_aside.clone(),
            rows_without_lengths: Vec::new(),
        },
        muscles,
        rows: Vec::new(),
        broken: Vec::new(),
        bad_cells: Vec::new(),
    };
    let mut seen = BTreeMap::new();
    for line in &cells.rows {
        reader.add(line, &mut table, &mut seen);
    }
    if table.rows.is_empty() {
        return Err(match table.broken.into_iter().next() {
            Some(row) => row.fault,
            None if !cells.rows.is_empty() => cells.end().error(
                "no row has a length",
                "write lengths in millimetres, like 57.8, where they were measured",
            ),
            None => {
                let what = format!("the table has a header but no rows; {}", cells.header_quoted());
                cells.end().error(what, "add a line for each subject and vowel")
            }
        });
    }
    Ok(table)
}

/// The half width of lengths by the digits of those in a unit.
fn half_width_by_digits(
    cells: &Cells<'_>,
    columns: &Columns,
    mark: DecimalMark,
    unit: TableUnit,
) -> HalfWidth {
    let fields: Vec<usize> = columns.lengths.iter().filter(|l| l.unit == unit).map(|l| l.field).collect();
    let cells = cells.rows.iter().flat_map(|row| fields.iter().map(|field| row.cell(*field)));
    match cells.filter_map(|cell| number::decimals_mm(cell, mark, unit)).max() {
        Some(n) if n <= MOST_DECIMALS => {
            // Parsed from text, to get exactly the decimal number.
            HalfWidth::Digits { mm: format!("5e{}", -n - 1).parse().unwrap_or(DEFAULT_HALF_WIDTH_MM) }
        }
        _ => HalfWidth::Default { mm: DEFAULT_HALF_WIDTH_MM },
    }
}

impl HalfWidth {
    fn without_column_mm(&self) -> f64 {
        match self {
            HalfWidth::Column { else_mm: mm, .. }
            | HalfWidth::Given { mm }
            | HalfWidth::Digits { mm }
            | HalfWidth::Default { mm } => *mm,
        }
    }
}

struct RowReader<'a> {
    cells: &'a Cells<'a>,
    columns: &'a Columns,
    mark: DecimalMark,
    /// Half width of each muscle's lengths where no column gives one, mm.
    else_mm: Vec<f64>,
    /// Whether the table has rows of both /u/ and /ɯ/, so that `u` does not stand for `ɯ`.
    has_both_u: bool,
}

impl RowReader<'_> {
    /// Adds a row to the table, or to what cannot be used. `seen` has the lines of earlier rows.
    fn add(&self, line: &Line, table: &mut Table, seen: &mut BTreeMap<(String, Vowel), u64>) {
        let mut bad_cells = Vec::new();
        let lengths = self.lengths(line, &table.muscles, &mut bad_cells);
        bad_cells.sort_by_key(|fault| fault.column);
        let measured = lengths.as_ref().map_or(0, |l| l.length_mm.iter().flatten().count());
        let fault = match lengths {
            Ok(_) if measured + bad_cells.len() == 0 => {
                return table.reading.rows_without_lengths.push(line.number);
            }
            // Mostly bad cells are a wrong unit or shifted columns: the others are then not to be trusted.
            Ok(_) if bad_cells.len() > measured => bad_cells.remove(0),
            Ok(lengths) => {
                let first =
                    *seen.entry((lengths.subject.clone(), lengths.vowel.clone())).or_insert(line.number);
                if first == line.number {
                    table.bad_cells.append(&mut bad_cells);
                    return table.rows.push(Row { line: line.number, lengths });
                }
                let what = format!(
                    "{} /{}/ is given twice, here and on line {first}",
                    lengths.subject, lengths.vowel
                );
                let fault = self
                    .cells
                    .at(line, 0)
                    .error(what, "keep one of the two lines, or tell repetitions apart, as in a1 and a2");
                // The first of the two rows is used, so this one has no subject or vowel.
                return table.broken.push(BrokenRow { subject: None, vowel: None, fault });
            }
            Err(fault) => fault,
        };
        let (subject, vowel) = (line.cell(self.columns.subject), line.cell(self.columns.vowel));
        let subject = (!subject.is_empty()).then(|| subject.to_owned());
        table.broken.push(BrokenRow { subject, vowel: self.vowel(vowel).ok(), fault });
    }

    fn vowel(&self, label: &str) -> Result<Vowel, BadLabel> {
        if self.has_both_u { Vowel::as_written(label) } else { Vowel::new(label) }
    }

    /// The lengths of a row; those whose cells are wrong are as if they had not been measured.
    fn lengths(
        &self,
        line: &Line,
        muscles: &Arc<[String]>,
        bad: &mut Vec<Malformed>,
    ) -> Result<Lengths, Malformed> {
        self.cells.check_shape(line)?;
        let at = |field| self.cells.at(line, field);
        let subject = line.cell(self.columns.subject).to_owned();
        if subject.is_empty() || subject.contains(char::is_control) {
            let what = format!("the subject is {:?}", clip(&subject));
            return Err(
                at(self.columns.subject).error(what, "give it a name of printable characters, like S2")
            );
        }
        let vowel = self.vowel(line.cell(self.columns.vowel)).map_err(|e| {
            let what = format!("the vowel is {:?}", e.label);
            at(self.columns.vowel)
                .error(what, "write a label of 1 to 40 printable characters, like a, ɔ or ə")
        })?;
        let mut number = |(field, unit), read: fn(Numbers<'_>, &str) -> Result<Option<f64>, CellFault>| {
            let numbers = Numbers { column: self.cells.header.cell(field), unit, mark: self.mark };
            let found = read(numbers, line.cell(field)).map_err(|(what, help)| at(field).error(what, help));
            found.unwrap_or_else(|fault| {
                bad.push(fault);
                None
            })
        };
        let lengths = &self.columns.lengths;
        let length_mm: Vec<_> =
            lengths.iter().map(|l| number((l.field, l.unit), |n, cell| n.length(cell))).collect();
        let in_mm = lengths.iter().all(|l| l.unit == TableUnit::Mm);
        if in_mm && length_mm.len() > 2 && length_mm.iter().all(|mm| *mm == Some(100.0)) {
            let help = "write the measured lengths, not percent of those in the baseline";
            return Err(at(lengths[0].field).error("every length is 100", help));
        }
        let common = self.columns.half_width.and_then(|field| number(field, |n, cell| n.half_width(cell)));
        let own = lengths.iter().zip(&self.else_mm);
        let half_width = |(l, else_mm): (&super::columns::Length, &f64)| {
            let given = l.half_width.map_or(common, |field| number(field, |n, cell| n.half_width(cell)));
            given.unwrap_or(*else_mm)
        };
        let half_width_mm = own.map(half_width).collect();
        Ok(Lengths { subject, vowel, muscles: muscles.clone(), length_mm, half_width_mm })
    }
}
