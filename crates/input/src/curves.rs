//! Tension curves from a CSV file with a column of times and one for each driven muscle.

use std::io::Read;
use std::path::Path;

use crate::files;
use crate::measured::ReadError;
use crate::measured::lengths::position_of;
use tongue_core::suggest;

use tongue_core::dynamics::{SHORTEST_S, Tensions};

const TIME: &str = "time_s";

#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    pub muscles: Vec<usize>,
    /// The tensions of all muscles, zero for those that are not driven.
    pub tensions: Tensions,
}

impl Curves {
    /// Reads the CSV file at `path`; see [`Curves::from_reader`] for the format.
    pub fn from_path(path: &Path, names: &[String]) -> Result<Self, ReadError> {
        let origin = path.display().to_string();
        let bytes = files::read(path).map_err(|e| unreadable(&origin, &e))?;
        Self::from_reader(bytes.as_slice(), &origin, names)
    }

    /// Reads a comma-separated table whose header names `time_s` and one or more of the muscles `names` of a
    /// body, given in the order of their numbers. Columns are in any order. Times are ascending, s; tensions
    /// finite and not negative, N (2D: per metre of thickness). `origin` is the name of the table in errors.
    pub fn from_reader(reader: impl Read, origin: &str, names: &[String]) -> Result<Self, ReadError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).has_headers(true).from_reader(reader);
        let wrong = |line: u64, column: Option<String>, problem: String| {
            let column = column.map_or_else(String::new, |column| format!(", column {column}"));
            ReadError::Refused(format!("tension curves \"{origin}\", line {line}{column}: {problem}"))
        };
        let broken = |e: csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            let problem = match e.into_kind() {
                csv::ErrorKind::Io(source) => return unreadable(origin, &source),
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("{len} fields, but the header has {expected_len}; give every column a value")
                }
                other => format!("not a UTF-8 table ({other:?}); save it as CSV"),
            };
            wrong(line, None, problem)
        };
        let header = reader.headers().map_err(broken)?.clone();
        let named = |i: usize| Some(format!("{} ({})", i + 1, header.get(i).unwrap_or_default()));
        let mut columns: Vec<Option<usize>> = Vec::new();
        for (i, name) in header.iter().enumerate() {
            let column = if name == TIME { None } else { position_of(names, name) };
            if column.is_none() && name != TIME {
                let known = names.iter().map(String::as_str).chain([TIME]);
                let problem = format!("unknown muscle \"{name}\"; {}", suggest::hint(name, known));
                return Err(wrong(1, named(i), problem));
            }
            if columns.contains(&column) {
                return Err(wrong(1, named(i), "comes twice; keep one".to_owned()));
            }
            columns.push(column);
        }
        let muscles: Vec<usize> = columns.iter().copied().flatten().collect();
        let (mut times, mut values): (Vec<f64>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        let whole = |problem: &str| Err(wrong(1, None, problem.to_owned()));
        if !columns.contains(&None) {
            return whole("no column time_s; name the column of times time_s");
        }
        if muscles.is_empty() {
            return whole("no column of a muscle; add one named GGa, for instance");
        }
        for record in reader.records() {
            let record = record.map_err(broken)?;
            let line = record.position().map_or(1, csv::Position::line);
            let mut row = vec![0.0; names.len()];
            for (i, (text, column)) in record.iter().zip(&columns).enumerate() {
                let what = if column.is_none() { "time" } else { "tension" };
                let number = match text.parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(value),
                    Ok(value) => Err(format!("the {what} is {value}; it must be finite")),
                    Err(_) if text.is_empty() => Err(format!("the {what} is missing; give a number")),
                    Err(_) => Err(format!("\"{text}\" is not a number; give the {what} as one")),
                };
                let checked = number.and_then(|value| match column {
                    None => after(times.last().copied(), value).map(|()| times.push(value)),
                    Some(m) if value < 0.0 => Err(format!(
                        "the tension of {} is {value} N; it must not be negative (muscles pull, they do not push)",
                        names[*m]
                    )),
                    Some(m) => {
                        row[*m] = value;
                        Ok(())
                    }
                });
                checked.map_err(|problem| wrong(line, named(i), problem))?;
            }
            values.push(row);
        }
        if times.is_empty() {
            return whole("no row below the header; give at least one time");
        }
        Ok(Self { muscles, tensions: Tensions::Table { times, values } })
    }
}

fn unreadable(origin: &str, source: &std::io::Error) -> ReadError {
    ReadError::Refused(format!("cannot read the tension curves \"{origin}\": {source}"))
}

/// Checks that a time comes after the previous one by at least the shortest step.
fn after(last: Option<f64>, time: f64) -> Result<(), String> {
    match last {
        None if time > 0.0 && time < SHORTEST_S => {
            Err(format!("the time {time:e} s is too short; take 0 for the start"))
        }
        Some(last) if time < last + SHORTEST_S => Err(format!(
            "the time {time} s does not come after {last} s of the row before by at least {SHORTEST_S:e} s; sort the rows by \
             time, each time once"
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Curves, ReadError> {
        Curves::from_reader(text.as_bytes(), "t.csv", &["GGa", "GGm", "SGm"].map(String::from))
    }

    #[test]
    fn columns_may_come_in_any_order() {
        let curves = read("SGm, time_s, GGa\n1, 0, 2\n3, 0.5, 4\n").unwrap();
        assert_eq!(curves.muscles, [2, 0]);
        let mut out = [0.0; 3];
        curves.tensions.at(0.25, &mut out);
        assert_eq!(out, [3.0, 0.0, 2.0]);
    }

    #[test]
    fn faults_are_named_with_line_and_column() {
        let cases = [
            (
                "time_s,GGa\n0,1\n0.2,1\n0.1,1\n",
                "line 4, column 1 (time_s): the time 0.1 s does not come after 0.2 s",
            ),
            ("time_s,GGa\n0,1\n0,2\n", "line 3, column 1 (time_s): the time 0 s does not come after 0 s"),
            ("time_s,GGa\n0,1\n,1\n", "line 3, column 1 (time_s): the time is missing"),
            ("time_s,GGa\nnan,1\n", "line 2, column 1 (time_s): the time is NaN"),
            ("time_s,GGa\n0,inf\n", "line 2, column 2 (GGa): the tension is inf"),
            ("time_s,GGa\n0,-1\n", "line 2, column 2 (GGa): the tension of GGa is -1 N"),
            ("time_s,GGa\n0,x\n", "line 2, column 2 (GGa): \"x\" is not a number"),
            ("time_s,GGa\n0\n", "line 2: 1 fields, but the header has 2"),
            ("time_s,GGaa\n0,1\n", "line 1, column 2 (GGaa): unknown muscle \"GGaa\"; did you mean \"GGa\"?"),
            ("time_s,GGa,gga\n0,1,1\n", "line 1, column 3 (gga): comes twice"),
            ("GGa\n1\n", "line 1: no column time_s"),
            ("time_s\n1\n", "line 1: no column of a muscle"),
            ("time_s,GGa\n", "line 1: no row below the header"),
        ];
        for (text, expected) in cases {
            let message = read(text).unwrap_err().to_string();
            assert!(message.starts_with(&format!("tension curves \"t.csv\", {expected}")), "{message}");
        }
    }
}
