//! Implausible recordings are reported with their cause, and good recordings raise no doubt.

use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::{
    AlignedRecording, FaultKind, Format, Recording, Severity, check_plausibility, other_size, remove_outliers,
};

use tongue_input::measured::recording::Label;

use crate::recordings_are_read::{aligned, aligned_recording, read};

use Severity::{Note, Refused, Untrusted};
use std::f64::consts::TAU;

/// Frames with their times (s) and points by name, mm.
pub type Frames = Vec<(f64, Vec<(String, [f64; 2])>)>;

/// A tongue of a face to the left that rises and advances with time, with noise: eleven points from root to tip, the hyoid and the mental
/// spine, mm.
pub fn tongue(frames: usize) -> Frames {
    let mut rng = fastrand(7);
    (0..frames)
        .map(|f| {
            let phase = f as f64 * 0.12;
            let (rise, forth) = (5.0 * phase.sin(), 3.0 * (0.7 * phase).cos());
            let mut points: Vec<(String, [f64; 2])> = (0..11)
                .map(|i| {
                    let angle = 0.15 + 0.27 * f64::from(i);
                    let x = 27.0 * angle.cos() + 22.0 - forth;
                    let y = 26.0 * angle.sin() + 14.0 + rise * angle.sin() + 0.9 * f64::from(i);
                    (format!("tongue_{i}"), [x + 0.3 * rng(), y + 0.3 * rng()])
                })
                .collect();
            points.push(("hyoid".to_owned(), [42.0 + 0.1 * rng(), -2.0]));
            points.push(("mental_spine".to_owned(), [4.0, 0.1 * rng()]));
            (f as f64 / 80.0, points)
        })
        .collect()
}

/// Pseudo-random numbers from -1 to 1.
pub fn fastrand(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f64 / f64::from(1_u32 << 30)) - 1.0
    }
}

/// The recording of a table whose coordinates have four digits, as AAA writes them.
pub fn recording(frames: &Frames) -> Recording {
    let mut text = "time_s,point,x_mm,y_mm\n".to_owned();
    for (time, points) in frames {
        points.iter().for_each(|(name, [x, y])| text += &format!("{time},{name},{x:.4},{y:.4}\n"));
    }
    read(text.as_bytes(), "t.csv").remove(0)
}

fn seen_with(frames: &Frames, map: &str) -> AlignedRecording {
    aligned_recording(&recording(frames), map)
}

fn changed(change: impl Fn(usize, &mut f64, &mut Vec<(String, [f64; 2])>)) -> Frames {
    let mut all = tongue(90);
    all.iter_mut().enumerate().for_each(|(f, (time, points))| change(f, time, points));
    all
}

fn moved(mut frames: Frames, to: impl Fn([f64; 2]) -> [f64; 2]) -> Frames {
    frames.iter_mut().flat_map(|(_, points)| points).for_each(|(_, p)| *p = to(*p));
    frames
}

fn scaled(frames: Frames, factor: f64) -> Frames {
    moved(frames, |p| p.map(|v| factor * v))
}

fn contour() -> Frames {
    changed(|_, _, points| points.truncate(11))
}

/// The messages of all doubts, and the worst severity.
fn doubts_and_severity(frames: &Frames, map: &str) -> (String, Option<Severity>) {
    let all = check_plausibility(&seen_with(frames, map), None);
    let words: Vec<&str> = all.iter().map(|d| d.message.as_str()).collect();
    (words.join("; "), all.iter().map(|d| d.severity).max())
}

fn not_suspected(frames: &Frames, map: &str) {
    assert_eq!(doubts_and_severity(frames, map), (String::new(), None));
}

#[track_caller]
fn noticed(frames: &Frames, map: &str, word: &str, severity: Severity) {
    let (words, worst) = doubts_and_severity(frames, map);
    assert!(words.contains(word) && worst == Some(severity), "{word}: {words:?}, {worst:?}");
    assert_eq!(words.matches(word).count(), 1, "told once: {words}");
}

