//! Which rows of a batch are fitted, and with which baseline.

use std::collections::BTreeMap;

use tongue_infer::inverse::batch::{Selection, plan};
use tongue_input::measured::{Dataset, TargetKind, Vowel};

fn both() -> Selection {
    Selection { kinds: TargetKind::ALL.to_vec(), ..Selection::default() }
}

#[test]
fn a_named_baseline_is_no_substitute_and_a_missing_one_refuses_every_row_of_its_subject() {
    let data = Dataset::reference().unwrap();
    let vowel = |label| Vowel::new(label).unwrap();
    let of = BTreeMap::from([("S4".to_owned(), vowel("i"))]);
    let s4 = Selection { subjects: Some(vec!["S4".into()]), baseline_of: of, ..both() };
    let found = plan(&data, &s4).unwrap();
    assert_eq!(found.baselines.len(), 1);
    assert!(found.jobs.iter().all(|j| j.target.baseline == vowel("i") && !j.substitute));

    let all = Selection { baseline: Some(Vowel::unrounded_u()), ..both() };
    let found = plan(&data, &all).unwrap();
    assert_eq!((found.jobs.len(), found.refusals.len()), (24, 4));
    assert!(found.refusals[0].message.starts_with("S4 has no row for the baseline vowel /ɯ/"));
    assert!(found.refusals.iter().all(|r| r.line >= 17));

    let unknown = Selection { subjects: Some(vec!["S9".into()]), ..both() };
    assert!(plan(&data, &unknown).unwrap_err().to_string().starts_with("unknown subject \"S9\""));
}
