//! A speaker's body: an identity changes no bit, landmarks turn and scale, contours change the shape at rest, and a body that would fold is
//! refused.

use std::collections::BTreeMap;

use nalgebra::DVector;
use tongue_fit::body::{Anatomy, Body};
use tongue_fit::geometry::{Point, Similarity};
use tongue_fit::measured::recording::Map;
use tongue_fit::system::Model;
use tongue_infer::adapt::{AdaptationInput, Landmarks, Rest, RestShapeMethod, mark_of};
use tongue_infer::posterior::parameters;
use tongue_infer::track::TrackSettings;

use crate::synthetic::{Kind, Speaker, drawn_scores};

/// Scale of the tensions, N/m, and their correlation time, s.
const SCALE_N: f64 = 20.0;
const MEMORY_S: f64 = 0.1;

fn basis<'a>(body: &'a Body<2>, anatomy: &'a Anatomy) -> AdaptationInput<'a> {
    AdaptationInput {
        body,
        anatomy: Some(anatomy),
        model: Model::default(),
        contracting: (0..8).collect(),
        settings: TrackSettings::new(SCALE_N, MEMORY_S),
        palate: None,
    }
}

fn landmarks(body: &Body<2>, place: impl Fn(Point) -> Point) -> Landmarks {
    let named = ["mental_spine", "hyoid"].map(|b| (b.to_owned(), place(mark_of(body, b).unwrap())));
    Landmarks { named: BTreeMap::from(named), ..Landmarks::default() }
}

/// Tensions of all frames, drawn from the half-normal prior with its correlation in time.
fn drawn(times: &[f64], rng: &mut fastrand::Rng) -> Vec<Vec<f64>> {
    let all = drawn_scores(8, MEMORY_S, times, rng);
    all.iter().map(|x| x.iter().map(|g| SCALE_N * parameters::tension(*g).0).collect()).collect()
}

#[test]
fn an_identity_changes_no_bit() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let mut own = landmarks(&body, |p| p);
    own.contour = anatomy.outline().points[3..14].to_vec();
    own.named.insert("uvula".to_owned(), Point::new(0.06, 0.04));
    let adapted = basis(&body, &anatomy).adapt_to_landmarks(&own).unwrap();
    assert_eq!(adapted.body, body);
    assert!(adapted.notes.iter().any(|n| n.contains("uvula")), "landmarks that say nothing are named");
}

#[test]
fn exchanged_bones_and_points_out_of_order_are_told() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let contour = anatomy.outline().points[3..18].to_vec();
    let read = |rows: Vec<(String, Point)>, side: f64| {
        let row = |(name, p): &(String, Point)| format!("{name},{},{}\n", side * 1e3 * p.x, 1e3 * p.y);
        let text = "point,x_mm,y_mm\n".to_owned() + &rows.iter().map(row).collect::<String>();
        Landmarks::from_bytes(text.as_bytes(), "points.csv", &Map::default()).unwrap()
    };
    let doubt = |names: [&str; 2], order: &[usize], side: f64| {
        let bones = [mark_of(&body, "mental_spine").unwrap(), mark_of(&body, "hyoid").unwrap()];
        let bones = names.iter().zip(bones).map(|(name, at)| ((*name).to_owned(), at)).collect();
        let drawn = order.iter().enumerate().map(|(n, &p)| (format!("p{n}"), contour[p])).collect();
        read(bones, side).with_contour(read(drawn, side)).doubt().unwrap_or_default()
    };
    let right = ["mental_spine", "hyoid"];
    let along = Vec::from_iter(0..contour.len());
    let backwards = Vec::from_iter(along.iter().rev().copied());
    let mut disordered = along.clone();
    disordered.swap(3, 9);
    // All parts of the contour with at least eight points, in both directions, of faces to the left and to the right.
    for side in [1.0, -1.0] {
        for (first, last) in (0..=7).flat_map(|first| (first + 8..=15).map(move |last| (first, last))) {
            for order in [&along[first..last], &backwards[15 - last..15 - first]] {
                assert_eq!(doubt(right, order, side), "", "{order:?}");
            }
        }
        for order in [&along, &backwards] {
            let message = doubt(["hyoid", "mental_spine"], order, side);
            assert!(message.contains("the names of these two are exchanged"), "{message}");
        }
        assert!(doubt(right, &disordered, side).contains("not in their order along the tongue"));
    }
}

