//! Columns of tables: name, unit, meaning and value of each, from which every format is made.

use std::borrow::Cow;
#[cfg(feature = "files")]
use std::io;

use serde_json::Value;

#[cfg(feature = "files")]
use super::cells;
use super::csv::Table;

/// A column of a table whose rows are `R`.
pub struct Column<'a, R> {
    /// Its name in CSV and JSON.
    pub name: Cow<'static, str>,
    /// Unit of its values; empty where they have none.
    pub unit: &'static str,
    /// What it holds, in a few words.
    pub meaning: &'static str,
    pub(super) value: Box<dyn Fn(&R) -> Value + 'a>,
}

impl<'a, R> Column<'a, R> {
    /// A column with this name, unit, meaning and value.
    pub fn new(
        name: impl Into<Cow<'static, str>>,
        unit: &'static str,
        meaning: &'static str,
        value: impl Fn(&R) -> Value + 'a,
    ) -> Self {
        Self { name: name.into(), unit, meaning, value: Box::new(value) }
    }

    /// The value of a row as a cell of CSV: empty where there is none.
    pub fn cell(&self, row: &R) -> String {
        match (self.value)(row) {
            Value::Null => String::new(),
            Value::String(text) => text,
            other => other.to_string(),
        }
    }
}

/// A table of these columns.
pub fn table<R>(columns: &[Column<'_, R>], rows: &[R]) -> Table {
    Table {
        columns: columns.iter().map(|c| c.name.clone().into_owned()).collect(),
        rows: rows.iter().map(|row| columns.iter().map(|c| c.cell(row)).collect()).collect(),
    }
}

/// Lines of CSV; the header is a line too.
#[cfg(feature = "files")]
pub fn lines(out: &mut dyn io::Write, lines: impl IntoIterator<Item = Vec<String>>) -> io::Result<()> {
    let mut writer = cells::writer(out);
    lines.into_iter().try_for_each(|line| writer.write_record(line))?;
    writer.flush()
}

/// What the columns mean, as a table of Markdown.
#[cfg(all(test, feature = "files"))]
pub fn explained<R>(columns: &[Column<'_, R>]) -> String {
    let line = |c: &Column<'_, R>| format!("| `{}` | {} | {} |\n", c.name, c.unit, c.meaning);
    "| column | unit | meaning |\n|---|---|---|\n".to_owned() + &columns.iter().map(line).collect::<String>()
}
