//! Three to five coils on tongues of other shapes, sizes and directions place the built-in tongue. The intervals of the placement contain
//! the true one, and those of the tensions include its uncertainty.

use tongue_core::observe::TongueSurface;
use tongue_fit::adapt::{AdaptationInput, RestShapeMethod};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::AlignedRecording;
use tongue_fit::parallel;
use tongue_fit::statistics::median;
use tongue_fit::system::{Model, System};
use tongue_infer::adapt::{Placement, RestError};
use tongue_infer::track::{RestShape, TrackSettings, TrackedRecording, TrackingContext, Watch, frames};

use crate::cases;
use crate::speakers::{Recorded, Seeing, Tones, recorded, recorded_with};
use crate::tracked_intervals_cover_the_truth::Held;

pub fn adaptation_input<'a>(body: &'a Body<2>, palate: Option<&'a [Point]>) -> AdaptationInput<'a> {
    let settings = TrackSettings::new(20.0, 0.1);
    AdaptationInput {
        body,
        anatomy: None,
        model: Model::default(),
        contracting: (0..8).collect(),
        settings,
        palate,
    }
}

/// Place of the middle along both axes, m, turn and scale: the truth, and the estimate with its interval.
fn compared(speaker: &Recorded, placement: &Placement, middle: Point) -> [(f64, [f64; 3]); 4] {
    let at = speaker.placed.place(middle);
    let truth = [at.x, at.y, speaker.placed.angle(), speaker.placed.scale()];
    std::array::from_fn(|i| (truth[i], placement.intervals()[i]))
}

#[test]
#[allow(clippy::print_stdout, reason = "for --nocapture")]
fn placements_of_coils_hold_where_the_tongue_is() {
    let body = Body::tongue(5.5e-3).unwrap();
    let outline = body.mesh.surface_nodes();
    let middle = outline.iter().map(|&n| body.mesh.nodes[n]).sum::<Point>() / outline.len() as f64;
    let seeds: Vec<u64> = (0..cases(200) as u64).collect();
    let all = parallel::map(&seeds, |&seed| {
        let speaker = recorded(seed + 5000, Seeing::Coils(3 + seed as usize % 2, 10));
        let recordings: Vec<&AlignedRecording> = speaker.recordings.iter().collect();
        [None, Some(speaker.palate.as_slice())].map(|palate| {
            let placed = adaptation_input(&body, palate).place(&recordings, &[]).unwrap();
            compared(&speaker, &placed.by_coils.unwrap(), middle)
        })
    });
    for (with, name) in ["coils alone", "coils and a palate"].iter().enumerate() {
        for (i, what) in ["back", "up", "turn", "scale"].iter().enumerate() {
            let of = || all.iter().map(|a| a[with][i]);
            let held = of().filter(|(truth, [_, low, high])| low <= truth && truth <= high).count();
            let width = median(of().map(|(_, [_, low, high])| 0.5 * (high - low))).unwrap();
            let missed = median(of().map(|(truth, [found, ..])| (found - truth).abs())).unwrap();
            let part = 100.0 * held as f64 / seeds.len() as f64;
            println!(
                "{name}, {what}: {part:.1} % held, half width {width:.4}, missed by {missed:.4} (medians)"
            );
        }
    }
    // The limits are 93 to 98 % with a standard deviation of 1.8 % for 200 speakers. By coils alone the interval of the shift is too wide,
    // because the mean postures of these speakers differ from rest by less than 5 mm.
    for with in 0..2 {
        for i in 0..4 {
            let held = all.iter().map(|a| a[with][i]).filter(|(t, [_, low, high])| low <= t && t <= high);
            let part = held.count() as f64 / seeds.len() as f64;
            let most = if with == 0 && i < 2 { 1.0 } else { 0.985 };
            assert!((0.92..=most).contains(&part), "{with} {i}: {part}");
        }
    }
    let missed = |i: usize| median(all.iter().map(|a| (a[1][i].1[0] - a[1][i].0).abs())).unwrap();
    let far = median(all.iter().map(|a| {
        let away = |i: usize| a[1][i].1[0] - a[1][i].0;
        away(0).hypot(away(1))
    }));
    println!("with a palate the middle is {:.4} m off (median)", far.unwrap());
    // Along each axis, m.
    assert!(missed(0) <= 3e-3 && missed(1) <= 3e-3, "{} {}", missed(0), missed(1));
    assert!(missed(2) <= 6f64.to_radians(), "{}", missed(2));
}

