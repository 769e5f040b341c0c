//! Tensions over time are recovered from recordings of a simulated tongue, and recordings of other things are reported.

use std::sync::Arc;

use tongue_fit::acoustics::{Articulation, VocalTract};
use tongue_fit::adapt::{AdaptationInput, RestShapeMethod, followed_bones};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::inverse::MovableBone;
use tongue_fit::measured::recording::{AlignedRecording, FaultKind, remove_outliers};
use tongue_fit::parallel;
use tongue_fit::run::TrackRun;
use tongue_fit::system::Model;
use tongue_infer::posterior::Contrast;
use tongue_infer::track::{
    Comparison, ErrorModel, FrameStatus, Interval, LabelDraws, RestShape, TrackSettings, Tracked,
    TrackingContext, Watch, add_formants, compare, frames, is_untrusted, labels_to_compare, mark,
};
use tongue_input::measured::recording::Label;

use crate::synthetic::{Kind, Speaker};

fn speaker() -> Speaker {
    Speaker::of(Body::tongue(5.5e-3).unwrap())
}

/// Smooth tensions of eight muscles, N per metre of thickness.
fn course(time_s: f64) -> Vec<f64> {
    (0..8).map(|m| 8.0 + 6.0 * (7.0 * time_s + f64::from(m)).sin() + f64::from(m)).collect()
}

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.0125 * i as f64).collect()
}

fn recorded(speaker: &Speaker, count: usize, noise: f64) -> AlignedRecording {
    let times = times(count);
    let shapes: Vec<Vec<Point>> =
        times.iter().map(|t| speaker.shape(&course(*t), Point::zeros()).unwrap()).collect();
    speaker.record(&shapes, &times, Kind::Contour(11, noise), &mut fastrand::Rng::with_seed(7))
}

fn independent() -> TrackSettings {
    TrackSettings { errors: ErrorModel::INDEPENDENT, ..TrackSettings::new(20.0, 0.1) }
}

/// With the known body and independent errors.
fn tracked(speaker: &Speaker, recording: &AlignedRecording) -> Vec<Tracked> {
    tracked_with(speaker, recording, &[], &independent(), None)
}

fn tracked_with(
    speaker: &Speaker,
    recording: &AlignedRecording,
    freed: &[MovableBone<2>],
    settings: &TrackSettings,
    shape: Option<&RestShape>,
) -> Vec<Tracked> {
    let followed = &followed_bones(&speaker.body, &recording.bones);
    let ready = vec![frames(recording, &speaker.surface, followed, &[])];
    let context = TrackingContext { system: &speaker.system, followed, freed, shape };
    Watch::collect(|watch| context.smooth(ready, settings, watch)).unwrap().pop().unwrap().frames
}

/// The part of the intervals that contain the truth.
fn part_inside(found: &[Tracked]) -> f64 {
    let held = found
        .iter()
        .flat_map(|f| f.tensions.iter().zip(course(f.time_s)).map(|(level, truth)| level.holds(truth)));
    held.clone().filter(|held| *held).count() as f64 / held.count() as f64
}

#[test]
fn courses_are_found_again_as_far_as_a_contour_tells() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 24, 0.05e-3);
    let found = tracked(&speaker, &recording);
    for (t, frame) in found.iter().enumerate() {
        assert_eq!(frame.status, FrameStatus::Converged, "{t}");
        assert!(frame.rms_m.unwrap() < 0.1e-3, "{t}: {:?}", frame.rms_m);
        // GGa shapes the visible surface, so its tension is known well.
        let off = frame.tensions[0].median - course(frame.time_s)[0];
        assert!(off.abs() < 1.5, "{t}: {:?}", frame.tensions);
    }
    assert!(part_inside(&found) >= 0.9);
    // With less noise more directions are resolved.
    recording.frames.iter_mut().flat_map(|f| f.contour.iter_mut().flatten()).for_each(|m| m.sd = 2e-3);
    let vague = tracked(&speaker, &recording);
    let resolved = |all: &[Tracked]| all.iter().map(|f| f.resolved).sum::<usize>();
    assert!(resolved(&vague) < resolved(&found));
}

