//! Repeatability over labels.

use tongue_core::random::normal;
use tongue_infer::track::repeatability::{POINTS, Repeatable, icc, of_label, repeated};
use tongue_input::measured::recording::Label;

#[test]
fn the_icc_is_that_of_shrout_and_fleiss() {
    // Their table 2: six targets, four judges; ICC(1,1) = .17.
    let table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]];
    let groups: Vec<Vec<f64>> = table.iter().map(|row| row.iter().map(|v| f64::from(*v)).collect()).collect();
    assert!((icc(&groups, 1) - 0.17).abs() < 0.005, "{}", icc(&groups, 1));
}

fn label(tier: &str, name: &str, from_s: f64, to_s: f64) -> Label {
    Label { tier: tier.into(), name: name.into(), from_s, to_s }
}

#[test]
fn what_repeats_is_told_from_what_does_not() {
    let times: Vec<f64> = (0..300).map(|i| 0.01 * f64::from(i)).collect();
    // The tier with one label for everything has most repetitions but does not distinguish.
    let mut labels: Vec<Label> =
        [("pa", 0.1, 0.5), ("ta", 0.6, 1.0), ("pa", 1.1, 1.7), ("ta", 1.8, 2.1), ("pa", 2.3, 2.8)]
            .map(|(name, from_s, to_s)| label("word", name, from_s, to_s))
            .to_vec();
    labels.extend((0..9).map(|i| label("all", "ultrasound", 0.3 * f64::from(i), 0.3 * f64::from(i + 1))));
    // One movement differs between the words, at a speed that depends on the word's length; one does not depend on words; one is common
    // to both words.
    let courses: Vec<Vec<f64>> = Vec::from_iter(times.iter().map(|&t| {
        let inside = labels.iter().find(|l| l.tier == "word" && l.holds(t));
        let part = inside.map_or(0.0, |l| (t - l.from_s) / (l.to_s - l.from_s));
        let sign = inside.map_or(0.0, |l| if l.name == "pa" { 1.0 } else { -1.0 });
        let noise = (11.0 * t * t).sin();
        vec![10.0 * sign * (6.3 * part).sin(), noise, 10.0 * (3.1 * part).sin() + noise]
    }));
    let recording = |labels| Repeatable { times: times.clone(), courses: courses.clone(), labels };
    let names = ["word", "noise", "both"].map(String::from);
    let found = repeated(&[recording(&labels)], &names).unwrap();
    assert_eq!((found.tier.as_str(), found.labels.values().next().copied()), ("word", Some(3)));
    let [differs, none, common] = [0, 1, 2].map(|m| found.muscles.0[m].1);
    assert!(differs.icc > 0.98 && differs.chance_95 < differs.icc, "{found:?}");
    assert!(differs.of_label > 0.98 && differs.by_exchange < 0.7, "{found:?}");
    assert!(none.icc < 0.5 && none.of_label < none.of_label_95, "{found:?}");
    // What is common to all words repeats as well with exchanged labels, and does not distinguish a label.
    assert!(common.icc > 0.8 && common.by_exchange > 0.8, "{found:?}");
    assert!(common.by_chance < 0.5 && common.of_label < common.of_label_95, "{found:?}");
    assert_eq!(repeated(&[recording(&labels[..3])], &names), None);
    // Labels longer than a recording, and recordings of one frame.
    let mut odd = labels.clone();
    odd[0].to_s = 1e9;
    repeated(&[recording(&odd)], &names);
    let (times, courses) = (times[..1].to_vec(), courses[..1].to_vec());
    repeated(&[Repeatable { times, courses, labels: &labels }], &names);
}

#[test]
fn without_a_difference_between_labels_none_is_found_on_average() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut sum = 0.0;
    for _ in 0..400 {
        let groups = (0..4 * POINTS).map(|i| {
            let common = (i % POINTS) as f64;
            (0..3 + i / POINTS).map(|_| common + normal(&mut random)).collect()
        });
        sum += of_label(&groups.collect::<Vec<Vec<f64>>>());
    }
    assert!((sum / 400.0).abs() < 0.01, "{}", sum / 400.0);
}
