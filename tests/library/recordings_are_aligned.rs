//! Contours in the frame of each sample, mirrored fans and coils on the jaw are recognised and reported, and good recordings stay
//! unchanged.

use std::fmt::Write as _;

use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::{AlignedRecording, Map, Recording};
use tongue_input::measured::recording::WITHOUT_BONES;

use crate::recordings_are_plausible::{Frames, fastrand, recording, tongue};
use crate::recordings_are_read::{aligned, read};

const HYOID: usize = 11;

/// A speaker in the frame of a probe that shakes by `shakes` mm, with noise of tracking at every point; the mandible is the last point.
fn speaker(seed: u64, frames: usize, shakes: f64, left: bool) -> Frames {
    let mut rng = fastrand(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let (size, angle) = (1.0 + 0.25 * rng(), 0.3 * rng());
    let (place, noise) = (Point::new(45.0 + 25.0 * rng(), 25.0 + 20.0 * rng()), 0.5 + 0.4 * rng());
    let face = if left { 1.0 } else { -1.0 };
    let mut all = tongue(frames);
    for (_, points) in &mut all {
        let [x, y] = points[12].1;
        points.push(("mandible".to_owned(), [x - 1.0, y - 8.0]));
        let shake = Point::new(rng(), rng()) * shakes;
        for (_, p) in points {
            let turned = turned(Point::from(*p), angle) * size + place + shake;
            let [x, y]: [f64; 2] = (turned + Point::new(rng(), rng()) * (1.7 * noise)).into();
            *p = [face * x, y];
        }
    }
    all
}

fn turned(p: Point, angle: f64) -> Point {
    let (sin, cos) = angle.sin_cos();
    Point::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y)
}

fn shifted(mut frames: Frames, points: std::ops::RangeFrom<usize>, by: Point) -> Frames {
    for p in frames.iter_mut().flat_map(|(_, all)| &mut all[points.clone()]) {
        p.1 = (Point::from(p.1) + by).into();
    }
    frames
}

/// The contour of every frame in a frame with its origin at the hyoid and x towards the point number `towards`.
fn exported(frames: &Frames, towards: usize) -> Frames {
    let mut out = frames.clone();
    for (_, points) in &mut out {
        let hyoid = Point::from(points[HYOID].1);
        let x = (Point::from(points[towards].1) - hyoid).normalize();
        for (_, p) in &mut points[..HYOID] {
            let from = Point::from(*p) - hyoid;
            *p = [x.dot(&from), x.perp(&from)];
        }
    }
    out
}

fn aligned_recording(frames: &Frames) -> AlignedRecording {
    aligned(&recording(frames), "").unwrap()
}

fn is_told(recording: &AlignedRecording) -> bool {
    recording.notes.iter().filter(|n| n.starts_with("its contour is in a frame of each sample")).count() == 1
}

/// Largest distance of contour points between two recordings, m, when the bones of the second were shifted by `bones_by`, mm.
fn apart(a: &AlignedRecording, b: &AlignedRecording, bones_by: Point) -> f64 {
    let by = Point::new(if a.mirrored { -bones_by.x } else { bones_by.x }, bones_by.y) * 1e-3;
    let points = |s: &AlignedRecording| s.frames.iter().flat_map(|f| f.contour.clone()).collect::<Vec<_>>();
    let pairs = points(a).into_iter().zip(points(b));
    pairs.map(|(a, b)| (a.unwrap().at - b.unwrap().at + by).norm()).fold(0.0, f64::max)
}

#[test]
fn contours_in_a_frame_of_each_sample_are_brought_back_also_where_the_bones_fit_by_chance() {
    for seed in 0..40 {
        let frames = speaker(seed, 90, 0.0, seed % 2 == 1);
        let right = aligned_recording(&frames);
        assert!(!is_told(&right), "{seed}: {:?}", right.notes);
        for towards in [12, 13] {
            let moved = exported(&frames, towards);
            // Bones as they are, and shifted so that the hyoid is on average at the origin of the contour.
            let hyoid = frames.iter().map(|(_, p)| Point::from(p[HYOID].1)).sum::<Point>() / 90.0;
            for bones_by in [Point::zeros(), -hyoid] {
                let found = aligned_recording(&shifted(moved.clone(), HYOID.., bones_by));
                assert!(is_told(&found), "{seed} {towards} {bones_by}: {:?}", found.notes);
                let off = apart(&right, &found, bones_by);
                assert!(off < 5e-7, "{seed} {towards} {bones_by}: {off}");
            }
        }
    }
}