#[test]
fn a_good_recording_is_not_suspected() {
    not_suspected(&tongue(90), "");
    // A face to the right, a single frame, and pixels with the right unit are good, too.
    not_suspected(&moved(tongue(90), |[x, y]| [-x, y]), "");
    not_suspected(&tongue(1), "");
    not_suspected(&scaled(tongue(90), 8.0), "unit_mm = 0.125");
    let built_in = read(include_bytes!("../../targets/recordings/synthetic.tsv"), "synthetic.tsv");
    assert!(
        built_in.len() == 2
            && built_in.iter().all(|one| check_plausibility(&aligned_recording(one, ""), None).is_empty())
    );
}

#[test]
fn wrong_units_are_reported() {
    for factor in [0.001, 0.1, 10.0, 1000.0] {
        // Without bones the size of the contour or the distances of coils show a wrong unit.
        for wrong in [tongue(90), contour(), coils(["T1", "T2", "T3"])] {
            noticed(&scaled(wrong, factor), "", "unit_mm", Refused);
        }
    }
}

#[test]
fn wrong_rates_are_reported() {
    for (factor, severity) in [(0.1, Untrusted), (100.0, Untrusted), (1e-6, Refused), (1000.0, Refused)] {
        let wrong = changed(|_, time, _| *time *= factor);
        noticed(&wrong, "", "rate_hz", severity);
    }
    // Four times too fast: 3 ms between frames are usual, but the speed is not.
    let fast = changed(|f, time, points| {
        *time /= 4.0;
        points.iter_mut().for_each(|(_, p)| p[1] += 7.0 * (0.9 * f as f64).sin());
    });
    noticed(&fast, "", "faster", Untrusted);
    // A tongue that rises and sinks 4.5 times a second, with times that are multiplied by a factor.
    let speech = |factor: f64| {
        changed(|f, time, points| {
            *time *= factor;
            points.iter_mut().for_each(|(_, p)| p[1] += 6.0 * (0.35 * f as f64).sin());
        })
    };
    not_suspected(&speech(1.0), "");
    not_suspected(&speech(2.0), "");
    (5..14).for_each(|factor| noticed(&speech(f64::from(factor)), "", "rate_hz", Untrusted));
    noticed(&speech(0.25), "", "rate_hz", Untrusted);
    noticed(&speech(1.0 / 3.0), "", "rate_hz", Untrusted);
    noticed(&changed(|_, time, _| *time *= 4.0), "", "rate_hz", Untrusted);
}

#[test]
fn a_tongue_that_is_shifted_at_once_and_a_point_that_stands_out_are_reported() {
    for shift in [12.0, -15.0] {
        // 0.6 of the shift is still more than bones move from frame to frame, and more than a whole tongue does.
        for (count, part) in [(11, 1.0), (13, 0.6), (11, 0.6)] {
            let slips = |(_, p): &mut (String, [f64; 2])| p[1] += part * shift;
            let slipped = changed(|f, _, points| points.iter_mut().take(count * (f / 40)).for_each(slips));
            noticed(&slipped, "", "slipped", Refused);
        }
    }
    // The hyoid moves by 12 mm within 0.2 s.
    let sinks = changed(|f, _, points| points[11].1[1] -= 12.0 * ((f as f64 - 50.0) / 16.0).clamp(0.0, 1.0));
    noticed(&sinks, "", "the hyoid moves by 12 mm", Note);
    for (point, by) in [(1, [-14.0, 0.0]), (4, [0.0, 12.0]), (8, [0.0, -20.0])] {
        let spike = changed(|_, _, points| (0..2).for_each(|axis| points[point].1[axis] += by[axis]));
        noticed(&spike, "", &format!("tongue_{point} stands out"), Untrusted);
    }
}

