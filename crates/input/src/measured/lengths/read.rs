//! Reader of tables of lengths. A fault in a cell makes only that cell unusable.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use super::columns::{LengthColumns, LengthField, is_known};
use super::dataset::{BrokenRow, HalfWidth, ReadColumn, Reading};
use super::number::{LARGEST_HALF_WIDTH_MM, LONGEST_MM, SHORTEST_MM, TableUnit, is_missing, with_point};
use super::text::clip;
use super::{Dataset, Lengths, Malformed, ReadError, Row, Vowel};
use crate::files;
use crate::measured::table::{TableLine, TableLines};

const REFERENCE: &str = include_str!("../../../../../targets/takano2007_lengths.csv");
const REFERENCE_ORIGIN: &str = "targets/takano2007_lengths.csv (built in)";

const LARGEST: u64 = 64 << 20;

/// Half width of lengths whose digits do not show it, mm: that of lengths read off an MR image.
pub(super) const DEFAULT_HALF_WIDTH_MM: f64 = 0.5;
/// Largest number of decimals of a millimetre that is attributed to a measurement; more decimals are attributed to a program.
const MOST_DECIMALS: i32 = 2;
/// Of lengths that are too short for millimetres, those from here on seem to be centimetres, smaller ones metres.
const SHORTEST_CM: f64 = 0.2;

impl Dataset {
    /// The built-in lengths of Takano and Honda (2007), from thesis table 4.4: eight muscles of the subjects S1 to S4 in 19 rows (S4 has no
    /// /ɯ/).
    pub fn reference() -> Result<Self, ReadError> {
        Ok(read(REFERENCE.as_bytes(), REFERENCE_ORIGIN)?)
    }

    /// Reads the table in the file at `path`, or on stdin if `path` is `-`; [`Dataset::from_reader`] has the format.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        if path.as_os_str() == "-" {
            return Self::from_reader(io::stdin().lock(), "stdin");
        }
        Self::from_input(files::read_up_to(LARGEST, path), &path.display().to_string())
    }

    /// Reads a table of lengths; `origin` names it in errors.
    ///
    /// The text is UTF-8, or UTF-16 with a byte order mark; fields are separated by commas, semicolons or tabs, decimals are written with a
    /// point or a comma, and line ends may be LF, CR or both. A title and comments (`#`) before the header are skipped. The header has, in
    /// any order, the column of subjects (`subject`, `speaker`, `participant`), that of vowels (`vowel`, `phoneme`, `segment`) and one for
    /// each muscle with its unit: `GGa_mm`, `GGa (mm)`, `GGa_cm`, `GGa_m`. A length is 10 to 200 mm, so that a wrong unit is refused; an
    /// empty cell, `NA`, `-` or `*` means that it was not measured. Half widths of rounding are read from `GGa_half_width_mm` or, for all
    /// muscles, from `half_width_mm` or `error_mm`; without these columns they are half of the last digit of the lengths (0.5 mm for whole
    /// millimetres). All other columns are ignored. Names, numbers and units may be written in full-width letters, the columns may be
    /// called `話者` and `母音`, and vowels may be written in kana.
    ///
    /// A cell that is no length counts as not measured and is listed in [`Dataset::bad_cells`]; a row without a subject, a vowel or any
    /// length is left out and listed in [`Dataset::broken`].
    pub fn from_reader(reader: impl Read, origin: &str) -> Result<Self, ReadError> {
        Self::from_input(files::take_up_to(LARGEST, reader), origin)
    }

    fn from_input(bytes: io::Result<Vec<u8>>, origin: &str) -> Result<Self, ReadError> {
        let bytes = bytes.map_err(|error| ReadError::unreadable(origin, &error))?;
        Ok(read(&bytes, origin)?)
    }
}

