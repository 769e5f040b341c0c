//! Repeatability: where a recording's labels or prompts repeat, the intraclass correlation of every muscle's course over the repetitions.
//!
//! Every repetition is resampled to the same number of points from its beginning to its end. At each point of each label the repetitions
//! are judges of one number: ICC(1) by one-way analysis of variance, with groups of different sizes (Shrout and Fleiss 1979; Donner and
//! Koval 1980). Courses are smooth, so any two intervals correlate a little. For comparison, the same is computed for labels shifted by a
//! random time in each recording; a recording continues at its beginning where it ends.

use serde::Serialize;

use tongue_core::random::seed_of;
use tongue_input::measured::recording::Label;

use super::found::Tracked;

/// Number of points to which a repetition is resampled.
const POINTS: usize = 11;
/// Number of random shifts of the labels.
const SHIFTS: usize = 200;
/// Fewest frames of a repetition.
const FEWEST_FRAMES: usize = 3;

/// A recording: the times of its frames, s, of every frame the course of each muscle, and its labels.
struct Repeatable<'a> {
    times: Vec<f64>,
    courses: Vec<Vec<f64>>,
    labels: &'a [Label],
}

/// Repeatability of the course of one muscle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Repeated {
    /// ICC(1) over repetitions.
    pub icc: f64,
    /// Mean of the same over shifted labels.
    pub by_chance: f64,
    /// The value below which 95 % of the shifted labels stay.
    pub chance_95: f64,
}

/// Repeatability of the courses in recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeats {
    /// The tier whose labels repeat.
    pub tier: String,
    /// Labels that repeat, and how often each does.
    pub labels: Vec<(String, usize)>,
    pub muscles: Vec<Repeated>,
}

/// The labels of a tier that repeat: for each its name, and the recording, beginning and end of every repetition.
type Groups = Vec<(String, Vec<(usize, f64, f64)>)>;

/// Repeatability in recordings, each given by its frames and its labels, with courses of this number of muscles; `None` if no label
/// repeats.
pub fn repeats<'a>(
    recordings: impl IntoIterator<Item = (&'a [Tracked], &'a [Label])>,
    muscles: usize,
) -> Option<Repeats> {
    let one = |(frames, labels): (&'a [Tracked], &'a [Label])| {
        let course = |f: &Tracked| f.courses.iter().map(|c| c.median).collect();
        let times = frames.iter().map(|f| f.time_s).collect();
        Repeatable { times, courses: frames.iter().map(course).collect(), labels }
    };
    repeated(&recordings.into_iter().map(one).collect::<Vec<_>>(), muscles)
}

