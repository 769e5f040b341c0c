//! Predictions of a muscle that is left out of a vowel, against a baseline in which muscles pull.

use tongue_fit::inverse::TargetOnBody;
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions};
use tongue_fit::parallel;
use tongue_infer::posterior::{Measurements, PosteriorProblem, Sampling, predict_each_from_others};

use crate::fixtures::{tongue, vowel};
use crate::synthetic_speakers::posterior_model;

/// The measurements of all rows of the published table against a baseline.
fn rows_against(baseline: &str) -> Vec<Measurements> {
    let (data, mesh) = (Dataset::reference().unwrap(), tongue());
    let options = TargetOptions { baseline: Some(vowel(baseline)), ..TargetOptions::default() };
    let rows = data.rows.iter().filter_map(|row| {
        let (subject, vowel) = (&row.lengths.subject, &row.lengths.vowel);
        let target = Target::new(&data, subject, vowel, TargetKind::Stretch, &options).ok()?;
        Some(Measurements::of_vowel(&TargetOnBody::new(&mesh, &target).unwrap()))
    });
    rows.collect()
}

#[test]
fn intervals_of_muscles_left_out_of_rows_against_another_baseline_hold() {
    let posterior_model = posterior_model("");
    let held = ["i", "e", "a", "o"].map(|baseline| {
        let rows = rows_against(baseline);
        assert_eq!(rows.len(), 15, "four vowels of S1 to S3, three of S4");
        let held = parallel::map(&rows, |row| {
            let mut problem = PosteriorProblem::new(&posterior_model, row.clone()).unwrap();
            let map_estimate = problem.map().unwrap();
            let found = predict_each_from_others(&problem, &map_estimate).unwrap();
            assert_eq!(found.len(), 8);
            found.iter().zip(&row.stretches).filter(|(f, y)| f.spread.holds(y.value)).count()
        });
        let held: usize = held.iter().sum();
        eprintln!("against /{baseline}/: {held} of 120 hold");
        held
    });
    // 0.95 less two binomial standard errors.
    let all: usize = held.iter().sum();
    assert!(all as f64 >= 0.93 * 480.0, "{all} of 480");
}

#[test]
fn a_vowel_against_another_and_the_other_against_it_have_opposite_answers() {
    let posterior_model = posterior_model("");
    let p_rises = |vowel: &str, baseline: &str| {
        let options = TargetOptions { baseline: Some(self::vowel(baseline)), ..TargetOptions::default() };
        let data = Dataset::reference().unwrap();
        let target = Target::new(&data, "S4", &self::vowel(vowel), TargetKind::Stretch, &options).unwrap();
        let row = Measurements::of_vowel(&TargetOnBody::new(&tongue(), &target).unwrap());
        let posterior = posterior_model.posterior(row, &Sampling { draws: 1000, seed: 1 }).unwrap();
        let rising = |m| posterior.draws.iter().filter(|draw| draw.change(0, m) > 0.0).count();
        [0, 1, 2, 3, 4, 5, 6, 7].map(|m| rising(m) as f64 / posterior.draws.len() as f64)
    };
    for (m, (there, back)) in p_rises("a", "i").iter().zip(p_rises("i", "a")).enumerate() {
        // Two standard errors of a difference of two probabilities from 400 effective draws each are below 0.08.
        assert!((there + back - 1.0).abs() < 0.1, "muscle {m}: {there} and {back}");
    }
}
