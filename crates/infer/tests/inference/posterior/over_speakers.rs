//! Differences over speakers.

use tongue_core::random;
use tongue_infer::posterior::{Contrast, OverSpeakers, population_mean};

#[test]
fn intervals_of_a_population_hold_its_mean_in_95_percent() {
    let mut random = fastrand::Rng::with_seed(1);
    for (speakers, between) in [(4, 0.0), (4, 3.0), (9, 1.0), (9, 6.0)] {
        const TRIALS: usize = 4000;
        let held = (0..TRIALS).filter(|_| {
            let estimates: Vec<f64> = Vec::from_iter((0..speakers).map(|_| {
                let sd = 1.0 + 4.0 * random.f64();
                let own = 2.0 + between * random::normal(&mut random);
                own + sd * random::normal(&mut random)
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
