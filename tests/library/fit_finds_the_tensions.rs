//! The inverse problem against answers that are known because they were simulated, and against the thesis.

use crate::fixtures::{target, target_of, tongue, vowel};
use tongue_fit::body::Mesh;
use tongue_fit::inverse::{self, Fit, Settings, Status};
use tongue_fit::measured::thesis::Thesis;
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions};
use tongue_fit::statics::{self, Workspace};
use tongue_fit::study::pulling;
use tongue_fit::system::{Model, System};

/// Lengths of the model, m, at rest and under the tensions.
fn simulated(mesh: &Mesh<2>, tensions: &[(&str, f64)]) -> (Vec<f64>, Vec<f64>) {
    let (active, all) = pulling(mesh, tensions).unwrap();
    let system = System::new(mesh, &Model::default(), &active).unwrap();
    let mut w = Workspace::new(&system);
    let solution = statics::solve(&system, &mut w, &all, &statics::Settings::default());
    assert_eq!(solution.status, statics::Status::Converged);
    (system.lengths(system.rest()), system.lengths(w.positions()))
}

/// A target made of simulated lengths, and the tensions that made them.
fn synthetic(mesh: &Mesh<2>, tensions: &[(&str, f64)], kind: TargetKind) -> Target {
    let (rest, lengths) = simulated(mesh, tensions);
    let muscles: Vec<&str> = tensions.iter().map(|(m, _)| *m).collect();
    target_of(mesh, &lengths, &rest, kind, &muscles)
}

fn s2_a(kind: TargetKind) -> Target {
    target("S2", "a", kind)
}

fn tension(fit: &Fit, muscle: &str) -> f64 {
    fit.tensions[fit.muscles.iter().position(|m| m == muscle).unwrap()]
}

fn fitted(mesh: &Mesh<2>, target: &Target) -> Fit {
    inverse::fit(mesh, &Model::default(), target, &Settings::default()).unwrap()
}

