//! Numbers in the cells of a table.

use serde::Serialize;

use super::text::clip;

/// Shortest plausible length, mm. Published ones are 20 to 66 mm, so that a length in centimetres is below it.
pub const SHORTEST_MM: f64 = 10.0;
/// Longest plausible length, mm; a length in micrometres or with a wrong decimal mark is above it.
pub const LONGEST_MM: f64 = 200.0;
/// Of lengths that are too short for millimetres, those from here on seem to be centimetres, smaller ones metres.
const SHORTEST_CM: f64 = 0.2;
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
    fn written(self, text: &str) -> String {
        if self == DecimalMark::Comma { text.replacen('.', ",", 1) } else { text.to_owned() }
    }
}

pub(in crate::measured) type CellFault = (String, String);

pub(in crate::measured) fn is_missing(cell: &str) -> bool {
    cell.is_empty() || MISSING.contains(&cell.to_lowercase().as_str())
}

/// The decimal mark of a number that has one; `None` for integers and for text.
pub(in crate::measured) fn mark_of(cell: &str) -> Option<DecimalMark> {
    let mark = match cell.find([',', '.'])? {
        at if cell[at..].starts_with(',') => DecimalMark::Comma,
        _ => DecimalMark::Point,
    };
    with_point(cell, mark)?.parse::<f64>().ok().map(|_| mark)
}

/// The number in `cell`; `column` is the name of its column, and `like` says what else to write.
pub(in crate::measured) fn number(
    column: &str,
    cell: &str,
    mark: DecimalMark,
    like: &str,
) -> Result<f64, CellFault> {
    let name = clip(column);
    if let Some(number) = with_point(cell, mark).and_then(|text| text.parse().ok()) {
        return Ok(number);
    }
    let (other, is, should) = match mark {
        DecimalMark::Point => (DecimalMark::Comma, "comma", "point"),
        DecimalMark::Comma => (DecimalMark::Point, "point", "comma"),
    };
    if mark_of(cell) == Some(other) {
        let to = mark.written(&cell.replacen(',', ".", 1));
        return Err((
            format!("{name} is {:?}, with a decimal {is}", clip(cell)),
            format!("write it with a decimal {should}, as the others: {}", clip(&to)),
        ));
    }
    Err((
        format!("{name} is {:?}, not a number", clip(cell)),
        format!("write {like} with a decimal {should}, or NA where nothing was measured"),
    ))
}

fn with_point(cell: &str, mark: DecimalMark) -> Option<String> {
    match mark {
        DecimalMark::Point => Some(cell.to_owned()),
        DecimalMark::Comma if cell.contains('.') => None,
        DecimalMark::Comma => Some(cell.replacen(',', ".", 1)),
    }
}

#[derive(Clone, Copy)]
pub(super) struct LengthNumbers<'a> {
    pub column: &'a str,
    pub unit: TableUnit,
    pub mark: DecimalMark,
}

impl LengthNumbers<'_> {
    /// Number of decimals of a length in millimetres: 0 for 57 mm and 5.7 cm, 1 for 57.8 mm, -1 for 6 cm.
    pub fn decimals_of_mm(self, cell: &str) -> Option<i32> {
        let text = with_point(cell, self.mark)?.to_ascii_lowercase();
        text.parse().ok().filter(|number: &f64| number.is_finite())?;
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
        i32::try_from(decimals).ok()?.checked_sub(exponent.parse().ok()?)?.checked_sub(self.unit.facts().2)
    }

    /// The length in mm, with the same bits as if it had been written in mm; `None` if it was not measured.
    fn in_mm(self, cell: &str) -> Result<Option<f64>, CellFault> {
        if is_missing(cell) {
            return Ok(None);
        }
        let (_, unit, power, example) = self.unit.facts();
        let like = format!("{unit} like {}", self.mark.written(example));
        let number = number(self.column, cell, self.mark, &like)?;
        let text = with_point(cell, self.mark).unwrap_or_default();
        let shifted = (power > 0 && number.is_finite() && !text.contains(['e', 'E']))
            .then(|| format!("{text}e{power}").parse().ok())
            .flatten();
        Ok(Some(shifted.unwrap_or(number * 10f64.powi(power))))
    }

    pub fn length(self, cell: &str) -> Result<Option<f64>, CellFault> {
        let Some(mm) = self.in_mm(cell)? else { return Ok(None) };
        let (_, unit, _, example) = self.unit.facts();
        let like = format!("write a measured length in {unit}, like {}", self.mark.written(example));
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
        Err((format!("{} is {}, {why}", clip(self.column), clip(cell)), help))
    }

    pub fn half_width(self, cell: &str) -> Result<Option<f64>, CellFault> {
        let Some(mm) = self.in_mm(cell)? else { return Ok(None) };
        if (0.0..=LARGEST_HALF_WIDTH_MM).contains(&mm) {
            return Ok(Some(mm));
        }
        let what = format!("{} is {}, which is not a half width of a length", clip(self.column), clip(cell));
        Err((what, format!("write one from 0 to {LARGEST_HALF_WIDTH_MM} mm, like 0.5")))
    }
}
