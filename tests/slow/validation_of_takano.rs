//! The committed validation is reproduced.

use std::path::Path;

use serde_json::Value;
use tongue_fit::body::Body;
use tongue_fit::inverse::TargetOnBody;
use tongue_fit::measured::{Dataset, TargetKind, Vowel};
use tongue_fit::parallel;
use tongue_fit::system::Model;
use tongue_fit::validate::{self, ValidationPlan};
use tongue_infer::posterior::{
    LeftOut, Measurements, PosteriorModel, PosteriorProblem, Priors, predict_each_from_others,
};

use crate::fixtures::target;

/// The committed output of `tongue-fit validate --posterior`.
fn committed() -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("results/validate/validate.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn the_committed_numbers_are_found_again() {
    let committed = committed();
    // Only what is compared here is computed.
    let plan = ValidationPlan { baseline: Vowel::unrounded_u(), permutations: 0, seed: 1, posterior: false };
    let (data, body) = (Dataset::reference().unwrap(), Body::tongue(0.0055).unwrap());
    let study = validate::run(&data, &body, &Model::default(), &plan, &|_, _, _| {}).unwrap();
    let near = |found: f64, committed: &Value| (found - committed.as_f64().unwrap()).abs() < 2e-4;
    for (found, committed) in study.opponents.iter().zip(committed["opponents"].as_array().unwrap()) {
        assert_eq!(found.name, committed["name"].as_str().unwrap());
        assert!(near(found.rms, &committed["rms"]), "{}: {} {}", found.name, found.rms, committed["rms"]);
    }
    assert!((study.opponents[0].rms - 0.1141).abs() < 1e-4);
    assert!((study.opponents[1].rms - 0.0832).abs() < 1e-4);
}

#[test]
fn the_posterior_tells_every_muscle_from_the_others_as_well_as_was_committed() {
    let body = Body::tongue(0.0055).unwrap();
    // Rows are validated by themselves without a tilt of the hyoid.
    let priors = Priors::from_toml("hyoid_tilt.off = true", "test").unwrap();
    let posterior_model = PosteriorModel::new(&body, &Model::default(), &priors).unwrap();
    let rows: Vec<_> =
        ["S1", "S2", "S3"].iter().flat_map(|s| ["i", "e", "a", "o"].map(|v| (*s, v))).collect();
    let predicted: Vec<Vec<(f64, LeftOut)>> = parallel::map(&rows, |&(subject, vowel)| {
        let target = target(subject, vowel, TargetKind::Stretch);
        let measurements = Measurements::of_vowel(&TargetOnBody::new(&body.mesh, &target).unwrap());
        let mut problem = PosteriorProblem::new(&posterior_model, measurements).unwrap();
        let map_estimate = problem.map().unwrap();
        target
            .values
            .iter()
            .copied()
            .zip(predict_each_from_others(&problem, &map_estimate).unwrap())
            .collect()
    });
    let predicted = predicted.concat();
    assert_eq!(predicted.len(), 96);
    let mean =
        |of: &dyn Fn(f64, &LeftOut) -> f64| predicted.iter().map(|(y, p)| of(*y, p)).sum::<f64>() / 96.0;
    let rms = mean(&|y, p| (p.spread.mean - y).powi(2)).sqrt();
    let log_score = mean(&|_, p| p.log_score);
    let held = mean(&|y, p| f64::from(u8::from(p.spread.holds(y))));

    let committed = committed();
    let scores = &committed["posterior"]["scores"];
    let of = |which: usize, what: &str| scores[which][what].as_f64().unwrap();
    assert_eq!(
        (scores[1]["name"].as_str(), scores[2]["name"].as_str()),
        (Some("gaussian"), Some("posterior"))
    );
    eprintln!("RMS {rms:.4}, log score {log_score:.3}, {held:.3} in 95 % intervals");
    assert!((rms - of(2, "rms")).abs() < 1e-3, "{rms}");
    assert!((log_score - of(2, "log_score")).abs() < 1e-2, "{log_score}");
    assert!((held - of(2, "coverage_95")).abs() < 0.011, "{held}");
    // The intervals are calibrated, and the distribution is better than the normal one of the other speakers. Its mean is not (0.091
    // against 0.088): equal scales of F and F0 cost 0.003.
    assert!((0.9..=0.98).contains(&held) && log_score > of(1, "log_score"), "{held}");
    // A speaker's vowels together are better in both scores, and other speakers' vowels are worse than a row alone.
    let names: Vec<&str> = scores.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names[3..], ["posterior_joint", "posterior_joint_tilt", "control_other_speakers"]);
    for (better, worse) in [(3, 1), (3, 2), (4, 3), (2, 5)] {
        assert!(of(better, "rms") < of(worse, "rms") && of(better, "log_score") > of(worse, "log_score"));
    }
    let permuted = committed["posterior"]["permuted_rms"].as_array().unwrap();
    assert!(
        permuted.len() == 10 && permuted.iter().all(|other| other.as_f64().unwrap() > rms),
        "{permuted:?}"
    );
}
