//! Tensions over time: the prior of frames, how a shape is reached, the jaw of formants, predicted points, repeatability.

use nalgebra::{DMatrix, DVector, SVector};
use tongue_core::body::{Body, DEFAULT_SPACING_M, largest_distance};
use tongue_core::geometry::Point;
use tongue_core::random::normal;
use tongue_core::statics::{self, SAME_SHAPE_M, SolveSettings, Workspace};
use tongue_core::system::{Model, System};
use tongue_infer::track::prediction::{ContourPoint, MEAN, Process, Split};
use tongue_infer::track::repeatability::{POINTS, Repeatable, icc, of_label, repeated};
use tongue_infer::track::{
    Frame, FrameSolver, OrnsteinUhlenbeck, Reachability, Softplus, TrackingContext, opened_deg,
};
use tongue_input::measured::recording::Label;

#[test]
fn solutions_images_and_draws_are_those_of_the_whole_matrix() {
    let (n, times, memory) = (2, [0.0, 0.01, 0.03, 0.035], 0.02);
    let mut rng = fastrand::Rng::with_seed(3);
    let mut random = |rows: usize, columns: usize| DMatrix::from_fn(rows, columns, |_, _| rng.f64() - 0.5);
    let covariance = DMatrix::identity(n, n) * 0.7 + DMatrix::from_element(n, n, 0.2);
    let curvature: Vec<_> = times.iter().map(|_| random(3, n)).map(|j| j.transpose() * j).collect();
    let chain = OrnsteinUhlenbeck::new(covariance.clone().try_inverse().unwrap(), memory, &times);

    // The covariance of the process, element by element.
    let all = n * times.len();
    let process = DMatrix::from_fn(all, all, |i, j| {
        let apart: f64 = times[i / n] - times[j / n];
        covariance[(i % n, j % n)] * (-apart.abs() / memory).exp()
    });
    let mut whole = process.try_inverse().unwrap();
    let z = random(all, 1);
    let blocks =
        |v: &DMatrix<f64>| (0..times.len()).map(|t| v.rows(t * n, n).into_owned()).collect::<Vec<_>>();
    let image = chain.image(&blocks(&z).iter().map(|b| b.column(0).into_owned()).collect::<Vec<_>>());
    for (a, b) in image.iter().zip(blocks(&(&whole * &z))) {
        assert!((a - b.column(0)).amax() < 1e-9);
    }
    for (t, g) in curvature.iter().enumerate() {
        let mut part = whole.view_mut((t * n, t * n), (n, n));
        part += g;
    }
    let inverse = whole.try_inverse().unwrap();
    let factors = chain.factorise(curvature).unwrap();
    let right = random(all, 3);
    let mut solved = blocks(&right);
    factors.solve(&mut solved);
    for (a, b) in solved.iter().zip(blocks(&(&inverse * right))) {
        assert!((a - b).amax() < 1e-10);
    }
    // Draws made window by window, the last first, are the same bits.
    let whole = blocks(&DMatrix::from_fn(all, 2, |i, j| (i + 3 * j) as f64 * 0.1));
    let mut at_once = whole.clone();
    factors.colour(&mut at_once, 0, None);
    let mut last = whole[2..].to_vec();
    factors.colour(&mut last, 2, None);
    let mut first = whole[..2].to_vec();
    factors.colour(&mut first, 0, Some(&last[0]));
    assert_eq!([first, last].concat(), at_once);
    // The images of unit vectors are a square root of the covariance.
    let mut root = blocks(&DMatrix::identity(all, all));
    factors.colour(&mut root, 0, None);
    let mut square = DMatrix::zeros(all, all);
    for (i, a) in root.iter().enumerate() {
        for (j, b) in root.iter().enumerate() {
            square.view_mut((i * n, j * n), (n, n)).copy_from(&(a * b.transpose()));
        }
    }
    assert!((square - inverse).amax() < 1e-10);
}

