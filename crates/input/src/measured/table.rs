//! Cells of tables as spreadsheets and statistics programs write them: encoding, separator, header, rows.

use std::cmp::Reverse;

use csv::StringRecord;

use super::error::{Malformed, SourcePlace};
use super::lengths::number::{self, DecimalMark};
use super::lengths::text::{Text, clip, decode, fold};
use super::lengths::{Encoding, LineEnds, Separator};

const MOST_ROWS: usize = 200_000;
const MOST_COLUMNS: usize = 10_000;
/// The header is one of so many lines; the lines before it are a title.
pub(super) const HEADER_WITHIN: usize = 20;

pub(super) struct TableLine<'a> {
    pub at: SourcePlace<'a>,
    pub cells: StringRecord,
}

impl<'a> TableLine<'a> {
    /// The text in a column; empty if the line ends before it.
    pub fn cell(&self, field: usize) -> &str {
        self.cells.get(field).unwrap_or_default()
    }

    pub fn place(&self, field: usize) -> SourcePlace<'a> {
        self.at.at_column(field + 1)
    }
}

pub(super) struct TableLines<'a> {
    pub encoding: Encoding,
    pub line_ends: LineEnds,
    pub separator: Separator,
    /// The decimal mark: a point before [`TableLines::find_decimal_mark`].
    pub mark: DecimalMark,
    pub header: TableLine<'a>,
    pub rows: Vec<TableLine<'a>>,
    pub end: SourcePlace<'a>,
}

impl<'a> TableLines<'a> {
    /// Reads a table. The separator and the header are those with which most names of columns satisfy `is_known`. Comments (`#`) and
    /// Excel's `sep=;` before the header are skipped. `wanted` is an example of a header for messages.
    pub fn read(
        bytes: &[u8],
        origin: &'a str,
        wanted: &str,
        is_known: impl Fn(&str) -> bool,
    ) -> Result<Self, Malformed> {
        let Text { text, encoding, line_ends } = decode(bytes, origin)?;
        let start = SourcePlace::start(origin);
        if ["{", "[{", "<"].iter().any(|begin| text.trim_start().starts_with(begin)) {
            let what = "the file is JSON, XML or a page, not a table";
            return Err(start.error(what, "export the table as CSV"));
        }
        let (mut body, mut before, mut declared) = (&*text, 0, None);
        while let Some((line, rest)) = body.split_once('\n') {
            let sep = line.trim().strip_prefix("sep=").and_then(|sep| match sep {
                "" => Some(Separator::Tab),
                sep => Separator::ALL.into_iter().find(|s| sep.as_bytes() == [*s as u8]),
            });
            if !line.trim().is_empty() && !line.trim().starts_with('#') && sep.is_none() {
                break;
            }
            (body, before, declared) = (rest, before + 1, declared.or(sep));
        }
        if body.trim().is_empty() {
            return Err(start.error("the file is empty", format!("begin with a line like {wanted}")));
        }
        // At most the first rows that are not empty, with folded cells.
        let filled = |separator: Separator, most: usize| -> Vec<TableLine<'a>> {
            let mut builder = csv::ReaderBuilder::new();
            builder.delimiter(separator as u8).flexible(true);
            // Records of any number of fields in UTF-8 text cannot fail.
            let rows = records(&text, origin, before, &mut builder, "").map_while(Result::ok);
            let rows = rows.filter(|row| row.cells.iter().any(|cell| !cell.is_empty())).map(|row| {
                let is_ascii = row.cells.as_slice().is_ascii();
                let cells = if is_ascii { row.cells } else { row.cells.iter().map(fold).collect() };
                TableLine { cells, ..row }
            });
            rows.take(most).collect()
        };
        let candidates = declared.map_or(Separator::ALL.to_vec(), |separator| vec![separator]);
        let known =
            |line: &TableLine<'_>| line.cells.iter().take(MOST_COLUMNS).filter(|name| is_known(name)).count();
        let scored = candidates.into_iter().rev().flat_map(|separator| {
            let first = filled(separator, HEADER_WITHIN);
            let score = |(n, line): (usize, &TableLine<'_>)| (known(line), Reverse(n), line.cells.len());
            first.iter().enumerate().map(score).map(|score| (score, separator)).collect::<Vec<_>>()
        });
        // `max_by_key` returns the last of equal scores, which is the first of `ALL`.
        let best = scored.max_by_key(|(score, _)| *score);
        let (n, separator) = best.map_or((0, Separator::Comma), |((_, n, _), separator)| (n.0, separator));
        let mut rows = filled(separator, n + MOST_ROWS + 2).split_off(n);
        let none = TableLine { at: start, cells: StringRecord::new() };
        let header = if rows.is_empty() { none } else { rows.remove(0) };
        if header.cells.len() > MOST_COLUMNS {
            let what = format!("the header has {} columns", header.cells.len());
            return Err(header.at.error(what, format!("give at most {MOST_COLUMNS}, one a muscle")));
        }
        if let Some(line) = rows.get(MOST_ROWS) {
            let what = format!("the table has more than {MOST_ROWS} rows");
            return Err(line.at.error(what, "split it into smaller files"));
        }
        rows.retain(|row| !(row.cell(0).starts_with('#') && row.cells.len() < header.cells.len()));
        let end = SourcePlace { line: 1 + text.matches('\n').count() as u64, ..start };
        let mark = DecimalMark::Point;
        let mut cells = Self { encoding, line_ends, separator, mark, header, rows, end };
        // R writes names of rows without a header for their column. Between commas the surplus field may come from a decimal comma.
        let width = cells.header.cells.len();
        if separator != Separator::Comma
            && !cells.rows.is_empty()
            && cells.rows.iter().all(|row| row.cells.len() == width + 1)
        {
            cells.header.cells = std::iter::once("").chain(&cells.header.cells).collect();
        }
        if cells.header.cells.len() < 2 {
            let what = format!("the table has fewer than two columns; {}", cells.header_quoted());
            let help = format!("put commas, semicolons or tabs between the fields, as in {wanted}");
            return Err(cells.header.at.error(what, help));
        }
        Ok(cells)
    }