/// The recording with only three coils on the tongue, with these names from the tip backwards.
fn coils(names: [&str; 3]) -> Frames {
    changed(|_, _, points| {
        points.retain(|(n, _)| ["tongue_4", "tongue_7", "tongue_10"].contains(&n.as_str()));
        points.iter_mut().rev().zip(names).for_each(|(point, name)| point.0 = name.to_owned());
    })
}

#[test]
fn coils_of_other_names_sizes_and_axes_are_reported() {
    let good = coils(["T1", "T2", "T3"]);
    let numbered = "[points]\na = { coil = 1 }\nb = { coil = 2 }\nc = { coil = 3 }";
    not_suspected(&good, "");
    noticed(&coils(["T2", "T1", "T3"]), "", "order T2, T1, T3", Note);
    noticed(&coils(["TT", "TD", "TB"]), "", "order TT, TD, TB", Note);
    let mut copied = good.clone();
    copied.iter_mut().for_each(|(_, points)| points[1].1 = points[0].1);
    noticed(&copied, "", "is a copy of the other", Refused);
    let paused = good
        .iter()
        .cloned()
        .enumerate()
        .map(|(f, (time, points))| (time + if f < 45 { 0.0 } else { 700.0 }, points));
    noticed(&paused.collect(), "", "no frame lies in the 700 s after 0.550 s", Refused);
    not_suspected(&coils(["a", "b", "c"]), numbered);
    noticed(&coils(["a", "c", "b"]), numbered, "along the tongue in this order", Refused);
    noticed(&good, "back = \"-x\"", "lies behind the others", Refused);
    let below = moved(good.clone(), |[x, y]| [x, -y]);
    noticed(&below, "", "either the recording is upside down, or the tongue is held hollow", Refused);
    // A map that states the axis or the unit is not contradicted.
    not_suspected(&below, "up = \"y\"");
    for factor in [0.4, 1.8] {
        let other = scaled(good.clone(), factor);
        noticed(&other, "", "unit_mm", Refused);
        not_suspected(&other, "unit_mm = 1");
    }
    for exchange in [|[x, y]: [f64; 2]| [y, x], |[x, y]: [f64; 2]| [y, -x]] {
        noticed(&moved(good.clone(), exchange), "", "x and y seem to be exchanged", Refused);
    }
    // A retroflex in a third of the frames makes the tongue hollow there.
    let mut retroflex = good.clone();
    for (f, (_, points)) in retroflex.iter_mut().enumerate() {
        let part = (0.07 * f as f64).sin().max(0.0);
        points.iter_mut().filter(|(n, _)| n == "T2").for_each(|(_, p)| p[1] -= 14.0 * part);
    }
    not_suspected(&retroflex, "");
    // For a face to the right in a table without axes, a note says which coil is taken for the tip.
    assert!(seen_with(&good, "").notes.is_empty());
    let exchanged = seen_with(&coils(["T3", "T2", "T1"]), "");
    assert!(exchanged.notes[0].contains("looks to the right"), "{:?}", exchanged.notes);
    // Lips show which axis points upwards and which to the front.
    for (upper, lower, names, expected) in [
        (40.0, 20.0, ["T1", "T2", "T3"], ""),
        (20.0, 40.0, ["T1", "T2", "T3"], "upside down"),
        (40.0, 20.0, ["T3", "T2", "T1"], "exchanged"),
    ] {
        let lips = [("UL", upper), ("LL", lower)].map(|(n, y)| (n.to_owned(), [-25.0, y]));
        let with = |(t, points): (f64, Vec<_>)| (t, [points, lips.to_vec()].concat());
        let found = aligned(&recording(&coils(names).into_iter().map(with).collect()), "").err();
        assert!(found.is_some() != expected.is_empty() && found.unwrap_or_default().contains(expected));
    }
    // A coil at the incisors must be in front of the first one on the tongue, unless a map gives its role.
    let mut behind = good;
    behind.iter_mut().for_each(|(_, points)| {
        let [x, y] = points[2].1;
        points.push(("LI".to_owned(), [x + 8.0, y - 5.0]));
    });
    let notes = |map| seen_with(&behind, map).notes.join("; ");
    assert!(notes("").contains("LI is seen 8 mm behind T1"), "{}", notes(""));
    assert!(!notes("[points]\nLI = \"ignore\"").contains("behind"), "{}", notes("[points]\nLI = \"ignore\""));
}

