//! The committed validation is what the command finds.

use std::path::Path;

use serde_json::Value;
use tongue_fit::body::Body;
use tongue_fit::measured::{Dataset, Vowel};
use tongue_fit::study::validate::{self, Plan};
use tongue_fit::system::Model;

#[test]
fn the_committed_numbers_are_found_again_and_the_levers_beat_the_constant() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("results/validate/validate.json")).unwrap();
    let committed: Value = serde_json::from_str(&text).unwrap();
    let plan = Plan { baseline: Vowel::unrounded_u(), permutations: 2, seed: 1, posterior: false };
    let (data, body) = (Dataset::reference().unwrap(), Body::tongue(0.0055).unwrap());
    let study = validate::run(&data, &body, &Model::default(), &plan, &|_, _, _| {}).unwrap();
    let near = |found: f64, committed: &Value| (found - committed.as_f64().unwrap()).abs() < 2e-4;
    for (found, committed) in study.opponents.iter().zip(committed["opponents"].as_array().unwrap()) {
        assert_eq!(found.name, committed["name"].as_str().unwrap());
        assert!(near(found.rms, &committed["rms"]), "{}: {} {}", found.name, found.rms, committed["rms"]);
    }
    for (found, committed) in
        study.leave_one_muscle_out.iter().zip(committed["leave_one_muscle_out"].as_array().unwrap())
    {
        assert!(near(found.rms, &committed["rms"]), "{}: {} {}", found.name, found.rms, committed["rms"]);
    }
    // The first two of the permutations are the same ones.
    let permuted = &study.permuted_labels;
    assert!(near(permuted.true_rms, &committed["permuted_labels"]["true_rms"]));
    for (found, committed) in
        permuted.permuted_rms.iter().zip(committed["permuted_labels"]["permuted_rms"].as_array().unwrap())
    {
        assert!(near(*found, committed) && *found > permuted.true_rms);
    }
    // What the experiments behind the levers found: in a nearly incompressible body one tone and the hyoid stay below 0.065 on
    // subjects that they were not tuned on, and beat the constant in nearly every bootstrap.
    let levers = study.opponent("tone_hyoid_nu_0.499").unwrap();
    assert!(levers.rms <= 0.065 && levers.worse_than_no_change <= 2 && levers.better_than_constant >= 0.95);
    assert!((study.opponent("no_change").unwrap().rms - 0.1141).abs() < 1e-4);
    assert!((study.opponent("constant").unwrap().rms - 0.0832).abs() < 1e-4);
}
