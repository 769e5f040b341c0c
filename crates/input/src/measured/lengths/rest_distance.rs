//! How much a body at rest differs from measured rows.

use serde::Serialize;

use tongue_core::statistics::least_by;

use super::{Dataset, Lengths, Vowel, position_of};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RestDistance {
    /// Root mean square difference of the ratios to the reference muscle.
    pub rms_ratio: f64,
    pub largest_relative: f64,
    /// Number of ratios that were compared.
    #[serde(skip)]
    pub ratios: u32,
}

/// What [`RestDistance::rms_ratio`] is, for this number of `ratios` to the muscle `reference`.
pub fn measure(ratios: usize, reference: &str) -> String {
    let count = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    let count = count.get(ratios).map_or_else(|| ratios.to_string(), |word| (*word).to_owned());
    format!(
        "root mean square difference of the {count} ratios to {reference}, model at rest less measured row"
    )
}

/// The difference between a row and a body whose `muscles` have the lengths `rest` (any unit), by their ratios to the muscle `reference`.
/// Muscles that were not measured or that the body lacks are left out; `None` if no ratio is left.
pub fn distance(muscles: &[String], rest: &[f64], row: &Lengths, reference: &str) -> Option<RestDistance> {
    let unit = position_of(muscles, reference)?;
    let (rest_unit, row_unit) = (*rest.get(unit)?, row.length_mm_of(reference)?);
    let (mut squares, mut count, mut largest) = (0.0, 0, 0.0_f64);
    for (i, (name, length)) in muscles.iter().zip(rest).enumerate() {
        let Some(measured) = row.length_mm_of(name).filter(|_| i != unit) else { continue };
        let (model, measured) = (length / rest_unit, measured / row_unit);
        squares += (model - measured).powi(2);
        count += 1;
        largest = largest.max((model / measured - 1.0).abs());
    }
    let rms_ratio = (squares / f64::from(count)).sqrt();
    (count > 0).then_some(RestDistance { rms_ratio, largest_relative: largest, ratios: count })
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NearestRow {
    pub subject: String,
    pub vowel: Vowel,
    pub distance: RestDistance,
}

/// The row with the smallest [`RestDistance::rms_ratio`], the first of equals, of those with the most ratios; `None` if no row can be
/// compared.
pub fn nearest(muscles: &[String], rest: &[f64], data: &Dataset, reference: &str) -> Option<NearestRow> {
    let rows = data.rows.iter().map(|row| &row.lengths);
    let rows: Vec<_> = rows.filter_map(|row| Some((distance(muscles, rest, row, reference)?, row))).collect();
    let most = rows.iter().map(|(distance, _)| distance.ratios).max()?;
    let (distance, row) =
        least_by(rows.into_iter().filter(|(distance, _)| distance.ratios == most), |(d, _)| d.rms_ratio)?;
    Some(NearestRow { subject: row.subject.clone(), vowel: row.vowel.clone(), distance })
}
