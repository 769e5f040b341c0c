//! Distance of a body at rest from measured rows.

use serde::Serialize;

use super::{Dataset, Lengths, Vowel, position_of};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::thesis::Thesis;

    #[test]
    fn the_thesis_model_is_nearest_to_u_of_s1_by_this_measure() {
        let thesis = Thesis::reference().unwrap();
        let rest: Vec<f64> = thesis.rows().iter().map(|r| r.rest_length_mm).collect();
        let names: Vec<String> = thesis.rows().iter().map(|r| r.muscle.clone()).collect();
        let data = Dataset::reference().unwrap();
        // docs/model.md: 0.118, against 0.126 for the /ɯ/ of S2, which the thesis names.
        let found = nearest(&names, &rest, &data, "GGa").unwrap();
        assert_eq!((found.subject.as_str(), found.vowel), ("S1", Vowel::unrounded_u()));
        assert!((found.distance.rms_ratio - 0.118).abs() < 5e-4);
        assert!((found.distance.largest_relative - 0.19).abs() < 5e-3);
        let s2 = distance(&names, &rest, data.baseline("S2").unwrap(), "GGa").unwrap();
        assert!((s2.rms_ratio - 0.126).abs() < 5e-4 && (s2.largest_relative - 0.23).abs() < 5e-3);
        assert_eq!(
            measure(7, "GGa"),
            "root mean square difference of the seven ratios to GGa, model at rest less measured row"
        );
    }

    #[test]
    fn unmeasured_muscles_are_left_out() {
        let data = Dataset::from_reader(&b"subject,vowel,GGa_mm,B_mm\nX,a,40,20\nX,e,40,NA\n"[..], "my.csv")
            .unwrap();
        let names = ["GGa".to_owned(), "B".to_owned(), "C".to_owned()];
        let of = |n: usize| distance(&names, &[4.0, 3.0, 1.0], &data.rows()[n].lengths, "GGa");
        assert_eq!(of(0), Some(RestDistance { rms_ratio: 0.25, largest_relative: 0.5 }));
        assert_eq!(of(1), None);
        assert_eq!(distance(&names, &[4.0, 3.0, 1.0], &data.rows()[0].lengths, "C"), None);
    }
}
