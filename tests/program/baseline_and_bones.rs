//! Premises of the baseline and of movable bones: options, outputs, and the thesis's numbers with
//! `--preset thesis`.

use serde_json::Value;

use super::run::{json, refused, run};

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

/// Numbers of commit 045c151, before there was a tone. `.ci/compare_binaries.py` compares bits; other
/// processors may round the last digits differently.
#[test]
fn the_preset_thesis_gives_the_numbers_from_before_there_was_a_tone() {
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
        let row = format!("--vowel {vowel} --subject {subject}");
        let found = fit(&format!("{row} --preset thesis"));
        near(&tensions(&found), wanted, 1e-9);
        near(&[found["passive_rms"].as_f64().unwrap()], &[passive_rms], 1e-9);
        assert_eq!(found["evaluations"].as_u64(), Some(evaluations));
        assert_eq!((&found["tone_n_per_m"], &found["hyoid_mm"]), (&0.0.into(), &Value::Null));
        let same = fit(&format!("{row} --tone 0 --hyoid fixed"));
        assert_eq!(found["tensions_n"], same["tensions_n"]);
    }
}

#[test]
fn stretches_are_counted_from_a_baseline_with_tone_and_the_hyoid_is_found() {
    let found = fit("--vowel i --subject S3");
    assert_eq!(found["tone_n_per_m"], 8.0);
    let pair = |value: &Value| [0, 1].map(|i| value[i].as_f64().unwrap());
    let hyoid = pair(&found["hyoid_mm"]);
    assert!(hyoid[0] < -3.0, "to the front in /i/: {hyoid:?}");
    for axis in 0..2 {
        let [low, high] = pair(&found["hyoid_interval_mm"][axis]);
        assert!(low < hyoid[axis] && hyoid[axis] < high && high - low < 4.0 * 5.0);
    }
    assert_eq!(found["bones"]["hyoid"]["shift_mm"], found["hyoid_mm"]);
    for (muscle, stretch) in found["stretches"].as_object().unwrap() {
        let of = |what: &str| found[what][muscle].as_f64().unwrap();
        near(&[of("lengths_mm") / of("model_baseline_lengths_mm")], &[stretch.as_f64().unwrap()], 1e-12);
        assert_ne!(found["rest_lengths_mm"][muscle], found["model_baseline_lengths_mm"][muscle]);
    }
    let table = fit("--vowel i --subject S3 --tone table --hyoid fixed");
    assert!(table["tone_n_per_m"]["HGa"].as_f64().unwrap() > 0.0);
    assert_eq!(table["hyoid_mm"], Value::Null);
    let both = fit("--vowel i --subject S3 --hyoid forward --free-bone mental_spine");
    assert_eq!(pair(&both["hyoid_mm"])[1], 0.0);
    assert_eq!(both["bones"]["mental_spine"]["shift_mm"].as_array().unwrap().len(), 2);
}

#[test]
fn tables_and_pictures_say_from_which_posture_changes_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let text = run(folder.path(), "--vowel a --target stretch").out;
    for line in text.lines() {
        assert!(line.chars().count() <= 100, "{} columns: {line}", line.chars().count());
    }
    let posture = "in the baseline with 8 N/m in every muscle";
    assert!(text.contains(&format!("changes are counted from the tongue {posture}\n")), "{text}");
    assert!(text.contains("| in the baseline (tone)") && text.contains("\nhyoid moves "), "{text}");
    let picture = std::fs::read_to_string(folder.path().join("results/tongue.svg")).unwrap();
    assert!(picture.contains(posture) && picture.contains(">baseline<") && !picture.contains(">rest<"));
    // Muscles that keep their tone of 8 N/m are not drawn as contracting.
    assert!(picture.contains("Contracting muscles: GGa, SGm, HGa."), "{picture}");
    assert!(!picture.contains("HGp 8.0"), "{picture}");
}

#[test]
fn a_scene_can_have_a_tone() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "title = \"t\"\nwant = \"lengths\"\n[body.tongue]\n[fit]\nsubject = \"S2\"\nvowel = \"a\"\n\
                 target = \"stretch\"\ntone_n_per_m = 8.0\n[effects]\nincompressibility = true\n";
    std::fs::write(folder.path().join("my.toml"), scene).unwrap();
    let found = json(folder.path(), "scene run my.toml --json");
    let same = fit("--vowel a --tone 8 --hyoid fixed");
    for muscle in found["muscles"].as_array().unwrap() {
        let name = muscle["muscle"].as_str().unwrap();
        let of = |what: &str| same[what][name].as_f64().unwrap();
        assert!((muscle["tension_n"].as_f64().unwrap() - of("tensions_n")).abs() < 1e-3, "{name}");
        assert!((muscle["stretch"].as_f64().unwrap() - of("stretches")).abs() < 1e-5, "{name}");
    }
}

#[test]
fn invalid_premises_are_refused_in_one_message() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tone.csv"), "muscle,tone_n_per_m\nGGa,3\nGGx,1\n").unwrap();
    for (options, told) in [
        ("--tone -1", "the tone is -1 N; it must be from 0"),
        ("--tone soft", "neither a number nor `table`, nor a file"),
        ("--tone tone.csv", "the tone names GGx"),
        ("--tone 1e5", "no equilibrium of the baseline at this tone"),
        ("--free-bone hyoid", "free already"),
    ] {
        let message = refused(folder.path(), &format!("--vowel a --target stretch {options}"));
        assert!(message.contains(told), "{message}");
    }
}