#[test]
fn tongues_of_two_sizes_and_labels_of_another_time_are_reported() {
    let of = |factor: f64| seen_with(&scaled(tongue(90), factor), "");
    let (one, other) = (of(1.0), of(0.8));
    assert_eq!(other_size(&[&one, &of(1.1), &one]), None);
    let (number, doubt) = other_size(&[&one, &one, &other]).unwrap();
    assert!(number == 2 && doubt.message.contains("0.80 times") && doubt.severity == Note, "{doubt:?}");
    let label = |from_s: f64| Label { tier: "a".into(), name: "x".into(), from_s, to_s: from_s + 0.3 };
    let with = |labels| check_plausibility(&AlignedRecording { labels, ..one.clone() }, None);
    assert_eq!(with(vec![label(0.9), label(50.0)]), []);
    // Of two labels one ends behind the last frame, and is mostly not seen.
    let doubts = with(vec![label(1.0), label(50.0)]);
    assert!(doubts.len() == 1 && doubts[0].message.contains("most of these are not used"), "{doubts:?}");
    // A label that lasts longer than the recording is used in all its frames.
    assert_eq!(with(vec![Label { from_s: -1.0, to_s: 10.0, ..label(0.0) }]), []);
    let other = Label { tier: "b".into(), ..label(50.0) };
    let doubts = with(vec![label(0.9), other]);
    assert!(doubts.len() == 1 && doubts[0].message.contains("of the tier \"b\""), "{doubts:?}");
}

#[test]
fn errors_that_leave_nothing_to_know_and_rounded_places_are_reported() {
    noticed(&tongue(90), "noise_mm = 20", "a standard deviation of 20 mm", Note);
    not_suspected(&tongue(90), "noise_mm = 4");
    let round = |frames: Frames, mm: f64| moved(frames, |p| p.map(|v| (v / mm).round() * mm));
    not_suspected(&round(tongue(90), 0.5), "");
    let (words, worst) = doubts_and_severity(&round(tongue(90), 4.0), "");
    assert!(words.contains("rounded to steps") && worst == Some(Note), "{words}");
}

#[test]
fn distant_and_stuck_points_are_reported() {
    let far = changed(|_, _, points| points[3].1 = [1e9, 20.0]);
    noticed(&far, "", "tongue_3 lies", Note);
    let frozen: Frames = tongue(90).into_iter().map(|(t, _)| (t, tongue(1).remove(0).1)).collect();
    noticed(&frozen, "", "nothing moves", Refused);
    let stuck = changed(|_, _, points| points[4].1 = [30.0, 44.0]);
    noticed(&stuck, "", "tongue_4 stays", Note);
    let mut paused = tongue(90);
    let held = paused[30].1.clone();
    paused[30..50].iter_mut().for_each(|(_, points)| points.clone_from(&held));
    noticed(&paused, "", "exactly the same place in 20 frames", Note);
    // A tongue at rest with positions that are rounded to 0.1 mm.
    let mut rng = fastrand(9);
    let mut rest = frozen;
    let places = rest.iter_mut().flat_map(|(_, points)| points).flat_map(|(_, p)| p);
    places.for_each(|v| *v = (10.0 * (*v + 0.04 * rng())).round() / 10.0);
    not_suspected(&rest, "");
}

