//! Posteriors: the normal distribution, statistics and diagnostics of draws, errors of coils, and what is said of muscles.

use tongue_core::random::normal;
use tongue_infer::posterior::diagnostics::{mixing, most_r_hat};
use tongue_infer::posterior::parameters::{tension, upper_tail};
use tongue_infer::posterior::point_data::glue;
use tongue_infer::posterior::quantiles::effective;
use tongue_infer::posterior::sensitivity::{moved, weights};
use tongue_infer::posterior::{
    Certainty, Contrast, MixtureComponent, MuscleVerdict, OverSpeakers, PredictionMethod, Quantiles,
    SENSITIVE, Verdict, VerdictFrom, left_out, population_mean,
};
use tongue_input::measured::recording::AlignedRecording;

#[test]
fn tails_are_those_of_the_tables() {
    // Abramowitz and Stegun 1964, table 26.1.
    for (x, p) in
        [(0.5, 0.308_537_538_725_987), (1.0, 0.158_655_253_931_457), (3.0, 1.349_898_031_630_095e-3)]
    {
        assert!((upper_tail(x) / p - 1.0).abs() < 1e-12, "{x}");
    }
    assert!((upper_tail(5.0) / 2.866_515_718_791_94e-7 - 1.0).abs() < 1e-12);
}

#[test]
fn a_tension_has_the_tail_of_its_score_and_the_slope_is_the_derivative() {
    for n in -44..=52 {
        let g = f64::from(n) * 0.1;
        let (z, slope) = tension(g);
        // The probability of tensions above it is that of scores above the score.
        assert!((2.0 * upper_tail(z) / upper_tail(g) - 1.0).abs() < 1e-9, "{g}: {z}");
        let h = 1e-5;
        let difference = (tension(g + h).0 - tension(g - h).0) / (2.0 * h);
        assert!((slope / difference - 1.0).abs() < 1e-6, "{g}: {slope} {difference}");
    }
    assert!((tension(0.0).0 - 0.674_489_750_196_081_7).abs() < 1e-14);
    assert!(tension(1.96).0 > 2.2 && tension(1.96).0 < 2.25);
}

#[test]
fn weights_count_as_repetitions_do() {
    let repeated = Quantiles::of([1.0, 2.0, 2.0, 2.0, 5.0, 7.0, 7.0]);
    let weighted = Quantiles::weighted(vec![(5.0, 1.0), (2.0, 3.0), (7.0, 2.0), (1.0, 1.0)], f64::INFINITY);
    assert!((repeated.mean - weighted.mean).abs() < 1e-15);
    let many = Quantiles::of((0..10_001).map(|i| f64::from(i) / 10_000.0));
    for (found, exact) in [(many.median, 0.5), (many.interval_95[0], 0.025), (many.interval_50[1], 0.75)] {
        assert!((found - exact).abs() < 1e-4, "{found} {exact}");
    }
    let heavy = Quantiles::weighted((0..1000).map(|i| (f64::from(i), f64::from(i))).collect(), f64::INFINITY);
    // The density is 2x on (0, 1), half of which lies below the root of a half.
    assert!((heavy.median / 1000.0 - 0.5f64.sqrt()).abs() < 2e-3, "{heavy:?}");
    assert!((effective(&[1.0; 8]) - 8.0).abs() < 1e-12 && effective(&[1.0, 0.0, 0.0]) == 1.0);
}

#[test]
fn intervals_of_few_draws_contain_95_percent_of_further_ones() {
    for count in [50, 100, 240] {
        let mut random = fastrand::Rng::with_seed(count);
        let runs = 4000;
        let held = (0..runs).map(|_| {
            let draws: Vec<f64> = (0..count).map(|_| random.f64()).collect();
            let [low, high] = Quantiles::of_few(draws, count as f64).interval_95;
            high - low
        });
        // The standard error of the mean is below 0.0007.
        let mean = held.sum::<f64>() / f64::from(runs);
        assert!((mean - 0.95).abs() < 0.003, "{mean} of {count} draws");
    }
}

#[test]
fn scores_of_a_normal_distribution_are_the_exact_ones() {
    let parts = vec![MixtureComponent { mean: 1.0, weight: 1.0 }; 40_000];
    let found = left_out(&parts, 0.2, 1.1, (PredictionMethod::Together, 40_000.0), 1);
    let z: f64 = 0.5;
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    assert!((found.log_score - (density / 0.2).ln()).abs() < 1e-12);
    // sd (z (2 Phi(z) - 1) + 2 phi(z) - 1/sqrt(pi)), Gneiting and Raftery 2007; Phi(0.5) = 0.69146.
    let exact = 0.2 * (z * (2.0 * 0.691_462_5 - 1.0) + 2.0 * density - std::f64::consts::PI.sqrt().recip());
    assert!((found.crps / exact - 1.0).abs() < 0.02, "{} {exact}", found.crps);
    assert!((found.spread.interval_95[1] - (1.0 + 0.2 * 1.96)).abs() < 0.01);
}