#[test]
fn the_slope_is_the_derivative_and_nothing_overflows() {
    let link = Softplus::default();
    for h in [-900.0, -20.0, -1.0, 0.0, 0.5, 8.0, 60.0, 5000.0] {
        let (f, slope) = link.tension(h);
        let difference = (link.tension(h + 1e-4).0 - link.tension(h - 1e-4).0) / 2e-4;
        assert!(f >= 0.0 && (slope - difference).abs() < 1e-6, "{h}: {f} {slope} {difference}");
    }
    assert!((link.tension(0.0).0 - 3.0 * 2f64.ln()).abs() < 1e-12);
    // The width of the prior's 95 % interval.
    assert!((link.prior_quantile(1.96) - link.prior_quantile(-1.96) - 52.7).abs() < 0.1);
    // Its standard deviation, from two million draws of another program.
    assert!((link.prior_sd_n() - 15.62).abs() < 0.02, "{}", link.prior_sd_n());
    assert!((Softplus::of_scale(40.0).tension(16.0).0 - 2.0 * link.tension(8.0).0).abs() < 1e-12);
}

#[test]
fn a_shape_that_one_muscle_before_the_others_leads_to_is_reached_in_another_way() {
    let body = Body::tongue(DEFAULT_SPACING_M).unwrap();
    let muscles: Vec<usize> = (0..body.mesh.muscles.len()).collect();
    let system = System::new(&body.mesh, &Model::default(), &muscles).unwrap();
    // At these tensions, N/m, the tongue has two shapes: Newton's method from rest finds the one to which the load path does not lead.
    let tensions = [77.0, 47.6, 14.4, 89.0, 0.0, 4.7, 38.6, 70.2];
    let link = Softplus::default();
    let x = DVector::from_iterator(8, tensions.map(|f| link.bend_n * (f / link.bend_n).exp_m1().ln()));
    let mut solver = FrameSolver::new(TrackingContext::fixed(&system), link);
    let frame = Frame::default();
    let other = solver.solve(&frame, &x, None).unwrap().to_vec();
    let mut w = Workspace::new(&system);
    statics::trace(&system, &mut w, &tensions, &SolveSettings::default());
    let together = w.positions();
    assert!(largest_distance(&other, together) > 1e-3);
    let reached = |solver: &mut FrameSolver<'_>, positions: &[SVector<f64, 2>]| {
        solver.how_reached(&[(&frame, &x, Some(positions))]).remove(0)
    };
    assert_eq!(reached(&mut solver, together), Some(Reachability::LoadPath));
    assert_eq!(reached(&mut solver, &other), Some(Reachability::OtherWay));
    // Without observations the nearest reached shape is the end of the load path, not that of Newton's method.
    let nearest = solver.nearest_reached(&frame, &x).unwrap();
    assert!(largest_distance(&nearest, together) <= SAME_SHAPE_M);
    // Positions that are no equilibrium are not reached.
    let nowhere: Vec<_> = other.iter().map(|p| p * 1.1).collect();
    assert_eq!(reached(&mut solver, &nowhere), None);
}

#[test]
fn the_angle_of_a_jaw_is_found_from_the_shift_of_its_mark() {
    let mark = Point::new(-0.07, -0.085);
    let angle: f64 = 3.0_f64.to_radians();
    let turned =
        Point::new(angle.cos() * mark.x - angle.sin() * mark.y, angle.sin() * mark.x + angle.cos() * mark.y);
    assert!((opened_deg(mark, turned - mark) - 3.0).abs() < 0.01);
    // A shift along the line to the joint is no rotation.
    assert!(opened_deg(mark, mark * 0.1).abs() < 1e-12);
}

#[test]
fn a_prediction_is_the_conditional_normal_distribution() {
    let process = Process { weight: 0.4, length_mm: 12.0, noise: 0.1 };
    let points = [[0.0, 1.0, 0.5], [10.0, 2.0, 0.1], [31.0, -1.0, 0.3], [18.0, 0.7, 0.2]];
    let mut fitted = points.map(|[at, at_rest, pulled]| ContourPoint { at, at_rest, pulled }).into();
    let hidden = Vec::split_off(&mut fitted, 3);
    let split = Split { fitted, hidden };
    let (error, variance) = process.errors(&split).unwrap()[0];
    let places = [0.0, 10.0, 31.0, 18.0];
    let joint = DMatrix::from_fn(4, 4, |i, j| {
        let apart: f64 = places[i] - places[j];
        MEAN + (-apart * apart / 288.0).exp() + if i == j { 0.01 } else { 0.0 }
    });
    // The last row of the precision gives the conditional distribution of the last value.
    let precision = joint.try_inverse().unwrap();
    let values = [0.8, 1.24, -0.48];
    let expected: f64 = -(0..3).map(|i| precision[(3, i)] * values[i]).sum::<f64>() / precision[(3, 3)];
    assert!((variance - 1.0 / precision[(3, 3)]).abs() < 1e-9, "{variance}");
    assert!((error - (0.5 - expected)).abs() < 1e-9, "{error}");
}