#[test]
fn contrasts_are_differences_of_means_in_the_same_draws_and_repetitions_do_not_narrow_them() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 12, 0.5e-3);
    let at = |name: &str, from: usize, to: usize| {
        let [from_s, to_s] = [from, to].map(|frame| 0.0125 * frame as f64);
        Label { tier: "part".into(), name: name.into(), from_s, to_s }
    };
    // Labels that occur twice are compared, but neither `x`, which is alone in its tier, nor `once`.
    for _ in 0..2 {
        recording.labels.extend([at("fourth", 3, 3), at("tenth", 9, 9), at("all", 0, 11)]);
    }
    recording.labels.extend([Label { tier: "one".into(), ..at("x", 0, 11) }, at("once", 2, 4)]);
    let compared = labels_to_compare(&[&recording]);
    assert_eq!(compared.iter().map(|c| c.label.as_str()).collect::<Vec<_>>(), ["fourth", "tenth", "all"]);
    let followed = followed_bones(&speaker.body, &recording.bones);
    let mut other = recording.clone();
    // A frame that cannot be of this tongue does not count.
    other.frames[6].contour.iter_mut().flatten().for_each(|m| m.at += Point::new(0.0, 0.03));
    let ready = |recording: &AlignedRecording| {
        let mut ready = frames(recording, &speaker.surface, &followed, &[]);
        mark(&mut ready, &recording.labels, &compared);
        ready
    };
    let settings = independent();
    let context = TrackingContext { system: &speaker.system, followed: &followed, freed: &[], shape: None };
    let all = vec![ready(&recording), ready(&other)];
    let found = Watch::collect(|watch| context.smooth(all, &settings, watch)).unwrap();
    let draws: Vec<&[LabelDraws]> = found.iter().map(|one| one.compared.as_slice()).collect();
    assert_eq!((draws[0][2].frames, draws[1][2].frames, draws[1][2].repetitions), (24, 22, 2));
    let names: Vec<String> = (0..8).map(|m| format!("m{m}")).collect();
    let of = |draws: &[&[LabelDraws]]| {
        compare(&compared, &names, &settings.link, draws.iter().copied()).pop().unwrap()
    };
    let near = |found: [f64; 3], direct: [f64; 3]| {
        assert!(found.iter().zip(&direct).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?} {direct:?}");
    };
    let contrast = |found: &Comparison, a: &str, b: &str, m: usize| {
        let is = |c: &&Contrast| (c.a.as_str(), c.b.as_str(), &c.muscle) == (a, b, &names[m]);
        let c = found.contrasts.iter().find(is).unwrap().clone();
        (c.probability_more, [c.interval_95[0], c.median, c.interval_95[1]])
    };
    let (first, both) = (of(&draws[..1]), of(&draws));
    for m in 0..8 {
        // The contrast of a frame with the whole recording is its course.
        let ends = |r: &Interval| [r.low, r.median, r.high];
        let tracked = &found[0].frames[3];
        near(contrast(&first, "fourth", "all", m).1, ends(&tracked.courses[m]));
        near(ends(&first.labels[0].tensions.0[m].1), ends(&tracked.tensions[m]));
        let draw = |of: &[LabelDraws], label: usize, d: usize| {
            of[label].means[m] + f64::from(of[label].deviations[m][d])
        };
        let difference = |of: &[LabelDraws], d: usize| draw(of, 0, d) - draw(of, 1, d);
        let (p, interval) = contrast(&first, "fourth", "tenth", m);
        let own: Vec<f64> = (0..settings.draws).map(|d| difference(draws[0], d)).collect();
        near(interval, ends(&Interval::of(own.iter().copied())));
        assert!((p - own.iter().filter(|d| **d > 0.0).count() as f64 / 1000.0).abs() < 1e-9, "{p}");
        // The mean over two recordings is that of their frames, and as uncertain as that over one of them.
        let single = draws.iter().map(|of| (0..settings.draws).map(|d| difference(of, d)));
        let single: Vec<Interval> = single.map(Interval::of).collect();
        let [low, median, high] = contrast(&both, "fourth", "tenth", m).1;
        let width = 0.5 * (single[0].width() + single[1].width());
        assert!(((high - low) / width - 1.0).abs() < 0.15, "{} {width}", high - low);
        let middle = 0.5 * (single[0].median + single[1].median);
        assert!((median - middle).abs() < 0.1 * width, "{median} {single:?}");
    }
    assert_eq!(both.contrasts[0].repetitions, Some([4, 4]));
}