fn autoregressive(chains: usize, n: usize, rho: f64, shift: f64) -> Vec<Vec<f64>> {
    let mut random = fastrand::Rng::with_seed(4);
    Vec::from_iter((0..chains).map(|c| {
        let mut x = normal(&mut random);
        (0..n)
            .map(|_| {
                x = rho * x + (1.0 - rho * rho).sqrt() * normal(&mut random);
                x + shift * c as f64
            })
            .collect()
    }))
}

#[test]
fn independent_draws_count_fully_and_correlated_ones_by_their_time() {
    let m = mixing(&autoregressive(4, 5000, 0.0, 0.0));
    assert!(m.r_hat < 1.003 && (m.bulk / 20_000.0 - 1.0).abs() < 0.1, "{m:?}");
    // The integrated autocorrelation time of a first-order process is (1 + rho)/(1 - rho).
    let m = mixing(&autoregressive(4, 50_000, 0.8, 0.0));
    assert!((m.bulk / (200_000.0 / 9.0) - 1.0).abs() < 0.1, "{m:?}");
    let anti = mixing(&autoregressive(4, 50_000, -0.5, 0.0));
    assert!((anti.bulk / (200_000.0 * 3.0) - 1.0).abs() < 0.15, "{anti:?}");
    assert!(anti.tail < anti.bulk);
}

#[test]
fn independent_draws_of_many_quantities_exceed_the_largest_r_hat_once_in_a_hundred_runs() {
    let mut random = fastrand::Rng::with_seed(7);
    let (runs, quantities, draws) = (300, 30, 125);
    let most = most_r_hat(8, draws, quantities);
    // The limit is stated in docs/model.md.
    assert!((most - 1.015).abs() < 5e-4 && most_r_hat(8, 1000, 30) == 1.01, "{most}");
    let mut quantity = || -> f64 {
        let chain = |_| (0..draws).map(|_| normal(&mut random)).collect();
        mixing(&(0..8).map(chain).collect::<Vec<Vec<f64>>>()).r_hat
    };
    let exceeded = (0..runs).filter(|_| (0..quantities).any(|_| quantity() >= most)).count();
    // Of 300 runs one in 100 is expected to be above; 9 or more of them are above with a probability of 1 / 280.
    assert!(exceeded <= 8, "{exceeded} of {runs}");
    assert!(mixing(&autoregressive(8, draws, 0.0, 0.5)).r_hat > most, "one chain in eight is elsewhere");
}

#[test]
fn chains_elsewhere_or_of_another_width_have_not_mixed() {
    let apart = mixing(&autoregressive(4, 1000, 0.0, 0.5));
    assert!(apart.r_hat > 1.05 && apart.bulk < 100.0, "{apart:?}");
    let mut wide = autoregressive(4, 1000, 0.0, 0.0);
    wide[0].iter_mut().for_each(|x| *x *= 3.0);
    let wide = mixing(&wide);
    assert!(wide.r_hat > 1.05, "the distances from the median tell: {wide:?}");
}

/// Sensitivity of a quantity with prior N(0, 1) and one measurement, both of which are known exactly.
fn of_measurement(measured: f64, sd: f64) -> [f64; 2] {
    let mut random = fastrand::Rng::with_seed(3);
    let precision = 1.0 + 1.0 / (sd * sd);
    let mean = measured / (sd * sd) / precision;
    let values: Vec<f64> = (0..8000).map(|_| mean + normal(&mut random) / precision.sqrt()).collect();
    let prior: Vec<f64> = values.iter().map(|v| -0.5 * v * v).collect();
    let likelihood: Vec<f64> = values.iter().map(|v| -0.5 * ((v - measured) / sd).powi(2)).collect();
    [prior, likelihood].map(|logs| moved(&values, &weights(&logs)))
}

#[test]
fn what_a_measurement_decides_depends_on_it_and_what_it_does_not_on_the_prior() {
    let [prior, likelihood] = of_measurement(0.0, 0.2);
    assert!(prior < SENSITIVE && likelihood > 3.0 * prior, "{prior} {likelihood}");
    let [prior, likelihood] = of_measurement(0.0, 5.0);
    assert!(prior > SENSITIVE && likelihood < SENSITIVE, "{prior} {likelihood}");
    // A measurement far from the prior is sensitive to both.
    let [prior, likelihood] = of_measurement(6.0, 1.0);
    assert!(prior > SENSITIVE && likelihood > SENSITIVE, "{prior} {likelihood}");
}