#[test]
fn the_icc_is_that_of_shrout_and_fleiss() {
    // Their table 2: six targets, four judges; ICC(1,1) = .17.
    let table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]];
    let groups: Vec<Vec<f64>> = table.iter().map(|row| row.iter().map(|v| f64::from(*v)).collect()).collect();
    assert!((icc(&groups, 1) - 0.17).abs() < 0.005, "{}", icc(&groups, 1));
}

fn label(tier: &str, name: &str, from_s: f64, to_s: f64) -> Label {
    Label { tier: tier.into(), name: name.into(), from_s, to_s }
}

#[test]
fn what_repeats_is_told_from_what_does_not() {
    let times: Vec<f64> = (0..300).map(|i| 0.01 * f64::from(i)).collect();
    // The tier with one label for everything has most repetitions but does not distinguish.
    let mut labels: Vec<Label> =
        [("pa", 0.1, 0.5), ("ta", 0.6, 1.0), ("pa", 1.1, 1.7), ("ta", 1.8, 2.1), ("pa", 2.3, 2.8)]
            .map(|(name, from_s, to_s)| label("word", name, from_s, to_s))
            .to_vec();
    labels.extend((0..9).map(|i| label("all", "ultrasound", 0.3 * f64::from(i), 0.3 * f64::from(i + 1))));
    // One movement differs between the words, at a speed that depends on the word's length; one does not depend on words; one is common
    // to both words.
    let courses: Vec<Vec<f64>> = Vec::from_iter(times.iter().map(|&t| {
        let inside = labels.iter().find(|l| l.tier == "word" && l.holds(t));
        let part = inside.map_or(0.0, |l| (t - l.from_s) / (l.to_s - l.from_s));
        let sign = inside.map_or(0.0, |l| if l.name == "pa" { 1.0 } else { -1.0 });
        let noise = (11.0 * t * t).sin();
        vec![10.0 * sign * (6.3 * part).sin(), noise, 10.0 * (3.1 * part).sin() + noise]
    }));
    let recording = |labels| Repeatable { times: times.clone(), courses: courses.clone(), labels };
    let names = ["word", "noise", "both"].map(String::from);
    let found = repeated(&[recording(&labels)], &names).unwrap();
    assert_eq!((found.tier.as_str(), found.labels.values().next().copied()), ("word", Some(3)));
    let [differs, none, common] = [0, 1, 2].map(|m| found.muscles.0[m].1);
    assert!(differs.icc > 0.98 && differs.chance_95 < differs.icc, "{found:?}");
    assert!(differs.of_label > 0.98 && differs.by_exchange < 0.7, "{found:?}");
    assert!(none.icc < 0.5 && none.of_label < none.of_label_95, "{found:?}");
    // What is common to all words repeats as well with exchanged labels, and does not distinguish a label.
    assert!(common.icc > 0.8 && common.by_exchange > 0.8, "{found:?}");
    assert!(common.by_chance < 0.5 && common.of_label < common.of_label_95, "{found:?}");
    assert_eq!(repeated(&[recording(&labels[..3])], &names), None);
    // Labels longer than a recording, and recordings of one frame.
    let mut odd = labels.clone();
    odd[0].to_s = 1e9;
    repeated(&[recording(&odd)], &names);
    let (times, courses) = (times[..1].to_vec(), courses[..1].to_vec());
    repeated(&[Repeatable { times, courses, labels: &labels }], &names);
}

#[test]
fn without_a_difference_between_labels_none_is_found_on_average() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut sum = 0.0;
    for _ in 0..400 {
        let groups = (0..4 * POINTS).map(|i| {
            let common = (i % POINTS) as f64;
            (0..3 + i / POINTS).map(|_| common + normal(&mut random)).collect()
        });
        sum += of_label(&groups.collect::<Vec<Vec<f64>>>());
    }
    assert!((sum / 400.0).abs() < 0.01, "{}", sum / 400.0);
}
