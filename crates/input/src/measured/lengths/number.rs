//! Lengths in the cells of a table.

use serde::Serialize;

use super::error::{Malformed, Place};
use super::vowel::clip;

/// The shortest plausible length, mm. The published ones are 20 to 66 mm, so a length in centimetres is below
/// it.
pub const SHORTEST_MM: f64 = 10.0;
/// The longest plausible length, mm; a length in micrometres or with a wrong decimal point is above it.
pub const LONGEST_MM: f64 = 200.0;
/// Numbers from here on are taken for centimetres, numbers below for metres.
const SHORTEST_CM: f64 = 0.2;
/// The largest half width of a length, mm: with more, a length has no information.
pub(super) const LARGEST_HALF_WIDTH_MM: f64 = 100.0;

/// Marks of a length that was not measured, in any case, beside the empty cell.
const MISSING: [&str; 10] = ["na", "n/a", "#n/a", "nan", "null", "-", "–", "—", "*", "."];

/// The unit that a column's name gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TableUnit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
}

impl TableUnit {
    /// All units; the first with which a name ends is its unit.
    pub(super) const ALL: [TableUnit; 3] = [TableUnit::Mm, TableUnit::Cm, TableUnit::M];

    /// Its symbol.
    pub const fn symbol(self) -> &'static str {
        match self {
            TableUnit::Mm => "mm",
            TableUnit::Cm => "cm",
            TableUnit::M => "m",
        }
    }

    /// Its power of ten in millimetres.
    pub(super) const fn power(self) -> i32 {
        match self {
            TableUnit::Mm => 0,
            TableUnit::Cm => 1,
            TableUnit::M => 3,
        }
    }
}

/// Mark between the integer part of a number and its decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DecimalMark {
    /// 57.8
    Point,
    /// 57,8
    Comma,
}

/// Whether the cell says that nothing was measured.
pub(super) fn is_missing(cell: &str) -> bool {
    cell.is_empty() || MISSING.contains(&cell.to_lowercase().as_str())
}

/// The mark with which alone `cell` can be read; `None` for integers and for text.
pub(super) fn mark_of(cell: &str) -> Option<DecimalMark> {
    let mark = match cell.find([',', '.'])? {
        at if cell[at..].starts_with(',') => DecimalMark::Comma,
        _ => DecimalMark::Point,
    };
    in_mm(cell, mark, TableUnit::Mm).map(|_| mark)
}

/// The number in `cell`, in mm, with the same bits as if it had been written in mm.
fn in_mm(cell: &str, mark: DecimalMark, unit: TableUnit) -> Option<f64> {
    let text = with_point(cell, mark)?;
    let number: f64 = text.parse().ok()?;
    match unit.power() {
        0 => Some(number),
        power if number.is_finite() && !text.contains(['e', 'E']) => format!("{text}e{power}").parse().ok(),
        power => Some(number * 10f64.powi(power)),
    }
}

fn with_point(cell: &str, mark: DecimalMark) -> Option<String> {
    match mark {
        DecimalMark::Point => Some(cell.to_owned()),
        DecimalMark::Comma if cell.contains('.') => None,
        DecimalMark::Comma => Some(cell.replacen(',', ".", 1)),
    }
}

/// Number of decimals of a millimetre in `cell`: 0 for 57 mm and for 5.7 cm, 1 for 57.8 mm, -1 for 6 cm.
pub(super) fn decimals_mm(cell: &str, mark: DecimalMark, unit: TableUnit) -> Option<i32> {
    in_mm(cell, mark, unit).filter(|mm| mm.is_finite())?;
    let text = with_point(cell, mark)?.to_ascii_lowercase();
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
    i32::try_from(decimals).ok()?.checked_sub(exponent.parse().ok()?)?.checked_sub(unit.power())
}

/// A column of numbers, for messages about its cells.
#[derive(Clone, Copy)]
pub(super) struct Numbers<'a> {
    /// Name in the header.
    pub column: &'a str,
    pub unit: TableUnit,
    pub mark: DecimalMark,
}

