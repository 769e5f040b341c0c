//! Predictions of a muscle that is left out, from one run for all muscles and from a run for each.

use tongue_fit::inverse::TargetOnBody;
use tongue_fit::measured::TargetKind;
use tongue_infer::posterior::{
    Draw, Measurements, PosteriorProblem, Sampling, conditional, predict_each_from_others,
};

use crate::fixtures::{target, tongue};
use crate::synthetic_speakers::coarse_posterior_model;

#[test]
fn one_run_for_all_muscles_left_out_predicts_what_a_run_without_each_does() {
    let posterior_model = coarse_posterior_model("");
    let matched = TargetOnBody::new(&tongue(), &target("S3", "e", TargetKind::Stretch)).unwrap();
    let mut problem = PosteriorProblem::new(&posterior_model, Measurements::of_vowel(&matched)).unwrap();
    let map_estimate = problem.map().unwrap();
    let found = predict_each_from_others(&problem, &map_estimate).unwrap();
    assert_eq!(found.len(), 8);
    assert!(found.iter().all(|f| f.effective > 50.0), "{found:?}");
    let mut leaning = Vec::new();
    for (position, found) in found.iter().enumerate() {
        let settings = Sampling { draws: 800, seed: 11 };
        let own = posterior_model.posterior(problem.measurements.without(position), &settings).unwrap();
        let row = problem.rows[position];
        // The errors by geometry that a stretch shares with the others move its conditional mean, as in the run for all.
        let (gain, _) = conditional(&problem, &own.problem, position);
        let mean = |d: &Draw| d.stretch(row) + gain.dot(&own.problem.residuals(&d.lengths, &d.auxiliary));
        let exact = own.draws.iter().map(mean).sum::<f64>() / own.draws.len() as f64;
        let sd = 0.25 * (found.spread.interval_95[1] - found.spread.interval_95[0]);
        eprintln!(
            "{}: {:.4}, exact {exact:.4}, sd {sd:.4}",
            problem.measurements.stretches[position].name, found.spread.mean
        );
        assert!((found.spread.mean - exact).abs() < 0.35 * sd, "{position}: {} {exact}", found.spread.mean);
        leaning.push((problem.measurements.stretches[position].value - exact, found.spread.mean - exact));
    }
    let slope =
        leaning.iter().map(|(x, y)| x * y).sum::<f64>() / leaning.iter().map(|(x, _)| x * x).sum::<f64>();
    eprintln!("leaning to the measured stretches: {slope:.3}");
    // Three standard errors of the draws; reweighted draws of the whole posterior have a slope of 0.22.
    assert!(slope.abs() < 0.12, "{slope}");
}