    pub fn header_quoted(&self) -> String {
        let between = char::from(self.separator as u8).to_string();
        let names = self.header.cells.iter().collect::<Vec<_>>().join(&between);
        format!("line {} was taken for the header: {:?}", self.header.at.line, clip(&names))
    }

    /// The error for two columns of the same meaning.
    pub fn twice(&self, first: usize, second: usize) -> Malformed {
        let [earlier, name] = [first, second].map(|field| clip(self.header.cell(field)));
        let what = if earlier == name {
            format!("column {name} appears twice, here and as column {}", first + 1)
        } else {
            format!("column {name} says the same as column {} ({earlier})", first + 1)
        };
        self.header.place(second).error(what, "keep one of the two")
    }

    /// Takes the decimal mark of most numbers in some columns for that of the table.
    pub fn find_decimal_mark(&mut self, fields: impl Iterator<Item = usize>) {
        let fields: Vec<usize> = fields.collect();
        let cells = self.rows.iter().flat_map(|row| fields.iter().map(|field| row.cell(*field)));
        let commas: i64 = cells
            .filter_map(number::mark_of)
            .map(|mark| if mark == DecimalMark::Comma { 1 } else { -1 })
            .sum();
        self.mark = if commas > 0 { DecimalMark::Comma } else { DecimalMark::Point };
    }

    /// The number in a cell; `like` says what else to write.
    pub fn number(&self, line: &TableLine<'_>, field: usize, like: &str) -> Result<f64, Malformed> {
        let (name, cell) = (clip(self.header.cell(field)), line.cell(field));
        if let Some(number) = number::with_point(cell, self.mark).and_then(|text| text.parse().ok()) {
            return Ok(number);
        }
        let (other, is, should) = match self.mark {
            DecimalMark::Point => (DecimalMark::Comma, "comma", "point"),
            DecimalMark::Comma => (DecimalMark::Point, "point", "comma"),
        };
        let (what, help) = if number::mark_of(cell) == Some(other) {
            let to = self.mark.written(&cell.replacen(',', ".", 1));
            let help = format!("write it with a decimal {should}, as the others: {}", clip(&to));
            (format!("with a decimal {is}"), help)
        } else {
            let help = format!("write {like} with a decimal {should}, or NA where nothing was measured");
            ("not a number".to_owned(), help)
        };
        Err(line.place(field).error(format!("{name} is {:?}, {what}", clip(cell)), help))
    }

    /// Refuses a row with content behind the fields of the header, or without a field for a named column.
    pub fn check_shape(&self, row: &TableLine<'_>) -> Result<(), Malformed> {
        let (header, width) = (&self.header.cells, row.cells.len());
        let at = row.place(width.min(header.len()));
        let (line, wanted) = (self.header.at.line, header.len());
        let message = format!("the line has {width} fields where the header, line {line}, has {wanted}");
        if row.cells.iter().skip(header.len()).any(|surplus| !surplus.is_empty()) {
            let help = match self.separator {
                Separator::Comma => "; between commas decimals are written with a point, like 57.8",
                _ => "",
            };
            return Err(at.error(message, format!("take out the surplus{help}")));
        }
        if header.iter().skip(width).all(str::is_empty) {
            return Ok(());
        }
        let (own, first) = (self.separator, row.cell(0).as_bytes());
        let other = Separator::ALL.into_iter().find(|s| *s != own && first.contains(&(*s as u8)));
        if let Some(other) = other.filter(|_| width == 1) {
            let what = format!("the fields are separated by {}", other.plural());
            return Err(row.at.error(what, format!("separate them by {}, as in the header", own.plural())));
        }
        Err(at.error(message, "give every column a value; check for a quotation mark that is never closed"))
    }
}

/// The rows of a table below its title, as the reader of CSV divides them; the header is the first of them.
pub(super) fn records<'a>(
    text: &str,
    origin: &'a str,
    title_lines: usize,
    builder: &mut csv::ReaderBuilder,
    help: &'static str,
) -> impl Iterator<Item = Result<TableLine<'a>, Malformed>> {
    let begin: usize = text.split_inclusive('\n').take(title_lines).map(str::len).sum();
    let body = &text.as_bytes()[begin..];
    let place = move |at: Option<&csv::Position>| {
        let (line, byte) = at.map_or((1, 0), |at| (at.line(), at.byte()));
        // The reader counts blank lines as part of the record after them.
        let from = usize::try_from(byte).ok().and_then(|byte| body.get(byte..));
        let blank = from.unwrap_or_default().iter().take_while(|b| **b == b'\n').count() as u64;
        SourcePlace { line: title_lines as u64 + line + blank, ..SourcePlace::start(origin) }
    };
    let reader = builder.has_headers(false).trim(csv::Trim::All).from_reader(body);
    reader.into_records().map(move |record| match record {
        Ok(cells) => Ok(TableLine { at: place(cells.position()), cells }),
        Err(e) => Err(place(e.position()).error(e.to_string(), help)),
    })
}