#[test]
fn formants_of_frames_are_as_far_from_the_true_ones_as_their_draws_spread() {
    let speaker = speaker();
    let recording = recorded(&speaker, 40, 0.5e-3);
    let followed = &followed_bones(&speaker.body, &recording.bones);
    let mut ready = frames(&recording, &speaker.surface, followed, &[]);
    let airway = Arc::new(VocalTract::round(&speaker.body, VocalTract::reference().unwrap()).unwrap());
    add_formants(&mut ready, &airway, followed, &Articulation::default(), 2);
    let settings = independent();
    let context = TrackingContext { system: &speaker.system, followed, freed: &[], shape: None };
    let found =
        Watch::collect(|watch| context.smooth(vec![ready], &settings, watch)).unwrap().pop().unwrap().frames;
    let mut squares = [Vec::new(), Vec::new()];
    for frame in &found {
        let shape = speaker.shape(&course(frame.time_s), Point::zeros()).unwrap();
        let Ok(truth) = airway.sound(&shape, &Articulation::default()) else { continue };
        for (i, formant) in frame.formants.iter().enumerate() {
            assert!(formant.sd_hz > 1.0 && formant.sd_hz < 0.3 * formant.hz, "{formant:?}");
            squares[i].push(((formant.hz - truth.formants[i].frequency_hz) / formant.sd_hz).powi(2));
        }
    }
    for all in squares {
        let ratio = (all.iter().sum::<f64>() / all.len() as f64).sqrt();
        assert!(all.len() > 20 && (0.5..1.6).contains(&ratio), "{ratio} of {}", all.len());
    }
}

/// tests/slow/tracked_intervals_cover_the_truth.rs tests its intervals, and those of tensions with it.
#[test]
fn a_bone_that_was_not_seen_is_found_where_it_is() {
    let speaker = speaker();
    let (times, hyoid) = (times(6), Point::new(3e-3, -4e-3));
    let shapes: Vec<_> = times.iter().map(|t| speaker.shape(&course(*t), hyoid).unwrap()).collect();
    let kind = Kind::Contour(31, 0.05e-3);
    let mut recording = speaker.record(&shapes, &times, kind, &mut fastrand::Rng::with_seed(7));
    recording.frames.iter_mut().for_each(|f| f.bones[0] = None);
    let freed = [MovableBone::of(&speaker.body, &Model::default(), &Vec::from_iter(0..8), "hyoid").unwrap()];
    let [found, held] =
        [&freed[..], &[]].map(|bones| tracked_with(&speaker, &recording, bones, &independent(), None));
    for (frame, held) in found.iter().zip(&held) {
        assert_eq!(frame.status, FrameStatus::Converged);
        assert!(
            (Point::from(frame.bones[0].shift_m) - hyoid).norm() < 0.7e-3 && held.bones.is_empty(),
            "{:?}",
            frame.bones
        );
        assert!(frame.rms_m.unwrap() < 0.2 * held.rms_m.unwrap(), "{:?} {:?}", frame.rms_m, held.rms_m);
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let speaker = speaker();
    let recording = recorded(&speaker, 70, 0.9e-3);
    let all: Vec<usize> = (0..8).collect();
    let shape = RestShape::of(&speaker.body, &Model::default(), &all, |_| None).unwrap();
    let bits = |threads: usize, seed: u64| {
        let settings = TrackSettings { seed, ..TrackSettings::new(20.0, 0.1) };
        let work = || tracked_with(&speaker, &recording, &[], &settings, Some(&shape));
        let found = parallel::with_threads(threads, work).unwrap();
        let numbers = |r: &Interval| [r.low, r.median, r.high];
        let both = |f: &Tracked| f.tensions.iter().chain(&f.courses).flat_map(numbers).collect::<Vec<_>>();
        found.iter().flat_map(both).map(f64::to_bits).collect::<Vec<_>>()
    };
    let one = bits(1, 0);
    assert!(one == bits(2, 0) && one == bits(5, 0));
    assert!(one != bits(2, 1), "another seed makes other draws");
}

#[test]
fn a_frame_without_data_is_a_gap_with_wide_intervals() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 9, 0.5e-3);
    recording.frames[4].contour.iter_mut().for_each(|m| *m = None);
    let found = tracked(&speaker, &recording);
    assert_eq!(found[4].status, FrameStatus::Gap);
    assert_eq!(found[4].rms_m, None);
    let width = |t: usize| found[t].tensions.iter().map(Interval::width).sum::<f64>();
    assert!(width(4) > width(3) && width(4) > width(5));
    assert!(found.iter().enumerate().all(|(t, f)| t == 4 || f.status == FrameStatus::Converged));
    // Without data the answer is the prior, and the status says so.
    recording.frames.iter_mut().flat_map(|f| &mut f.contour).for_each(|m| *m = None);
    let nothing = tracked(&speaker, &recording);
    assert!(nothing.iter().all(|f| f.status == FrameStatus::Gap && f.resolved == 0));
    assert!((nothing[0].tensions[0].median - 13.5).abs() < 0.5, "the median of the prior of scale 20");
    assert!((nothing[0].tensions[0].width() - 52.7).abs() < 4.0, "{:?}", nothing[0].tensions[0]);
}