fn read(bytes: &[u8], origin: &str) -> Result<Dataset, Malformed> {
    let wanted = "subject,vowel,GGa_mm,GGm_mm, then a line for each subject and vowel";
    let mut cells = TableLines::read(bytes, origin, wanted, is_known)?;
    let columns = LengthColumns::of(&cells)?;
    cells.find_decimal_mark(columns.lengths.iter().map(|l| l.field));
    let (cells, columns) = (&cells, &columns);
    let name = |field: usize| clip(cells.header.cell(field));
    let by_digits = TableUnit::ALL.map(|unit| {
        let of_unit = columns.lengths.iter().filter(move |l| l.unit == unit);
        half_width_by_digits(of_unit.flat_map(|l| {
            let lines = cells.rows.iter();
            lines.map(|line| LengthCell { table: cells, line, field: l.field, unit: l.unit })
        }))
    });
    let read = columns.lengths.iter().map(|l| {
        let half_width = match (l.half_width.or(columns.half_width), &by_digits[l.unit as usize]) {
            (Some((field, _)), digits) => HalfWidth::Column { name: name(field), else_mm: digits.1 },
            (None, (true, mm)) => HalfWidth::Digits { mm: *mm },
            (None, (false, mm)) => HalfWidth::Default { mm: *mm },
        };
        let (muscle, unit) = (l.muscle.clone(), l.unit);
        ReadColumn { muscle, name: name(l.field), column: l.field + 1, unit, half_width }
    });
    let vowels = cells.rows.iter().filter_map(|row| row.cell(columns.vowel).parse::<Vowel>().ok());
    let has = |label: &str| vowels.clone().any(|v| v.label() == label);
    let mut data = Dataset {
        origin: origin.to_owned(),
        muscles: columns.lengths.iter().map(|l| l.muscle.clone()).collect(),
        rows: Vec::new(),
        reading: Reading {
            encoding: cells.encoding,
            line_ends: cells.line_ends,
            separator: cells.separator,
            decimal_mark: cells.mark,
            header_line: cells.header.at.line,
            subject: name(columns.subject),
            vowel: name(columns.vowel),
            columns: read.collect(),
            set_aside: columns.set_aside.clone(),
            rows_without_lengths: Vec::new(),
        },
        broken: Vec::new(),
        bad_cells: Vec::new(),
        rows_of_subject: BTreeMap::new(),
    };
    let else_mm = columns.lengths.iter().map(|l| by_digits[l.unit as usize].1).collect();
    let (muscles, has_both_u) = (data.muscles.clone(), has("u") && has("ɯ"));
    let reader = Reader { cells, columns, muscles, else_mm, has_both_u };
    let mut seen = BTreeMap::new();
    for line in &cells.rows {
        reader.add(line, &mut data, &mut seen);
    }
    for (number, row) in data.rows.iter().enumerate() {
        data.rows_of_subject.entry(row.lengths.subject.clone()).or_default().push(number);
    }
    if !data.rows.is_empty() {
        return Ok(data);
    }
    Err(match data.broken.into_iter().next() {
        Some(row) => row.fault,
        None if !cells.rows.is_empty() => {
            let help = "write lengths in millimetres, like 57.8, where they were measured";
            cells.end.error("no row has a length", help)
        }
        None => {
            let what = format!("the table has a header but no rows; {}", cells.header_quoted());
            cells.end.error(what, "add a line for each subject and vowel")
        }
    })
}

/// Whether the digits of lengths in a unit show their half width, and the half width, mm.
fn half_width_by_digits<'a>(lengths: impl Iterator<Item = LengthCell<'a>> + Clone) -> (bool, f64) {
    let mut decimals: Vec<_> = lengths.clone().filter_map(LengthCell::decimals_of_mm).collect();
    decimals.sort_unstable();
    // A tenth of the lengths may have more decimals: such as a single 41.0 among whole millimetres.
    let decimals = decimals.get(decimals.len() * 9 / 10).copied();
    // Parsing text gives the `f64` that is nearest to the decimal number.
    let mm: Option<f64> =
        decimals.filter(|n| *n <= MOST_DECIMALS).and_then(|n| format!("5e{}", -n - 1).parse().ok());
    let by_digits = mm.unwrap_or(DEFAULT_HALF_WIDTH_MM);
    (mm.is_some(), half_of_common_step(lengths).map_or(by_digits, |mm| mm.max(by_digits)))
}

/// Half of the step, mm, if all lengths in a unit are multiples of 5 or 10 mm, whatever digits they are written with. Of fewer than eight
/// lengths this may be chance.
fn half_of_common_step<'a>(lengths: impl Iterator<Item = LengthCell<'a>>) -> Option<f64> {
    const FEWEST: usize = 8;
    const STEPS_MM: [f64; 2] = [10.0, 5.0];
    let lengths_mm: Vec<f64> = lengths.filter_map(|cell| cell.length().ok()?).collect();
    let is_common = |step: &f64| lengths_mm.iter().all(|mm| mm % step == 0.0);
    STEPS_MM.into_iter().filter(|_| lengths_mm.len() >= FEWEST).find(is_common).map(|step| step / 2.0)
}

