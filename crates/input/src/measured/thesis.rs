//! Published results of the thesis (Kato 2014) by muscle, from `targets/kato2014_tables.csv`.

use std::sync::LazyLock;

use serde::Deserialize;

use super::{Target, built_in_rows};

const REFERENCE: &str = include_str!("../../../../targets/kato2014_tables.csv");

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ThesisRow {
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

#[derive(Debug, Clone, PartialEq)]
pub struct Thesis(Vec<ThesisRow>);

impl Thesis {
    pub fn reference() -> &'static Self {
        static BUILT_IN: LazyLock<Thesis> = LazyLock::new(|| Thesis(built_in_rows(REFERENCE)));
        &BUILT_IN
    }

    pub fn rows(&self) -> &[ThesisRow] {
        &self.0
    }

    pub fn row(&self, muscle: &str) -> Option<&ThesisRow> {
        self.0.iter().find(|row| row.muscle.eq_ignore_ascii_case(muscle))
    }

    /// The tensions that the thesis found by hand for /a/ of S2, N per metre of thickness (section 4.4.1). They are one of many answers,
    /// because two ratios do not determine three tensions.
    pub fn tensions_a(&self) -> Vec<(&str, f64)> {
        self.0.iter().filter_map(|row| Some((row.muscle.as_str(), row.tension_a_n_per_m?))).collect()
    }

    /// Whether the thesis simulated this target: /a/ of S2 against /ɯ/.
    pub fn simulated(&self, target: &Target) -> bool {
        (target.subject.as_str(), target.vowel.label(), target.baseline.label()) == ("S2", "a", "ɯ")
    }

    /// Simulated ratios to GGa of `muscles` (table 4.8); `None` if the table lacks one of them.
    pub fn ratios_a(&self, muscles: &[String]) -> Option<Vec<f64>> {
        muscles.iter().map(|m| Some(self.row(m)?.simulated_ratio_a)).collect()
    }

    /// The simulated ratios as stretches over the rest lengths of table 4.5, for a given stretch of GGa; `None` if the table lacks one of
    /// `muscles`.
    pub fn stretches_a(&self, muscles: &[String], stretch_of_gga: f64) -> Option<Vec<f64>> {
        let gga_mm = stretch_of_gga * self.row("GGa")?.rest_length_mm;
        muscles
            .iter()
            .map(|m| self.row(m).map(|row| row.simulated_ratio_a * gga_mm / row.rest_length_mm))
            .collect()
    }
}
