//! Fits against an active baseline with a movable hyoid: simulated values are recovered by both searches, and
//! with the tone of the thesis the fits are the thesis's.

use nalgebra::SVector;
use tongue_fit::body::Body;
use tongue_fit::inverse::{Fit, FitSettings, FitStatus, Matched, Method, Tone, fit};
use tongue_fit::measured::{Dataset, Target, TargetKind};
use tongue_fit::statics::{self, Workspace};
use tongue_fit::system::Model;
use tongue_infer::inverse::{Forward, STRETCH_SD};
use tongue_infer::inverse::{LooseBone, Premises, Problem, Setup, fit_in};

use crate::fixtures::target;

fn body() -> Body<2> {
    Body::tongue(0.0055).unwrap()
}

fn setup(premises: Premises) -> Setup {
    Setup::new(&body(), &Model::default(), premises).unwrap()
}

fn gauss_newton() -> FitSettings {
    FitSettings { method: Method::GaussNewton, ..FitSettings::default() }
}

fn with_tone(tone: f64) -> Premises {
    Premises { tone: Tone::Uniform(tone), ..Premises::default() }
}

fn fitted(setup: &Setup, target: &Target, settings: &FitSettings) -> Fit {
    fit_in(setup, &Matched::new(&body().mesh, target).unwrap(), settings).unwrap()
}

/// Stretches of all muscles from the setup's baseline to an equilibrium, and its shape.
fn stretches(setup: &Setup, tensions: &[f64], shift: SVector<f64, 2>) -> Option<Vec<f64>> {
    let mut w = Workspace::new(&setup.system);
    w.carry_bone(&setup.system, body().bone("hyoid"), shift);
    let solution = statics::solve(&setup.system, &mut w, tensions, &statics::SolveSettings::default());
    let lengths = setup.system.lengths(w.positions());
    (solution.status == statics::SolveStatus::Converged)
        .then(|| lengths.iter().zip(&setup.lengths).map(|(l, from)| l / from).collect())
}

/// The target of a subject whose muscles have these stretches, made through a table, so that the rule decides
/// which muscles contract.
fn target_of(stretches: &[f64]) -> Option<Target> {
    let names = body().mesh.muscle_names();
    let header: String = names.iter().map(|m| format!(",{m}_mm,{m}_half_width_mm")).collect();
    let row = |vowel: &str, values: &[f64]| {
        let cells: String = values.iter().map(|s| format!(",{:.12},0.01", 50.0 * s)).collect();
        format!("X,{vowel}{cells}\n")
    };
    let table = format!("subject,vowel{header}\n{}{}", row("ɯ", &[1.0; 8]), row("a", stretches));
    Dataset::from_reader(table.as_bytes(), "made").unwrap().stretches("X", "a").ok()
}

#[test]
fn without_tone_a_body_whose_muscles_all_can_contract_gives_the_answers_of_the_thesis() {
    let (body, setup) = (body(), setup(Premises::default()));
    assert_eq!(setup.lengths, setup.system.lengths(setup.system.rest()));
    for subject in ["S1", "S2", "S3"] {
        let target = target(subject, "a", TargetKind::Stretch);
        let old = fit(&body.mesh, &Model::default(), &target, &gauss_newton()).unwrap();
        let new = fitted(&setup, &target, &gauss_newton());
        assert_eq!(old.status, new.status);
        for (a, b) in old.tensions.iter().zip(&new.tensions) {
            assert!((a - b).abs() < 1e-6 * a.max(1.0), "{subject}: {a} and {b}");
        }
    }
}

#[test]
fn tensions_come_back_from_the_stretches_that_they_make_of_a_baseline_with_tone() {
    let setup = setup(with_tone(8.0));
    // The tone of the baseline changes nothing.
    let same = stretches(&setup, &setup.tensions, SVector::zeros()).unwrap();
    assert!(same.iter().all(|s| (s - 1.0).abs() < 1e-9), "{same:?}");
    let truth = [20.0, 0.0, 0.0, 0.0, 30.0, 0.0, 25.0, 0.0];
    let made = stretches(&setup, &truth, SVector::zeros()).unwrap();
    let found = fitted(&setup, &target_of(&made).unwrap(), &gauss_newton());
    assert_eq!(found.status, FitStatus::Converged);
    for (found, truth) in found.tensions.iter().zip(truth) {
        assert!((found - truth).abs() < 1e-3, "{:?}", found);
    }
    // Stretches are relative to the baseline, not to rest.
    assert!(found.residuals.iter().all(|r| r.abs() < 1e-6), "{:?}", found.residuals);
    let shorter = |m: usize| found.baseline_lengths[m] < found.rest_lengths[m];
    assert!((0..8).filter(|&m| shorter(m)).count() >= 4);
}

#[test]
fn the_jacobian_holds_signs_and_priors() {
    let setup = setup(Premises::active_baseline(2));
    let target = target("S2", "a", TargetKind::Stretch);
    let matched = Matched::new(&body().mesh, &target).unwrap();
    let equilibrium = statics::SolveSettings { tolerance: 1e-11, ..statics::SolveSettings::default() };
    let settings = FitSettings { equilibrium, ..gauss_newton() };
    let inverse = matched.inverse(&setup, &settings);
    assert_eq!((inverse.observations.len(), inverse.signs.len(), inverse.unknowns.len()), (3, 5, 5));
    // Strong tensions and a hyoid far up: some muscles are shorter that should not be.
    let x = [30.0, 20.0, 40.0, -3.0, 9.0];
    let mut forward = Forward::new(&inverse, &settings);
    let linear = forward.linearise(&x).unwrap();
    assert_eq!(linear.jacobian.nrows(), 3 + 5 + 5);
    let violated = (3..8).filter(|&r| linear.residuals[r] < 0.0).count();
    assert!((1..5).contains(&violated), "{}", linear.residuals);
    for column in 0..x.len() {
        let at = |step: f64| {
            let mut x = x;
            x[column] += step;
            Forward::new(&inverse, &settings).residuals(&x).unwrap()
        };
        let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
        assert!((slope - linear.jacobian.column(column)).amax() < 1e-7, "unknown {column}");
    }
}

