//! Units and decimal marks of the numbers in a table.

use serde::Serialize;

/// Shortest plausible length, mm. Published ones are 20 to 66 mm, so that a length in centimetres is below it.
pub const SHORTEST_MM: f64 = 10.0;
/// Longest plausible length, mm; a length in micrometres or with a wrong decimal mark is above it.
pub const LONGEST_MM: f64 = 200.0;
/// Largest half width of a length, mm: with more, the length has no information.
pub(super) const LARGEST_HALF_WIDTH_MM: f64 = 100.0;

/// Cells, beside the empty one, that say that nothing was measured; in any case.
const MISSING: [&str; 10] = ["na", "n/a", "#n/a", "nan", "null", "-", "–", "—", "*", "."];

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TableUnit {
    Mm,
    Cm,
    M,
}

impl TableUnit {
    /// In the order in which the end of a name is compared with them: `m` is also the end of `mm`.
    pub(super) const ALL: [TableUnit; 3] = [TableUnit::Mm, TableUnit::Cm, TableUnit::M];

    /// Symbol, name, power of ten in millimetres, and the length 57.8 mm as an example.
    pub(super) const fn facts(self) -> (&'static str, &'static str, i32, &'static str) {
        match self {
            TableUnit::Mm => ("mm", "millimetres", 0, "57.8"),
            TableUnit::Cm => ("cm", "centimetres", 1, "5.78"),
            TableUnit::M => ("m", "metres", 3, "0.0578"),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DecimalMark {
    Point,
    Comma,
}

impl DecimalMark {
    pub(in crate::measured) fn written(self, text: &str) -> String {
        if self == DecimalMark::Comma { text.replacen('.', ",", 1) } else { text.to_owned() }
    }
}

pub(in crate::measured) fn is_missing(cell: &str) -> bool {
    cell.is_empty() || MISSING.contains(&cell.to_lowercase().as_str())
}

/// The decimal mark of a number that has one; `None` for integers and for text.
pub(in crate::measured) fn mark_of(cell: &str) -> Option<DecimalMark> {
    let first = cell.chars().find(|c| [',', '.'].contains(c))?;
    let mark = if first == ',' { DecimalMark::Comma } else { DecimalMark::Point };
    with_point(cell, mark)?.parse::<f64>().ok().map(|_| mark)
}

pub(in crate::measured) fn with_point(cell: &str, mark: DecimalMark) -> Option<String> {
    match mark {
        DecimalMark::Point => Some(cell.to_owned()),
        DecimalMark::Comma if cell.contains('.') => None,
        DecimalMark::Comma => Some(cell.replacen(',', ".", 1)),
    }
}
