//! Formants, muscle activity, contours and coils in one posterior with stretches: derivatives, what geometry does to them, what they add, and what
//! contradicts the rest.

use nalgebra::{DVector, SVector};
use tongue_core::random::normals;
use tongue_core::statics::lanes::Equilibrium;
use tongue_core::statistics::mean_and_variance;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::heard::{Airway, Articulation, Formants};
use tongue_fit::inverse::Matched;
use tongue_fit::measured::recording::{self, Format, Map, Recording};
use tongue_fit::measured::{Dataset, Target};
use tongue_fit::system::{Model, System, TissueModel};
use tongue_fit::track::TongueSurface;
use tongue_infer::posterior::{
    Beside, Density, Draw, Evaluator, Ground, Measurements, Mode, Priors, Sampling, Sight as _, Status,
    contradictions, gains, sample,
};

use crate::posterior::{coarse_ground, derivatives, solved};

const LIPS: Articulation =
    Articulation { jaw_deg: 0.0, hyoid_mm: [0.0, 0.0], lip_opening_mm: 8.0, lip_protrusion_mm: 0.0 };

fn grounds() -> Vec<Ground> {
    let elements = Model { tissue: TissueModel::FiniteElement, ..Model::default() };
    let make =
        |h: f64, model: &Model| Ground::new(&Body::tongue(h).unwrap(), model, &Priors::default()).unwrap();
    vec![make(5.5e-3, &Model::default()), make(8e-3, &elements)]
}

fn stretches() -> Measurements {
    let target: Target = Dataset::reference().unwrap().stretches("S2", "a").unwrap();
    Measurements::of(&Matched::new(&Body::tongue(5.5e-3).unwrap().mesh, &target).unwrap())
}

fn formants(ground: &Ground, hz: &[f64]) -> Beside {
    let about = Formants::about(&airway(ground), &LIPS, hz.len(), ground.system.rest()).unwrap();
    about.measured(0, hz, 0.03)
}

fn airway(ground: &Ground) -> Airway {
    Airway::round(&ground.body, Airway::drawn().unwrap()).unwrap()
}

/// Activity of GGa, and of the hyoglossus, HGa and HGp together, in the posture and in the baseline.
fn emg(active: [f64; 2]) -> Beside {
    let electrodes = [
        ("GGa".to_owned(), vec![0], vec![(Some(0), 0.9), (None, 0.3)]),
        ("HG".to_owned(), vec![6, 7], vec![(Some(0), active[0]), (None, active[1])]),
        ("SGm".to_owned(), vec![4], vec![(Some(0), 1.0)]),
    ];
    Beside::emg(&electrodes, |posture| format!("{posture:?}"))
}

/// Points of the surface where the nodes are at `positions`, m.
fn points_of(ground: &Ground, positions: &[Point]) -> Vec<Point> {
    let curve = TongueSurface::of(&ground.body).unwrap().curve;
    let place = |i: usize| curve.weights(curve.length() * (0.2 + 0.06 * f64::from(i as u32)));
    (0..11).map(|i| place(i).iter().map(|(node, w)| positions[*node] * *w).sum()).collect()
}

/// Contours of the posture and, if there is one, of the baseline.
fn contours(ground: &Ground, posture: &[Point], baseline: Option<&[Point]>) -> Beside {
    let all: Vec<&[Point]> = [posture].into_iter().chain(baseline).collect();
    Beside::points(&ground.body, &recording::AlignedRecording::of_contours(&all), &[Some(0), None]).unwrap()
}