struct Reader<'a> {
    cells: &'a TableLines<'a>,
    columns: &'a LengthColumns,
    muscles: Arc<[String]>,
    /// Half width of each muscle's lengths, mm, where no column gives it.
    else_mm: Vec<f64>,
    /// Whether the table has rows of both /u/ and /ɯ/, so that `u` does not stand for `ɯ`.
    has_both_u: bool,
}

impl Reader<'_> {
    /// Adds a row to the table, or to the rows that cannot be used. `seen` has the lines of earlier rows.
    fn add(&self, line: &TableLine<'_>, data: &mut Dataset, seen: &mut BTreeMap<(String, Vowel), u64>) {
        let mut bad_cells = Vec::new();
        let lengths = self.lengths(line, &mut bad_cells);
        bad_cells.sort_by_key(|fault| fault.column);
        let measured = lengths.as_ref().map_or(0, |l| l.length_mm.iter().flatten().count());
        let fault = match lengths {
            Ok(_) if measured + bad_cells.len() == 0 => {
                return data.reading.rows_without_lengths.push(line.at.line);
            }
            // Mostly bad cells mean a wrong unit or shifted columns, so that the other cells cannot be trusted either.
            Ok(_) if bad_cells.len() > measured => bad_cells.remove(0),
            Ok(lengths) => {
                let Lengths { subject, vowel, .. } = &lengths;
                let first = *seen.entry((subject.clone(), vowel.clone())).or_insert(line.at.line);
                if first == line.at.line {
                    data.bad_cells.append(&mut bad_cells);
                    return data.rows.push(Row { line: line.at.line, lengths });
                }
                let what = format!("{subject} /{vowel}/ is given twice, here and on line {first}");
                let help = "keep one of the two lines, or give repetitions different labels, as in a1 and a2";
                // The first of the two rows is found by its vowel, so this one gets none.
                let fault = line.place(0).error(what, help);
                let subject = Some(subject.clone());
                return data.broken.push(BrokenRow { subject, vowel: None, fault });
            }
            Err(fault) => fault,
        };
        let (subject, vowel) = (line.cell(self.columns.subject), line.cell(self.columns.vowel));
        let subject = (!subject.is_empty()).then(|| subject.to_owned());
        data.broken.push(BrokenRow { subject, vowel: self.vowel(vowel).ok(), fault });
    }

    fn vowel(&self, label: &str) -> Result<Vowel, ReadError> {
        if self.has_both_u { label.parse() } else { Vowel::new(label) }
    }

    /// The lengths of a row. Faults of cells are added to `bad`, and these cells count as not measured.
    fn lengths(&self, line: &TableLine<'_>, bad: &mut Vec<Malformed>) -> Result<Lengths, Malformed> {
        let LengthColumns { subject, vowel, lengths, half_width, .. } = self.columns;
        self.cells.check_shape(line)?;
        let at = |field: usize| line.place(field);
        let name = line.cell(*subject).to_owned();
        if name.is_empty() || name.contains(char::is_control) {
            let what = format!("the subject is {:?}", clip(&name));
            return Err(at(*subject).error(what, "give it a name of printable characters, like S2"));
        }
        let vowel = self.vowel(line.cell(*vowel)).map_err(|_| {
            let what = format!("the vowel is {:?}", clip(line.cell(*vowel)));
            at(*vowel).error(what, "write a label of 1 to 40 printable characters, like a, ɔ or ə")
        })?;
        let cell = |(field, unit)| LengthCell { table: self.cells, line, field, unit };
        let mut number = |read: Result<Option<f64>, Malformed>| {
            read.unwrap_or_else(|fault| {
                bad.push(fault);
                None
            })
        };
        let length_mm: Vec<_> = lengths.iter().map(|l| number(cell((l.field, l.unit)).length())).collect();
        let in_mm = lengths.iter().all(|l| l.unit == TableUnit::Mm);
        if in_mm && length_mm.len() > 2 && length_mm.iter().all(|mm| *mm == Some(100.0)) {
            let help = "write the measured lengths, not percent of those in the baseline";
            return Err(at(lengths[0].field).error("every length is 100", help));
        }
        let mut half = |field: LengthField| {
            number(cell(field).half_width().map_err(|fault| {
                let help = format!("{}; until then that of the lengths' digits is taken", fault.help);
                Malformed { help, ..fault }
            }))
        };
        let common = half_width.and_then(&mut half);
        let half_width_mm = Vec::from_iter(
            lengths
                .iter()
                .zip(&self.else_mm)
                .map(|(l, else_mm)| l.half_width.map_or(common, &mut half).unwrap_or(*else_mm)),
        );
        Ok(Lengths { subject: name, vowel, muscles: self.muscles.clone(), length_mm, half_width_mm })
    }
}

