//! Muscles that were not fitted are predicted for any table, the same on any number of threads, and the
//! README and the committed results agree.

use std::path::Path;

use serde_json::Value;

use super::run::json;

/// Two subjects, one of whom lacks a muscle, with a vowel that is not built in.
const TABLE: &str = "speaker,phoneme,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm\n\
    A,ɯ,46,56,46,56,25,40,36,31\nA,ɔ,38,57,50,54,21,47,33,33\nA,i,50,52,42,57,25,38,37,30\n\
    B,ɯ,44,55,44,58,28,41,40,\nB,ɔ,40,60,50,57,22,44,35,\n";

#[test]
fn any_table_of_two_subjects_is_validated_with_the_same_bits_on_one_and_two_threads() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("own.csv"), TABLE).unwrap();
    let run = |threads: &str| -> Value {
        let line = "validate --lengths own.csv --permutations 1 --json";
        let mut found = json(folder.path(), &format!("{line} --out {threads} --threads {threads}"));
        found.as_object_mut().unwrap().remove("command");
        found
    };
    let found = run("1");
    assert_eq!(found, run("2"));
    let names: Vec<&str> =
        found["opponents"].as_array().unwrap().iter().map(|o| o["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["no_change", "constant", "thesis", "most_probable"]);
    for opponent in found["opponents"].as_array().unwrap() {
        let of = |key: &str| opponent[key].as_f64().unwrap();
        assert!(of("low") <= of("rms") && of("rms") <= of("high") && of("rms") < 0.5, "{opponent}");
        assert!(opponent["tuned_parameters"].is_u64() && opponent["worse_than_no_change"].is_u64());
    }
    // The errors are those of the listed predictions, each fit with the same weight.
    let predictions = found["predictions"].as_array().unwrap();
    let fits = [("A", "ɔ"), ("A", "i"), ("B", "ɔ")];
    for (number, name) in names.iter().enumerate() {
        let of_fit = |(subject, vowel): &(&str, &str)| {
            let rows = predictions.iter().filter(|p| p["subject"] == *subject && p["vowel"] == *vowel);
            let squares: Vec<f64> = rows
                .map(|p| (p[*name].as_f64().unwrap() - p["measured"].as_f64().unwrap()).powi(2))
                .collect();
            squares.iter().sum::<f64>() / squares.len() as f64
        };
        let rms = (fits.iter().map(of_fit).sum::<f64>() / 3.0).sqrt();
        assert!((rms - found["opponents"][number]["rms"].as_f64().unwrap()).abs() < 1e-12, "{name}");
    }
    // The constant is the mean passive stretch of the other subject.
    let of = |subject: &'static str| predictions.iter().filter(move |p| p["subject"] == subject);
    let mean: f64 = of("A").map(|p| p["measured"].as_f64().unwrap()).sum::<f64>() / of("A").count() as f64;
    assert!(of("B").all(|p| (p["constant"].as_f64().unwrap() - mean).abs() < 1e-12));
    for file in ["README.md", "validate.json", "opponents.csv", "predictions.csv", "predicted.svg"] {
        assert!(folder.path().join("1").join(file).metadata().unwrap().len() > 100, "{file}");
    }
}

fn committed(path: &str) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(root.join(path)).unwrap()).unwrap()
}

fn rms(study: &Value, name: &str) -> f64 {
    let opponents = study["opponents"].as_array().unwrap();
    opponents.iter().find(|o| o["name"] == name).unwrap()["rms"].as_f64().unwrap()
}

/// Statements of README and model page agree with the committed results.
#[test]
fn predictions_on_the_pages_are_those_of_the_results() {
    let study = committed("results/validate/validate.json");
    let said = [
        format!("no change {:.3}", rms(&study, "no_change")),
        format!("one constant {:.3}", rms(&study, "constant")),
        format!("the thesis's model {:.3}", rms(&study, "thesis")),
        format!("the most probable point of the posterior's model {:.3}", rms(&study, "most_probable")),
    ];
    for (page, text) in
        [("README", include_str!("../../README.md")), ("model", include_str!("../../docs/model.md"))]
    {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for said in &said {
            assert!(text.contains(said), "{page} does not say \"{said}\"");
        }
    }
}