/// Coils at three places of the tongue where the nodes are at these positions, m: in the posture and in the baseline.
fn coils(ground: &Ground, positions: [&[Point]; 2]) -> Beside {
    let surface = TongueSurface::of(&ground.body).unwrap();
    let file = |positions: &[Point]| {
        let place = |behind: f64| -> Point {
            let weights = surface.curve.weights(surface.tip - behind);
            weights.iter().map(|(node, w)| positions[*node] * *w).sum()
        };
        let row =
            |(n, behind): (usize, f64)| format!("T{n},{},{}\n", 1e3 * place(behind).x, 1e3 * place(behind).y);
        let rows: String = (1..).zip([10e-3, 25e-3, 40e-3]).map(row).collect();
        let table = format!("point,x_mm,y_mm\n{rows}");
        Recording::from_bytes(table.as_bytes(), "coils.csv", Some(Format::Tidy)).unwrap().remove(0)
    };
    let both = Recording::of_coils(&positions.map(file)).unwrap();
    let seen = recording::AlignedRecording::new(&both, &Map::default()).unwrap();
    Beside::points(&ground.body, &seen, &[Some(0), None]).unwrap()
}

fn with_all(ground: &Ground) -> Measurements {
    let rest = ground.system.rest();
    let points: Vec<Point> = points_of(ground, rest).iter().map(|p| p + Point::new(1e-3, 2e-3)).collect();
    let baseline = points_of(ground, rest);
    let beside = vec![
        formants(ground, &[600.0, 1300.0]),
        emg([0.8, 0.1]),
        contours(ground, &points, Some(&baseline)),
        coils(ground, [rest, rest]),
    ];
    Measurements { beside, ..stretches() }
}

#[test]
fn the_gradient_is_the_derivative_of_the_density() {
    for ground in &grounds() {
        let mut density = Density::new(ground, with_all(ground)).unwrap();
        let mode = Mode::find(&mut density).unwrap();
        let n = density.parameters.len();
        let mut evaluator = Evaluator::new(&density);
        let at = &mode.scores + normals(n, &mut fastrand::Rng::with_seed(1)) * 0.2;
        let h = 1e-3;
        for (i, (exact, difference)) in
            derivatives(&mut evaluator, &at, &mode.place, h).into_iter().enumerate()
        {
            assert!(
                (exact - difference).abs() < 2e-6 * (1.0 + difference.abs()),
                "{i}: {exact} {difference}"
            );
        }
        // The rates at the mode, by which it was found, are those of the values too.
        let here = solved(&mut evaluator, &at, &mode.place);
        let (linear, _) = evaluator.linearise(&at, &here.place).unwrap();
        let rows = density.rows().len() - density.seen.len();
        assert_eq!(rows, 2 + 4 + 22 + 12, "activity in one posture says nothing");
        for i in 0..n {
            let mut side = |by: f64| {
                let mut x = at.clone();
                x[i] += by;
                DVector::from_vec(solved(&mut evaluator, &x, &here.place).place.beside)
            };
            let difference = (side(h) - side(-h)) / (2.0 * h);
            for row in 0..rows {
                let exact = linear.jacobian[(linear.values.len() - rows + row, i)];
                // Hertz for the formants, one for the logarithms of activity, and a millimetre for points.
                let scale = if row < 2 {
                    1e3
                } else if row < 6 {
                    1.0
                } else {
                    1e-3
                };
                assert!(
                    (exact - difference[row]).abs() < 1e-4 * scale,
                    "{row} {i}: {exact} {}",
                    difference[row]
                );
            }
        }
    }
}

