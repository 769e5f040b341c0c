//! Tables of numbers without a header, separated by blanks, tabs or commas.

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;
use super::super::lengths::text::decode;
use super::Budget;

/// A table in which every line has as many numbers as the first.
pub(super) struct Numbers {
    /// Numbers in a line.
    pub width: usize,
    /// All numbers, line by line; NaN where the file says so.
    values: Vec<f64>,
    /// The line of the file that each row was.
    lines: Vec<u64>,
}

impl Numbers {
    /// Reads the table; `widths` says how many numbers a line may have, and `help` what to do where it has another count.
    ///
    /// A first line of words alone is a header and is skipped.
    pub fn read(
        bytes: &[u8],
        origin: &str,
        widths: &[usize],
        help: &str,
        budget: &mut Budget,
    ) -> Result<Self, Malformed> {
        let text = decode(bytes, origin)?.text;
        let start = Place { origin, line: 1, column: 1 };
        let mut out = Self { width: 0, values: Vec::new(), lines: Vec::new() };
        for (n, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
            let at = Place { line: n as u64 + 1, ..start };
            let cells = || line.split([' ', '\t', ',']).map(str::trim).filter(|c| !c.is_empty());
            let is_header = n == 0 && cells().all(|c| c.parse::<f64>().is_err());
            if is_header {
                continue;
            }
            let before = out.values.len();
            for (column, cell) in cells().enumerate() {
                let value = cell.parse::<f64>();
                let value = value
                    .map_err(|_| at.at_column(column + 1).error(format!("{cell:?} is no number"), help))?;
                out.values.push(value);
            }
            let width = out.values.len() - before;
            if out.width == 0 && widths.contains(&width) {
                out.width = width;
            }
            if width != out.width {
                let wanted = match out.width {
                    0 => widths.iter().map(usize::to_string).collect::<Vec<_>>().join(" or "),
                    width => width.to_string(),
                };
                let what = format!("the line has {width} numbers where {wanted} are needed");
                return Err(at.at_column(width.max(1)).error(what, help));
            }
            out.lines.push(at.line);
            budget.add(out.lines.len(), width, width, at)?;
        }
        Ok(out)
    }

    /// The rows with their lines in the file.
    pub fn rows(&self) -> impl Iterator<Item = (u64, &[f64])> {
        self.lines.iter().copied().zip(self.values.chunks_exact(self.width.max(1)))
    }
}