#[test]
fn what_cannot_be_reached_is_told_and_not_fitted() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 9, 0.5e-3);
    // In one frame the whole contour jumps away; in another one point is 8 mm off, which is too little for a jump.
    recording.frames[3].contour.iter_mut().flatten().for_each(|m| m.at += Point::new(0.0, 0.03));
    let point = recording.frames[6].contour[5].as_mut().unwrap();
    point.at += Point::new(0.0, 8e-3);
    let faults = remove_outliers(&mut recording, None);
    assert_eq!(faults[3][0].kind, FaultKind::Jumped);
    assert_eq!(faults[3][0].points.len(), 11);
    let found = tracked(&speaker, &recording);
    assert_eq!(found[3].status, FrameStatus::Gap);
    assert_eq!(found[6].faults[0].kind, FaultKind::FarFromFit);
    assert_eq!(found[6].faults[0].points, ["tongue_5"]);
    let truth = course(found[6].time_s);
    assert!((found[6].tensions[0].median - truth[0]).abs() < 6.0);
    // The recording is of another head, so that every frame is out of reach.
    let mut other = recorded(&speaker, 3, 0.5e-3);
    other.frames.iter_mut().flat_map(|f| f.contour.iter_mut().flatten()).for_each(|m| m.at *= 1.6);
    assert!(tracked(&speaker, &other).iter().all(|f| f.status != FrameStatus::Converged));
}

#[test]
fn a_frame_beyond_three_standard_deviations_of_its_points_is_not_converged() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 9, 0.02e-3);
    recording.frames.iter_mut().flat_map(|f| f.contour.iter_mut().flatten()).for_each(|m| m.sd = 0.2e-3);
    // In one frame the points are by turns 0.75 mm outside and inside of the surface, which no tongue can do.
    let contour = &mut recording.frames[4].contour;
    let centre = contour.iter().flatten().map(|m| m.at).sum::<Point>() / contour.len() as f64;
    for (i, mark) in contour.iter_mut().flatten().enumerate() {
        let out = (mark.at - centre).normalize();
        mark.at += out * if i % 2 == 0 { 0.75e-3 } else { -0.75e-3 };
    }
    // The errors of a body of unknown shape are larger, but do not explain those of the points.
    let found = tracked_with(&speaker, &recording, &[], &TrackSettings::new(20.0, 0.1), None);
    assert_eq!(found[4].status, FrameStatus::PoorFit, "{:?}", found[4].rms_sd);
    assert!(found[4].rms_sd.unwrap() > 3.0 && found[4].faults.is_empty(), "{:?}", found[4].rms_sd);
    for (t, frame) in found.iter().enumerate().filter(|(t, _)| *t != 4) {
        assert!(frame.status.is_trusted() && frame.rms_sd.unwrap() < 3.0, "{t}: {:?}", frame.status);
    }
}

#[test]
fn a_recording_with_more_than_one_untrusted_frame_in_twenty_is_untrusted() {
    let speaker = speaker();
    let one = tracked(&speaker, &recorded(&speaker, 1, 0.1e-3)).pop().unwrap();
    let untrusted = |bad: usize, status: FrameStatus| {
        let frame = |t| if t < bad { Tracked { status, ..one.clone() } } else { one.clone() };
        is_untrusted(&(0..45).map(frame).collect::<Vec<_>>())
    };
    use FrameStatus::{AtBound, Converged, Gap, NotReached, OutOfReach, PoorFit, Unresolved};
    for status in [PoorFit, NotReached, OutOfReach, AtBound] {
        assert!(!untrusted(2, status) && untrusted(3, status), "{status:?}");
    }
    assert!([Converged, Unresolved, Gap].iter().all(|status| !untrusted(45, *status)));
}

