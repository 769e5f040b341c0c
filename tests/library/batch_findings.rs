//! Results of a batch about a fit beside its tensions: alarms, other subsets, intervals by seed.

use crate::fixtures::{target, tongue};
use tongue_core::observe::Certainty;
use tongue_fit::body::Mesh;
use tongue_fit::inverse::alarms::{Alarm, alarms};
use tongue_fit::inverse::batch::Thoroughness;
use tongue_fit::inverse::{FitSettings, Matched, Method};
use tongue_fit::measured::TargetKind;
use tongue_fit::measured::muscles::Muscles;
use tongue_fit::system::{Model, System};
use tongue_infer::inverse::batch::{Known, assess};
use tongue_infer::inverse::{Forward, Problem, Setup};

fn how() -> Thoroughness {
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    Thoroughness { settings, draws: 0, subset_changes: 0, ..Thoroughness::default() }
}

fn assessed(
    mesh: &Mesh<2>,
    subject: &str,
    kind: TargetKind,
    how: &Thoroughness,
) -> tongue_infer::inverse::batch::Assessment {
    assess(mesh, &Model::default(), None, &target(subject, "a", kind), &Known::built_in(), how).unwrap()
}

#[test]
fn each_alarm_is_raised_by_its_cause() {
    let mesh = tongue();
    let mut found = assessed(&mesh, "S2", TargetKind::Stretch, &how());
    // S2 /a/ against /ɯ/: only SGp is within rounding (59 mm in both).
    assert_eq!(found.alarms, [Alarm::DecidedWithinRounding { muscle: "SGp".into() }]);

    let settings = how().settings;
    let fit = &mut found.fit;
    let known = Muscles::reference().unwrap();
    // 25 times the tensions over 40 mm are as many newtons as the tensions per metre: 8 of GGa's 18, but 38 of
    // the styloglossus' 24.
    let (tensions, unbounded) = (fit.tensions.clone(), FitSettings { upper_bound: 1e4, ..settings });
    fit.tensions.iter_mut().for_each(|t| *t *= 25.0);
    let per_metre = alarms(&mesh, fit, &known, None, &unbounded);
    fit.tensions = tensions;
    assert_eq!(per_metre.len(), 2);
    assert!(matches!(
        &per_metre[0],
        Alarm::BeyondCapacity { muscle, capacity_n: 24.0, .. } if muscle == "styloglossus"
    ));

    let number = |name: &str| fit.muscles.iter().position(|m| m == name).unwrap();
    let (gga, sgm) = (number("GGa"), number("SGm"));
    fit.tensions[sgm] = settings.upper_bound;
    fit.tensions[gga] = 0.0;
    let ggm = mesh.muscles.iter().find(|m| m.name == "GGm").unwrap();
    let (before, folded) = (ggm.nodes[1], ggm.nodes[2]);
    fit.positions[folded] =
        fit.positions[before] + (fit.positions[ggm.nodes[0]] - fit.positions[before]) * 0.5;
    fit.identifiability = None;
    let all = alarms(&mesh, fit, &known, None, &settings);
    let has = |what: &dyn Fn(&Alarm) -> bool| all.iter().any(what);
    assert!(has(&|a| *a == Alarm::AtUpperBound { muscle: "SGm".into() }));
    assert!(has(&|a| *a == Alarm::AtLowerBound { muscle: "GGa".into() }));
    assert!(has(&|a| matches!(a, Alarm::FoldedChain { muscle, .. } if muscle == "GGm")));
    assert!(has(&|a| matches!(a, Alarm::EquilibriumNotCertain { .. })));
}

#[test]
fn a_smaller_subset_that_fits_as_well_comes_first() {
    let mesh = tongue();
    // At an end of the curve of S2 /a/ HGa has no tension, so GGa and SGm alone must fit as well.
    let how = Thoroughness { subset_changes: 1, ..how() };
    let found = assessed(&mesh, "S2", TargetKind::Ratio, &how);
    let best = &found.subsets[0];
    let names: Vec<&str> = best.muscles.iter().map(|&m| found.fit.muscles[m].as_str()).collect();
    assert_eq!(names, ["GGa", "SGm"]);
    assert!(best.within_rounding);
    let hga = found.fit.target.active.len() - 1;
    let valley = found.fit.valley().unwrap();
    let ends = [valley.points.first(), valley.points.last()].map(|end| &end.unwrap().x);
    let without = ends.into_iter().find(|x| x[hga] < 1e-6).unwrap();
    for (t, at_the_end) in best.tensions.iter().zip(without) {
        assert!((t - at_the_end).abs() < 0.5, "{:?} {without:?}", best.tensions);
    }
    let ranks: Vec<(bool, usize)> = found
        .subsets
        .iter()
        .map(|s| (!s.within_rounding, if s.within_rounding { s.muscles.len() } else { 0 }))
        .collect();
    assert!(ranks.is_sorted(), "{ranks:?}");
}

