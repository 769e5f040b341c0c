//! A body is placed in the frame of a recording by its contour, bones and palate.

use tongue_fit::body::{Body, HYOID, MANDIBLE};
use tongue_fit::geometry::{Point, Similarity};
use tongue_fit::inverse::Recorded;
use tongue_fit::measured::recording::AlignedRecording;
use tongue_fit::track::TongueSurface;
use tongue_infer::adapt::{Registration, RegistrationData, RestError, mark_of, similarity_by_bones};

fn body() -> Body<2> {
    Body::tongue(5.5e-3).unwrap()
}

fn on_surface(body: &Body<2>, behind: f64) -> Point {
    let surface = TongueSurface::of(body).unwrap();
    let at = surface.tip - behind;
    surface.curve.weights(at).iter().map(|(n, w)| body.mesh.nodes[*n] * *w).sum()
}

fn contour(body: &Body<2>, count: usize) -> Vec<Point> {
    (0..count).map(|i| on_surface(body, 95e-3 - 92e-3 * i as f64 / (count - 1) as f64)).collect()
}

/// Largest distance between the images of a node of the outline.
fn apart(a: &Similarity, b: &Similarity, body: &Body<2>) -> f64 {
    let surface = body.mesh.surface_nodes().into_iter().map(|n| body.mesh.nodes[n]);
    surface.map(|p| (a.place(p) - b.place(p)).norm()).fold(0.0, f64::max)
}

#[test]
fn a_body_that_was_turned_scaled_and_shifted_is_found_again() {
    let body = body();
    // The truth is far from the start of the search: a face that looks up by 25 degrees in the frame of an image.
    let truth = Similarity::new(1.08, -0.43, Point::new(0.09, -0.05));
    let seen = |bone: &str| Some(truth.place(mark_of(&body, bone).unwrap()));
    for count in [11, 100] {
        let drawn: Vec<Point> = contour(&body, count).iter().map(|p| truth.place(*p)).collect();
        let found = RegistrationData::of_contour(&drawn, seen(MANDIBLE), seen(HYOID)).place(&body).unwrap();
        // The priors of rotation and scale shrink the result slightly.
        assert!(apart(&found.similarity, &truth, &body) < 1.5e-3, "{found:?}");
        assert!(found.rms_m < 0.5e-3);
        let alone = RegistrationData::of_contour(&drawn, None, None).place(&body).unwrap();
        let far = apart(&alone.similarity, &truth, &body);
        assert!(far < 12e-3, "{far} {alone:?}");
    }
}

#[test]
fn a_hyoid_that_is_elsewhere_does_not_turn_the_tongue() {
    let body = body();
    let (spine, hyoid) = (mark_of(&body, MANDIBLE).unwrap(), mark_of(&body, HYOID).unwrap());
    // The hyoid is 12 mm lower. The two landmarks alone would turn the body by 17 degrees.
    let low = hyoid - Point::new(0.0, 12e-3);
    let found =
        RegistrationData::of_contour(&contour(&body, 11), Some(spine), Some(low)).place(&body).unwrap();
    assert!(found.similarity.angle().abs() < 0.1, "{}", found.similarity.angle());
    assert!((found.similarity.scale() - 1.0).abs() < 0.06);
    let by_two = similarity_by_bones(&body, |b| Some(if b == HYOID { low } else { spine })).unwrap();
    assert!(by_two.angle().abs() > 0.25);
}

#[test]
fn a_palate_of_another_frame_is_left_out_and_named() {
    let body = body();
    let palate = body.palate.clone().unwrap();
    let drawn = with_bones(&body, &contour(&body, 11), Point::zeros(), 1);
    let right = drawn.clone().with_palate(Some(&palate)).place(&body).unwrap();
    assert!(!right.without_palate && right.doubt().is_none(), "{right:?}");
    let elsewhere: Vec<Point> = palate.iter().map(|p| p + Point::new(40e-3, -40e-3)).collect();
    let wrong = drawn.clone().with_palate(Some(&elsewhere)).place(&body).unwrap();
    assert!(wrong.without_palate, "{wrong:?}");
    assert_eq!(wrong.similarity, drawn.place(&body).unwrap().similarity);
    assert!(wrong.doubt().unwrap().contains("the palate does not fit"));
}

#[test]
fn a_recording_in_the_frame_of_the_body_leaves_it_there() {
    let body = body();
    let found = with_bones(&body, &contour(&body, 300), Point::zeros(), 1).place(&body).unwrap();
    assert!(apart(&found.similarity, &Similarity::IDENTITY, &body) < 0.1e-3);
    crate::fixtures::says(RegistrationData::default().place(&body), "mental spine and the hyoid");
}