#[test]
fn contours_in_the_frame_of_their_bones_stay_there() {
    for seed in 0..120 {
        let shakes = [0.0, 1.0, 3.0][seed as usize % 3];
        let frames = speaker(seed, [6, 30, 90, 300][seed as usize % 4], shakes, seed % 2 == 1);
        let hyoid = Point::from(frames[0].1[HYOID].1);
        // The origin at the probe, and by chance at the hyoid.
        for origin in [Point::zeros(), hyoid] {
            let found = aligned_recording(&shifted(frames.clone(), 0.., -origin));
            assert!(!is_told(&found), "{seed} {origin}: {:?}", found.notes);
        }
    }
}

#[test]
fn a_few_frames_and_a_map_tell_the_frame_of_a_contour() {
    let frames = speaker(3, 8, 0.0, false);
    let moved = exported(&frames, 13);
    assert!(is_told(&aligned_recording(&moved)));
    assert!(!is_told(&aligned(&recording(&moved), "contour_frame = \"bones\"").unwrap()));
    // Eight frames whose bones fit by chance do not show the frame, but the map may state it.
    let hyoid = Point::from(frames[0].1[HYOID].1);
    let chance = recording(&shifted(moved.clone(), HYOID.., -hyoid));
    let stated = aligned(&chance, "contour_frame = \"hyoid\"").unwrap();
    assert!(is_told(&stated) && apart(&aligned_recording(&frames), &stated, -hyoid) < 2e-6);
    for (map, expected) in [
        ("contour_frame = \"hyoid\"\n[points]\nhyoid = \"ignore\"", "needs the hyoid"),
        ("contour_frame = \"hyoid\"\nback = \"x\"", "take back and up out of the map"),
    ] {
        assert!(aligned(&chance, map).unwrap_err().contains(expected), "{map}");
    }
    // Short recordings of one speaker are judged together.
    let all = speaker(5, 90, 0.0, false);
    let parts: Vec<Recording> = all.chunks(9).map(|part| recording(&exported(&part.to_vec(), 13))).collect();
    let all = AlignedRecording::all(&parts.iter().collect::<Vec<_>>(), &Map::default());
    assert!(all.len() == 10 && all.into_iter().all(|one| is_told(&one.unwrap())));
    // The line of a map that messages recommend leaves the bones out.
    assert!(aligned(&recording(&moved), WITHOUT_BONES).unwrap().bones.is_empty());
}

#[test]
fn the_lower_end_of_a_fan_is_the_root_whichever_line_it_is_on() {
    // An arch from the root on line 8 to the tip on line 35, in AAA's order of lines and in the reverse order.
    let fan = |backwards: bool| {
        let mut text = String::new();
        for t in 0..5 {
            let _ = write!(text, "01\t{}\t29/11/2016 15:10:52\tpata", 0.5 + 0.0125 * f64::from(t));
            for line in 1..=42 {
                let part = f64::from(if backwards { 35 - line } else { line - 8 }) / 27.0;
                let at = Point::new(60.0, 40.0)
                    + turned(Point::x(), 2.94 - 2.2 * part).component_mul(&Point::new(35.0, 32.0));
                let _ = match (0.0..=1.0).contains(&part) {
                    true => write!(text, "\t{:.4}\t{:.4}", at.x, at.y),
                    false => write!(text, "\t*\t*"),
                };
            }
            text += "\n";
        }
        aligned(&read(text.as_bytes(), "fan.txt")[0], "").unwrap()
    };
    let both = [false, true].map(fan);
    for (recording, is_turned) in both.iter().zip([false, true]) {
        let points: Vec<Point> = recording.frames[0].contour.iter().flatten().map(|m| m.at).collect();
        let (root, tip) = (points[0], points[points.len() - 1]);
        assert!(recording.mirrored && root.x > tip.x && root.y < tip.y, "{root} {tip}");
        let count = |words: &str| recording.notes.iter().filter(|n| n.contains(words)).count();
        assert_eq!(count("from the tip to the root (its lower end is the root)"), usize::from(is_turned));
        assert_eq!(count("the lower end of the contour"), 1);
    }
    assert_eq!(both[0].frames[0].contour, both[1].frames[0].contour);
}

