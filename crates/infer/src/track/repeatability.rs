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

/// Number of points of a label at which courses are compared.
pub const POINTS: usize = 11;
/// Number of random shifts, and of random exchanges of labels.
const CHANCES: usize = 200;
const FEWEST_FRAMES: usize = 3;

/// A recording: times of its frames, s, tensions of the muscles in each, and labels.
pub struct Repeatable<'a> {
    pub times: Vec<f64>,
    pub courses: Vec<Vec<f64>>,
    pub labels: &'a [Label],
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
    let measured = recordings.into_iter().map(|(frames, labels)| Repeatable {
        times: frames.iter().map(|f| f.time_s).collect(),
        courses: frames.iter().map(|f| f.courses.iter().map(|c| c.median).collect()).collect(),
        labels,
    });
    repeated(&measured.collect::<Vec<_>>(), muscles)
}

/// Repeatability of these muscles in recordings; `None` if no tier has two labels that repeat.
pub fn repeated(recordings: &[Repeatable<'_>], muscles: &[String]) -> Option<Repeatability> {
    let labelled: Vec<_> = recordings.iter().map(|r| (r.times.clone(), r.labels)).collect();
    let groups = distinguishing(&labelled, FEWEST_FRAMES).into_iter().next()?;
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
    let labels = groups.iter().map(|all| (all[0].1.name.clone(), all.len())).collect();
    let tier = groups[0][0].1.tier.clone();
    Some(Repeatability { tier, labels, muscles: ByMuscle::new(muscles, measured) })
}

/// Groups of the same sizes with repetitions of labels at random.
fn exchanged<'a>(groups: &Groups<'a>, random: &mut fastrand::Rng) -> Groups<'a> {
    let mut all: Vec<_> = groups.iter().flatten().copied().collect();
    random.shuffle(&mut all);
    let mut all = all.into_iter();
    groups.iter().map(|group| all.by_ref().take(group.len()).collect()).collect()
}

fn span(times: &[f64]) -> f64 {
    times.first().zip(times.last()).map_or(0.0, |(a, b)| b - a)
}

/// For every muscle, groups of numbers that should be equal, one for each label and point, with labels shifted by a time.
fn numbers(
    recordings: &[Repeatable<'_>],
    groups: &Groups<'_>,
    muscles: usize,
    shifts: &[f64],
) -> Vec<Vec<Vec<f64>>> {
    let mut numbers: Vec<Vec<Vec<f64>>> = vec![Vec::new(); muscles];
    for repetitions in groups {
        for point in 0..POINTS {
            let part = point as f64 / (POINTS - 1) as f64;
            let values: Vec<Vec<f64>> = Vec::from_iter(repetitions.iter().map(|&(number, label)| {
                let time = label.from_s + (label.to_s - label.from_s) * part;
                at(&recordings[number], time + shifts[number])
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
pub fn icc(groups: &[Vec<f64>], means: usize) -> f64 {
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
pub fn of_label(groups: &[Vec<f64>]) -> f64 {
    let mut means = [0.0; POINTS];
    for (point, mean) in means.iter_mut().enumerate() {
        let all: Vec<f64> = groups.iter().skip(point).step_by(POINTS).flatten().copied().collect();
        *mean = all.iter().sum::<f64>() / all.len() as f64;
    }
    let deviations =
        groups.iter().enumerate().map(|(i, group)| group.iter().map(|v| v - means[i % POINTS]).collect());
    icc(&deviations.collect::<Vec<_>>(), POINTS)
}
