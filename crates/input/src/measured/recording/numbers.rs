//! Reader of tables of numbers without a header, separated by spaces, tabs or commas.

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;
use super::budget::{self, Budget};

/// A table with the same number of values in every line.
pub(super) struct Numbers {
    /// Number of values in a line.
    pub width: usize,
    /// All values, line by line; NaN for those that the file marks as missing.
    values: Vec<f64>,
    /// Line number of each row in the file.
    lines: Vec<u64>,
}

impl Numbers {
    /// Reads the table; `widths` are the allowed numbers of values in a line, and `help` is the advice for
    /// other lines.
    ///
    /// A first line of words alone is a header and is skipped.
    pub fn read(
        bytes: &[u8],
        origin: &str,
        widths: &[usize],
        help: &str,
        budget: &mut Budget,
    ) -> Result<Self, Malformed> {
        let text = budget::text(bytes, origin)?;
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
                    .map_err(|_| at.at_column(column + 1).error(format!("{cell:?} is not a number"), help))?;
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
            budget.frame(out.lines.len(), width, at)?;
        }
        Ok(out)
    }

    /// The rows with their line numbers in the file.
    pub fn rows(&self) -> impl Iterator<Item = (u64, &[f64])> {
        self.lines.iter().copied().zip(self.values.chunks_exact(self.width.max(1)))
    }
}
