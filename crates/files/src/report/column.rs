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
    /// Its heading on a page, if that is not its name.
    pub(super) heading: Option<Cow<'static, str>>,
    pub(super) form: Form<'a, R>,
}

/// How the values of a column stand on a page.
pub(super) enum Form<'a, R> {
    /// As in CSV.
    Value,
    /// Numbers with this many decimals.
    Decimals(usize),
    /// Parts as percentages with this many decimals.
    PerCent(usize),
    /// The text of a row, aligned as its values are.
    Own(Box<dyn Fn(&R) -> String + 'a>),
    /// The text of a row, aligned to the left.
    Text(Box<dyn Fn(&R) -> String + 'a>),
    /// Only in CSV.
    Absent,
}

impl<'a, R> Column<'a, R> {
    /// A column with this name, unit, meaning and value.
    pub fn new(
        name: impl Into<Cow<'static, str>>,
        unit: &'static str,
        meaning: &'static str,
        value: impl Fn(&R) -> Value + 'a,
    ) -> Self {
        let (name, value) = (name.into(), Box::new(value));
        Self { name, unit, meaning, value, heading: None, form: Form::Value }
    }

    /// The column with this heading on pages; without one it has its name in words.
    pub fn headed(self, heading: impl Into<Cow<'static, str>>) -> Self {
        Self { heading: Some(heading.into()), ..self }
    }

    /// The column with this many decimals on pages.
    pub fn decimals(self, count: usize) -> Self {
        Self { form: Form::Decimals(count), ..self }
    }

    /// The column with its parts as percentages with this many decimals on pages.
    pub fn per_cent(self, decimals: usize) -> Self {
        Self { form: Form::PerCent(decimals), ..self }
    }

    /// The column with the text of each row on pages, aligned as its values are.
    pub fn shown(self, text: impl Fn(&R) -> String + 'a) -> Self {
        Self { form: Form::Own(Box::new(text)), ..self }
    }

    /// The column with the text of each row on pages, aligned to the left.
    pub fn shown_as_text(self, text: impl Fn(&R) -> String + 'a) -> Self {
        Self { form: Form::Text(Box::new(text)), ..self }
    }

    /// The column only in CSV, not on pages.
    pub fn in_csv_alone(self) -> Self {
        Self { form: Form::Absent, ..self }
    }

    /// The column of rows that contain such a row.
    pub fn within<Q>(self, part: fn(&Q) -> &R) -> Column<'a, Q>
    where
        R: 'a,
        Q: 'a,
    {
        let Self { name, unit, meaning, value, heading, form } = self;
        let within = |text: Box<dyn Fn(&R) -> String + 'a>| Box::new(move |row: &Q| text(part(row)));
        let form = match form {
            Form::Value => Form::Value,
            Form::Decimals(count) => Form::Decimals(count),
            Form::PerCent(decimals) => Form::PerCent(decimals),
            Form::Own(text) => Form::Own(within(text)),
            Form::Text(text) => Form::Text(within(text)),
            Form::Absent => Form::Absent,
        };
        let value = Box::new(move |row: &Q| value(part(row)));
        Column { name, unit, meaning, value, heading, form }
    }

    /// The value of a row as a cell of CSV: empty where there is none.
    pub fn cell(&self, row: &R) -> String {
        match (self.value)(row) {
            Value::Null => String::new(),
            Value::String(text) => text,
            other => other.to_string(),
        }
    }

    /// The value of a row as it stands on a page: a dash where there is none.
    fn on_page(&self, row: &R) -> String {
        let number = || (self.value)(row).as_f64();
        let text = match self.form {
            Form::Own(ref text) | Form::Text(ref text) => return text(row).replace('|', "/"),
            Form::Decimals(count) => number().map(|v| format!("{v:.count$}")),
            Form::PerCent(decimals) => number().map(|v| format!("{:.decimals$} %", 100.0 * v)),
            Form::Value | Form::Absent => Some(self.cell(row).replace('|', "/")).filter(|t| !t.is_empty()),
        };
        text.unwrap_or_else(|| "–".to_owned())
    }

    /// Whether it is aligned to the right on a page: all of its values are numbers.
    fn is_to_the_right(&self, rows: &[R]) -> bool {
        let is_number = |row| matches!((self.value)(row), Value::Number(_) | Value::Null);
        !matches!(self.form, Form::Text(_)) && !rows.is_empty() && rows.iter().all(is_number)
    }
}

/// A table of these columns.
pub fn table<R>(columns: &[Column<'_, R>], rows: &[R]) -> Table {
    Table {
        columns: columns.iter().map(|c| c.name.clone().into_owned()).collect(),
        rows: rows.iter().map(|row| columns.iter().map(|c| c.cell(row)).collect()).collect(),
    }
}

/// A table of Markdown of those of the columns that stand on pages.
pub fn markdown<R>(columns: &[Column<'_, R>], rows: &[R]) -> String {
    let shown: Vec<_> = columns.iter().filter(|c| !matches!(c.form, Form::Absent)).collect();
    let heading = |c: &&Column<'_, R>| match &c.heading {
        Some(text) if text.is_empty() => " ".to_owned(),
        Some(text) => format!(" {text} "),
        None => format!(" {} ", c.name.replace('_', " ")),
    };
    let rule = |c: &&Column<'_, R>| if c.is_to_the_right(rows) { "--:" } else { "---" }.to_owned();
    let line = |cells: Vec<String>| format!("|{}|\n", cells.join("|"));
    let row = |row: &R| line(shown.iter().map(|c| format!(" {} ", c.on_page(row))).collect());
    let head = line(shown.iter().map(heading).collect()) + &line(shown.iter().map(rule).collect());
    rows.iter().map(row).fold(head, |text, row| text + &row)
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
    let of: [Column<'_, Column<'_, R>>; 3] = [
        Column::new("column", "", "its name", |c: &Column<'_, R>| format!("`{}`", c.name).into()),
        Column::new("unit", "", "its unit", |c: &Column<'_, R>| c.unit.into()).shown(|c| c.unit.to_owned()),
        Column::new("meaning", "", "what it holds", |c: &Column<'_, R>| c.meaning.into()),
    ];
    markdown(&of, columns)
}
