//! How far a body at rest is from measured rows.

use serde::Serialize;

use super::{Dataset, Lengths, Vowel, position_of};
use crate::measured::thesis::Thesis;
use tongue_core::statistics::{mean_and_variance, upper_median};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RestDistance {
    /// Root mean square difference of the ratios to the reference muscle.
    pub rms_ratio: f64,
    pub largest_relative: f64,
}

/// Name of the measure for this number of `ratios` to the muscle `reference`.
pub fn measure(ratios: usize, reference: &str) -> String {
    let count = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    let count = count.get(ratios).map_or_else(|| ratios.to_string(), |word| (*word).to_owned());
    format!(
        "root mean square difference of the {count} ratios to {reference}, model at rest less measured row"
    )
}

/// The distance of a body whose `muscles` have the lengths `rest` (any unit) from a row, by their ratios to
/// the muscle `reference`. Muscles that were not measured or that the body lacks are left out; `None` if no
/// ratio is left.
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
    (count > 0)
        .then(|| RestDistance { rms_ratio: (squares / f64::from(count)).sqrt(), largest_relative: largest })
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NearestRow {
    pub subject: String,
    pub vowel: Vowel,
    pub distance: RestDistance,
}

/// The nearest of all rows, the first of equals; `None` if [`distance`] is `None` for all.
pub fn nearest(muscles: &[String], rest: &[f64], data: &Dataset, reference: &str) -> Option<NearestRow> {
    let rows = data.rows().iter().map(|row| &row.lengths);
    let (distance, row) = rows
        .filter_map(|row| Some((distance(muscles, rest, row, reference)?, row)))
        .min_by(|a, b| a.0.rms_ratio.total_cmp(&b.0.rms_ratio))?;
    Some(NearestRow { subject: row.subject.clone(), vowel: row.vowel.clone(), distance })
}

/// The doubt about a table whose numbers are no lengths, or whose names of muscles are shifted against its columns. Numbers that are nearly
/// the same in all muscles, where the lengths of a tongue spread by 0.31, are parts of a length. Names are shifted where the proportions of
/// the lengths (their medians) to those of the tongue at rest are much more alike with the names of other columns: they spread by 0.10 to
/// 0.27 in published rows, and by 0.28 to 0.65 where names are shifted.
pub fn doubt_of_proportions(data: &Dataset) -> Option<String> {
    const ALIKE: f64 = 0.1;
    const SPREAD: f64 = 0.27;
    const PART: f64 = 0.6;
    const FEWEST: usize = 5;
    let thesis = Thesis::reference().ok()?;
    let columns = Vec::from_iter(data.muscles().iter().enumerate().filter_map(|(n, name)| {
        let lengths = data.rows().iter().filter_map(|row| *row.lengths.length_mm.get(n)?);
        Some((name, upper_median(lengths)?.ln(), thesis.row(name)?.rest_length_mm.ln()))
    }));
    let count = columns.len();
    if count >= FEWEST && mean_and_variance(columns.iter().map(|c| c.1)).1.sqrt() < ALIKE {
        return Some(
            "all muscles have nearly the same length, where the longest of a tongue is more than twice the shortest: give lengths in millimetres, not \
             percentages or other parts of a length"
                .to_owned(),
        );
    }
    let spread = |by: usize| {
        let shifted = columns.iter().cycle().skip(by);
        mean_and_variance(columns.iter().zip(shifted).map(|(a, b)| a.1 - b.2)).1.sqrt()
    };
    let best = (1..count).min_by(|a, b| spread(*a).total_cmp(&spread(*b)))?;
    let is_doubtful = count >= FEWEST && spread(0) > SPREAD && spread(best) < PART * spread(0);
    is_doubtful.then(|| {
        format!(
            "the lengths have the proportions of a tongue if the names of its muscles are shifted by {}: {} seems to have the lengths of {}, and so \
             on; check the header",
            if best == 1 || best == count - 1 { "one column".to_owned() } else { format!("{} columns", best.min(count - best)) },
            columns[0].0, columns[best].0
        )
    })
}