impl Numbers<'_> {
    /// A plausible length, mm; `None` if it was not measured.
    pub fn length(self, cell: &str, at: Place<'_>) -> Result<Option<f64>, Malformed> {
        if is_missing(cell) {
            return Ok(None);
        }
        let mm = in_mm(cell, self.mark, self.unit).ok_or_else(|| self.no_number(cell, at))?;
        self.check_length(cell, mm, at).map(|()| Some(mm))
    }

    /// A half width, mm; `None` if none is given.
    pub fn half_width(self, cell: &str, at: Place<'_>) -> Result<Option<f64>, Malformed> {
        if is_missing(cell) {
            return Ok(None);
        }
        let mm = in_mm(cell, self.mark, self.unit).ok_or_else(|| self.no_number(cell, at))?;
        if (0.0..=LARGEST_HALF_WIDTH_MM).contains(&mm) {
            return Ok(Some(mm));
        }
        let what = format!("{} is {}, which is not a half width of a length", clip(self.column), clip(cell));
        Err(at.error(what, format!("write one from 0 to {LARGEST_HALF_WIDTH_MM} mm, like 0.5")))
    }

    fn no_number(self, cell: &str, at: Place<'_>) -> Malformed {
        let name = clip(self.column);
        let (example, other) = match self.mark {
            DecimalMark::Point => ("a decimal point, like 57.8", DecimalMark::Comma),
            DecimalMark::Comma => ("a decimal comma like the others, as 57,8", DecimalMark::Point),
        };
        if mark_of(cell) == Some(other) {
            let (is, should, to) = match other {
                DecimalMark::Comma => ("comma", "point", cell.replacen(',', ".", 1)),
                DecimalMark::Point => ("point", "comma", cell.replacen('.', ",", 1)),
            };
            return at.error(
                format!("{name} is {:?}, with a decimal {is}", clip(cell)),
                format!("write it with a decimal {should}: {}", clip(&to)),
            );
        }
        let unit = match self.unit {
            TableUnit::Mm => "millimetres",
            TableUnit::Cm => "centimetres",
            TableUnit::M => "metres",
        };
        at.error(
            format!("{name} is {:?}, not a number", clip(cell)),
            format!("write {unit} with {example}, or NA where nothing was measured"),
        )
    }

    fn check_length(self, cell: &str, mm: f64, at: Place<'_>) -> Result<(), Malformed> {
        let name = clip(self.column);
        let (why, help) = if !mm.is_finite() {
            ("not finite", "write a measured length in millimetres, like 57.8")
        } else if mm <= 0.0 {
            ("not positive", "write a measured length in millimetres, like 57.8, or NA where there is none")
        } else if (SHORTEST_MM..=LONGEST_MM).contains(&mm) {
            return Ok(());
        } else if self.unit != TableUnit::Mm {
            let mm = clip(&format!("{mm}"));
            let what = format!(
                "{name} is {}, which is {mm} mm: not a length of a tongue muscle (10 to 200 mm)",
                clip(cell)
            );
            return Err(at.error(what, "check the number, and the unit that the column's name gives"));
        } else if mm < SHORTEST_CM {
            (
                "far too short for millimetres: it looks like metres",
                "multiply the lengths by 1000, or write m in place of mm in the column's name",
            )
        } else if mm < SHORTEST_MM {
            (
                "too short for millimetres (below 10): it looks like centimetres",
                "multiply the lengths by 10, or write cm in place of mm in the column's name",
            )
        } else {
            (
                "too long for a tongue muscle (above 200 mm)",
                "write the length in millimetres, like 57.8; a column that is not of a muscle is ignored if its name has no unit",
            )
        };
        Err(at.error(format!("{name} is {}, {why}", clip(&format!("{mm}"))), help))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_in_other_units_have_the_bits_of_millimetres() {
        for tenths in 100..2000 {
            let mm = f64::from(tenths) / 10.0;
            let cell = |power: i32| format!("{}", mm / 10f64.powi(power));
            // The texts are built from digits, because division by ten rounds.
            let (whole, tenth) = (tenths / 10, tenths % 10);
            let cm = format!("{}.{}{tenth}", whole / 10, whole % 10);
            let m = format!("0,{whole:03}{tenth}");
            assert_eq!(in_mm(&cm, DecimalMark::Point, TableUnit::Cm), Some(mm));
            assert_eq!(in_mm(&m, DecimalMark::Comma, TableUnit::M), Some(mm));
            assert_eq!(in_mm(&cell(0), DecimalMark::Point, TableUnit::Mm), Some(mm));
            assert_eq!(decimals_mm(&cm, DecimalMark::Point, TableUnit::Cm), Some(1));
            assert_eq!(decimals_mm(&m, DecimalMark::Comma, TableUnit::M), Some(1));
        }
    }

    #[test]
    fn marks_and_decimals_are_seen() {
        assert_eq!(mark_of("57,8"), Some(DecimalMark::Comma));
        assert_eq!(mark_of("57.8"), Some(DecimalMark::Point));
        for none in ["57", "", "a,b", "5,7,8", "1.234,5", "1,234.5"] {
            assert_eq!(mark_of(none), None, "{none}");
        }
        for (cell, unit, decimals) in [
            ("57", TableUnit::Mm, 0),
            ("57.0", TableUnit::Mm, 1),
            ("5.7", TableUnit::Cm, 0),
            ("6", TableUnit::Cm, -1),
        ] {
            assert_eq!(decimals_mm(cell, DecimalMark::Point, unit), Some(decimals));
        }
        assert_eq!(decimals_mm("5.78e1", DecimalMark::Point, TableUnit::Mm), Some(1));
    }
}