#[derive(Clone, Copy)]
struct LengthCell<'a> {
    table: &'a TableLines<'a>,
    line: &'a TableLine<'a>,
    field: usize,
    unit: TableUnit,
}

impl<'a> LengthCell<'a> {
    fn text(self) -> &'a str {
        self.line.cell(self.field)
    }

    /// Number of decimals of a length in millimetres: 0 for 57 mm and 5.7 cm, 1 for 57.8 mm, -1 for 6 cm.
    fn decimals_of_mm(self) -> Option<i32> {
        let text = with_point(self.text(), self.table.mark)?.to_ascii_lowercase();
        text.parse().ok().filter(|number: &f64| number.is_finite())?;
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
        i32::try_from(decimals).ok()?.checked_sub(exponent.parse().ok()?)?.checked_sub(self.unit.facts().2)
    }

    /// The length in mm, with the same bits as if it had been written in mm; `None` if it was not measured.
    fn in_mm(self) -> Result<Option<f64>, Malformed> {
        if is_missing(self.text()) {
            return Ok(None);
        }
        let (_, unit, power, example) = self.unit.facts();
        let like = format!("{unit} like {}", self.table.mark.written(example));
        let number = self.table.number(self.line, self.field, &like)?;
        let text = with_point(self.text(), self.table.mark).unwrap_or_default();
        let shifted = (power > 0 && number.is_finite() && !text.contains(['e', 'E']))
            .then(|| format!("{text}e{power}").parse().ok())
            .flatten();
        Ok(Some(shifted.unwrap_or(number * 10f64.powi(power))))
    }

    fn length(self) -> Result<Option<f64>, Malformed> {
        let Some(mm) = self.in_mm()? else { return Ok(None) };
        let (_, unit, _, example) = self.unit.facts();
        let like = format!("write a measured length in {unit}, like {}", self.table.mark.written(example));
        let (why, help) = match mm {
            SHORTEST_MM..=LONGEST_MM => return Ok(Some(mm)),
            mm if !mm.is_finite() => ("not finite".to_owned(), like),
            ..=0.0 => ("not positive".to_owned(), format!("{like}, or NA where there is none")),
            mm if self.unit != TableUnit::Mm => (
                format!(
                    "which is {} mm: not a length of a tongue muscle (10 to 200 mm)",
                    clip(&mm.to_string())
                ),
                "check the number, and the unit that the column's name gives".to_owned(),
            ),
            LONGEST_MM.. => (
                "too long for a tongue muscle (above 200 mm)".to_owned(),
                format!("{like}; a column that is not of a muscle is ignored if its name has no unit"),
            ),
            mm => {
                let (other, unit) = if mm < SHORTEST_CM { ("metres", "m") } else { ("centimetres", "cm") };
                (
                    "too short for millimetres (below 10)".to_owned(),
                    format!(
                        "correct it, or if all lengths are in {other}, write {unit} in place of mm in the column's name"
                    ),
                )
            }
        };
        Err(self.wrong(&why, help))
    }

    fn half_width(self) -> Result<Option<f64>, Malformed> {
        match self.in_mm()? {
            Some(mm) if !(0.0..=LARGEST_HALF_WIDTH_MM).contains(&mm) => Err(self.wrong(
                "which is not a half width of a length",
                format!("write one from 0 to {LARGEST_HALF_WIDTH_MM} mm, like 0.5"),
            )),
            found => Ok(found),
        }
    }

    fn wrong(self, why: &str, help: String) -> Malformed {
        let name = clip(self.table.header.cell(self.field));
        self.line.place(self.field).error(format!("{name} is {}, {why}", clip(self.text())), help)
    }
}
