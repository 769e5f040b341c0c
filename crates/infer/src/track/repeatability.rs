//! Repeatability of a muscle's course over repetitions of labels or prompts: the intraclass correlation.
//!
//! Every repetition is resampled to the same number of points. At each point of each label the repetitions are judges of one number: ICC(1)
//! by one-way analysis of variance with groups of different sizes (Shrout and Fleiss 1979; Donner and Koval 1980). Two controls are
//! computed in the same way. As smooth courses of any two intervals correlate, labels are shifted by a random time in each recording,
//! cyclically. As words that begin and end alike correlate, labels are exchanged at random between repetitions, and courses are taken less
//! their mean over all labels at each point.

use std::collections::BTreeMap;

use serde::Serialize;

use tongue_core::random::seed_of;
use tongue_input::measured::ByMuscle;
use tongue_input::measured::recording::Label;

use super::results::Tracked;
use super::segments::{Groups, distinguishing};

const POINTS: usize = 11;
/// Number of random shifts, and of random exchanges of labels.
const CHANCES: usize = 200;
const FEWEST_FRAMES: usize = 3;

struct Repeatable<'a> {
    times: Vec<f64>,
    courses: Vec<Vec<f64>>,
    labels: &'a [Label],
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Repeated {
    /// ICC(1) over repetitions.
    pub icc: f64,
    /// Mean ICC(1) over shifts of the labels.
    pub by_chance: f64,
    /// 95th percentile of ICC(1) over shifts of the labels.
    pub chance_95: f64,
    /// Mean ICC(1) over exchanges of labels between repetitions.
    pub by_exchange: f64,
    /// 95th percentile of ICC(1) over exchanges.
    pub exchange_95: f64,
    /// ICC(1) of the course less its mean over all labels at each point, which distinguishes the labels.
    pub of_label: f64,
    /// 95th percentile of `of_label` over exchanges.
    pub of_label_95: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeatability {
    pub tier: String,
    /// Labels that repeat, with their number of repetitions.
    pub labels: BTreeMap<String, usize>,
    pub muscles: ByMuscle<Repeated>,
}

/// Repeatability of these muscles in recordings, which are given by their frames and labels; `None` if no tier has two labels that repeat.
pub fn repeatability<'a>(
    recordings: impl IntoIterator<Item = (&'a [Tracked], &'a [Label])>,
    muscles: &[String],
) -> Option<Repeatability> {
    let measured = recordings.into_iter().map(|(frames, labels)| {
        let times = frames.iter().map(|f| f.time_s).collect();
        Repeatable {
            times,
            courses: frames.iter().map(|f| f.courses.iter().map(|c| c.median).collect()).collect(),
            labels,
        }
    });
    repeated(&measured.collect::<Vec<_>>(), muscles)
}