#[test]
fn frames_and_points_out_of_order_are_reported() {
    let mut order: Vec<usize> = (0..90).collect();
    let mut rng = fastrand(3);
    order.sort_by_cached_key(|_| (rng() * 1e9) as i64);
    let good = tongue(90);
    let shuffled: Frames = order.iter().zip(&good).map(|(n, (t, _))| (*t, good[*n].1.clone())).collect();
    noticed(&shuffled, "", "do not follow one another", Refused);
    let renamed = changed(|_, _, points| {
        for (i, n) in [7, 2, 9, 0, 5, 10, 3, 8, 1, 6, 4].into_iter().enumerate() {
            points[i].0 = format!("tongue_{n}");
        }
    });
    noticed(&renamed, "", "not in their order", Refused);
    let reversed = changed(|_, _, points| {
        (0..11).for_each(|i| points[i].0 = format!("tongue_{}", 10 - i));
    });
    not_suspected(&reversed, "");
    let (recording, straight) = (seen_with(&reversed, ""), seen_with(&good, ""));
    assert!(recording.notes[0].contains("from the tip to the root"), "{:?}", recording.notes);
    assert_eq!(recording.frames, straight.frames, "it is taken the other way round");
}

#[test]
fn a_point_that_jumps_in_a_tongue_that_rests_says_nothing_of_the_order_of_frames() {
    let mut rng = fastrand(5);
    let first = tongue(1).remove(0).1;
    let frame = |f: usize| {
        let mut points = first.clone();
        points.iter_mut().for_each(|(_, p)| *p = p.map(|v| v + 0.3 * rng()));
        points[9].1[1] += if f == 12 { 30.0 } else { 0.0 };
        (f as f64 / 80.0, points)
    };
    not_suspected(&(0..24).map(frame).collect(), "");
}

#[test]
fn exchanged_bones_and_axes_are_reported() {
    let exchanged = changed(|_, _, points| {
        points[11].0 = "mental_spine".to_owned();
        points[12].0 = "hyoid".to_owned();
    });
    noticed(&exchanged, "", "the names of these two are wrong", Refused);
    // The mental spine is where the hyoid is. The contour shows that the unit is right.
    let near = changed(|_, _, points| points[12].1 = [points[11].1[0] - 8.0, 1.0]);
    noticed(&near, "", "one of them is another point; correct their names", Refused);
    assert!(!doubts_and_severity(&near, "").0.contains("unit_mm"));
    noticed(&tongue(90), "back = \"-x\"", "behind the hyoid", Refused);
    noticed(&tongue(90), "up = \"-y\"", "upside down", Refused);
    not_suspected(&contour(), "");
    noticed(&contour(), "up = \"-y\"", "upside down", Refused);
    noticed(&moved(tongue(90), |[x, y]| [y, x]), "", "x and y seem to be exchanged", Refused);
    for by in [15.0, 22.0] {
        let high = changed(|_, _, points| points.iter_mut().take(11).for_each(|(_, p)| p[1] += by));
        noticed(&high, "", "too high for the bones", Note);
    }
}

#[test]
fn one_coil_and_a_coil_of_the_tongue_as_reference_are_refused() {
    let with = |name: &str| aligned(&recording(&tongue(90)), &format!("[points]\n{name} = \"reference\""));
    assert!(with("mental_spine").is_ok() && with("tongue_6").unwrap_err().contains("reference"));
    let one = changed(|_, _, points| points.retain(|(n, _)| n == "tongue_7"));
    noticed(&one, "[points]\ntongue_7 = { surface_mm = 20 }\n", "only 1 coil is seen", Refused);
    let none = changed(|_, _, points| points.iter_mut().for_each(|(_, p)| p[0] = 1.0));
    let mut aligned_recording = seen_with(&none, "");
    aligned_recording.frames.iter_mut().for_each(|f| f.contour.iter_mut().for_each(|m| *m = None));
    assert!(
        check_plausibility(&aligned_recording, None)
            .iter()
            .any(|d| d.is_refused() && d.message.contains("no point"))
    );
}

