//! `tongue-fit sound`: its numbers, files and refusals, and its voice as Praat analyses it.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::run::{json, run};

fn sound_record(folder: &Path, options: &str) -> Value {
    json(folder, &format!("sound {options} --json"))
}

fn formants(record: &Value) -> Vec<f64> {
    serde_json::from_value(record["formants_hz"].clone()).unwrap()
}

#[test]
fn a_vowel_has_formants_areas_a_picture_and_a_voice() {
    let folder = tempfile::tempdir().unwrap();
    let record = sound_record(folder.path(), "--vowel a --out out");
    let f = formants(&record);
    assert!(f.windows(2).all(|w| w[0] < w[1]) && f.len() >= 4, "{f:?}");
    assert!(record["by_tension"].as_array().unwrap().iter().any(|b| b["muscle"] == "HGa"), "{record}");
    let out = folder.path().join("out");
    let wav = std::fs::read(out.join("a.wav")).unwrap();
    let size = u32::from_le_bytes(wav[4..8].try_into().unwrap());
    assert!(wav.starts_with(b"RIFF") && wav.len() as u32 == 8 + size);
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    roxmltree::Document::parse(&text("a.svg")).unwrap();
    assert!(text("a.csv").starts_with("from_glottis_mm,length_mm,area_cm2,"));
    assert_eq!(serde_json::from_str::<Value>(&text("a.json")).unwrap()["formants_hz"], record["formants_hz"]);
    // The voice contains the command line too.
    assert!(String::from_utf8_lossy(&wav).contains("command: tongue-fit sound --vowel a"));
}

/// `walls_are_traced` in tests/library and `drawn_tract` in crates/sound show the effects of jaw, lips and larynx.
#[test]
fn half_the_step_of_a_tract_changes_the_first_four_formants_by_less_than_2_percent() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = include_str!("../../targets/tract.toml").replace("step_mm = 4.0", "step_mm = 2.0");
    std::fs::write(folder.path().join("mine.toml"), drawn).unwrap();
    let [plain, finer] = ["", "--tract mine.toml"].map(|more| {
        formants(&sound_record(folder.path(), &format!("--tension GGp=10 --tension GGa=2 {more}")))
    });
    for (a, b) in plain.iter().zip(&finer).take(4) {
        assert!((a / b - 1.0).abs() < 0.02 && a != b, "{plain:?} {finer:?}");
    }
}

#[test]
fn praat_finds_the_computed_formants() {
    let required = std::env::var_os("TONGUE_FIT_REQUIRE_PYTHON").is_some();
    let listens = |python: &OsString| {
        let asked = Command::new(python).args(["-c", "import parselmouth"]).output();
        asked.is_ok_and(|done| done.status.success())
    };
    let Some(python) = std::env::var_os("TONGUE_FIT_PYTHON").filter(listens) else {
        assert!(!required, "TONGUE_FIT_PYTHON must name a Python with praat-parselmouth");
        println!("skipped: TONGUE_FIT_PYTHON names no Python that has praat-parselmouth");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/praat/formants.py");
    // /ɯ/ is the baseline of the other vowels, with the tongue at rest.
    for (vowel, said, file) in [
        ("i", "--vowel i", "i"),
        ("e", "--vowel e", "e"),
        ("a", "--vowel a", "a"),
        ("o", "--vowel o", "o"),
        ("ɯ", "--tension GGp=0", "sound"),
    ] {
        let ours = formants(&sound_record(folder.path(), &format!("{said} --out out")));
        let wav = folder.path().join(format!("out/{file}.wav"));
        let done = Command::new(&python).arg(&script).arg(wav).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let theirs: Vec<f64> = serde_json::from_slice(&done.stdout).unwrap();
        // Linear prediction may find one more, weak peak that is not a resonance of the tract.
        for a in &ours[..4] {
            let found = theirs.iter().any(|b| (a / b - 1.0).abs() < 0.05);
            assert!(found, "/{vowel}/: {ours:.0?}, Praat {theirs:.0?}");
        }
    }
}

#[test]
fn a_vowel_in_upper_case_is_its_row_and_a_strained_tongue_is_not_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let [mut lower, mut upper] = ["a", "A"].map(|v| sound_record(folder.path(), &format!("--vowel {v}")));
    for record in [&mut lower, &mut upper] {
        let keys = record.as_object_mut().unwrap();
        keys.retain(|key, _| key != "wall_s" && key != "command");
    }
    assert_eq!(lower, upper);
    let done = run(folder.path(), "sound --tension GGa=500 --json");
    assert_eq!(done.status, Some(3), "{}", done.err);
    assert!(done.record()["alarms"].to_string().contains("GGa"), "{}", done.err);
}

#[test]
fn tensions_jaw_lips_and_another_tract_change_the_sound() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let pulled = "--tension GGp=10 --tension GGa=2";
    let plain = formants(&sound_record(at, pulled));
    for more in ["--jaw 4", "--lip-opening 4", "--lip-protrusion 5", "--hyoid 0,-6"] {
        let other = formants(&sound_record(at, &format!("{pulled} {more}")));
        assert!(plain.iter().zip(&other).any(|(a, b)| (a - b).abs() > 2.0), "{more:?}: {plain:?} {other:?}");
    }
    let drawn =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("targets/tract.toml")).unwrap();
    // The postures of a tract are found by their vowels in any spelling.
    std::fs::write(at.join("upper.toml"), drawn.replace("\n\"a\" = {", "\n\"/A/\" = {")).unwrap();
    let [own, upper] =
        ["", " --tract upper.toml"].map(|tract| sound_record(at, &format!("--vowel a{tract}")));
    assert_eq!(formants(&own), formants(&upper));
    std::fs::write(at.join("mine.toml"), drawn.replace("step_mm = 4.0", "step_mm = 2.0")).unwrap();
    let finer = formants(&sound_record(at, &format!("{pulled} --tract mine.toml")));
    // Half the step changes the first four formants by less than 2 %, so that the step is small enough.
    for (a, b) in plain.iter().zip(&finer).take(4) {
        assert!((a / b - 1.0).abs() < 0.02 && a != b, "{plain:?} {finer:?}");
    }
}
