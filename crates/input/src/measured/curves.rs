//! Tension curves: a table with a column of times and one for each driven muscle, in the formats of tables of lengths.

use std::path::Path;

use super::error::{Malformed, ReadError};
use super::lengths::number::is_missing;
use super::lengths::position_of;
use super::table::TableLines;
use crate::files;
use tongue_core::choice;
use tongue_core::dynamics::{SHORTEST_S, Tensions};

const TIME: &str = "time_s";

#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    pub muscles: Vec<usize>,
    /// Tensions of all muscles of the body; zero for those that are not driven.
    pub tensions: Tensions,
}

impl Curves {
    /// Reads a file; [`Curves::read`] has the format.
    pub fn from_path(path: &Path, names: &[String]) -> Result<Self, ReadError> {
        let origin = path.display().to_string();
        let bytes = files::read(path).map_err(|error| ReadError::unreadable(&origin, &error))?;
        Ok(Self::read(&bytes, &origin, names)?)
    }

    /// Reads a table with a column `time_s` and columns of one or more of the muscles `names` of a body (in the body's order), in any
    /// order. Times ascend, s; tensions are finite and not negative, N (in the plane per metre of thickness). `origin` names the table in
    /// errors.
    pub fn read(bytes: &[u8], origin: &str, names: &[String]) -> Result<Self, Malformed> {
        // `None` for an unknown name, `Some(None)` for the time, otherwise the number of the muscle.
        let known = |name: &str| match name {
            TIME => Some(None),
            name => position_of(names, name).map(Some),
        };
        let wanted = "time_s,GGa,SGm, then a line for each time";
        let mut cells = TableLines::read(bytes, origin, wanted, |name| known(name).is_some())?;
        let mut columns: Vec<Option<usize>> = Vec::new();
        for (field, name) in cells.header.cells.iter().enumerate() {
            let Some(column) = known(name) else {
                let hint = choice::hint(name, names.iter().map(String::as_str).chain([TIME]));
                let at = cells.header.place(field);
                return Err(at.error(format!("unknown muscle \"{name}\""), hint));
            };
            if let Some(first) = columns.iter().position(|c| *c == column) {
                return Err(cells.twice(first, field));
            }
            columns.push(column);
        }
        if !columns.contains(&None) {
            let help = "name the column of times time_s";
            return Err(cells.header.place(0).error("there is no column time_s", help));
        }
        cells.find_decimal_mark(0..columns.len());
        let (mut times, mut values): (Vec<f64>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for line in &cells.rows {
            cells.check_shape(line)?;
            let mut row = vec![0.0; names.len()];
            for (field, column) in columns.iter().enumerate() {
                let (name, text) = (cells.header.cell(field), line.cell(field));
                if is_missing(text) {
                    return Err(line.place(field).error(format!("{name} is missing"), "give a number"));
                }
                let value = cells.number(line, field, "a number")?;
                let fault = match (column, times.last()) {
                    _ if !value.is_finite() => "it must be finite",
                    (Some(_), _) if value < 0.0 => "it must not be negative: muscles pull, they do not push",
                    (None, None) if value > 0.0 && value < SHORTEST_S => {
                        "it is too short; take 0 for the start"
                    }
                    (None, Some(last)) if value < last + SHORTEST_S => {
                        "it does not come after that of the row before by at least 1e-9 s; sort the rows by time, each time once"
                    }
                    (Some(muscle), _) => {
                        row[*muscle] = value;
                        continue;
                    }
                    (None, _) => {
                        times.push(value);
                        continue;
                    }
                };
                return Err(line.place(field).error(format!("{name} is {text}"), fault));
            }
            values.push(row);
        }
        if times.is_empty() {
            return Err(cells.end.error("no row below the header", "give at least one time"));
        }
        let muscles = columns.into_iter().flatten().collect();
        Ok(Self { muscles, tensions: Tensions { times, values } })
    }
}