#[test]
fn a_coil_behind_a_measured_one_is_as_uncertain_as_the_gap() {
    let mut recording = AlignedRecording {
        sensors: (1..).zip([0.01, 0.026, 0.042]).map(|(i, behind)| (format!("T{i}"), behind)).collect(),
        measured: vec![false; 3],
        ..AlignedRecording::of_contours(&[])
    };
    let sds = |recording: &AlignedRecording, coil| {
        glue(recording, coil).iter().map(|(_, sd)| *sd).collect::<Vec<_>>()
    };
    assert_eq!(sds(&recording, 2), [4e-3, 2e-3, 2e-3]);
    recording.measured[1] = true;
    assert_eq!(sds(&recording, 2), [1e-3, 2e-3]);
    assert_eq!(sds(&recording, 0), [4e-3]);
}

fn verdict(muscle: &str, p_rises: f64, mostly_prior: bool) -> MuscleVerdict {
    let (muscle, certainty) = (muscle.to_owned(), Certainty::of(p_rises));
    MuscleVerdict { muscle, p_rises: Some(p_rises), certainty, tension_n_per_m: [14.2, 68.9], mostly_prior }
}

#[test]
fn three_sentences_name_every_muscle_once_and_say_how_sure_it_is() {
    let from = VerdictFrom::Draws;
    let muscles = vec![
        verdict("GGa", 0.9, false),
        verdict("GGm", 0.3, true),
        verdict("SGm", 0.99, true),
        verdict("HGa", 1.0, true),
        verdict("HGp", 0.11, true),
        verdict("SGa", 0.01, true),
    ];
    let [harder, open, how_hard] = Verdict { from, hyoid_mm: None, muscles }.sentences("ɯ");
    assert_eq!(
        harder,
        "Harder than in /ɯ/, surely: SGm, HGa; probably: GGa. Not harder, surely: SGa; probably: HGp."
    );
    assert_eq!(open, "Not known: GGm.");
    assert_eq!(
        how_hard,
        "How hard: GGa 14 to 69 N/m; SGm 14 to 69, HGa 14 to 69 N/m (more from prior than data)."
    );
    let nobody = Verdict { from, hyoid_mm: None, muscles: vec![verdict("GGa", 0.5, true)] }.sentences("e");
    assert_eq!(nobody[0], "No muscle is known to pull harder than in /e/.");
    assert_eq!(nobody[2], "No muscle is known to pull harder, so no tension is listed.");
}

#[test]
fn words_change_at_the_probabilities_that_are_documented() {
    let words = [0.95, 0.949, 0.8, 0.79, 0.21, 0.2, 0.051, 0.05].map(|p| Certainty::of(p).text());
    assert_eq!(
        words.join("; "),
        "surely harder; probably harder; probably harder; not known; not known; probably not harder; probably not harder; \
         surely not harder"
    );
}

#[test]
fn intervals_of_a_population_hold_its_mean_in_95_percent() {
    let mut random = fastrand::Rng::with_seed(1);
    for (speakers, between) in [(4, 0.0), (4, 3.0), (9, 1.0), (9, 6.0)] {
        const TRIALS: usize = 4000;
        let held = (0..TRIALS).filter(|_| {
            let estimates: Vec<f64> = Vec::from_iter((0..speakers).map(|_| {
                let sd = 1.0 + 4.0 * random.f64();
                let own = 2.0 + between * normal(&mut random);
                own + sd * normal(&mut random)
            }));
            let [low, high] = population_mean(&estimates).1.unwrap();
            (low..=high).contains(&2.0)
        });
        let part = held.count() as f64 / TRIALS as f64;
        assert!((0.93..=0.97).contains(&part), "{speakers} speakers, {between} between: {part}");
    }
}

#[test]
fn differences_are_those_of_the_same_labels_in_either_order() {
    let draws = |middle: f64| (0..100).map(|i| middle + 0.01 * f64::from(i)).collect::<Vec<_>>();
    let all = [
        Contrast::of("GGp", ["i", "a"], &draws(5.0)),
        Contrast::of("GGp", ["a", "i"], &draws(-7.0)),
        Contrast::of("GGp", ["i", "a"], &draws(-0.5)),
        Contrast::of("HGa", ["i", "a"], &draws(1.0)),
    ];
    let found = OverSpeakers::all(all.iter().map(|c| ("word", c)));
    let [one] = &found[..] else { panic!("{found:?}") };
    assert_eq!((one.speakers, one.surely_harder_in_a, one.harder_in_a, one.harder_in_b), (3, 2, 2, 0));
    assert!(
        one.sentence()
            .unwrap()
            .starts_with("GGp: harder in /i/ than in /a/ in 2 of 3 speakers, surely in 2, on")
    );
    assert!((one.mean_n - 3.8).abs() < 0.2 && one.interval_95.unwrap()[0] < 0.0, "{one:?}");
}