#[test]
fn both_searches_find_the_same_hyoid_and_the_signs_hold() {
    let setup = setup(Premises::active_baseline(2));
    let target = target("S3", "i", TargetKind::Stretch);
    let [simplex, newton] = [Method::NelderMead, Method::GaussNewton]
        .map(|method| fitted(&setup, &target, &FitSettings { method, ..FitSettings::default() }));
    assert_eq!((simplex.status, newton.status), (FitStatus::Converged, FitStatus::Converged));
    assert!((simplex.bones[0].shift - newton.bones[0].shift).amax() < 1e-5);
    for (a, b) in simplex.tensions.iter().zip(&newton.tensions) {
        assert!((a - b).abs() < 1e-2, "{a} and {b}");
    }
    // In /i/ the hyoid moves to the front: to negative x.
    assert!(newton.bones[0].shift.x < -2e-3, "{}", newton.bones[0].shift);
    // With forward motion only, the height stays.
    let hyoid = LooseBone { name: "hyoid".into(), axes: vec![0] };
    let forward = Premises { bones: vec![hyoid], ..Premises::active_baseline(2) };
    let forward = fitted(&self::setup(forward), &target, &gauss_newton());
    assert_eq!((forward.bones[0].shift.y, forward.bones[0].half_width.y), (0.0, 0.0));
    assert!(forward.bones[0].shift.x < -2e-3);
}

/// Truths drawn from the priors and measured with the assumed error: nineteen of twenty intervals contain
/// them.
#[test]
fn intervals_of_the_hyoid_hold_it_at_their_rate() {
    let setup = setup(Premises::active_baseline(2));
    let mut random = fastrand::Rng::with_seed(5);
    let mut normal = move || {
        let (u, v) = (1.0 - random.f64(), random.f64());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let (mut held, mut intervals) = (0, 0);
    while intervals < 240 {
        let shift = SVector::from([5e-3 * normal(), 5e-3 * normal()]);
        let chosen = if normal() > 0.0 { [0, 4, 6] } else { [1, 2, 7] };
        let mut tensions = [0.0; 8];
        chosen.iter().for_each(|&m: &usize| tensions[m] = f64::max(20.0 + 8.0 * normal(), 0.0));
        let Some(mut made) = stretches(&setup, &tensions, shift) else { continue };
        made.iter_mut().for_each(|s| *s += STRETCH_SD * normal());
        let Some(target) = target_of(&made).filter(|t| t.active == chosen) else { continue };
        let found = &fitted(&setup, &target, &gauss_newton()).bones[0];
        for axis in 0..2 {
            intervals += 1;
            held += usize::from((found.shift[axis] - shift[axis]).abs() <= found.half_width[axis]);
        }
    }
    let rate = f64::from(held as u32) / f64::from(intervals);
    println!("{held} of {intervals}");
    assert!((0.90..=0.99).contains(&rate), "{rate}");
}

#[test]
fn muscles_of_which_nothing_was_measured_keep_their_tone() {
    let setup = setup(with_tone(8.0));
    // Another muscle has the tension of the baseline and is longer.
    let with = |unmeasured: usize| {
        let mut truth = [20.0, 0.0, 0.0, 0.0, 30.0, 0.0, 25.0, 0.0];
        truth[unmeasured] = 8.0;
        let made = stretches(&setup, &truth, SVector::zeros()).unwrap();
        (made[unmeasured] > 1.001).then(|| (unmeasured, truth, target_of(&made).unwrap()))
    };
    let (unmeasured, truth, whole) = [1, 2, 3, 5, 7].into_iter().find_map(with).unwrap();
    let name = body().mesh.muscles[unmeasured].name.clone();
    let without = whole.of_body(|muscle| muscle != name).unwrap();
    let found = fitted(&setup, &without, &gauss_newton());
    assert_eq!(found.body_tensions[unmeasured], 8.0);
    for (found, truth) in found.body_tensions.iter().zip(truth) {
        assert!((found - truth).abs() < 1e-3, "{:?}", found);
    }
}

#[test]
fn invalid_premises_are_reported() {
    let refused =
        |premises: Premises| Setup::new(&body(), &Model::default(), premises).unwrap_err().to_string();
    let bone = |name: &str| LooseBone { name: name.into(), axes: vec![0, 1] };
    let freed = |bones: Vec<LooseBone>| Premises { bones, ..Premises::default() };
    let known = "the bones of this body are hyoid, mental_spine, styloid";
    assert_eq!(refused(freed(vec![bone("jaw")])), format!("the bone \"jaw\" cannot be freed: {known}"));
    assert!(refused(with_tone(-1.0)).contains("the tone is -1"));
    assert!(refused(with_tone(f64::NAN)).contains("the tone is NaN"));
    let named = Premises { tone: Tone::ByMuscle(vec![("GGx".into(), 3.0)]), ..Premises::default() };
    assert!(refused(named).contains("the tone names GGx"));
    assert!(
        refused(Premises { bone_sd_m: 0.0, ..Premises::default() }).contains("standard deviation of a bone")
    );
}
