//! Mean tensions over all frames with a label, and differences between labels, from the same draws of tensions and courses.
//!
//! Recordings of one session share the draws of levels and shape at rest, so their errors cancel from a difference; those of different
//! sessions do not.

use serde::Serialize;
use tongue_core::random::seed_of;
use tongue_input::measured::ByMuscle;
use tongue_input::measured::recording::{AlignedRecording, Label};

use super::draws::Means;
use super::frame::Frame;
use super::interval::Interval;
use super::ornstein_uhlenbeck::Softplus;
use super::results::LabelDraws;
use super::segments::{CourseSummary, distinguishing, summaries};
use crate::posterior::Contrast;

/// Largest number of repeated labels of a tier that is compared.
const MOST_LABELS: usize = 60;
/// Largest number of draws by which labels are compared.
const MOST_DRAWS: usize = 2000;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Compared {
    pub tier: String,
    pub label: String,
}

/// The labels that are compared, of tiers in which at least two and at most 60 labels repeat.
pub fn labels_to_compare(recordings: &[&AlignedRecording]) -> Vec<Compared> {
    let times = recordings.iter().map(|recording| recording.frames.iter().map(|f| f.time_s).collect());
    let labelled: Vec<(Vec<f64>, &[Label])> =
        times.zip(recordings).map(|(times, recording)| (times, recording.labels.as_slice())).collect();
    let tiers = distinguishing(&labelled, 1).into_iter().filter(|groups| groups.len() <= MOST_LABELS);
    Vec::from_iter(tiers.flatten().map(|repetitions| {
        let (_, label) = repetitions[0];
        Compared { tier: label.tier.clone(), label: label.name.clone() }
    }))
}

/// Sets [`Frame::compared`]; `labels` are those of the recording.
pub fn mark(frames: &mut [Frame], labels: &[Label], compared: &[Compared]) {
    let numbers: Vec<Option<usize>> =
        labels.iter().map(|l| compared.iter().position(|c| c.tier == l.tier && c.label == l.name)).collect();
    for frame in frames {
        let known = frame.labels.iter().filter_map(|&l| Some((l, numbers.get(l).copied().flatten()?)));
        frame.compared = known.collect();
    }
}

impl LabelDraws {
    /// One repetition, from draws of the means over its frames.
    pub(super) fn of(compared: usize, frames: usize, draws: &Means) -> Self {
        let kept = draws.0.iter().map(|all| &all[..all.len().min(MOST_DRAWS)]);
        let means = kept.clone().map(|all| all.iter().sum::<f64>() / all.len().max(1) as f64);
        let means: Vec<f64> = means.collect();
        let deviations = kept.zip(&means).map(|(all, mean)| all.iter().map(|d| (d - mean) as f32).collect());
        Self { compared, repetitions: 1, frames, deviations: deviations.collect(), means }
    }

    /// Adds other repetitions; each draw becomes that of one of all repetitions at random.
    pub(super) fn add(&mut self, other: &Self) {
        let part = other.frames as f64 / (self.frames + other.frames) as f64;
        self.means.iter_mut().zip(&other.means).for_each(|(a, b)| *a += part * (b - *a));
        let mut random = fastrand::Rng::with_seed(seed_of(self.compared as u64, self.repetitions));
        self.repetitions += other.repetitions;
        self.frames += other.frames;
        for draw in 0..self.deviations.first().map_or(0, Vec::len) {
            if random.usize(..self.repetitions) < other.repetitions {
                let pairs = self.deviations.iter_mut().zip(&other.deviations);
                pairs.for_each(|(own, other)| own[draw] = other[draw]);
            }
        }
    }