#[test]
fn landmarks_turn_scale_and_shift() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let from = [Point::new(0.0, 0.0), Point::new(1.0, 0.0)];
    let (angle, scale) = (0.2_f64, 1.1);
    let to = [Point::new(0.01, -0.02), Point::new(0.01 + scale * angle.cos(), -0.02 + scale * angle.sin())];
    let truth = Similarity::between(&from, &to).unwrap();
    let adapted = basis(&body, &anatomy).adapt_to_landmarks(&landmarks(&body, |p| truth.place(p))).unwrap();
    for (a, b) in adapted.body.mesh.nodes.iter().zip(&body.mesh.nodes) {
        assert!((a - truth.place(*b)).norm() < 1e-12);
    }
    let named = BTreeMap::from([("hyoid".into(), Point::zeros())]);
    let lonely =
        basis(&body, &anatomy).adapt_to_landmarks(&Landmarks { named, ..Landmarks::default() }).unwrap_err();
    assert!(lonely.to_string().contains("mental_spine"), "{lonely}");
}

#[test]
fn a_resting_contour_changes_the_shape_and_one_that_folds_it_is_refused() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let rest = Rest::new(&body, Similarity::IDENTITY).unwrap();
    // The dorsum is higher: control points 5 to 7 go up by 4 mm.
    let mut up = DVector::zeros(rest.unknowns());
    [11, 13, 15].into_iter().for_each(|i| up[i] = 4e-3);
    let other = Speaker::of(rest.body(&up));
    let drawn: Vec<Point> = (0..15)
        .map(|i| 6e-3 + (other.surface.tip - 8e-3) * f64::from(i) / 14.0)
        .map(|at| other.surface.curve.weights(at).iter().map(|(n, w)| other.body.mesh.nodes[*n] * *w).sum())
        .collect();
    let with = |contour: Vec<Point>| Landmarks { contour, ..landmarks(&body, |p| p) };
    let adapted = basis(&body, &anatomy).adapt_to_landmarks(&with(drawn.clone())).unwrap();
    assert_eq!(adapted.how, RestShapeMethod::Contour);
    assert!(adapted.rms_m.unwrap() < 0.3e-3, "{:?}", adapted.rms_m);
    assert!(adapted.least_area_ratio > 0.5 && adapted.notes.is_empty());
    let lengths = |b: &Body<2>| b.mesh.distance(b.mesh.muscles[1].ends());
    assert!(lengths(&adapted.body) > lengths(&body) + 3e-3, "GGm reaches the dorsum");
    // This contour in the floor of the mouth would turn the tissue inside out.
    let below: Vec<Point> = drawn.iter().map(|p| Point::new(p.x, -0.02 - 0.2 * p.y)).collect();
    let least = basis(&body, &anatomy).adapt_to_landmarks(&with(below)).unwrap().least_area_ratio;
    assert!(least >= 0.15, "no cell folds, whatever is asked: {least}");
}

#[test]
fn ten_speakers_are_met_or_refused_whichever_way_they_look() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let mut rng = fastrand::Rng::with_seed(16);
    let mut met = 0;
    for nth in 0..10 {
        let number = |rng: &mut fastrand::Rng| 2.0 * rng.f64() - 1.0;
        let similarity = Similarity::new(
            1.0 + 0.18 * number(&mut rng),
            0.35 * number(&mut rng),
            Point::new(number(&mut rng), number(&mut rng)) * 0.05,
        );
        let rest = Rest::new(&body, similarity).unwrap();
        // Another shape of the surface and the root, and another hyoid.
        let mut change = DVector::from_fn(rest.unknowns(), |i, _| {
            let (sd, point) = (if (4..10).contains(&(i / 2)) { 3e-3 } else { 1e-3 }, i / 2);
            if point == 0 { 0.0 } else { sd * number(&mut rng) }
        });
        change[21] -= 5e-3 * rng.f64();
        let other = Speaker::of(rest.body(&change));
        let side = if nth % 2 == 0 { 1.0 } else { -1.0 };
        let mut table = "point,x_mm,y_mm\n".to_owned();
        let mut write = |name: &str, p: Point| {
            table += &format!("{name},{},{}\n", side * p.x * 1e3, p.y * 1e3);
        };
        for bone in ["mental_spine", "hyoid"] {
            write(bone, mark_of(&other.body, bone).unwrap());
        }
        for i in 0..15 {
            let at = 6e-3 + (other.surface.tip - 8e-3) * f64::from(i) / 14.0;
            let weights = other.surface.curve.weights(at);
            write(&format!("tongue_{i}"), weights.iter().map(|(n, w)| other.body.mesh.nodes[*n] * *w).sum());
        }
        let drawn = Landmarks::from_bytes(table.as_bytes(), "rest.csv", &Map::default()).unwrap();
        assert_eq!(drawn.mirrored, side < 0.0, "{nth}");
        let adapted = basis(&body, &anatomy).adapt_to_landmarks(&drawn).unwrap();
        let length = |b: &Body<2>| b.mesh.distance(b.mesh.muscles[0].ends());
        let ratio = length(&adapted.body) / length(&other.body);
        if adapted.doubts(&body).is_empty() {
            met += 1;
            let rms = adapted.rms_m.unwrap();
            assert!(rms < 0.7e-3 && (ratio - 1.0).abs() < 0.05, "{nth}: {rms} m, GGa {ratio}");
        }
    }
    assert!(met >= 8, "{met} of 10 are met");
}

