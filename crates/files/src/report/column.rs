//! Columns of tables: name, unit, meaning and value of each, from which every format is made.

use std::borrow::Cow;
use std::rc::Rc;

use serde_json::Value;

use super::csv::Table;
use super::export::text;

type CellValue<'a, R, T> = Rc<dyn Fn(&R) -> T + 'a>;

#[derive(Clone)]
pub struct Column<'a, R> {
    /// Its name in CSV and JSON.
    pub name: Cow<'static, str>,
    /// Unit of its values; empty if they have none.
    pub unit: &'static str,
    pub meaning: &'static str,
    value: CellValue<'a, R, Value>,
    /// Its heading on pages and on the terminal; `None` if only CSV has it.
    heading: Option<Cow<'static, str>>,
    /// The text of a row on pages and on the terminal; `None` if that is the value.
    text: Option<CellValue<'a, R, String>>,
    /// Whether numbers are aligned to the left there.
    is_text: bool,
}

impl<'a, R: 'a> Column<'a, R> {
    /// A column whose heading is its name in words.
    pub fn named(name: impl Into<Cow<'static, str>>, value: impl Fn(&R) -> Value + 'a) -> Self {
        let name = name.into();
        let heading = Some(name.replace('_', " ").into());
        Self { name, unit: "", meaning: "", value: Rc::new(value), heading, text: None, is_text: false }
    }

    /// The same with the unit and the meaning of its values.
    pub fn new(
        name: impl Into<Cow<'static, str>>,
        unit: &'static str,
        meaning: &'static str,
        value: impl Fn(&R) -> Value + 'a,
    ) -> Self {
        Self { unit, meaning, ..Self::named(name, value) }
    }

    /// A column that only pages and the terminal have.
    pub fn of_page(heading: impl Into<Cow<'static, str>>, value: impl Fn(&R) -> Value + 'a) -> Self {
        let heading = heading.into();
        Self::named(heading.clone(), value).with_heading(heading)
    }

    pub fn with_heading(self, heading: impl Into<Cow<'static, str>>) -> Self {
        Self { heading: Some(heading.into()), ..self }
    }

    pub fn decimals(self, count: usize) -> Self {
        self.with_number(move |v| format!("{v:.count$}"))
    }

    /// The column with parts of one shown as percentages.
    pub fn per_cent(self, decimals: usize) -> Self {
        self.with_number(move |v| format!("{:.decimals$} %", 100.0 * v))
    }

    pub fn with_number(self, text: impl Fn(f64) -> String + 'a) -> Self {
        let value = self.value.clone();
        self.with_text(move |row| value(row).as_f64().map_or_else(|| "–".to_owned(), &text))
    }

    pub fn with_text(self, text: impl Fn(&R) -> String + 'a) -> Self {
        Self { text: Some(Rc::new(text)), ..self }
    }

    pub fn with_text_on_the_left(self, text: impl Fn(&R) -> String + 'a) -> Self {
        Self { is_text: true, ..self.with_text(text) }
    }

    pub fn in_csv_alone(self) -> Self {
        Self { heading: None, ..self }
    }

    /// The value of a row in CSV; empty if there is none.
    pub fn cell(&self, row: &R) -> String {
        text((self.value)(row))
    }

    /// The value of a row on pages and on the terminal; a dash if there is none.
    pub fn page_text(&self, row: &R) -> String {
        match &self.text {
            Some(text) => text(row),
            None => Some(self.cell(row)).filter(|t| !t.is_empty()).unwrap_or_else(|| "–".to_owned()),
        }
    }

    pub fn number(&self, row: &R) -> Option<f64> {
        (self.value)(row).as_f64()
    }

    /// Whether it is aligned to the right on pages and on the terminal, because all values are numbers.
    pub fn is_to_the_right(&self, rows: &[R]) -> bool {
        !self.is_text
            && !rows.is_empty()
            && rows.iter().all(|row| matches!((self.value)(row), Value::Number(_) | Value::Null))
    }
}

pub(super) type NamedColumn<R> = (&'static str, &'static str, &'static str, fn(&R) -> Value);

pub(super) fn columns<'a, R: 'a, const N: usize>(all: [NamedColumn<R>; N]) -> Vec<Column<'a, R>> {
    all.into_iter().map(|(name, unit, meaning, value)| Column::new(name, unit, meaning, value)).collect()
}

pub fn table<'a, R: 'a>(columns: &[Column<'a, R>], rows: &[R]) -> Table {
    Table {
        columns: columns.iter().map(|c| c.name.clone().into_owned()).collect(),
        rows: rows.iter().map(|row| columns.iter().map(|c| c.cell(row)).collect()).collect(),
    }
}

pub fn objects<'a, R: 'a>(columns: &[Column<'a, R>], rows: &[R]) -> Vec<Value> {
    let objects = rows
        .iter()
        .map(|row| columns.iter().map(|c| (c.name.clone().into_owned(), (c.value)(row))).collect::<Value>());
    objects.collect()
}

/// The headings of the columns that pages and the terminal show, and these columns.
pub fn columns_with_heading<'c, 'a, R: 'a>(
    columns: &'c [Column<'a, R>],
) -> (Vec<&'c str>, Vec<&'c Column<'a, R>>) {
    columns.iter().filter_map(|c| Some((c.heading.as_deref()?, c))).unzip()
}

pub fn markdown<'a, R: 'a>(columns: &[Column<'a, R>], rows: &[R]) -> String {
    let (headings, shown) = columns_with_heading(columns);
    let head =
        headings.iter().map(|h| if h.is_empty() { " ".to_owned() } else { format!(" {h} ") }).collect();
    let rule = |c: &Column<'a, R>| if c.is_to_the_right(rows) { "--:" } else { "---" }.to_owned();
    let rules = line(shown.iter().map(|c| rule(c)).collect());
    let row =
        |row: &R| line(shown.iter().map(|c| format!(" {} ", c.page_text(row).replace('|', "/"))).collect());
    rows.iter().map(row).fold(line(head) + &rules, |text, row| text + &row)
}

fn line(cells: Vec<String>) -> String {
    format!("|{}|\n", cells.join("|"))
}

#[cfg(all(test, feature = "files"))]
pub(crate) fn explanations<'a, R: 'a>(columns: &[Column<'a, R>]) -> String {
    type Explained<'a, R> = Column<'a, Column<'a, R>>;
    let of = [
        Explained::of_page("column", |c| format!("`{}`", c.name).into()),
        Explained::of_page("unit", |c| c.unit.into()).with_text(|c| c.unit.to_owned()),
        Explained::of_page("meaning", |c| c.meaning.into()),
    ];
    markdown(&of, columns)
}
