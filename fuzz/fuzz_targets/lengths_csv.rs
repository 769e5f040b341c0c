//! Whatever the bytes, reading lengths ends in a dataset or in an error, and a dataset's targets in values that are finite.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, lengths};

fuzz_target!(|bytes: &[u8]| {
    let Ok(data) = Dataset::from_reader(bytes, "fuzz.csv") else { return };
    for row in data.rows() {
        assert!(row.lengths.measured().all(|(_, mm)| (lengths::SHORTEST_MM..=lengths::LONGEST_MM).contains(&mm)));
        assert!(data.row(&row.lengths.subject, &row.lengths.vowel).is_ok());
    }
    for subject in data.subjects() {
        let Ok(vowels) = data.vowels(subject) else { continue };
        for vowel in &vowels {
            for kind in [TargetKind::Ratio, TargetKind::Stretch] {
                if let Ok(target) = Target::new(&data, subject, vowel, kind, &TargetOptions::default()) {
                    assert!(target.values.iter().all(|v| v.is_finite() && *v > 0.0), "{:?}", target.values);
                }
            }
        }
    }
});