fn repeated(recordings: &[Repeatable<'_>], muscles: usize) -> Option<Repeats> {
    let mut tiers: Vec<&str> = Vec::new();
    for label in recordings.iter().flat_map(|r| r.labels) {
        if !tiers.contains(&label.tier.as_str()) {
            tiers.push(&label.tier);
        }
    }
    // The tier with most repetitions; of equal ones the first.
    let count = |groups: &Groups| groups.iter().map(|(_, all)| all.len()).sum::<usize>();
    let all = tiers.iter().map(|tier| (*tier, groups(recordings, tier)));
    let (tier, groups) = all.filter(|(_, g)| !g.is_empty()).rev().max_by_key(|(_, g)| count(g))?;
    let found = iccs(recordings, &groups, muscles, &vec![0.0; recordings.len()]);
    let mut random = fastrand::Rng::with_seed(seed_of(0, recordings.len()));
    let shifted: Vec<Vec<f64>> = (0..SHIFTS)
        .map(|_| {
            let shifts: Vec<f64> = recordings.iter().map(|r| random.f64() * span(&r.times)).collect();
            iccs(recordings, &groups, muscles, &shifts)
        })
        .collect();
    let one = |m: usize| {
        let mut by_chance: Vec<f64> = shifted.iter().map(|s| s[m]).collect();
        by_chance.sort_by(f64::total_cmp);
        let mean = by_chance.iter().sum::<f64>() / SHIFTS as f64;
        Repeated { icc: found[m], by_chance: mean, chance_95: by_chance[SHIFTS * 95 / 100] }
    };
    let labels = groups.iter().map(|(name, all)| (name.clone(), all.len())).collect();
    Some(Repeats { tier: tier.to_owned(), labels, muscles: (0..muscles).map(one).collect() })
}

fn groups(recordings: &[Repeatable<'_>], tier: &str) -> Groups {
    let mut out: Groups = Vec::new();
    for (number, recording) in recordings.iter().enumerate() {
        for label in recording.labels.iter().filter(|l| l.tier == tier) {
            if recording.times.iter().filter(|t| label.holds(**t)).count() < FEWEST_FRAMES {
                continue;
            }
            let place = (number, label.from_s, label.to_s);
            match out.iter_mut().find(|(name, _)| *name == label.name) {
                Some((_, all)) => all.push(place),
                None => out.push((label.name.clone(), vec![place])),
            }
        }
    }
    out.retain(|(_, all)| all.len() > 1);
    out
}

fn span(times: &[f64]) -> f64 {
    times.first().zip(times.last()).map_or(0.0, |(a, b)| b - a)
}

/// The ICC of every muscle with the labels of each recording shifted by a time.
fn iccs(recordings: &[Repeatable<'_>], groups: &Groups, muscles: usize, shifts: &[f64]) -> Vec<f64> {
    // For every muscle, groups of numbers that should be equal: one group for each label and point.
    let mut numbers: Vec<Vec<Vec<f64>>> = vec![Vec::new(); muscles];
    for (_, repetitions) in groups {
        for point in 0..POINTS {
            let part = point as f64 / (POINTS - 1) as f64;
            let values: Vec<Vec<f64>> = repetitions
                .iter()
                .map(|&(number, from, to)| {
                    at(&recordings[number], from + (to - from) * part + shifts[number])
                })
                .collect();
            for (m, all) in numbers.iter_mut().enumerate() {
                all.push(values.iter().map(|v| v.get(m).copied().unwrap_or(f64::NAN)).collect());
            }
        }
    }
    numbers.iter().map(|groups| icc(groups)).collect()
}

/// The courses at a time, interpolated linearly between frames; a recording continues at its beginning where it ends.
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

/// ICC(1) of groups of numbers.
fn icc(groups: &[Vec<f64>]) -> f64 {
    let total: usize = groups.iter().map(Vec::len).sum();
    let (n, count) = (total as f64, groups.len() as f64);
    let mean = groups.iter().flatten().sum::<f64>() / n;
    let (mut between, mut within, mut squares) = (0.0, 0.0, 0.0);
    for group in groups {
        let size = group.len() as f64;
        let own = group.iter().sum::<f64>() / size;
        between += size * (own - mean).powi(2);
        within += group.iter().map(|v| (v - own).powi(2)).sum::<f64>();
        squares += size * size;
    }
    let (between, within) = (between / (count - 1.0), within / (n - count));
    let usual = (n - squares / n) / (count - 1.0);
    (between - within) / (between + (usual - 1.0) * within)
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
        assert!((icc(&groups) - 0.17).abs() < 0.005, "{}", icc(&groups));
    }

    #[test]
    fn what_repeats_is_told_from_what_does_not() {
        let times: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
        // One movement repeats in every word, at a speed that depends on the word's length; the other does not depend on words.
        let labels: Vec<Label> = [(0.1, 0.5), (0.6, 1.0), (1.1, 1.7)]
            .into_iter()
            .map(|(from_s, to_s)| Label { tier: "word".into(), name: "pa".into(), from_s, to_s })
            .collect();
        let of = |t: f64| {
            let inside = labels.iter().find(|l| l.holds(t));
            let same = inside.map_or(0.0, |l| (6.3 * (t - l.from_s) / (l.to_s - l.from_s)).sin());
            vec![10.0 * same, (11.0 * t * t).sin()]
        };
        let courses: Vec<Vec<f64>> = times.iter().map(|t| of(*t)).collect();
        let recording = |labels| Repeatable { times: times.clone(), courses: courses.clone(), labels };
        let found = repeated(&[recording(&labels)], 2).unwrap();
        assert_eq!((found.tier.as_str(), found.labels[0].1), ("word", 3));
        assert!(
            found.muscles[0].icc > 0.98 && found.muscles[0].chance_95 < found.muscles[0].icc,
            "{found:?}"
        );
        assert!(found.muscles[1].icc < 0.5, "{found:?}");
        assert_eq!(repeated(&[recording(&labels[..1])], 2), None);
        // Labels longer than a recording, and recordings of one frame.
        let odd = [Label { to_s: 1e9, ..labels[0].clone() }, labels[1].clone()];
        repeated(&[recording(&odd)], 2);
        let (times, courses) = (times[..1].to_vec(), courses[..1].to_vec());
        repeated(&[Repeatable { times, courses, labels: &labels }], 2);
    }
}
