//! How far the model at rest is from the rows that were measured.

use serde::Serialize;

use super::{Dataset, Lengths, TargetKind, Vowel};
use crate::muscle::{Muscle, PerMuscle};

/// The measure, in words.
pub const MEASURE: &str =
    "root mean square difference of the seven ratios to GGa, model at rest less measured row";

/// How far the model's ratios at rest are from a measured row's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RestDistance {
    /// Root mean square difference of the seven ratios to GGa.
    pub rms_ratio: f64,
    /// Largest difference of a ratio, relative to the measured one.
    pub largest_relative: f64,
}

/// The distance of `rest` (lengths of the model, any unit) from a row, under [`MEASURE`].
pub fn distance(rest: &PerMuscle<f64>, row: &Lengths) -> RestDistance {
    let ratio = TargetKind::Ratio;
    let (model, measured) = (ratio.values(rest, rest), ratio.values(&row.length_mm, &row.length_mm));
    let others = || Muscle::ALL.into_iter().filter(|m| ratio.constrains(*m)).map(Muscle::index);
    let squares: f64 = others().map(|i| (model[i] - measured[i]).powi(2)).sum();
    let relative = others().map(|i| (model[i] / measured[i] - 1.0).abs());
    RestDistance {
        rms_ratio: (squares / others().count() as f64).sqrt(),
        largest_relative: relative.fold(0.0, f64::max),
    }
}

/// The row that is nearest to the model at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NearestRow {
    /// Its subject.
    pub subject: String,
    /// Its vowel.
    pub vowel: Vowel,
    /// How far it is.
    pub distance: RestDistance,
}

/// The nearest of all rows, the first of equals; `None` only for no rows.
pub fn nearest(rest: &PerMuscle<f64>, data: &Dataset) -> Option<NearestRow> {
    let rows = data.rows().iter().map(|row| (distance(rest, &row.lengths), &row.lengths));
    let (distance, row) = rows.min_by(|a, b| a.0.rms_ratio.total_cmp(&b.0.rms_ratio))?;
    Some(NearestRow { subject: row.subject.clone(), vowel: row.vowel, distance })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::published::Tables;

    #[test]
    fn the_thesis_model_is_nearest_to_u_of_s1_by_this_measure() {
        // physics.md, slip 12: 0.118 against 0.126 for the /ɯ/ of S2, which the thesis names.
        let rest = Tables::reference().unwrap().rest_length_mm;
        let data = Dataset::reference().unwrap();
        let found = nearest(&rest, &data).unwrap();
        assert_eq!((found.subject.as_str(), found.vowel), ("S1", Vowel::U));
        assert!((found.distance.rms_ratio - 0.118).abs() < 5e-4);
        assert!((found.distance.largest_relative - 0.19).abs() < 5e-3);
        let s2 = distance(&rest, data.baseline("S2").unwrap());
        assert!((s2.rms_ratio - 0.126).abs() < 5e-4 && (s2.largest_relative - 0.23).abs() < 5e-3);
    }
}
