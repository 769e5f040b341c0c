//! Contours in the frame of each sample, mirrored fans and coils on the jaw are recognised and told, and good recordings stay as they are.

use std::fmt::Write as _;

use super::*;

/// Frames of eleven contour points from the root to the tip, the hyoid, the mandible and the mental spine, mm.
type Frames = Vec<[Point; 14]>;

/// Random numbers from -1 to 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f64 / f64::from(1_u32 << 30)) - 1.0
    }
}

/// A speaker in the frame of a probe that shakes by `shakes` mm, with noise that the tracker makes at every point.
fn speaker(seed: u64, frames: usize, shakes: f64, left: bool) -> Frames {
    let mut rng = random(seed);
    let (size, angle) = (1.0 + 0.25 * rng(), 0.3 * rng());
    let (place, noise) = (Point::new(45.0 + 25.0 * rng(), 25.0 + 20.0 * rng()), 0.5 + 0.4 * rng());
    let face = if left { -1.0 } else { 1.0 };
    let one = |t: usize| {
        let phase = 0.35 * t as f64;
        let (rise, forth) = (5.0 * phase.sin(), 3.0 * (0.7 * phase).cos());
        let mut points = [Point::zeros(); 14];
        for (i, p) in points.iter_mut().take(11).enumerate() {
            let turn = std::f64::consts::PI - 0.15 - 0.27 * i as f64;
            *p = Point::new(
                27.0 * turn.cos() + 16.0 + forth,
                26.0 * turn.sin() + 12.0 + 0.9 * i as f64 + rise * turn.sin(),
            );
        }
        points[11] = Point::new(0.4 * rise, 0.3 * forth);
        points[12] = Point::new(41.0, 1.0 + 0.2 * rise);
        points[13] = Point::new(40.0, 9.0 + 0.2 * rise);
        let shake = Point::new(rng(), rng()) * shakes;
        points.map(|p| {
            let p = Point::new(angle.cos() * p.x - angle.sin() * p.y, angle.sin() * p.x + angle.cos() * p.y)
                * size;
            let p = p + place + shake + Point::new(rng(), rng()) * (1.7 * noise);
            Point::new(face * p.x, p.y)
        })
    };
    (0..frames).map(one).collect()
}

/// The contour of every frame in a frame with its origin at the hyoid and x towards the point of this number.
fn exported(frames: &Frames, towards: usize) -> Frames {
    let one = |frame: &[Point; 14]| {
        let mut out = *frame;
        let x = (frame[towards] - frame[11]).normalize();
        for p in &mut out[..11] {
            let from = *p - frame[11];
            *p = Point::new(x.dot(&from), x.perp(&from));
        }
        out
    };
    frames.iter().map(one).collect()
}

/// The recording with every coordinate rounded to four digits as AAA does, and its bones (or all points) shifted.
fn table(frames: &Frames, bones_by: Point) -> Recording {
    let mut text = "time_s,point,x_mm,y_mm\n".to_owned();
    for (t, frame) in frames.iter().enumerate() {
        for (i, p) in frame.iter().enumerate() {
            let name = match i {
                11 => "hyoid".to_owned(),
                12 => "mandible".to_owned(),
                13 => "mental_spine".to_owned(),
                i => format!("tongue_{i}"),
            };
            let p = if i > 10 { p + bones_by } else { *p };
            let _ = writeln!(text, "{},{name},{:.4},{:.4}", 0.0149 * t as f64, p.x, p.y);
        }
    }
    Recording::from_bytes(text.as_bytes(), "t.csv", None).unwrap().remove(0)
}

fn read(recording: &Recording) -> AlignedRecording {
    AlignedRecording::new(recording, &Map::default()).unwrap()
}

fn is_told(seen: &AlignedRecording) -> bool {
    seen.notes.iter().filter(|n| n.as_str() == contour_frame::TOLD).count() == 1
}

/// Largest distance of contour points of two recordings, m, after the bones of the second are shifted back, mm.
fn apart(a: &AlignedRecording, b: &AlignedRecording, bones_by: Point) -> f64 {
    let by = Point::new(if a.mirrored { -bones_by.x } else { bones_by.x }, bones_by.y) * 1e-3;
    let points = |s: &AlignedRecording| s.frames.iter().flat_map(|f| f.contour.clone()).collect::<Vec<_>>();
    let pairs = points(a).into_iter().zip(points(b));
    pairs.map(|(a, b)| (a.unwrap().at - b.unwrap().at + by).norm()).fold(0.0, f64::max)
}

