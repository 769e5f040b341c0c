//! The inverse problem against answers that are known because they were simulated, and against the thesis.

use crate::fixtures::tongue;
use tongue_fit::body::Mesh;
use tongue_fit::inverse::{self, Fit, Settings, Status};
use tongue_fit::measured::published::{TENSIONS_A_N, Tables};
use tongue_fit::measured::{Dataset, Lengths, Target, TargetKind, TargetOptions, Vowel};
use tongue_fit::muscle::{Muscle, PerMuscle};
use tongue_fit::statics::{self, Workspace};
use tongue_fit::system::{Model, System};

/// Lengths of the model, m, at rest and under the tensions.
fn simulated(mesh: &Mesh<2>, tensions: &[(Muscle, f64)]) -> (PerMuscle<f64>, PerMuscle<f64>) {
    let numbers = inverse::muscle_numbers(mesh).unwrap();
    let active: Vec<usize> = tensions.iter().map(|(m, _)| numbers[m.index()]).collect();
    let system = System::new(mesh, &Model::default(), &active).unwrap();
    let mut all = vec![0.0; 8];
    tensions.iter().for_each(|(m, t)| all[numbers[m.index()]] = *t);
    let mut w = Workspace::new(&system);
    let solution = statics::solve(&system, &mut w, &all, &statics::Settings::default());
    assert_eq!(solution.status, statics::Status::Converged);
    (numbers.map(|n| system.length(system.rest(), n)), numbers.map(|n| system.length(w.positions(), n)))
}

/// A target made of simulated lengths, and the tensions that made them.
fn synthetic(mesh: &Mesh<2>, tensions: &[(Muscle, f64)], kind: TargetKind) -> Target {
    let (rest, lengths) = simulated(mesh, tensions);
    let row = |vowel, l: PerMuscle<f64>| Lengths {
        subject: "synthetic".into(),
        vowel,
        length_mm: l.map(|l| l * 1e3),
    };
    let muscles: Vec<Muscle> = tensions.iter().map(|(m, _)| *m).collect();
    Target::from_lengths(&row(Vowel::A, lengths), &row(Vowel::U, rest), kind, Some(&muscles)).unwrap()
}

fn s2_a(kind: TargetKind) -> Target {
    Target::new(&Dataset::reference().unwrap(), "S2", Vowel::A, kind, &TargetOptions::default()).unwrap()
}

fn fitted(mesh: &Mesh<2>, target: &Target) -> Fit {
    inverse::fit(mesh, &Model::default(), target, &Settings::default()).unwrap()
}

#[test]
fn tensions_that_were_simulated_are_found_again() {
    let mesh = tongue();
    let cases: [&[(Muscle, f64)]; 3] = [
        &[(Muscle::GGa, 12.0), (Muscle::SGm, 11.5), (Muscle::HGa, 4.5)],
        &[(Muscle::GGp, 20.0)],
        &[(Muscle::GGa, 3.0), (Muscle::GGm, 9.0), (Muscle::SGa, 6.0), (Muscle::HGp, 15.0)],
    ];
    for truth in cases {
        let fit = fitted(&mesh, &synthetic(&mesh, truth, TargetKind::Stretch));
        assert_eq!(fit.status, Status::Converged);
        for (m, t) in truth {
            let error = (fit.tensions[m.index()] - t).abs();
            assert!(error < 1e-3, "{m}: {} in place of {t} N", fit.tensions[m.index()]);
        }
        assert!(fit.identifiability.unwrap().null_directions.is_empty());
    }
}

#[test]
fn ratios_of_three_muscles_leave_one_direction_open_and_the_truth_lies_on_it() {
    let mesh = tongue();
    let truth = [(Muscle::GGa, 12.0), (Muscle::SGm, 11.5), (Muscle::HGa, 4.5)];
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
        for m in &fit.target.fitted {
            let error = (got[m.index()] - fit.target.values[m.index()]).abs();
            assert!(error < 2e-3, "{m} off by {error} at {end:?}");
        }
    }
}

#[test]
fn s2_a_is_met_and_the_effort_costs_less_than_a_thousandth_of_a_ratio() {
    let fit = fitted(&tongue(), &s2_a(TargetKind::Ratio));
    assert_eq!(fit.status, Status::Converged);
    for m in &fit.target.fitted {
        assert!(fit.residuals[m.index()].abs() < 1e-3, "{m}: {}", fit.residuals[m.index()]);
    }
    assert!(fit.replay.largest_difference < 1e-12 && fit.replay.solution.max_residual_force < 1e-9);
}

/// Every row of S1 to S3, both kinds: whatever is called converged meets its target, the shape is found again from rest, and
/// the lengths reported are those of an independent solve at the tensions reported.
#[test]
fn all_rows_beside_a_baseline_end_in_a_status_that_is_true() {
    let mesh = tongue();
    let data = Dataset::reference().unwrap();
    let mut converged = 0;
    for subject in ["S1", "S2", "S3"] {
        for vowel in [Vowel::I, Vowel::E, Vowel::A, Vowel::O] {
            for kind in TargetKind::ALL {
                let target = Target::new(&data, subject, vowel, kind, &TargetOptions::default()).unwrap();
                let fit = fitted(&mesh, &target);
                let tensions: Vec<_> = target.active.iter().map(|m| (*m, fit.tensions[m.index()])).collect();
                let (_, lengths) = simulated(&mesh, &tensions);
                for m in Muscle::ALL {
                    let error = (lengths[m.index()] - fit.lengths[m.index()]).abs();
                    assert!(error < 1e-8, "{subject} {vowel} {kind} {m}: {error:e}");
                }
                if fit.status == Status::Converged {
                    converged += 1;
                    for m in &target.fitted {
                        let r = fit.residuals[m.index()];
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
    let options = TargetOptions { muscles: Some(Muscle::ALL.to_vec()), baseline: None };
    let data = Dataset::reference().unwrap();
    let target = Target::new(&data, "S2", Vowel::A, TargetKind::Ratio, &options).unwrap();
    let fit = fitted(&tongue(), &target);
    assert_eq!(fit.status, Status::Converged, "{}", fit.misfit);
}

#[test]
fn the_published_tensions_give_the_published_ratios() {
    let mesh = tongue();
    let (rest, lengths) = simulated(&mesh, &TENSIONS_A_N);
    let ratios = TargetKind::Ratio.values(&lengths, &rest);
    let table_4_8 = Tables::reference().unwrap().simulated_ratio_a;
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