#[test]
fn palates_are_compared_with_the_recording() {
    let recording = seen_with(&tongue(90), "");
    let vault = |height: f64, shift: f64, sign: f64| -> Vec<Point> {
        let arch = |i| 12.0 * (std::f64::consts::PI * f64::from(i) / 8.0).sin();
        (0..9).map(|i| Point::new(6.25 * f64::from(i) + shift, height + sign * arch(i)) * 1e-3).collect()
    };
    let doubts = |palate: &[Point]| check_plausibility(&recording, Some(palate));
    assert_eq!(doubts(&vault(45.0, 0.0, 1.0)), []);
    // A palate with the incisors, which is steep at the front.
    let incisors = |sign: f64| -> Vec<Point> {
        let shape = [-16.0, -14.5, -8.5, 3.0, 16.0, 30.0, 40.0]
            .into_iter()
            .zip([31.0, 36.0, 43.0, 49.0, 53.0, 55.0, 53.0]);
        shape.map(|(x, y)| Point::new(x + 10.0, 50.0 + sign * (y - 50.0)) * 1e-3).collect()
    };
    assert_eq!(doubts(&incisors(1.0)), []);
    let mut low_at_front = vault(45.0, 0.0, 1.0);
    low_at_front[0].y -= 40e-3;
    for (palate, expected, severity) in [
        (incisors(-1.0), "upside down", Refused),
        (vault(60.0, 0.0, -1.0), "upside down", Refused),
        (vault(45.0, 500.0, 1.0), "no point", Refused),
        (vault(75.0, 0.0, 1.0), "above the highest", Note),
        (vault(545.0, 0.0, 1.0), "above the highest", Refused),
        (vault(-500.0, 0.0, 1.0), "beyond the palate", Refused),
        (
            vault(45.0, 0.0, 1.0).iter().map(|p| Point::new(p.y, p.x)).collect(),
            "far more than as it is given",
            Refused,
        ),
        // Its front end dips into the tongue, where one of eleven points lies.
        (low_at_front, "in a wrong place", Untrusted),
    ] {
        let doubt = doubts(&palate).remove(0);
        assert!(doubt.message.contains(expected) && doubt.severity == severity, "{doubt:?}");
    }
    // Coils are checked, too, in every frame.
    let map = "[points]\ntongue_4 = \"coil\"\ntongue_7 = \"coil\"\ntongue_10 = { coil = 1 }";
    let mut coils = changed(|_, _, points| points.retain(|(n, _)| n != "tongue_0"));
    coils[13].1.iter_mut().filter(|(n, _)| n == "tongue_7").for_each(|(_, p)| p[1] += 11.0);
    let mut recording = seen_with(&coils, map);
    let faults = remove_outliers(&mut recording, Some(&vault(43.0, 0.0, 1.0)));
    assert!(faults[13].iter().any(|f| f.points.contains(&"tongue_7".to_owned())), "{:?}", faults[13]);
}

/// A speaker of three syllables, `scale` times as large as an adult, with this rate of frames and of syllables, a pause, and a vowel that
/// is held for `held_s`.
fn speech(scale: f64, rate_hz: f64, syllables_hz: f64, pause_s: f64, held_s: f64) -> Frames {
    let mut rng = fastrand(11);
    let spoken_s = 3.0 / syllables_hz;
    let frame = |f: usize| {
        let time = f as f64 / rate_hz;
        // The tongue is high in the middle of each syllable, and stays at the top of the second.
        let phase = match time - pause_s {
            t if t < 0.0 => 0.0,
            t if t < spoken_s / 2.0 => t * syllables_hz,
            t if t < spoken_s / 2.0 + held_s => 1.5,
            t => ((t - held_s) * syllables_hz).min(3.0),
        };
        let (rise, forth) = (-7.0 * (TAU * phase).cos(), 3.0 * (TAU * 0.5 * phase).sin());
        let mut points = tongue(1).remove(0).1;
        for (i, (name, p)) in points.iter_mut().enumerate() {
            let angle = 0.15 + 0.27 * i as f64;
            if name.starts_with("tongue") {
                *p = [p[0] - forth, p[1] - 4.0 + rise * angle.sin()];
            }
            *p = p.map(|v| scale * v + 0.3 * rng());
        }
        (time, points)
    };
    (0..((spoken_s + pause_s + held_s + pause_s) * rate_hz) as usize).map(frame).collect()
}

