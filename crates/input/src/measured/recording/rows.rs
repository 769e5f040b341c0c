//! Rows of tables of recordings, the numbers in their cells, and last numbers that are cut off.

use std::cmp::Reverse;
use std::fmt::Display;

use super::{HEADER_WITHIN, Malformed, SourcePlace, TableLine, coordinate};

/// The lines of a text that are not blank, each divided into cells; the first one is at `start`.
pub(super) fn split<'a, I: Iterator<Item = &'a str>>(
    text: &'a str,
    start: SourcePlace<'a>,
    cells: impl Fn(&'a str) -> I,
) -> impl Iterator<Item = TableLine<'a>> {
    let lines = (start.line..).zip(text.lines()).filter(|(_, text)| !text.trim().is_empty());
    lines.map(move |(line, text)| TableLine {
        at: SourcePlace { line, ..start },
        cells: cells(text).collect(),
    })
}

/// The cells of a line. They are separated by spaces, tabs or commas.
pub(super) fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t', ',']).map(str::trim).filter(|cell| !cell.is_empty())
}

/// The separator of a table (tab, comma or semicolon) and the number of lines before its header: those with which most fields are known
/// names of columns.
pub(super) fn header(text: &str, is_known: impl Fn(&str) -> bool) -> (u8, usize) {
    let known = |line: &str, separator: u8| {
        let names = line.split(char::from(separator)).map(|name| name.trim_matches([' ', '"']));
        names.filter(|name| is_known(name)).count()
    };
    let scores = text
        .lines()
        .take(HEADER_WITHIN)
        .enumerate()
        .flat_map(|(n, line)| b"\t,;".map(|separator| (known(line, separator), Reverse(n), separator)));
    let best = scores.filter(|(known, ..)| *known > 0).max_by_key(|(known, n, _)| (*known, *n));
    best.map_or((b'\t', 0), |(_, Reverse(n), separator)| (separator, n))
}

impl TableLine<'_> {
    /// The number in a cell; `None` if the cell says that nothing was measured. `what` names the cell in errors.
    pub(super) fn number(&self, field: usize, what: impl Display) -> Result<Option<f64>, Malformed> {
        let text = self.cell(field);
        if is_missing(text) {
            return Ok(None);
        }
        number(text).map(Some).ok_or_else(|| {
            let help = "give a number up to 1e9, or leave the cell empty where the point was not seen";
            self.place(field).error(format!("{what} is {text:?}"), help)
        })
    }

    /// The position of a point in the plane; `None` if a coordinate was not measured. `what` names a coordinate in errors.
    pub(super) fn point(
        &self,
        [x, y]: [usize; 2],
        what: impl Display,
    ) -> Result<Option<[f64; 3]>, Malformed> {
        let (x, y) = (self.number(x, &what)?, self.number(y, &what)?);
        Ok(x.zip(y).map(|(x, y)| [x, y, 0.0]))
    }

    pub(super) fn seconds(&self, field: usize) -> Result<f64, Malformed> {
        let text = self.cell(field);
        number(text).ok_or_else(|| {
            self.place(field).error(
                format!("the time is {text:?}"),
                "give a number of seconds up to 1e9, such as those since the start of the recording",
            )
        })
    }
}

pub(super) fn is_missing(text: &str) -> bool {
    matches!(text, "" | "*" | "NA" | "NaN" | "nan")
}

/// A finite number, with a decimal point or comma.
pub(super) fn number(text: &str) -> Option<f64> {
    let comma = text.matches(',').count() == 1 && !text.contains('.');
    coordinate(text).or_else(|| coordinate(&text.replace(',', ".")).filter(|_| comma))
}

/// The last number of a text that has no line end behind it, and the last numbers of the lines above; each with its number of decimals.
pub(super) struct LastNumber<'a> {
    cell: &'a str,
    value: (f64, usize),
    above: Vec<(f64, usize)>,
}

impl<'a> LastNumber<'a> {
    pub fn of(text: &'a str) -> Option<Self> {
        let (above, last) = text.rsplit_once('\n')?;
        let between = ['\t', ';', ','].into_iter().find(|c| last.contains(*c)).unwrap_or(' ');
        let cell = |line: &'a str| line.rsplit(between).next().unwrap_or_default().trim();
        let number = |line: &'a str| -> Option<(f64, usize)> {
            let cell = cell(line).replace(',', ".");
            Some((cell.parse().ok()?, cell.split_once('.').map_or(0, |(_, decimals)| decimals.len())))
        };
        Some(Self {
            cell: cell(last),
            value: number(last)?,
            above: above.lines().filter_map(number).collect(),
        })
    }

    /// Whether it has fewer decimals than every number above it.
    pub fn is_short(&self) -> bool {
        self.above.iter().map(|(_, decimals)| *decimals).min() > Some(self.value.1)
    }
}

/// A note if a text file seems to be cut off: it ends without a line end in a number that has fewer digits than those above it in the same
/// column.
pub(super) fn truncation_note(bytes: &[u8]) -> Option<String> {
    const TAIL: usize = 1 << 16;
    const FEWEST_LINES: usize = 5;
    // Text in UTF-16 has NUL bytes.
    let tail: Vec<u8> =
        bytes[bytes.len().saturating_sub(TAIL)..].iter().copied().filter(|b| *b != 0).collect();
    let text = String::from_utf8_lossy(&tail);
    let last = LastNumber::of(&text).filter(|last| last.above.len() >= FEWEST_LINES)?;
    let LastNumber { cell, value: (value, decimals), above } = &last;
    let most = above.iter().map(|o| o.1).max()?;
    let usual = (0..=most).max_by_key(|n| above.iter().filter(|o| o.1 == *n).count())?;
    let is_cut = match usual {
        0 => *value != 0.0 && above.iter().all(|o| o.0.abs() > 5.0 * value.abs()),
        _ => last.is_short() || decimals + 2 <= usual,
    };
    is_cut.then(|| {
        format!("the file ends without a line end in a number, {cell}, that is shorter than those above it: it may be cut off; export it again")
    })
}