fn repeated(recordings: &[Repeatable<'_>], muscles: &[String]) -> Option<Repeatability> {
    let labelled: Vec<_> = recordings.iter().map(|r| (r.times.clone(), r.labels)).collect();
    let (tier, groups) = distinguishing(&labelled, FEWEST_FRAMES).into_iter().next()?;
    let still = vec![0.0; recordings.len()];
    let found = numbers(recordings, &groups, muscles.len(), &still);
    let mut random = fastrand::Rng::with_seed(seed_of(0, recordings.len()));
    let shifted: Vec<Vec<Vec<Vec<f64>>>> = Vec::from_iter((0..CHANCES).map(|_| {
        let shifts: Vec<f64> = recordings.iter().map(|r| random.f64() * span(&r.times)).collect();
        numbers(recordings, &groups, muscles.len(), &shifts)
    }));
    let exchanged: Vec<Vec<Vec<Vec<f64>>>> = (0..CHANCES)
        .map(|_| numbers(recordings, &exchanged(&groups, &mut random), muscles.len(), &still))
        .collect();
    let measured = (0..muscles.len()).map(|m| {
        let chance = |all: &[Vec<Vec<Vec<f64>>>], of: fn(&[Vec<f64>]) -> f64| {
            let mut by_chance: Vec<f64> = all.iter().map(|numbers| of(&numbers[m])).collect();
            by_chance.sort_by(f64::total_cmp);
            (by_chance.iter().sum::<f64>() / CHANCES as f64, by_chance[CHANCES * 95 / 100])
        };
        let whole = |numbers: &[Vec<f64>]| icc(numbers, 1);
        let (by_chance, chance_95) = chance(&shifted, whole);
        let (by_exchange, exchange_95) = chance(&exchanged, whole);
        Repeated {
            icc: whole(&found[m]),
            by_chance,
            chance_95,
            by_exchange,
            exchange_95,
            of_label: of_label(&found[m]),
            of_label_95: chance(&exchanged, of_label).1,
        }
    });
    let labels = groups.iter().map(|(name, all)| (name.clone(), all.len())).collect();
    Some(Repeatability { tier, labels, muscles: ByMuscle::new(muscles, measured) })
}

fn exchanged(groups: &Groups, random: &mut fastrand::Rng) -> Groups {
    let mut places: Vec<_> = groups.iter().flat_map(|(_, all)| all.iter().copied()).collect();
    random.shuffle(&mut places);
    let mut places = places.into_iter();
    groups.iter().map(|(name, all)| (name.clone(), places.by_ref().take(all.len()).collect())).collect()
}

fn span(times: &[f64]) -> f64 {
    times.first().zip(times.last()).map_or(0.0, |(a, b)| b - a)
}

/// For every muscle, groups of numbers that should be equal, one for each label and point, with labels shifted by a time.
fn numbers(
    recordings: &[Repeatable<'_>],
    groups: &Groups,
    muscles: usize,
    shifts: &[f64],
) -> Vec<Vec<Vec<f64>>> {
    let mut numbers: Vec<Vec<Vec<f64>>> = vec![Vec::new(); muscles];
    for (_, repetitions) in groups {
        for point in 0..POINTS {
            let part = point as f64 / (POINTS - 1) as f64;
            let values: Vec<Vec<f64>> = Vec::from_iter(repetitions.iter().map(|&(number, from, to)| {
                at(&recordings[number], from + (to - from) * part + shifts[number])
            }));
            for (m, all) in numbers.iter_mut().enumerate() {
                all.push(values.iter().map(|v| v.get(m).copied().unwrap_or(f64::NAN)).collect());
            }
        }
    }
    numbers
}

/// Courses at a time, interpolated linearly. A time past the end continues at the beginning, once.
fn at(recording: &Repeatable<'_>, time: f64) -> Vec<f64> {
    let (Some(&first), length) = (recording.times.first(), span(&recording.times)) else { return Vec::new() };
    let time = if time > first + length { time - length } else { time };
    let after = recording.times.partition_point(|t| *t < time).clamp(1, recording.times.len().max(2) - 1);
    let (Some(low), Some(high)) = (recording.courses.get(after - 1), recording.courses.get(after)) else {
        return recording.courses.first().cloned().unwrap_or_default();
    };
    let [a, b] = [recording.times[after - 1], recording.times[after]];
    let part = ((time - a) / (b - a)).clamp(0.0, 1.0);
    low.iter().zip(high).map(|(l, h)| l + (h - l) * part).collect()
}

/// ICC(1) of groups of numbers from which `means` means were taken (1: only the common one).
fn icc(groups: &[Vec<f64>], means: usize) -> f64 {
    let total: usize = groups.iter().map(Vec::len).sum();
    let (n, count, means) = (total as f64, groups.len() as f64, means as f64);
    let mean = groups.iter().flatten().sum::<f64>() / n;
    let (mut between, mut within, mut squares) = (0.0, 0.0, 0.0);
    for group in groups {
        let size = group.len() as f64;
        let own = group.iter().sum::<f64>() / size;
        between += size * (own - mean).powi(2);
        within += group.iter().map(|v| (v - own).powi(2)).sum::<f64>();
        squares += size * size;
    }
    let (between, within) = (between / (count - means), within / (n - count));
    let usual = (n - means * squares / n) / (count - means);
    (between - within) / (between + (usual - 1.0) * within)
}

/// ICC(1) of numbers less their mean over all labels at each point.
fn of_label(groups: &[Vec<f64>]) -> f64 {
    let mut means = [0.0; POINTS];
    for (point, mean) in means.iter_mut().enumerate() {
        let all: Vec<f64> = groups.iter().skip(point).step_by(POINTS).flatten().copied().collect();
        *mean = all.iter().sum::<f64>() / all.len() as f64;
    }
    let deviations =
        groups.iter().enumerate().map(|(i, group)| group.iter().map(|v| v - means[i % POINTS]).collect());
    icc(&deviations.collect::<Vec<_>>(), POINTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icc_is_that_of_shrout_and_fleiss() {
        // Their table 2: six targets, four judges; ICC(1,1) = .17.
        let table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]];
        let groups: Vec<Vec<f64>> =
            table.iter().map(|row| row.iter().map(|v| f64::from(*v)).collect()).collect();
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
                (0..3 + i / POINTS).map(|_| common + tongue_core::random::normal(&mut random)).collect()
            });
            sum += of_label(&groups.collect::<Vec<Vec<f64>>>());
        }
        assert!((sum / 400.0).abs() < 0.01, "{}", sum / 400.0);
    }
}