/// The coils of a recording of a contour.
fn as_coils(frames: &Frames) -> Frames {
    let coil = |(name, p): &(String, [f64; 2])| {
        let nth = ["tongue_10", "tongue_8", "tongue_5"].iter().position(|n| n == name)?;
        Some((["T1", "T2", "T3"][nth].to_owned(), *p))
    };
    frames.iter().map(|(t, points)| (*t, points.iter().rev().filter_map(coil).collect())).collect()
}

#[test]
fn good_speakers_of_all_sizes_rates_and_manners_are_not_suspected_and_ten_times_as_slow_they_are() {
    let manners = [(4.0, 0.3, 0.0), (2.5, 0.0, 0.0), (6.0, 0.0, 0.5), (4.0, 1.5, 3.0)];
    let mut good = 0;
    for (number, (scale, rate_hz)) in [0.75, 1.0, 1.3]
        .into_iter()
        .flat_map(|s| [25.0, 60.0, 80.0, 200.0, 400.0].map(|r| (s, r)))
        .enumerate()
    {
        // Every size occurs with all four manners of speech, and every rate with three.
        let (syllables_hz, pause_s, held_s) = manners[number % manners.len()];
        let frames = speech(scale, rate_hz, syllables_hz, pause_s, held_s);
        for frames in [as_coils(&frames), frames] {
            not_suspected(&frames, "");
            good += 1;
            let slow: Frames = frames.into_iter().map(|(t, points)| (10.0 * t, points)).collect();
            let doubts = check_plausibility(&seen_with(&slow, ""), None);
            assert!(doubts.iter().any(|d| d.severity == Untrusted), "{scale} {rate_hz} {doubts:?}");
        }
        // A vowel that is held throughout, a single posture, and a posture with rounded positions.
        let held = speech(scale, rate_hz, 4.0, 1.0, 0.0);
        let held: Frames = held.into_iter().take(rate_hz as usize).collect();
        not_suspected(&held, "");
        not_suspected(&held[..1].to_vec(), "");
        not_suspected(&moved(held, |p| p.map(f64::round)), "");
        good += 3;
    }
    assert!(good >= 40, "{good}");
}

#[test]
fn a_coil_whose_tracking_slips_is_named_and_no_axis_is_blamed() {
    for (by, from) in [([0.0, 35.0], 10), ([-30.0, 0.0], 45), ([5.0, 60.0], 60), ([0.0, -25.0], 20)] {
        let mut slipped = coils(["T1", "T2", "T3"]);
        let slip = |(_, points): &mut (f64, Vec<(String, [f64; 2])>)| {
            let coil = points.iter_mut().find(|(n, _)| n == "T3").unwrap();
            coil.1 = [coil.1[0] + by[0], coil.1[1] + by[1]];
        };
        slipped.iter_mut().skip(from).for_each(slip);
        let first = check_plausibility(&seen_with(&slipped, ""), None)
            .into_iter()
            .find(|d| d.is_refused())
            .unwrap()
            .message;
        let is_named = first.contains("T3") && first.contains("slipped") && first.contains("\"ignore\"");
        assert!(is_named && !first.contains("exchanged"), "{first}");
    }
    // The coil came off before the recording began.
    let off = moved(coils(["T1", "T2", "T3"]), |[x, y]| if x > 22.0 { [x, y + 45.0] } else { [x, y] });
    noticed(&off, "", "\"T3\" = \"ignore\"", Refused);
    // The hyoid is above the spine while the tongue is arched upwards.
    let bone = changed(|_, _, points| points[11].1 = [8.0, 62.0]);
    noticed(&bone, "", "hyoid = \"ignore\"", Refused);
}