#[test]
fn a_recording_of_several_windows_has_the_course_of_a_short_one_and_no_seams() {
    let speaker = speaker();
    let count = 540;
    let recording = recorded(&speaker, count, 0.3e-3);
    let settings = TrackSettings {
        errors: ErrorModel::INDEPENDENT,
        draws: 100,
        reachability: false,
        shapes: 11,
        ..TrackSettings::new(20.0, 0.1)
    };
    let found = tracked_with(&speaker, &recording, &[], &settings, None);
    assert_eq!(found.iter().filter(|f| !f.positions.is_empty()).count(), 11);
    // The widths do not show the border between the windows of 512 frames.
    let widths: Vec<f64> = found.iter().map(|f| f.tensions.iter().map(Interval::width).sum()).collect();
    let beside = widths[500..524].iter().sum::<f64>() / 24.0;
    for width in &widths[510..514] {
        assert!((width / beside - 1.0).abs() < 0.25, "{width} {beside}");
    }
    assert!(part_inside(&found) >= 0.9);
    // A course is a tension less its mean in the same draw.
    let mean: f64 = found.iter().map(|f| f.courses[0].median).sum::<f64>() / count as f64;
    assert!(mean.abs() < 0.3, "{mean}");
}

#[test]
fn bones_are_displaced_to_where_they_are_seen() {
    let speaker = speaker();
    let mut recording = recorded(&speaker, 4, 1e-6);
    // Everything is shifted with the head. With bones that follow, the tongue is the same but for the styloid process, which is far away.
    let by = Point::new(0.4e-3, -0.3e-3);
    for frame in &mut recording.frames {
        frame.contour.iter_mut().flatten().for_each(|m| m.at += by);
        frame.bones.iter_mut().flatten().for_each(|p| *p += by);
        frame.contour.iter_mut().flatten().for_each(|m| m.sd = 0.3e-3);
    }
    let with = tracked(&speaker, &recording);
    recording.frames.iter_mut().for_each(|f| f.bones = vec![None, None]);
    let without = tracked(&speaker, &recording);
    let rms = |all: &[Tracked]| all.iter().map(|f| f.rms_m.unwrap()).fold(0.0, f64::max);
    assert!(rms(&with) < 0.5 * rms(&without), "{} {}", rms(&with), rms(&without));
}

#[test]
fn sensors_are_material_points() {
    let speaker = speaker();
    let times = times(6);
    let shapes: Vec<Vec<Point>> =
        times.iter().map(|t| speaker.shape(&course(*t), Point::zeros()).unwrap()).collect();
    let recording =
        speaker.record(&shapes, &times, Kind::Sensors(3, 0.05e-3), &mut fastrand::Rng::with_seed(9));
    let found = tracked(&speaker, &recording);
    assert!(found.iter().all(|f| f.status == FrameStatus::Converged && f.rms_m.unwrap() < 0.15e-3));
    // Three coils leave most directions of the eight tensions to the prior.
    assert!(
        found.iter().all(|f| f.resolved < 8),
        "{:?}",
        found.iter().map(|f| f.resolved).collect::<Vec<_>>()
    );
}

#[test]
fn a_run_from_options_places_the_body_and_meets_the_contours() {
    let speaker = speaker();
    // Everything is turned, enlarged and shifted.
    let mut recording = recorded(&speaker, 8, 0.3e-3);
    let to = |p: Point| Point::new(p.x - 0.1 * p.y, p.y + 0.1 * p.x) * 1.08 + Point::new(4e-3, -7e-3);
    for frame in &mut recording.frames {
        frame.contour.iter_mut().flatten().for_each(|m| m.at = to(m.at));
        frame.bones.iter_mut().flatten().for_each(|p| *p = to(*p));
    }
    let basis = AdaptationInput {
        body: &speaker.body,
        anatomy: None,
        model: Model::default(),
        contracting: (0..speaker.body.mesh.muscles.len()).collect(),
        settings: TrackSettings { draws: 200, ..TrackSettings::new(20.0, 0.1) },
        palate: None,
    };
    let run = TrackRun {
        basis,
        adaptation: None,
        is_given: false,
        rest: RestShapeMethod::Similarity,
        free_bones: &[],
        hide: &[],
    };
    let placed = run.body(&[&recording], &|_, _| ()).unwrap().similarity.unwrap();
    assert!((placed.scale() / 1.085 - 1.0).abs() < 0.03, "{placed:?}");
    let found = run.run(&[&recording], &|note| panic!("{note}")).unwrap();
    assert_eq!(found.len(), 1);
    for frame in &found[0].frames {
        assert_eq!(frame.status, FrameStatus::Converged);
        assert!(frame.rms_m.unwrap() < 0.6e-3, "{:?}", frame.rms_m);
    }
    let twice = ["hyoid".to_owned(), "hyoid".to_owned()];
    let message = TrackRun { free_bones: &twice, ..run }.run(&[&recording], &|_| ()).unwrap_err().to_string();
    assert!(message.starts_with("hyoid: it is seen in every recording"), "{message}");
}