#[test]
fn many_frames_tell_the_rest_shape_of_another_speaker() {
    let anatomy = Anatomy::reference().unwrap();
    let body = Body::tongue(5.5e-3).unwrap();
    let rest = Rest::new(&body, Similarity::IDENTITY).unwrap();
    let mut change = DVector::zeros(rest.unknowns());
    [(4, -2e-3), (7, 3e-3), (11, -3e-3), (13, -3e-3), (16, 2e-3)]
        .into_iter()
        .for_each(|(i, d)| change[i] = d);
    let speaker = Speaker::of(rest.body(&change));
    let mut rng = fastrand::Rng::with_seed(5);
    let times: Vec<f64> = (0..24).map(|i| 0.1 * f64::from(i)).collect();
    let all = drawn(&times, &mut rng);
    let shapes =
        all.iter().zip(&times).filter_map(|(t, time)| Some((speaker.shape(t, Point::zeros())?, *time)));
    let (shapes, kept): (Vec<_>, Vec<_>) = shapes.unzip();
    let recording = speaker.record(&shapes, &kept, Kind::Contour(11, 0.5e-3), &mut rng);
    let basis = basis(&body, &anatomy);
    let fit = |how| basis.adapt_to_recordings(&[&recording], how, &[], &|_, _| {}).unwrap();
    let (similar, joint) = (fit(RestShapeMethod::Similarity), fit(RestShapeMethod::Joint));
    // Root mean square distance between a body's surface at rest and the speaker's.
    let away = |b: &Body<2>| {
        let curve = &speaker.surface.curve;
        let place = |at: f64| -> Point {
            curve.weights(at).iter().map(|(n, w)| speaker.body.mesh.nodes[*n] * *w).sum()
        };
        let surface = tongue_fit::track::TongueSurface::of(b).unwrap();
        let squares = (2..20)
            .map(|i| surface.distance(place(curve.length() * f64::from(i) / 28.0), &b.mesh.nodes).powi(2));
        (squares.sum::<f64>() / 18.0).sqrt()
    };
    assert!(away(&joint.body) < 0.87 * away(&similar.body), "{} {}", away(&joint.body), away(&similar.body));
    assert!(joint.rms_m.unwrap() < 0.6e-3, "{:?}", joint.rms_m);
    assert!(joint.least_area_ratio > 0.5 && joint.doubts(&body).is_empty(), "{:?}", joint.doubts(&body));
}

#[test]
fn slicer_s_markups_and_tables_say_the_same() {
    let table = "point,x_mm,y_mm\nmental_spine,1,2\nhyoid,38,-3\n";
    let markups = include_str!("../fixtures/slicer.mrk.json");
    let map = Map::default();
    let a = Landmarks::from_bytes(table.as_bytes(), "a.csv", &map).unwrap();
    let b = Landmarks::from_bytes(markups.as_bytes(), "b.mrk.json", &map).unwrap();
    assert_eq!(a.named, b.named);
    let other = Landmarks::from_bytes(table.replace("hyoid", "Hyoid").as_bytes(), "c.csv", &map).unwrap();
    assert_eq!(a.named, other.named);
    assert_eq!(b.contour, [Point::new(0.010, 0.040)]);
    let wrong = Landmarks::from_bytes(b"{\"markups\": 3}", "c.mrk.json", &map).unwrap_err().to_string();
    assert!(wrong.contains("c.mrk.json") && wrong.contains("Slicer"), "{wrong}");
}
