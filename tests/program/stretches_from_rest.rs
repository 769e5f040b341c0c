//! Fits of stretches have the numbers of the thesis's model.

use serde_json::Value;

use super::run::json;

fn fit(options: &str) -> Value {
    json(tempfile::tempdir().unwrap().path(), &format!("--target stretch --json {options}"))
}

fn tensions(fit: &Value) -> Vec<f64> {
    let of = |muscle: &Value| fit["tensions_n"][muscle.as_str().unwrap()].as_f64().unwrap();
    fit["active"].as_array().unwrap().iter().map(of).collect()
}

fn near(found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len());
    for (f, w) in found.iter().zip(wanted) {
        assert!((f / w - 1.0).abs() < tolerance, "{found:?} and {wanted:?}");
    }
}

/// Numbers of commit 045c151. `.ci/compare_binaries.py` compares bits; other
/// processors may round the last digits differently.
#[test]
fn stretches_are_fitted_from_rest_with_the_numbers_of_the_first_version() {
    let before: [(&str, &str, &[f64], f64, u64); 3] = [
        (
            "S1",
            "e",
            &[4.1135196925586115, 6.483379784736712, 10.23812697763353, 15.190072246871008],
            0.11427527646655036,
            1410,
        ),
        ("S2", "a", &[7.883220097979518, 37.94019609480982, 33.38161445076521], 0.10870685809607297, 944),
        (
            "S3",
            "o",
            &[
                16.60179888270877,
                22.734151540164376,
                20.80419758084184,
                21.006635661207408,
                32.411866267812826,
            ],
            0.12458260360353555,
            1901,
        ),
    ];
    for (subject, vowel, wanted, passive_rms, evaluations) in before {
        let found = fit(&format!("--vowel {vowel} --subject {subject}"));
        near(&tensions(&found), wanted, 1e-9);
        near(&[found["passive_rms"].as_f64().unwrap()], &[passive_rms], 1e-9);
        assert_eq!(found["evaluations"].as_u64(), Some(evaluations));
    }
}
