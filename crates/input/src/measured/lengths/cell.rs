//! Cells with lengths and their half widths.

use super::number::{LARGEST_HALF_WIDTH_MM, LONGEST_MM, SHORTEST_MM, TableUnit, is_missing, with_point};
use super::text::clip;
use crate::measured::error::Malformed;
use crate::measured::table::{TableLine, TableLines};

/// Of lengths that are too short for millimetres, those from here on seem to be centimetres, smaller ones metres.
const SHORTEST_CM: f64 = 0.2;

#[derive(Clone, Copy)]
pub(super) struct LengthCell<'a> {
    pub table: &'a TableLines<'a>,
    pub line: &'a TableLine<'a>,
    pub field: usize,
    pub unit: TableUnit,
}

impl<'a> LengthCell<'a> {
    fn text(self) -> &'a str {
        self.line.cell(self.field)
    }

    /// Number of decimals of a length in millimetres: 0 for 57 mm and 5.7 cm, 1 for 57.8 mm, -1 for 6 cm.
    pub fn decimals_of_mm(self) -> Option<i32> {
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

    pub fn length(self) -> Result<Option<f64>, Malformed> {
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

    pub fn half_width(self) -> Result<Option<f64>, Malformed> {
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