#[test]
fn contours_in_a_frame_of_each_sample_are_brought_back_also_where_the_bones_fit_by_chance() {
    for seed in 0..40 {
        let left = seed % 2 == 1;
        let frames = speaker(seed, 90, 0.0, left);
        let right = read(&table(&frames, Point::zeros()));
        assert!(!is_told(&right), "{seed}: {:?}", right.notes);
        for towards in [12, 13] {
            let moved = exported(&frames, towards);
            // Bones where they are, and with the hyoid at the origin of the contour in the middle of all frames.
            let hyoid = frames.iter().map(|f| f[11]).sum::<Point>() / frames.len() as f64;
            for bones_by in [Point::zeros(), -hyoid] {
                let found = read(&table(&moved, bones_by));
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
        let hyoid = frames[0][11];
        // The origin at the place of the probe, and by chance at the hyoid.
        for origin in [Point::zeros(), hyoid] {
            let frames: Frames = frames.iter().map(|f| f.map(|p| p - origin)).collect();
            let found = read(&table(&frames, Point::zeros()));
            assert!(!is_told(&found), "{seed} {origin}: {:?}", found.notes);
        }
    }
}

#[test]
fn a_few_frames_and_a_map_tell_the_frame_of_a_contour() {
    let frames = speaker(3, 8, 0.0, false);
    let moved = table(&exported(&frames, 12), Point::zeros());
    assert!(is_told(&read(&moved)));
    let with = |recording, map: &str| AlignedRecording::new(recording, &Map::from_toml(map, "m").unwrap());
    assert!(!is_told(&with(&moved, "contour_frame = \"bones\"").unwrap()));
    // Eight frames whose bones fit by chance say nothing, but the user can.
    let chance = table(&exported(&frames, 12), -frames[0][11]);
    let stated = with(&chance, "contour_frame = \"hyoid\"").unwrap();
    assert!(
        is_told(&stated) && apart(&read(&table(&frames, Point::zeros())), &stated, -frames[0][11]) < 2e-6
    );
    let without = "contour_frame = \"hyoid\"\n[points]\nhyoid = \"ignore\"";
    assert!(with(&chance, without).unwrap_err().to_string().contains("needs the hyoid"));
    let axes = with(&chance, "contour_frame = \"hyoid\"\nback = \"x\"").unwrap_err().to_string();
    assert!(axes.contains("take back and up out of the map"), "{axes}");
    // Short recordings of one speaker are judged together.
    let parts: Vec<Recording> = speaker(5, 90, 0.0, false)
        .chunks(9)
        .map(|part| table(&exported(&part.to_vec(), 12), Point::zeros()))
        .collect();
    let all = AlignedRecording::all(&parts.iter().collect::<Vec<_>>(), &Map::default());
    assert!(all.len() == 10 && all.into_iter().all(|one| is_told(&one.unwrap())));
    // The line that refusals name leaves the bones out.
    let line = super::super::WITHOUT_BONES;
    assert!(with(&moved, line).unwrap().bones.is_empty());
}

#[test]
fn the_lower_end_of_a_fan_is_the_root_whichever_line_it_is_on() {
    // An arch from the root at line 8 to the tip at line 35, as AAA counts, and counted from the other end.
    let fan = |backwards: bool| {
        let mut text = String::new();
        for t in 0..5 {
            let _ = write!(text, "01\t{}\t29/11/2016 15:10:52\tpata", 0.5 + 0.0125 * f64::from(t));
            for line in 1..=42 {
                let i = if backwards { 43 - line } else { line };
                match f64::from(i - 8) / 27.0 {
                    part @ 0.0..=1.0 => {
                        let turn = std::f64::consts::PI - 0.2 - 2.2 * part;
                        let _ = write!(
                            text,
                            "\t{:.4}\t{:.4}",
                            60.0 + 35.0 * turn.cos(),
                            40.0 + 32.0 * turn.sin()
                        );
                    }
                    _ => text += "\t*\t*",
                }
            }
            text += "\n";
        }
        read(&Recording::from_bytes(text.as_bytes(), "fan.txt", None).unwrap()[0])
    };
    let (forwards, backwards) = (fan(false), fan(true));
    for (seen, is_turned) in [(&forwards, false), (&backwards, true)] {
        let points: Vec<Point> = seen.frames[0].contour.iter().flatten().map(|m| m.at).collect();
        let (root, tip) = (points[0], points[points.len() - 1]);
        assert!(seen.mirrored && root.x > tip.x && root.y < tip.y, "{root} {tip}");
        assert_eq!(seen.notes.iter().filter(|n| n.as_str() == REVERSED).count(), usize::from(is_turned));
        assert_eq!(seen.notes.iter().filter(|n| n.contains("the lower end of the contour")).count(), 1);
    }
    assert_eq!(forwards.frames[0].contour, backwards.frames[0].contour);
}

/// Coils of tongue and jaw over 60 frames, mm, x to the front as in the X-ray microbeam: the jaw turns about a point near the ears.
fn coils(change: impl Fn(&str, Point) -> Point) -> AlignedRecording {
    let mut text = "time_s,point,x_mm,y_mm\n".to_owned();
    let mut rng = random(11);
    for t in 0..60 {
        let open: f64 = -0.09 + 0.09 * (0.3 * f64::from(t)).cos();
        let jaw = |p: Point| {
            let from = p - Point::new(-85.0, 35.0);
            let turned = Point::new(
                open.cos() * from.x - open.sin() * from.y,
                open.sin() * from.x + open.cos() * from.y,
            );
            turned + Point::new(-85.0, 35.0)
        };
        let places = [("T1", [-14.0, 0.0]), ("T2", [-28.0, 8.0]), ("T3", [-42.0, 8.0]), ("T4", [-55.0, 2.0])];
        let places =
            places.map(|(n, p)| (n, jaw(Point::from(p)) + Point::new(0.0, 3.0 * (0.5 * f64::from(t)).sin())));
        let bones =
            [("MANi", [-2.0, -10.0]), ("MANm", [-30.0, -12.0])].map(|(n, p)| (n, jaw(Point::from(p))));
        for (name, p) in places.into_iter().chain(bones) {
            let p = change(name, p) + Point::new(rng(), rng()) * 0.1;
            let _ = writeln!(text, "{},{name},{},{}", 0.0069 * f64::from(t), p.x, p.y);
        }
    }
    read(&Recording::from_bytes(text.as_bytes(), "coils.csv", None).unwrap()[0])
}

#[test]
fn coils_on_the_jaw_are_the_mandible_and_two_of_them_turn_it() {
    let seen = coils(|_, p| p);
    assert_eq!((seen.bones.as_slice(), seen.ignored.len()), (&[MANDIBLE.to_owned()][..], 0));
    assert_eq!(seen.notes, Vec::<String>::new());
    // The way of the mental spine, which is below and behind the incisors, about the same point.
    let one = |front: Point| {
        let at = |open: f64| {
            let from = front - Point::new(-85.0, 35.0);
            Point::new(open.cos() * from.x - open.sin() * from.y, open.sin() * from.x + open.cos() * from.y)
        };
        (at(-0.18) - at(0.0)) * 1e-3
    };
    let ends = |axis: usize| {
        let all = seen.frames.iter().map(|f| f.bones[0].unwrap()[axis]);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    let (spine, incisor) = (one(Point::new(-16.0, -30.0)), one(Point::new(-2.0, -10.0)));
    let off = |of: Point| (ends(0) - of.x.abs()).hypot(ends(1) - of.y.abs());
    assert!(off(spine) < 1.5e-3 && off(incisor) > 2.5e-3, "{} {}", off(spine), off(incisor));
    // The names of other laboratories; beside a contour, by which the body is placed, such a coil is not used.
    for name in ["JAW", "LI", "li", "MANi", "Lower incisor", "jaw"] {
        let text = format!("time_s,point,x_mm,y_mm\n0,TT,0,10\n0,TB,15,15\n0,{name},-12,2\n");
        let seen = read(&Recording::from_bytes(text.as_bytes(), "t.csv", None).unwrap()[0]);
        assert_eq!(seen.bones, [MANDIBLE], "{name}");
        let text = text.replace("TT", "tongue_1").replace("TB", "tongue_0");
        let seen = read(&Recording::from_bytes(text.as_bytes(), "t.csv", None).unwrap()[0]);
        assert_eq!((seen.bones.len(), seen.ignored.as_slice()), (0, &[name.to_owned()][..]));
    }
}

#[test]
fn coils_of_tongue_and_jaw_that_belong_to_two_frames_or_are_exchanged_are_told() {
    let told = |change: &dyn Fn(&str, Point) -> Point| coils(change).notes;
    let of_tongue =
        |by: f64| move |name: &str, p: Point| if name.starts_with('T') { p + Point::new(0.0, by) } else { p };
    assert!(
        told(&of_tongue(15.0))[0].contains("T1 lies") && told(&of_tongue(15.0))[0].contains("above MANi")
    );
    assert!(told(&of_tongue(-30.0))[0].contains("below MANi"));
    let exchanged = told(&|name, p| match name {
        "T1" => p + Point::new(12.0, -10.0),
        "MANi" => p + Point::new(-12.0, 10.0),
        _ => p,
    });
    assert!(
        exchanged.len() == 1 && exchanged[0].contains("MANi") && exchanged[0].contains("exchanged with it"),
        "{exchanged:?}"
    );
}
