//! Quantiles of weighted and of few draws.

use tongue_infer::posterior::Quantiles;
use tongue_infer::posterior::quantiles::effective;

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