#[test]
fn the_same_seed_gives_the_same_intervals_and_another_seed_others() {
    let mesh = tongue();
    let of = |seed| {
        assessed(&mesh, "S1", TargetKind::Stretch, &Thoroughness { draws: 50, seed, ..how() })
            .intervals
            .unwrap()
    };
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
}

/// The comparison in results/batch/README.md: no change, and one number from the other two subjects.
#[test]
fn one_constant_from_the_other_subjects_predicts_passive_stretches_better_than_no_change() {
    let rows = ["S1", "S2", "S3"].map(|s| {
        ["i", "e", "a", "o"].map(|v| {
            let t = target(s, v, TargetKind::Stretch);
            t.compared().filter(|m| !t.active.contains(m)).map(|m| t.values[m]).collect::<Vec<f64>>()
        })
    });
    // Every row of the same weight.
    let rms = |predicted: &dyn Fn(usize) -> f64| {
        let squares = |(s, row): (usize, &Vec<f64>)| {
            row.iter().map(|v| (v - predicted(s)).powi(2)).sum::<f64>() / row.len() as f64
        };
        let each: Vec<f64> = rows
            .iter()
            .enumerate()
            .flat_map(|(s, rows)| rows.iter().map(move |r| (s, r)))
            .map(squares)
            .collect();
        (each.iter().sum::<f64>() / each.len() as f64).sqrt()
    };
    let constant = |left_out: usize| {
        let others: Vec<f64> =
            (0..3).filter(|s| *s != left_out).flat_map(|s| rows[s].iter().flatten().copied()).collect();
        others.iter().sum::<f64>() / others.len() as f64
    };
    assert!((rms(&|_| 1.0) - 0.114).abs() < 5e-4);
    assert!((rms(&constant) - 0.083).abs() < 5e-4, "{}", rms(&constant));
    assert!((0..3).all(|s| (1.06..1.10).contains(&constant(s))));
}

#[test]
fn segments_end_where_a_target_leaves_its_rounding_or_a_tension_its_bounds() {
    let mesh = tongue();
    let settings = how().settings;
    for kind in TargetKind::ALL {
        let found = assessed(&mesh, "S2", kind, &how());
        let matched = Matched::new(&mesh, &found.fit.target).unwrap();
        let setup = Setup::at_rest(System::new(&mesh, &Model::default(), &matched.contracting()).unwrap());
        let inverse = matched.inverse(&setup, &settings);
        let mut forward = Forward::new(&inverse, &settings);
        // How far a fitted value is outside its range, as a part of half the range.
        let mut outside_by = |tensions: &[f64]| {
            forward.residuals(tensions).unwrap();
            let each = inverse.observations.iter().filter_map(|o| match o.certainty {
                Certainty::Between(low, high) => {
                    let half = 0.5 * (high - low);
                    Some(((o.observable.value(forward.positions()) - 0.5 * (low + high)).abs() - half) / half)
                }
                _ => None,
            });
            each.fold(f64::NEG_INFINITY, f64::max)
        };
        let all = found.segments.unwrap();
        assert_eq!(all.len(), 3);
        for (end, sign, direction) in
            all.iter().flat_map(|s| [(&s.from_n, -1.0, &s.direction), (&s.to_n, 1.0, &s.direction)])
        {
            let by = outside_by(end);
            let beyond: Vec<f64> = end.iter().zip(direction).map(|(t, d)| t + sign * 1e-6 * d).collect();
            let at_bound = beyond.iter().any(|t| *t < 0.0 || *t > settings.upper_bound);
            assert!(by <= 0.0 && (by > -0.02 || at_bound), "{kind}: {by} at {end:?}");
        }
    }
}