/// A contour, the mental spine at its place and the hyoid displaced by `off` (m), in this number of frames.
fn with_bones(body: &Body<2>, drawn: &[Point], off: Point, frames: usize) -> RegistrationData {
    let (spine, hyoid) = (mark_of(body, MANDIBLE).unwrap(), mark_of(body, HYOID).unwrap());
    RegistrationData { frames, ..RegistrationData::of_contour(drawn, Some(spine), Some(hyoid + off)) }
}

/// Distance of the farther bone from its place, mm.
fn off_mm(placed: &Registration) -> f64 {
    placed.bones_m.iter().map(|b| b.1 * 1e3).fold(0.0, f64::max)
}

#[test]
fn a_bone_more_than_10_mm_from_its_place_refuses_a_recording_in_the_plane_and_in_space() {
    let body = body();
    let drawn = contour(&body, 11);
    for (off_m, is_refused) in [([0.0, 0.0], false), ([0.0, -8e-3], false), ([8e-3, -28e-3], true)] {
        let data = with_bones(&body, &drawn, Point::from(off_m), 40);
        let mut recording = AlignedRecording::of_contours(&[&drawn]);
        recording.bones = vec![MANDIBLE.to_owned(), HYOID.to_owned()];
        let aligned_recording = mark_of(&body, HYOID).map(|hyoid| hyoid + Point::from(off_m));
        recording.frames[0].bones = vec![mark_of(&body, MANDIBLE), aligned_recording];
        recording.frames = vec![recording.frames[0].clone(); 40];
        let in_plane = data.place(&body).and_then(Registration::in_one_frame).map(drop);
        let in_space = Recorded::of_recordings(&[&recording], Some(&body), None).map(drop);
        for found in [in_plane, in_space] {
            match found {
                Ok(()) => assert!(!is_refused, "{off_m:?}"),
                Err(RestError::NotOneFrame(why)) => {
                    assert!(
                        is_refused
                            && ["the hyoid lies", "hyoid = \"ignore\""].iter().all(|w| why.contains(w))
                    );
                }
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn a_contour_of_another_scale_or_without_its_root_is_named_beside_a_bone_far_from_its_place() {
    let body = body();
    let whole = contour(&body, 11);
    let of = |drawn: &[Point], up_m: f64| {
        with_bones(&body, drawn, Point::new(0.0, up_m), 90).place(&body).unwrap()
    };
    let larger: Vec<Point> = whole.iter().map(|p| p * 1.5 + Point::new(20e-3, -20e-3)).collect();
    let behind: Vec<Point> = whole.iter().map(|p| p + Point::new(25e-3, 0.0)).collect();
    for (placed, expected) in [
        (of(&larger, 0.0), "its unit is larger"),
        (of(&behind, 0.0), "not in one frame"),
        (of(&whole[4..], -35e-3), "its root is not drawn"),
    ] {
        let message = placed.in_one_frame().unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains("hyoid = \"ignore\""), "{message}");
    }
    // A contour without the root is used although the hyoid is 10 to 14 mm off, with a note.
    let mut used = 0;
    for down_mm in 0..40 {
        let short = of(&whole[4..], -1e-3 * f64::from(down_mm));
        let (off_mm, is_doubted) =
            (off_mm(&short), short.doubt().is_some_and(|message| message.contains("its root is not drawn")));
        assert_eq!((short.in_one_frame().is_ok(), is_doubted), (off_mm <= 14.0, off_mm > 10.0), "{off_mm}");
        used += i32::from(off_mm > 10.0 && off_mm <= 14.0);
    }
    assert!(used > 2, "{used}");
}

#[test]
fn a_bone_10_to_20_mm_from_its_place_is_told_of_single_frames_and_refused_of_whole_recordings() {
    let body = body();
    let drawn = contour(&body, 11);
    let mut counts = [0; 3];
    for down_mm in (0..80).step_by(8) {
        let off = Point::new(0.0, -1e-3 * f64::from(down_mm));
        let of = |frames| with_bones(&body, &drawn, off, frames).place(&body).unwrap();
        let one = of(1);
        let off_mm = off_mm(&one);
        for (frames, most_mm) in [(1, 19.75), (10, 17.5), (20, 15.0), (40, 10.0), (90, 10.0)] {
            assert_eq!(of(frames).in_one_frame().is_ok(), off_mm <= most_mm, "{off_mm}");
        }
        let is_doubted = one.doubt().is_some_and(|message| message.contains("so few frames (1)"));
        assert_eq!(is_doubted, off_mm > 10.0, "{off_mm}");
        counts[usize::from(off_mm > 10.0) + usize::from(off_mm > 19.75)] += 1;
    }
    assert!(counts.iter().all(|n| *n > 0), "{counts:?}");
}