#[test]
fn what_geometry_does_to_other_data_is_what_bodies_that_are_moved_show() {
    for ground in &grounds() {
        let mut density = Density::new(ground, with_all(ground)).unwrap();
        let mode = Mode::find(&mut density).unwrap();
        let (meaning, _) = density.meaning(&mode.scores);
        let (linear, _) = Evaluator::new(&density).linearise(&mode.scores, &mode.place).unwrap();
        let of_muscles = ground.muscles.len();
        let all: Vec<usize> = (0..of_muscles).collect();
        // Of the posture and of the baseline.
        let values = |shapes: &[Equilibrium<2>]| -> DVector<f64> {
            let shape = |posture: Option<usize>| shapes[posture.unwrap_or(1)].positions.as_slice();
            DVector::from_vec(density.seen.beside.iter().flat_map(|b| b.of_shapes(shape)).collect())
        };
        let h = 1e-3;
        let mut largest: f64 = 0.0;
        for (which, derivative) in [(0, &linear.geometry.ends), (1, &linear.geometry.outline)] {
            for f in (0..derivative.ncols()).step_by(7) {
                let side = |by: f64| {
                    let mut fields = [vec![0.0; ground.ends.len()], vec![0.0; ground.outline.len()]];
                    fields[which][f] = by;
                    let body = ground.displaced(&fields[0], &fields[1]).unwrap();
                    let system = System::new(&body.mesh, &ground.model, &all).unwrap();
                    let loads: Vec<_> = (0..2)
                        .map(|s| ground.load(&meaning, s, Some(mode.place.shape(s).0)).in_body(&system))
                        .collect();
                    values(&density.lanes().solve(&loads, density.settings()))
                };
                let difference = (side(h) - side(-h)) / (2.0 * h);
                for (row, difference) in difference.iter().enumerate() {
                    let exact = derivative[(of_muscles + row, f)];
                    let scale = if row < 2 { 10.0 } else { 1e-3 };
                    largest = largest.max(difference.abs() / scale);
                    assert!(
                        (exact - difference).abs() < 1e-3 * scale,
                        "{which} {f} {row}: {exact} {difference}"
                    );
                }
            }
        }
        assert!(largest > 0.3, "they do matter: {largest}");
    }
}

#[test]
fn each_kind_adds_to_what_is_known() {
    let ground = &grounds()[0];
    let settings = Sampling { draws: 1000, seed: 1 };
    let alone = sample(ground, stretches(), &settings).unwrap();
    assert_eq!(alone.status, Status::Mixed, "{}", alone.why);
    // The 95 % interval of the 7 % that are counted as the error of formants linear about the mode holds 93 to 97 % of the exact ones over
    // the draws. Their root mean square is 9 %, by the few shapes that nearly touch the palate.
    let airway = airway(ground);
    let about = Formants::about(&airway, &LIPS, 2, &alone.mode.place.postures[0]).unwrap();
    let (mut near, mut count) = (0.0, 0.0);
    for shape in alone.shapes(0, 400) {
        // Some draws touch the palate, where there is no sound.
        let Ok(exact) = airway.sound(&shape, &LIPS) else { continue };
        for (linear, exact) in about.values(&shape).iter().zip(&exact.formants) {
            near += f64::from(u8::from((linear / exact.frequency_hz - 1.0).abs() < 1.96 * 0.07));
            count += 1.0;
        }
    }
    let part: f64 = near / count;
    eprintln!("of {count} linear formants {:.1} % are within 1.96 times 7 % of the exact ones", 100.0 * part);
    assert!(count > 400.0 && (0.93..=0.97).contains(&part), "{part}");
    // A contour of the baseline too tells more: the errors of the placement and of the body are those of both.
    let mean_sd = |draws: &[Draw]| {
        let sd = |m: usize| mean_and_variance(draws.iter().map(|d| d.change(0, m))).1.sqrt();
        (0..8).map(sd).sum::<f64>() / 8.0
    };
    let part = |beside: Beside| {
        let with = sample(ground, Measurements { beside: vec![beside], ..stretches() }, &settings).unwrap();
        assert_eq!(with.status, Status::Mixed, "{}", with.why);
        mean_sd(&with.draws) / mean_sd(&alone.draws)
    };
    let shape = &alone.mode.place.postures[0];
    let baseline = points_of(ground, &alone.mode.place.baseline);
    let posture = points_of(ground, shape);
    let one = part(contours(ground, &posture, None));
    let both = part(contours(ground, &posture, Some(&baseline)));
    let glued = part(coils(ground, [shape, &alone.mode.place.baseline]));
    eprintln!(
        "sd of F - F0 over that of lengths alone: contour {one:.3}, contours {both:.3}, coils of both {glued:.3}"
    );
    assert!((0.93..1.0).contains(&one) && (0.85..0.95).contains(&both), "{one} {both}");
    assert!((0.85..0.98).contains(&glued), "{glued}");
}

