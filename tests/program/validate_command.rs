//! Muscles that were not fitted are predicted for any table, with the same bits on any number of threads. The README agrees with the
//! committed results.

use std::path::Path;

use serde_json::Value;
use tongue_core::statistics::mean_and_variance;

use super::run::{json, record};

/// Two subjects, one without one of the muscles, and a vowel that is not built in.
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
    assert_eq!(names, ["no_change", "constant", "thesis", "most_probable", "most_probable_passive"]);
    for opponent in found["opponents"].as_array().unwrap() {
        let of = |key: &str| opponent[key].as_f64().unwrap();
        assert!(of("low") <= of("rms") && of("rms") <= of("high") && of("rms") < 0.5, "{opponent}");
    }
    // The errors are those of the listed predictions, each fit with the same weight.
    let predictions = found["predictions"].as_array().unwrap();
    let fits = [("A", "ɔ"), ("A", "i"), ("B", "ɔ")];
    for (number, name) in names.iter().enumerate() {
        let of_fit = |(subject, vowel): &(&str, &str)| {
            let rows = predictions.iter().filter(|p| p["subject"] == *subject && p["vowel"] == *vowel);
            let square = |p: &Value| (p[*name].as_f64().unwrap() - p["measured"].as_f64().unwrap()).powi(2);
            mean_and_variance(rows.map(square)).0
        };
        let rms = (fits.iter().map(of_fit).sum::<f64>() / 3.0).sqrt();
        assert!((rms - found["opponents"][number]["rms"].as_f64().unwrap()).abs() < 1e-12, "{name}");
    }
    // The constant is the mean passive stretch of the other subject.
    let of = |subject: &'static str| predictions.iter().filter(move |p| p["subject"] == subject);
    let mean = mean_and_variance(of("A").map(|p| p["measured"].as_f64().unwrap())).0;
    assert!(of("B").all(|p| (p["constant"].as_f64().unwrap() - mean).abs() < 1e-12));
    for file in ["README.md", "validate.json", "opponents.csv", "predictions.csv", "predicted.svg"] {
        assert!(folder.path().join("1").join(file).metadata().unwrap().len() > 100, "{file}");
    }
}

/// Statements of the README, docs/model.md and the guide agree with the committed results.
#[test]
fn predictions_on_the_pages_are_those_of_the_results() {
    let study = record(Path::new(env!("CARGO_MANIFEST_DIR")), "results/validate/validate.json");
    let joined = |page: &str| page.split_whitespace().collect::<Vec<_>>().join(" ");
    let pages = [include_str!("../../README.md"), include_str!("../../docs/model.md")].map(joined);
    let guide = joined(include_str!("../../docs/guide.md"));
    let opponents = study["opponents"].as_array().unwrap();
    let rms = |name: &str| {
        let opponent = opponents.iter().find(|o| o["name"] == name).unwrap();
        format!("{:.3}", opponent["rms"].as_f64().unwrap())
    };
    for (name, words) in [
        ("no_change", "no change"),
        ("constant", "one constant"),
        ("thesis", "the thesis's model"),
        ("most_probable", "the most probable point of the posterior's model"),
    ] {
        let said = format!("{words} {}", rms(name));
        assert!(pages.iter().all(|page| page.contains(&said)), "{said}");
    }
    let passive = format!("and {} if longer muscles do not pull", rms("most_probable_passive"));
    assert!(pages.iter().all(|page| page.contains(&passive)), "{passive}");
    let thesis = study["opponents"][2]["better_than_constant"].as_f64().unwrap();
    assert!(pages[0].contains("a constant is better than the thesis's model in seven of ten bootstraps"));
    assert!((thesis - 0.3).abs() < 0.05, "{thesis}");
    let of = |scores: &Value, name: &str, what: &str| {
        scores.as_array().unwrap().iter().find(|s| s["name"] == name).unwrap()[what].as_f64().unwrap()
    };
    let (own, others) = (&study["posterior"]["scores"], &study["posterior"]["other_baselines"]);
    let [i, e] = ["i", "e"].map(|vowel| {
        let scores = &others.as_array().unwrap().iter().find(|o| o["baseline"] == vowel).unwrap()["scores"];
        ["gaussian", "posterior"].map(|name| of(scores, name, "rms"))
    });
    let rows = format!("(RMS {:.3} and {:.3}; the model {:.3} and {:.3})", i[0], e[0], i[1], e[1]);
    let [joint, normal] = ["posterior_joint", "gaussian"].map(|name| of(own, name, "rms"));
    let together = format!("better: {joint:.3} against /ɯ/, where the normal distribution has {normal:.3}");
    assert!(pages[0].contains(&rows) && pages[0].contains(&together), "{rows} {together}");
    // The parts that 95 % intervals hold, of rows against /ɯ/ and against other vowels, and of all vowels of a speaker.
    let [[own, other], [joint, joint_other]] = ["posterior", "posterior_joint_tilt"].map(|name| {
        let of_all =
            others.as_array().unwrap().iter().filter(|o| o["subjects"].as_array().unwrap().len() > 1);
        let all = of_all.map(|o| 100.0 * of(&o["scores"], name, "coverage_95"));
        let (low, high) = all.fold((100.0, 0.0), |(low, high): (f64, f64), p| (low.min(p), high.max(p)));
        [format!("{:.0} %", 100.0 * of(own, name, "coverage_95")), format!("{low:.0} to {high:.0} %")]
    });
    let held = format!(
        "they contain {own} from the same row with /ɯ/ as baseline and {other} with another vowel (with a hyoid that does not tilt), \
         and {joint} and {joint_other} with `--joint`"
    );
    assert!(guide.contains(&held), "{held}");
}
