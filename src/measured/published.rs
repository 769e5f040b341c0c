//! What the thesis (Kato 2014) published, to compare with.

use csv::Reader;
use serde::Deserialize;

use super::Error;
use super::record::{Place, unexpected};
use crate::muscle::{COUNT, Muscle, PerMuscle};

const TABLES: &str = include_str!("../../targets/kato2014_tables.csv");
const ORIGIN: &str = "targets/kato2014_tables.csv (built in)";

/// The tensions that the thesis found by hand for /a/ of S2, N per metre of thickness (section 4.4.1).
///
/// One point of a valley of equally good answers: two ratios do not determine three tensions.
pub const TENSIONS_A_N: [(Muscle, f64); 3] = [(Muscle::GGa, 12.0), (Muscle::SGm, 11.5), (Muscle::HGa, 4.5)];

/// The thesis's tables of muscle lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tables {
    /// Table 4.5: lengths of the model's muscles at rest, mm, printed to 0.1 mm.
    pub rest_length_mm: PerMuscle<f64>,
    /// Table 4.7: measured length over that of GGa, /a/ of S2, printed to 0.01.
    pub measured_ratio_a: PerMuscle<f64>,
    /// Table 4.8: simulated length over that of GGa at [`TENSIONS_A_N`], printed to 0.01.
    pub simulated_ratio_a: PerMuscle<f64>,
}

#[derive(Deserialize)]
struct Record {
    muscle: Muscle,
    table4_5_rest_length_mm: f64,
    table4_7_measured_ratio_a: f64,
    table4_8_simulated_ratio_a: f64,
}

impl Tables {
    /// The built-in tables.
    ///
    /// # Errors
    /// [`Error::Malformed`] where a row is damaged or a muscle missing; a test holds that the built-in tables
    /// are whole.
    pub fn reference() -> Result<Self, Error> {
        Self::parse(TABLES)
    }

    fn parse(text: &str) -> Result<Self, Error> {
        let mut of_muscle: PerMuscle<Option<Record>> = Default::default();
        for record in Reader::from_reader(text.as_bytes()).deserialize() {
            let record: Record = record.map_err(|e| unexpected(ORIGIN, &e))?;
            let index = record.muscle.index();
            of_muscle[index] = Some(record);
        }
        let mut tables = Self {
            rest_length_mm: [0.0; COUNT],
            measured_ratio_a: [0.0; COUNT],
            simulated_ratio_a: [0.0; COUNT],
        };
        for (muscle, record) in Muscle::ALL.into_iter().zip(of_muscle) {
            let record = record.ok_or_else(|| {
                let end = Place { origin: ORIGIN, line: 1 + text.lines().count() as u64, column: 1 };
                end.error(format!("{muscle} is missing"), "give each of the eight muscles a row")
            })?;
            tables.rest_length_mm[muscle.index()] = record.table4_5_rest_length_mm;
            tables.measured_ratio_a[muscle.index()] = record.table4_7_measured_ratio_a;
            tables.simulated_ratio_a[muscle.index()] = record.table4_8_simulated_ratio_a;
        }
        Ok(tables)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_tables_are_those_of_the_thesis() {
        let tables = Tables::reference().unwrap();
        assert_eq!(tables.rest_length_mm, [42.7, 57.8, 47.9, 56.3, 23.0, 33.2, 31.0, 32.9]);
        assert_eq!(tables.measured_ratio_a, [1.00, 1.51, 1.29, 1.44, 0.56, 1.07, 0.80, 0.85]);
        assert_eq!(tables.simulated_ratio_a, [1.00, 1.52, 1.31, 1.54, 0.56, 0.97, 0.80, 0.91]);
    }

    #[test]
    fn a_missing_muscle_is_named() {
        let without_hga: String =
            TABLES.lines().filter(|l| !l.starts_with("HGa")).map(|l| format!("{l}\n")).collect();
        let message = Tables::parse(&without_hga).unwrap_err().to_string();
        assert!(message.contains(":9:1: HGa is missing"), "{message}");
    }
}