/// The centre of rotation of the jaw, mm.
const EARS: Point = Point::new(-85.0, 35.0);

/// Coils of tongue and jaw over 60 frames, mm, x to the front as in the X-ray microbeam.
fn coils(change: impl Fn(&str, Point) -> Point) -> AlignedRecording {
    let mut rng = fastrand(11);
    let tongue = [("T1", [-14.0, 0.0]), ("T2", [-28.0, 8.0]), ("T3", [-42.0, 8.0]), ("T4", [-55.0, 2.0])];
    let places = [&tongue[..], &[("MANi", [-2.0, -10.0]), ("MANm", [-30.0, -12.0])]].concat();
    let frame = |t: u32| {
        let open = -0.09 + 0.09 * (0.3 * f64::from(t)).cos();
        let rise = 3.0 * (0.5 * f64::from(t)).sin();
        let mut place = |(name, at): (&str, [f64; 2])| {
            let p = EARS + turned(Point::from(at) - EARS, open);
            let p = if name.starts_with('T') { p + Point::new(0.0, rise) } else { p };
            (name.to_owned(), (change(name, p) + Point::new(rng(), rng()) * 0.1).into())
        };
        (0.0069 * f64::from(t), places.iter().copied().map(&mut place).collect())
    };
    aligned_recording(&(0..60).map(frame).collect())
}

#[test]
fn coils_on_the_jaw_are_the_mandible_and_two_of_them_turn_it() {
    let found = coils(|_, p| p);
    assert_eq!((found.bones.join(" "), found.ignored.len()), ("mental_spine".to_owned(), 0));
    assert_eq!(found.notes, [""; 0]);
    // The path of the mental spine, which is below and behind the incisors, about the same centre.
    let ends = |axis: usize| {
        let all = found.frames.iter().map(|f| f.bones[0].unwrap()[axis]);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    let off = |x: f64, y: f64| {
        let way = (turned(Point::new(x, y) - EARS, -0.18) - (Point::new(x, y) - EARS)) * 1e-3;
        (ends(0) - way.x.abs()).hypot(ends(1) - way.y.abs())
    };
    let [spine, incisor] = [off(-16.0, -30.0), off(-2.0, -10.0)];
    assert!(spine < 1.5e-3 && incisor > 2.5e-3, "{spine} {incisor}");
    // Names of other laboratories. Beside a contour, which places the body, a coil on the jaw is not used.
    for name in ["JAW", "LI", "li", "MANi", "Lower incisor", "jaw"] {
        let with = |front: &str, back: &str| {
            let points = [(front, [0.0, 10.0]), (back, [15.0, 15.0]), (name, [-12.0, 2.0])];
            aligned_recording(&vec![(0.0, points.map(|(name, at)| (name.to_owned(), at)).to_vec())])
        };
        assert_eq!(with("TT", "TB").bones, ["mental_spine"], "{name}");
        let beside = with("tongue_1", "tongue_0");
        assert_eq!((beside.bones.len(), beside.ignored.as_slice()), (0, &[name.to_owned()][..]));
    }
}

#[test]
fn coils_of_tongue_and_jaw_that_belong_to_two_frames_or_are_exchanged_are_told() {
    let raised = |by: f64| {
        coils(|name, p| if name.starts_with('T') { p + Point::new(0.0, by) } else { p }).notes[0].clone()
    };
    assert!(raised(15.0).contains("T1 lies") && raised(15.0).contains("above MANi"));
    assert!(raised(-30.0).contains("below MANi"));
    let by = Point::new(12.0, -10.0);
    let exchanged = coils(|name, p| match name {
        "T1" => p + by,
        "MANi" => p - by,
        _ => p,
    });
    let is_told = |note: &String| note.contains("MANi") && note.contains("exchanged with it");
    assert!(exchanged.notes.len() == 1 && exchanged.notes.iter().all(is_told), "{:?}", exchanged.notes);
}