#[test]
#[allow(clippy::print_stdout, reason = "for --nocapture")]
fn a_palate_brings_the_placement_by_a_contour_nearer() {
    let body = Body::tongue(5.5e-3).unwrap();
    let outline: Vec<Point> = body.mesh.surface_nodes().iter().map(|&n| body.mesh.nodes[n]).collect();
    let seeds: Vec<u64> = (0..cases(60) as u64).collect();
    // A recording is refused where a bone is more than 10 mm from its place in a tongue with this contour.
    let all = parallel::map(&seeds, |&seed| {
        let speaker = recorded(seed, Seeing::Contour);
        let recordings: Vec<&AlignedRecording> = speaker.recordings.iter().collect();
        [None, Some(speaker.palate.as_slice())].map(|palate| {
            let found = match adaptation_input(&body, palate).place(&recordings, &[]) {
                Ok(placed) => placed.similarity,
                Err(RestError::NotOneFrame(_)) => return None,
                Err(other) => panic!("{other}"),
            };
            let squares = outline.iter().map(|p| (found.place(*p) - speaker.placed.place(*p)).norm_squared());
            Some((squares.sum::<f64>() / outline.len() as f64).sqrt())
        })
    });
    let placed: Vec<[f64; 2]> = all.iter().filter_map(|[a, b]| Some([(*a)?, (*b)?])).collect();
    println!("{} of {} speakers placed", placed.len(), all.len());
    // These bodies differ more than people do; no real recording in the right frame is refused for its bones.
    assert!(placed.len() * 4 >= all.len() * 3, "{} of {}", placed.len(), all.len());
    let [without, with] = [0, 1].map(|i| median(placed.iter().map(|a| a[i])).unwrap());
    println!("outline off by {without:.5} m without a palate, {with:.5} m with one (medians)");
    assert!(with < 0.9 * without, "{with} {without}");
}

/// Tracks a speaker by coils on the built-in tongue, as `tongue-fit track` does.
fn tracked(speaker: &Recorded) -> Vec<TrackedRecording> {
    let body = Body::tongue(5.5e-3).unwrap();
    let recordings: Vec<&AlignedRecording> = speaker.recordings.iter().collect();
    let made = adaptation_input(&body, None)
        .adapt_to_recordings(&recordings, RestShapeMethod::Similarity, &[], &|_, _| {})
        .unwrap();
    let placement = made.placement.unwrap();
    let contracting: Vec<usize> = (0..8).collect();
    let system = System::new(&made.body.mesh, &Model::default(), &contracting).unwrap();
    let shape = RestShape::of_coils(&made.body, &Model::default(), &contracting, &placement).unwrap();
    let surface = TongueSurface::of(&made.body).unwrap();
    let seated = speaker.recordings.iter().map(|s| placement.with_coil_positions(s));
    let ready = seated.map(|s| frames(&s, &surface, &made.followed, &[])).collect();
    let context =
        TrackingContext { system: &system, followed: &made.followed, freed: &[], shape: Some(&shape) };
    let settings = TrackSettings { reachability: false, ..TrackSettings::new(20.0, 0.1) };
    Watch::collect(|watch| context.smooth(ready, &settings, watch)).unwrap()
}

#[test]
#[allow(clippy::print_stdout, reason = "for --nocapture")]
fn intervals_of_speakers_seen_by_coils_hold_the_truth() {
    let seeds: Vec<u64> = (0..cases(20) as u64).collect();
    let all = parallel::map(&seeds, |&seed| {
        let speaker =
            recorded_with(seed + 7000, Seeing::Coils(3 + seed as usize % 2, 1), Tones::HalfNormal(20.0));
        let found = tracked(&speaker);
        let met: Vec<f64> = found.iter().flat_map(|r| &r.frames).filter_map(|f| f.rms_m).collect();
        let mut held = Held::default();
        held.add(&speaker, found);
        (speaker.what, held, median(met).unwrap_or(f64::NAN))
    });
    let mut sum = Held::default();
    for (what, held, met) in &all {
        println!("{what}: {}; met to {:.2} mm", held.summary(), met * 1e3);
        sum.extend(held);
    }
    println!("all: {}", sum.summary());
    assert!((93.0..=98.0).contains(&sum.levels()), "{}", sum.summary());
    assert!((93.0..=99.5).contains(&sum.courses()), "{}", sum.summary());
}

#[test]
fn recordings_of_synthetic_speakers_raise_no_doubt() {
    let all = (0..40).flat_map(|seed| {
        [Seeing::Contour, Seeing::Coils(3, 1), Seeing::Coils(4, 1)].map(|seeing| (seed, seeing))
    });
    let doubted: Vec<_> = all.map(|(seed, seeing)| (seed, seeing, recorded(seed, seeing).doubts())).collect();
    let doubted: Vec<_> = doubted.iter().filter(|(.., doubts)| !doubts.is_empty()).collect();
    assert!(doubted.is_empty(), "{doubted:#?}");
}
