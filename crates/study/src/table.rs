//! Markdown tables of serialisable rows: their fields are the columns, as in CSV.

use csv::StringRecord;
use serde::Serialize;
use serde_json::Value;

use tongue_files::report::column::{self, Column};

/// Markdown with a column for each field except those in `without`; unknown values are a dash.
pub fn markdown<'a, T: Serialize + 'a>(
    rows: impl IntoIterator<Item = &'a T>,
    without: &[&str],
) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.serialize(row))?;
    let bytes = writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    let mut reader = csv::Reader::from_reader(bytes.as_slice());
    let fields = reader.headers()?.clone();
    let records = reader.into_records().collect::<Result<Vec<_>, _>>()?;
    let column = |(i, field): (usize, &str)| {
        let (heading, name) = (heading(field), field.to_owned());
        let value = move |r: &StringRecord| if r[i].is_empty() { Value::Null } else { value(&r[i]) };
        Column::of_page(heading, value).shown(move |r| cell(&name, &r[i]))
    };
    let shown = fields.iter().enumerate().filter(|(_, field)| !without.contains(field));
    Ok(column::markdown(&shown.map(column).collect::<Vec<_>>(), &records) + "\n")
}

/// A number, or else the text.
fn value(text: &str) -> Value {
    text.parse::<f64>().map_or_else(|_| text.into(), Value::from)
}

/// The name of a field in words, with its unit unless the cells contain one.
fn heading(field: &str) -> String {
    let units = [("_n_per_m", ", N/m"), ("_mm", ", mm"), ("_n", ", N"), ("_bytes", ", MB"), ("_s", "")];
    let (name, unit) = units
        .into_iter()
        .find_map(|(end, unit)| Some((field.strip_suffix(end)?, unit)))
        .unwrap_or((if field == "seconds" { "time" } else { field }, ""));
    name.replace('_', " ") + unit
}

fn cell(column: &str, text: &str) -> String {
    let is_time = column == "seconds" || column.ends_with("_s");
    match text.parse::<f64>() {
        _ if text.is_empty() => "–".to_owned(),
        // Poisson's ratio keeps all digits: 0.4998 must not become 0.5.
        _ if column == "poisson_ratio" => text.to_owned(),
        Ok(seconds) if is_time => duration(seconds),
        Ok(bytes) if column.ends_with("_bytes") => number(1e-6 * bytes),
        Ok(v) if text.contains(['.', 'e']) => number(v),
        _ => text.to_owned(),
    }
}

/// `1.2e-7`, or without exponent if that is short.
pub fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e4).contains(&v.abs()) {
        let digits = (2 - v.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
        format!("{:.*}", if v == 0.0 { 0 } else { digits }, v)
    } else {
        format!("{v:.1e}")
    }
}

/// A duration in words: seconds, minutes or hours.
pub fn duration(seconds: f64) -> String {
    match seconds {
        0.0 => "0 s".to_owned(),
        s if s < 1e-5 => format!("{:.1} µs", s * 1e6),
        s if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 0.1 => format!("{:.2} ms", s * 1e3),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Row {
        name: &'static str,
        error_mm: Option<f64>,
        seconds: f64,
        steps: usize,
        hidden: u8,
    }

    #[test]
    fn fields_are_columns_with_their_units_and_numbers_are_short() {
        let row = |name, error_mm| Row { name, error_mm, seconds: 1.5e-4, steps: 12, hidden: 0 };
        let rows = [row("a|b", Some(1.25e-8)), row("c", None)];
        assert_eq!(
            markdown(&rows, &["hidden"]).unwrap(),
            "| name | error, mm | time | steps |\n|---|--:|--:|--:|\n\
             | a/b | 1.2e-8 | 150 µs | 12 |\n| c | – | 150 µs | 12 |\n\n"
        );
    }
}
