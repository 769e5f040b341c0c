//! Rows as Markdown tables, whose columns are their fields, and as curves.

use serde::Serialize;
use serde_json::{Error, Value};

use tongue_core::statistics::grouped;
use tongue_files::report::PrecisionCurve;
use tongue_files::report::column::{self, Column};

/// `without` names fields that are left out; unknown values are a dash.
pub fn markdown<'a, T: Serialize + 'a>(
    rows: impl IntoIterator<Item = &'a T>,
    without: &[&str],
) -> Result<String, Error> {
    let rows = rows.into_iter().map(serde_json::to_value).collect::<Result<Vec<Value>, _>>()?;
    let fields = rows.first().and_then(Value::as_object).into_iter().flat_map(|row| row.keys());
    let columns = Vec::from_iter(fields.filter(|field| !without.contains(&field.as_str())).map(|field| {
        let (own, field) = (field.clone(), field.clone());
        Column::of_page(heading(&own), move |row: &Value| row[&own].clone())
            .with_text(move |row| cell(&field, &row[&field]))
    }));
    Ok(column::markdown(&columns, &rows) + "\n")
}

/// A curve for each name, through the points of its rows.
pub fn curves<R>(
    rows: &[R],
    name: fn(&R) -> &'static str,
    point: fn(&R) -> Option<(f64, f64)>,
) -> Vec<PrecisionCurve> {
    let curves = grouped(rows, |row| name(row)).into_iter().map(|own| PrecisionCurve {
        name: name(own[0]).to_owned(),
        points: own.into_iter().filter_map(point).collect(),
    });
    curves.collect()
}

/// The name of a field in words, with its unit unless cells contain it.
fn heading(field: &str) -> String {
    let units = [("_n_per_m", ", N/m"), ("_mm", ", mm"), ("_n", ", N"), ("_bytes", ", MB"), ("_s", "")];
    let (name, unit) = units
        .into_iter()
        .find_map(|(end, unit)| Some((field.strip_suffix(end)?, unit)))
        .unwrap_or((if field == "seconds" { "time" } else { field }, ""));
    name.replace('_', " ") + unit
}

fn cell(column: &str, value: &Value) -> String {
    let is_time = column == "seconds" || column.ends_with("_s");
    match (value, value.as_f64()) {
        (Value::String(text), _) if !text.is_empty() => text.clone(),
        (Value::Null | Value::String(_), _) => "–".to_owned(),
        (_, Some(seconds)) if is_time => duration(seconds),
        (_, Some(bytes)) if column.ends_with("_bytes") => number(1e-6 * bytes),
        // Poisson's ratio keeps all digits, because 0.4998 must not become 0.5.
        (_, Some(v)) if value.is_f64() && column != "poisson_ratio" => number(v),
        _ => value.to_string(),
    }
}

/// Three significant digits, or `1.2e-7` for very small and very large numbers.
pub fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e4).contains(&v.abs()) {
        let digits = (2 - v.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
        format!("{:.*}", if v == 0.0 { 0 } else { digits }, v)
    } else {
        format!("{v:.1e}")
    }
}

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