#[test]
fn tensions_that_were_simulated_are_found_again() {
    let mesh = tongue();
    let cases: [&[(&str, f64)]; 3] = [
        &[("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)],
        &[("GGp", 20.0)],
        &[("GGa", 3.0), ("GGm", 9.0), ("SGa", 6.0), ("HGp", 15.0)],
    ];
    for truth in cases {
        let fit = fitted(&mesh, &synthetic(&mesh, truth, TargetKind::Stretch));
        assert_eq!(fit.status, Status::Converged);
        for (m, t) in truth {
            let found = tension(&fit, m);
            assert!((found - t).abs() < 1e-3, "{m}: {found} in place of {t} N");
        }
        assert!(fit.identifiability.unwrap().null_directions.is_empty());
    }
}

#[test]
fn ratios_of_three_muscles_leave_one_direction_open_and_the_truth_lies_on_it() {
    let mesh = tongue();
    let truth = [("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)];
    let fit = fitted(&mesh, &synthetic(&mesh, &truth, TargetKind::Ratio));
    assert_eq!(fit.status, Status::Converged);
    let total: f64 = fit.tensions.iter().sum();
    assert!(total < 28.0, "the effort term takes the least total tension, not {total}");
    let i = fit.identifiability.as_ref().unwrap();
    assert_eq!(i.null_directions.len(), 1);
    assert!(i.singular_values[2] < 1e-9 && i.singular_values[1] > 1e-3, "{:?}", i.singular_values);
    // The truth lies between the ends of the segment in every tension, and fits as well as the answer.
    let n = &i.null_directions[0];
    for (column, (m, t)) in truth.iter().enumerate() {
        assert!(n.from_n[column] < *t && *t < n.to_n[column], "{m}: {n:?}");
    }
    // Both ends really fit: solve them.
    for end in [&n.from_n, &n.to_n] {
        let tensions: Vec<_> = truth.iter().zip(end).map(|((m, _), t)| (*m, *t)).collect();
        let (rest, lengths) = simulated(&mesh, &tensions);
        let got = fit.target.simulated(&lengths, &rest);
        for &m in &fit.target.fitted {
            let error = (got[m] - fit.target.values[m]).abs();
            assert!(error < 2e-3, "{m} off by {error} at {end:?}");
        }
    }
}

#[test]
fn s2_a_is_met_and_the_effort_costs_less_than_a_thousandth_of_a_ratio() {
    let fit = fitted(&tongue(), &s2_a(TargetKind::Ratio));
    assert_eq!(fit.status, Status::Converged);
    for &m in &fit.target.fitted {
        assert!(fit.residuals[m].abs() < 1e-3, "{}: {}", fit.muscles[m], fit.residuals[m]);
    }
    assert!(fit.replay.largest_difference < 1e-12 && fit.replay.solution.max_residual_force < 1e-9);
}

/// Every row of S1 to S3, both kinds: whatever is called converged meets its target, the shape is found again from rest, and
/// the lengths reported are those of an independent solve at the tensions reported.
#[test]
fn all_rows_beside_a_baseline_end_in_a_status_that_is_true() {
    let mesh = tongue();
    let mut converged = 0;
    for subject in ["S1", "S2", "S3"] {
        for vowel in ["i", "e", "a", "o"] {
            for kind in TargetKind::ALL {
                let target = target(subject, vowel, kind);
                let fit = fitted(&mesh, &target);
                let pull = target.active.iter().map(|&m| (fit.muscles[m].as_str(), fit.tensions[m]));
                let tensions: Vec<_> = pull.collect();
                let (_, lengths) = simulated(&mesh, &tensions);
                for (there, here) in lengths.iter().zip(&fit.lengths) {
                    let error = (there - here).abs();
                    assert!(error < 1e-8, "{subject} {vowel} {kind}: {error:e}");
                }
                if fit.status == Status::Converged {
                    converged += 1;
                    for &m in &target.fitted {
                        let r = fit.residuals[m];
                        assert!(r.abs() < 1e-3, "{subject} {vowel} {kind} {m}: {r}");
                    }
                } else {
                    assert!(
                        fit.misfit > 1e-3,
                        "{subject} {vowel} {kind}: {:?} at {}",
                        fit.status,
                        fit.misfit
                    );
                }
            }
        }
    }
    assert!(converged >= 17, "{converged} of 24");
}

#[test]
fn eight_muscles_meet_seven_ratios_without_the_effort_in_the_way() {
    let data = Dataset::reference().unwrap();
    let options = TargetOptions { muscles: Some(data.muscles().to_vec()), baseline: None };
    let target = Target::new(&data, "S2", &vowel("a"), TargetKind::Ratio, &options).unwrap();
    let fit = fitted(&tongue(), &target);
    assert_eq!(fit.status, Status::Converged, "{}", fit.misfit);
}

#[test]
fn the_published_tensions_give_the_published_ratios() {
    let mesh = tongue();
    let thesis = Thesis::reference().unwrap();
    let (rest, lengths) = simulated(&mesh, &thesis.tensions_a());
    let ratios = TargetKind::Ratio.values(&lengths, &rest, 0);
    let table_4_8 = thesis.ratios_a(&mesh.muscle_names()).unwrap();
    let squares: f64 = ratios.iter().zip(&table_4_8).map(|(a, b)| (a - b).powi(2)).sum();
    let rms = (squares / 7.0).sqrt();
    assert!(rms <= 0.03, "{rms}: {ratios:?}");
}

#[test]
fn the_same_bits_on_one_two_and_four_threads() {
    let mesh = tongue();
    let target = s2_a(TargetKind::Stretch);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fitted(&mesh, &target))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(4));
}

#[test]
fn failed_equilibria_make_a_bad_fit_not_a_panic() {
    let settings = Settings {
        equilibrium: statics::Settings { max_iterations: 0, ..Default::default() },
        ..Settings::default()
    };
    let fit = inverse::fit(&tongue(), &Model::default(), &s2_a(TargetKind::Ratio), &settings).unwrap();
    assert_eq!(fit.status, Status::NoEquilibrium);
    assert!(fit.starts.iter().all(|s| !s.converged));
    assert!(fit.misfit.is_infinite() && fit.identifiability.is_none());
}

#[test]
fn a_bound_that_is_too_low_is_reported_not_hidden() {
    let settings = Settings { upper_bound: 10.0, ..Settings::default() };
    let fit = inverse::fit(&tongue(), &Model::default(), &s2_a(TargetKind::Stretch), &settings).unwrap();
    assert_eq!(fit.status, Status::AtUpperBound);
    assert!(fit.tensions.iter().all(|t| (0.0..=10.0).contains(t)));
}

#[test]
fn settings_out_of_range_are_named() {
    let bad = |settings: Settings| {
        inverse::fit(&tongue(), &Model::default(), &s2_a(TargetKind::Ratio), &settings)
            .unwrap_err()
            .to_string()
    };
    assert!(bad(Settings { starts: 0, ..Settings::default() }).contains("number of starts"));
    assert!(bad(Settings { upper_bound: f64::NAN, ..Settings::default() }).contains("upper bound"));
    assert!(bad(Settings { effort: -1.0, ..Settings::default() }).contains("effort"));
}