#[test]
fn a_bone_whose_tracking_slips_is_named_and_makes_no_frame_of_each_sample() {
    let of_sample =
        |recording: &AlignedRecording| recording.notes.iter().any(|n| n.contains("frame of each sample"));
    for (bone, by, from) in
        [(11, [0.0, 25.0], 40), (11, [-20.0, 6.0], 30), (11, [6.0, -22.0], 60), (12, [0.0, 24.0], 45)]
    {
        let slips = |f: usize| f >= from;
        let slipped = changed(|f, _, points| {
            (0..2).filter(|_| slips(f)).for_each(|axis| points[bone].1[axis] += by[axis]);
        });
        assert!(!of_sample(&seen_with(&slipped, "")));
        let name = ["hyoid", "mental_spine"][bone - 11];
        noticed(&slipped, "", &format!("{name} jumps by 2"), Refused);
    }
    // A bone that one frame does not show is reported in this frame.
    let missing = changed(|f, _, points| points.truncate(if f == 7 { 11 } else { 13 }));
    let mut faults = remove_outliers(&mut seen_with(&missing, ""), None);
    let found = faults.remove(7);
    assert!(
        faults.concat().is_empty() && found.iter().all(|a| a.kind == FaultKind::BoneMissing),
        "{found:?}"
    );
    assert_eq!(found.iter().flat_map(|a| &a.points).collect::<Vec<_>>(), ["hyoid", "mental_spine"]);
    // If it slips in every third frame, or in two frames, it is left out there.
    for slips in [|f: usize| f % 3 == 1, |f: usize| (30..32).contains(&f)] {
        let jumped = changed(|f, _, points| points[11].1[1] += if slips(f) { 24.0 } else { 0.0 });
        not_suspected(&jumped, "");
        let mut recording = seen_with(&jumped, "");
        assert!(!of_sample(&recording));
        let faults = remove_outliers(&mut recording, None);
        for (f, (faults, frame)) in faults.iter().zip(&recording.frames).enumerate() {
            let named = faults.iter().filter(|fault| fault.points == ["hyoid"]).count();
            assert_eq!((named, frame.bones.iter().flatten().count()), if slips(f) { (1, 1) } else { (0, 2) });
        }
    }
}

#[test]
fn postures_of_one_speaker_are_not_taken_for_two_speakers() {
    // The dorsum of an /i/ is higher than that of an /e/, so its coils are farther apart along the tongue.
    let vowel = |wider: f64| {
        let mut rng = fastrand(4);
        let mut frames = coils(["T1", "T2", "T3"]);
        let posture = frames[0].1.clone();
        for (_, points) in &mut frames {
            points.clone_from(&posture);
            points.iter_mut().for_each(|(_, p)| *p = [wider * p[0] + 0.1 * rng(), p[1] + 0.1 * rng()]);
        }
        seen_with(&frames, "")
    };
    let (e, i) = (vowel(1.0), vowel(1.3));
    assert_eq!(other_size(&[&e, &i]), None);
    assert_eq!(other_size(&[&i, &e]), None);
    assert_eq!(other_size(&[&e, &vowel(1.6)]).map(|(n, _)| n), Some(1));
}

#[test]
fn the_axis_to_the_back_is_found_where_it_is_not_the_usual_one() {
    // Coils of an AG500 whose y axis points to the back of the head.
    let coils = as_coils(&tongue(60));
    let read = recording(&coils);
    let mut turned = read.clone();
    turned.format = Format::Ag50x;
    let places = turned.samples.iter_mut().flat_map(|s| s.places.iter_mut().flatten());
    places.for_each(|p| *p = [0.5, p[0], p[1]]);
    let aligned_recording = aligned(&turned, "").unwrap();
    assert_eq!(aligned_recording.frames, aligned(&read, "").unwrap().frames);
    assert!(
        aligned_recording.notes.iter().any(|n| n.contains("y is taken for the axis to the back")),
        "{:?}",
        aligned_recording.notes
    );
    assert_eq!(check_plausibility(&aligned_recording, None), []);
}
