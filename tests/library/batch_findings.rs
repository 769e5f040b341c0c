//! Results of a batch about a fit beside its tensions: alarms.

use crate::fixtures::{target, tongue};
use tongue_fit::inverse::alarms::{Alarm, alarms};
use tongue_fit::inverse::{FitSettings, Method};
use tongue_fit::measured::{Muscles, TargetKind};
use tongue_fit::system::Model;
use tongue_infer::inverse::batch::{PublishedFacts, assess};

#[test]
fn each_alarm_is_raised_by_its_cause() {
    let mesh = tongue();
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    let target = target("S2", "a", TargetKind::Stretch);
    let mut found =
        assess(&mesh, &Model::default(), &target, &PublishedFacts::built_in(), &settings).unwrap();
    // S2 /a/ against /ɯ/: only SGp is within rounding (59 mm in both).
    assert_eq!(found.alarms, [Alarm::DecidedWithinRounding { muscle: "SGp".into() }]);

    let fit = &mut found.fit;
    let known = Muscles::reference().unwrap();
    // 25 times the tensions over 40 mm are as many newtons as the tensions per metre: 8 of GGa's 18, but 38 of
    // the styloglossus' 24.
    let (tensions, unbounded) = (fit.tensions.clone(), FitSettings { upper_bound: 1e4, ..settings });
    fit.tensions.iter_mut().for_each(|t| *t *= 25.0);
    let per_metre = alarms(&mesh, fit, &known, &unbounded);
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
    let all = alarms(&mesh, fit, &known, &settings);
    let has = |what: &dyn Fn(&Alarm) -> bool| all.iter().any(what);
    assert!(has(&|a| *a == Alarm::AtUpperBound { muscle: "SGm".into() }));
    assert!(has(&|a| *a == Alarm::AtLowerBound { muscle: "GGa".into() }));
    assert!(has(&|a| matches!(a, Alarm::FoldedChain { muscle, .. } if muscle == "GGm")));
    assert!(has(&|a| matches!(a, Alarm::EquilibriumNotCertain { .. })));
}