    fn mean(&self, muscle: usize) -> impl Iterator<Item = f64> {
        self.deviations[muscle].iter().map(move |by| self.means[muscle] + f64::from(*by))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelTension {
    pub label: String,
    pub repetitions: usize,
    pub frames: usize,
    /// N per metre of thickness.
    pub tensions: ByMuscle<Interval>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    pub tier: String,
    pub labels: Vec<LabelTension>,
    /// Summaries of the mean tensions over labels; courses are relative to the mean over labels.
    pub muscles: Vec<CourseSummary>,
    /// Differences of every muscle between every two labels.
    pub contrasts: Vec<Contrast>,
}

impl Comparison {
    /// Contrasts that are sure or probable, in this order, and large ones first.
    pub fn decided(&self) -> Vec<&Contrast> {
        let mut out: Vec<&Contrast> = self.contrasts.iter().filter(|c| c.sentence().is_some()).collect();
        out.sort_by(|a, b| {
            b.is_decided().cmp(&a.is_decided()).then(b.median.abs().total_cmp(&a.median.abs()))
        });
        out
    }

    /// The repetitions of each label, and the number of differences that are sure or probable.
    pub fn sentence(&self) -> String {
        let labels: Vec<String> =
            self.labels.iter().map(|l| format!("{} {}", l.label, l.repetitions)).collect();
        format!(
            "differences between labels of {} (repetitions: {}): {} of {} are sure or probable",
            self.tier,
            labels.join(", "),
            self.decided().len(),
            self.contrasts.len()
        )
    }
}

/// Compares labels of the same tier by the draws of all recordings. Labels with fewer than two tracked repetitions are left out, then tiers
/// with fewer than two labels.
pub fn compare<'a>(
    compared: &[Compared],
    names: &[String],
    link: &Softplus,
    recordings: impl IntoIterator<Item = &'a [LabelDraws]>,
) -> Vec<Comparison> {
    let mut labels: Vec<Option<LabelDraws>> = vec![None; compared.len()];
    for draws in recordings.into_iter().flatten() {
        match labels.get_mut(draws.compared) {
            Some(Some(all)) => all.add(draws),
            Some(none) => *none = Some(draws.clone()),
            None => {}
        }
    }
    let with_draws = compared.iter().zip(labels).filter_map(|(label, draws)| Some((label, draws?)));
    let all: Vec<(&Compared, LabelDraws)> = with_draws.filter(|(_, draws)| draws.repetitions > 1).collect();
    let tiers = all.chunk_by(|(a, _), (b, _)| a.tier == b.tier).filter(|tier| tier.len() > 1);
    tiers.map(|tier| comparison(tier, names, link)).collect()
}

fn comparison(tier: &[(&Compared, LabelDraws)], names: &[String], link: &Softplus) -> Comparison {
    let muscles = 0..names.len();
    let tensions: Vec<Vec<Interval>> = Vec::from_iter(
        tier.iter()
            .map(|(_, label)| muscles.clone().map(|m| Interval::of(label.mean(m)).or_slack(link)).collect()),
    );
    let means: Vec<Vec<f64>> = Vec::from_iter(muscles.clone().map(|m| {
        let mut sums: Vec<f64> = Vec::new();
        for (_, label) in tier {
            sums.resize(label.mean(m).count(), 0.0);
            sums.iter_mut().zip(label.mean(m)).for_each(|(sum, mean)| *sum += mean / tier.len() as f64);
        }
        sums
    }));
    let courses: Vec<Vec<Interval>> = Vec::from_iter(tier.iter().map(|(_, label)| {
        let own = muscles.clone().map(|m| label.mean(m).zip(&means[m]).map(|(own, mean)| own - mean));
        own.map(Interval::of).collect()
    }));
    let each: Vec<_> = tensions.iter().map(Vec::as_slice).zip(courses.iter().map(Vec::as_slice)).collect();
    let summarised = summaries(names, &each, link);
    let pairs = (0..tier.len()).flat_map(|a| (a + 1..tier.len()).map(move |b| [&tier[a], &tier[b]]));
    let contrast = |[a, b]: [&(&Compared, LabelDraws); 2], m: usize| {
        let labels = [a, b].map(|(compared, _)| compared.label.as_str());
        let draws: Vec<f64> = a.1.mean(m).zip(b.1.mean(m)).map(|(a, b)| a - b).collect();
        let repetitions = Some([a, b].map(|(_, label)| label.repetitions));
        Contrast { repetitions, ..Contrast::of(&names[m], labels, &draws) }
    };
    let contrasts = pairs.flat_map(|pair| muscles.clone().map(move |m| contrast(pair, m))).collect();
    let labels = tier.iter().zip(tensions).map(|((compared, label), tensions)| LabelTension {
        label: compared.label.clone(),
        repetitions: label.repetitions,
        frames: label.frames,
        tensions: ByMuscle::new(names, tensions),
    });
    let tier = tier[0].0.tier.clone();
    Comparison { tier, labels: labels.collect(), muscles: summarised, contrasts }
}
