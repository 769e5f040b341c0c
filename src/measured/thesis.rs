//! What the thesis (Kato 2014) published, by muscle, to compare with. Data, in `targets/kato2014_tables.csv`.

use serde::Deserialize;

const REFERENCE: &str = include_str!("../../targets/kato2014_tables.csv");

/// What the thesis prints of one muscle.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ThesisRow {
    /// The muscle.
    pub muscle: String,
    /// Table 4.5: length of the model's muscle at rest, mm, printed to 0.1 mm.
    #[serde(rename = "table4_5_rest_length_mm")]
    pub rest_length_mm: f64,
    /// Table 4.7: measured length over that of GGa, /a/ of S2, printed to 0.01.
    #[serde(rename = "table4_7_measured_ratio_a")]
    pub measured_ratio_a: f64,
    /// Table 4.8: simulated length over that of GGa at the tensions of section 4.4.1, printed to 0.01.
    #[serde(rename = "table4_8_simulated_ratio_a")]
    pub simulated_ratio_a: f64,
    /// Section 4.4.1: tension found by hand for /a/ of S2, N per metre of thickness; `None` for passive muscles.
    #[serde(rename = "section4_4_1_tension_a_n_per_m")]
    pub tension_a_n_per_m: Option<f64>,
}

/// The thesis's tables, looked up by muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct Thesis(Vec<ThesisRow>);

impl Thesis {
    /// The built-in tables.
    ///
    /// # Errors
    /// A damaged table; a test holds that the built-in one is whole.
    pub fn reference() -> Result<Self, csv::Error> {
        csv::Reader::from_reader(REFERENCE.as_bytes()).deserialize().collect::<Result<_, _>>().map(Self)
    }

    /// All muscles, in the order of the tables.
    pub fn rows(&self) -> &[ThesisRow] {
        &self.0
    }

    /// What it prints of a muscle; case does not count.
    pub fn of(&self, muscle: &str) -> Option<&ThesisRow> {
        self.0.iter().find(|row| row.muscle.eq_ignore_ascii_case(muscle))
    }

    /// The tensions found by hand for /a/ of S2, N per metre of thickness (section 4.4.1): one point of many answers, because
    /// two ratios do not determine three tensions.
    pub fn tensions_a(&self) -> Vec<(&str, f64)> {
        self.0.iter().filter_map(|row| Some((row.muscle.as_str(), row.tension_a_n_per_m?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::published;
    use crate::muscle::Muscle;

    #[test]
    fn the_built_in_tables_are_those_of_the_constants() {
        let (thesis, before) = (Thesis::reference().unwrap(), published::Tables::reference().unwrap());
        assert_eq!(thesis.rows().len(), 8);
        for (row, muscle) in thesis.rows().iter().zip(Muscle::ALL) {
            assert_eq!(row.muscle, muscle.name());
            assert_eq!(row.rest_length_mm, before.rest_length_mm[muscle.index()]);
            assert_eq!(row.measured_ratio_a, before.measured_ratio_a[muscle.index()]);
            assert_eq!(row.simulated_ratio_a, before.simulated_ratio_a[muscle.index()]);
        }
        assert_eq!(thesis.tensions_a(), published::TENSIONS_A_N.map(|(m, t)| (m.name(), t)));
        assert_eq!(thesis.of("sgm").unwrap().rest_length_mm, 23.0);
        assert!(thesis.of("mylohyoid").is_none());
    }
}
