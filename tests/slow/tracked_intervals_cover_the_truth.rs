//! Recordings are simulated at tensions drawn from the prior that the intervals stand under; 95 % of the
//! intervals hold the truth, whatever is recorded.

use nalgebra::DVector;
use tongue_fit::adapt::followed;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::inverse::FreedBone;
use tongue_fit::parallel;
use tongue_fit::system::Model;
use tongue_fit::track::{Prior, Settings, frames, track};
use tongue_infer::inverse::BONE_SD_M;

use crate::cases;
use crate::synthetic::{Kind, Speaker, drawn, drawn_scores};

/// Frames of a recording, 12.5 ms apart.
const FRAMES: usize = 5;

/// What became of intervals.
#[derive(Default)]
struct Counts {
    all: usize,
    /// Truths below and above their intervals.
    missed: [usize; 2],
    resolved: usize,
}

impl Counts {
    fn covered(&self) -> f64 {
        1.0 - (self.missed[0] + self.missed[1]) as f64 / self.all as f64
    }
}

/// `unseen`: the hyoid moves about its place and is not seen.
fn counted(speaker: &Speaker, kind: Kind, unseen: bool, recordings: usize) -> Counts {
    let all: Vec<usize> = (0..8).collect();
    let freed = FreedBone::of(&speaker.body, &Model::default(), &all, "hyoid").unwrap();
    let freed = if unseen { std::slice::from_ref(&freed) } else { &[] };
    let prior = Prior::half_normal(8, 20.0, 0.1);
    let bones = followed(&speaker.body, &["hyoid".to_owned(), "mental_spine".to_owned()]);
    let times: Vec<f64> = (0..FRAMES).map(|i| 0.0125 * i as f64).collect();
    let seeds: Vec<u64> = (0..recordings as u64).collect();
    let one = |seed: &u64| {
        let mut rng = fastrand::Rng::with_seed(1000 + seed);
        // Tensions without an equilibrium nobody can record.
        let (truth, shapes) = loop {
            let truth = drawn(&prior, &times, &mut rng);
            let hyoid = match unseen {
                true => drawn_scores(2, prior.memory_s, &times, &mut rng),
                false => vec![DVector::zeros(2); FRAMES],
            };
            let shape =
                |(t, h): (&Vec<f64>, &DVector<f64>)| speaker.shape(t, Point::new(h[0], h[1]) * BONE_SD_M);
            let shapes: Option<Vec<_>> = truth.iter().zip(&hyoid).map(shape).collect();
            if let Some(shapes) = shapes {
                break (truth, shapes);
            }
        };
        let mut seen = speaker.seen(&shapes, &times, kind, &mut rng);
        if unseen {
            seen.frames.iter_mut().for_each(|f| f.bones[0] = None);
        }
        let settings = Settings::new(prior.clone());
        let ready = frames(&seen, &speaker.surface, &bones, &[]);
        let found = track(&speaker.system, &bones, freed, ready, &settings, &|_, _| {});
        let mut counts = Counts::default();
        for (frame, truth) in found.iter().zip(&truth) {
            counts.all += truth.len();
            counts.missed[0] += truth.iter().zip(&frame.low_n).filter(|(t, low)| t < low).count();
            counts.missed[1] += truth.iter().zip(&frame.high_n).filter(|(t, high)| t > high).count();
            counts.resolved += frame.resolved;
        }
        counts
    };
    parallel::map(&seeds, one).into_iter().fold(Counts::default(), |sum, c| Counts {
        all: sum.all + c.all,
        missed: [sum.missed[0] + c.missed[0], sum.missed[1] + c.missed[1]],
        resolved: sum.resolved + c.resolved,
    })
}

#[test]
#[allow(clippy::print_stdout, reason = "for --nocapture")]
fn intervals_of_contours_and_sensors_hold_the_truth_in_95_of_100_cases() {
    let speaker = Speaker::of(Body::tongue(5.5e-3).unwrap());
    let kinds = [
        ("3 coils at 0.5 mm", Kind::Sensors(3, 0.5e-3), false),
        ("11 keypoints at 0.93 mm", Kind::Contour(11, 0.93e-3), false),
        ("31 points at 0.5 mm", Kind::Contour(31, 0.5e-3), false),
        ("3 coils at 0.5 mm, hyoid not seen", Kind::Sensors(3, 0.5e-3), true),
        ("31 points at 0.5 mm, hyoid not seen", Kind::Contour(31, 0.5e-3), true),
    ];
    let recordings = cases(200);
    let mut told = Vec::new();
    let mut good = true;
    for (name, kind, unseen) in kinds {
        let counts = counted(&speaker, kind, unseen, recordings);
        let (part, frames) = (counts.covered(), recordings as f64 * FRAMES as f64);
        let resolved = counts.resolved as f64 / frames;
        told.push(format!(
            "{name}: {:.1} %, {resolved:.1} directions, {:?} below and above",
            100.0 * part,
            counts.missed
        ));
        good &= (0.93..=0.97).contains(&part);
    }
    println!("{told:#?}");
    assert!(good, "{told:?}");
}