#[test]
fn what_each_kind_gains_is_told_and_a_contradiction_by_name() {
    // What is told is so on any mesh.
    let ground = &coarse_ground(&Priors::default());
    let settings = Sampling { draws: 1000, seed: 1 };
    let mode = Mode::find(&mut Density::new(ground, stretches()).unwrap()).unwrap();
    // What was seen beside the stretches fits the posterior's own mean.
    let shape: Vec<SVector<f64, 2>> = mode.place.postures[0].to_vec();
    let heard = formants(ground, &[600.0, 1300.0]);
    let heard = Beside { measured: heard.of_shapes(|_| &shape), ..heard };
    let baseline = points_of(ground, &mode.place.baseline);
    let drawn = contours(ground, &points_of(ground, &shape), Some(&baseline));
    let beside = vec![heard, emg([0.9, 0.3]), drawn];
    let all = sample(ground, Measurements { beside, ..stretches() }, &settings).unwrap();
    assert_eq!(all.status, Status::Mixed, "{}", all.why);
    assert!(contradictions(&all.density, &all.mode).is_empty());
    let gains = gains(&all, 0, &settings);
    let kinds: Vec<&str> = gains.iter().map(|g| g.kind.as_str()).collect();
    assert_eq!(kinds, ["formants", "EMG", "contour"]);
    for gain in &gains {
        let without = gain.sd_without_n.as_ref().unwrap();
        let parts: Vec<f64> = without.0.iter().zip(&gain.sd_with_n.0).map(|((_, a), (_, b))| b / a).collect();
        eprintln!("{}: sd with over without {parts:.2?}", gain.kind);
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        assert!(mean < 1.03, "{}: {parts:?}", gain.kind);
    }
    // Activity narrows the muscles of which it is; a contour narrows some.
    let ratio =
        |g: usize, m: usize| gains[g].sd_with_n.0[m].1 / gains[g].sd_without_n.as_ref().unwrap().0[m].1;
    assert!((0..8).any(|m| ratio(2, m) < 0.95), "{gains:?}");
    let of_hyoglossus = 0.5 * (ratio(1, 6) + ratio(1, 7));
    assert!(ratio(1, 0) < 0.9 && of_hyoglossus < 1.0, "{} {of_hyoglossus}", ratio(1, 0));
    // A contour that is nowhere near is told as a whole, though its points agree with each other.
    let away: Vec<Point> = points_of(ground, &shape).iter().map(|p| p + Point::new(0.0, 45e-3)).collect();
    let beside = vec![contours(ground, &away, None)];
    let mut density = Density::new(ground, Measurements { beside, ..stretches() }).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let told = contradictions(&density, &mode);
    assert!(told.iter().any(|c| c.name == "contour as a whole"), "{told:?}");
    // The gain of an electrode is free: other units of activity change nothing.
    let mode_with = |times: f64| {
        let mut beside = emg([0.8, 0.1]);
        beside.measured.iter_mut().take(2).for_each(|ln| *ln += times.ln());
        let mut density = Density::new(ground, Measurements { beside: vec![beside], ..stretches() }).unwrap();
        Mode::find(&mut density).unwrap().scores
    };
    assert!((mode_with(1.0) - mode_with(5.0)).amax() < 0.01);
    // A formant twice as high as any shape has it.
    let wrong = Measurements { beside: vec![formants(ground, &[2400.0])], ..stretches() };
    let mut density = Density::new(ground, wrong).unwrap();
    let mode = Mode::find(&mut density).unwrap();
    let told = contradictions(&density, &mode);
    assert!(told.iter().any(|c| c.name == "formants F1 in /a/" && c.p < 1e-3), "{told:?}");
}
