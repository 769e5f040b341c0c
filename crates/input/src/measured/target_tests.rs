use super::*;
use crate::measured::thesis::Thesis;

fn vowel(label: &str) -> Vowel {
    Vowel::new(label).unwrap()
}

fn target(subject: &str, label: &str, kind: TargetKind) -> Result<Target, ReadError> {
    Target::new(&Dataset::reference().unwrap(), subject, &vowel(label), kind, &TargetOptions::default())
}

fn message(result: Result<Target, ReadError>) -> String {
    result.unwrap_err().to_string()
}

fn names(t: &Target, positions: &[usize]) -> Vec<String> {
    positions.iter().map(|&m| t.muscles[m].clone()).collect()
}

#[test]
fn s2_a_is_the_target_of_the_thesis() {
    let t = target("S2", "a", TargetKind::Ratio).unwrap();
    assert_eq!(t.active_names(), ["GGa", "SGm", "HGa"]);
    assert_eq!(names(&t, &t.fitted), ["SGm", "HGa"]);
    assert_eq!(t.baseline, Vowel::unrounded_u());
    let of_active = t.active.iter().map(|&m| t.values[m]).collect::<Vec<_>>();
    assert_eq!(of_active, [1.0, 23.0 / 41.0, 33.0 / 41.0]);
    let thesis = Thesis::reference().unwrap();
    for (name, ours) in t.muscles.iter().zip(&t.values) {
        let theirs = thesis.of(name).unwrap().measured_ratio_a;
        assert!((ours - theirs).abs() <= 0.005, "{name}: {ours} against {theirs} in table 4.7");
    }
    let uncertain: Vec<usize> = (0..8).filter(|&m| t.activation[m].uncertain).collect();
    assert_eq!(names(&t, &uncertain), ["SGp"]);
}

#[test]
fn stretch_of_s2_a_has_three_equations() {
    let t = target("S2", "a", TargetKind::Stretch).unwrap();
    assert_eq!(t.fitted, t.active);
    assert_eq!((t.values[0], t.values[7]), (41.0 / 46.0, 35.0 / 31.0));
}

#[test]
fn all_twelve_rows_beside_a_baseline_have_both_kinds_of_target() {
    for subject in ["S1", "S2", "S3"] {
        for label in ["i", "e", "a", "o"] {
            for kind in TargetKind::ALL {
                let t = target(subject, label, kind).unwrap();
                assert!(t.active.iter().all(|&m| t.activation[m].change_mm < 0.0));
                assert!(!t.fitted.is_empty());
            }
        }
    }
}

#[test]
fn a_baseline_vowel_and_muscles_may_be_chosen() {
    let options =
        TargetOptions { muscles: Some(vec!["hga".into(), "GGa".into()]), baseline: Some(vowel("e")) };
    let data = Dataset::reference().unwrap();
    let t = Target::new(&data, "S4", &vowel("a"), TargetKind::Ratio, &options).unwrap();
    assert_eq!((t.baseline.label(), t.active_names()), ("e", vec!["GGa", "HGa"]));
    let lengths: Vec<Option<f64>> = t.baseline_mm.iter().copied().map(Some).collect();
    assert_eq!(lengths, data.row("S4", &vowel("e")).unwrap().length_mm);
}

#[test]
fn targets_that_cannot_be_fitted_are_refused_with_advice() {
    let data = Dataset::reference().unwrap();
    let choose = |muscles: &[&str]| {
        let muscles = Some(muscles.iter().map(|m| (*m).to_owned()).collect());
        let options = TargetOptions { muscles, baseline: None };
        Target::new(&data, "S2", &vowel("a"), TargetKind::Ratio, &options)
    };
    assert!(
        message(target("S2", "u", TargetKind::Ratio)).starts_with(
            "/ɯ/ of S2 is the baseline itself, so there is nothing to fit; choose another vowel"
        )
    );
    assert_eq!(
        message(target("S4", "a", TargetKind::Ratio)),
        "S4 has no row for the baseline vowel /ɯ/ in targets/takano2007_lengths.csv (built in); it has \
         /i/, /e/, /a/, /o/: choose one of these as the baseline instead"
    );
    assert!(
        message(choose(&[]))
            .starts_with("the list of contracting muscles is empty; name at least one of GGa, ")
    );
    assert!(message(choose(&["SGm", "GGa", "SGm"])).starts_with("muscle SGm is listed twice"));
    assert!(message(choose(&["GGa"])).contains("its ratio to itself is always 1"));
    assert!(message(choose(&["GGx"])).starts_with("unknown muscle \"GGx\"; did you mean"));
}

#[test]
fn a_row_in_which_nothing_shortens_says_so() {
    let data = Dataset::reference().unwrap();
    let baseline = data.baseline("S2").unwrap();
    let mut measured = Lengths { vowel: vowel("a"), ..baseline.clone() };
    let result = Target::from_lengths(&measured, baseline, TargetKind::Stretch, None);
    assert_eq!(
        message(result),
        "no muscle of S2 is shorter in /a/ than in /ɯ/, so none contracts; name the contracting muscles yourself"
    );
    // A millimetre shorter is within rounding: the muscle contracts and is marked as uncertain.
    measured.length_mm[4] = measured.length_mm[4].map(|mm| mm - 1.0);
    let t = Target::from_lengths(&measured, baseline, TargetKind::Stretch, None).unwrap();
    assert_eq!(t.active_names(), ["SGm"]);
    assert!(t.activation[4].uncertain);
}

#[test]
fn muscles_without_a_length_or_in_no_body_are_left_out() {
    let table = "subject,vowel,GGa_mm,B_mm,C_mm,D_mm\nX,ɯ,46,56,,25\nX,a,41,50,33,\n";
    let data = Dataset::from_reader(table.as_bytes(), "my.csv").unwrap();
    let new = |kind| Target::new(&data, "X", &vowel("a"), kind, &TargetOptions::default());
    let t = new(TargetKind::Ratio).unwrap();
    assert_eq!((t.muscles.join(" "), t.not_measured.join(" ")), ("GGa B".into(), "C D".into()));
    assert_eq!(t.of_body(|_| true).unwrap(), t);
    assert_eq!(t.of_body(|name| name != "B"), Err("B".to_owned()), "it contracts");
    let options = TargetOptions { muscles: Some(vec!["C".into()]), baseline: None };
    let refused = Target::new(&data, "X", &vowel("a"), TargetKind::Ratio, &options);
    assert!(message(refused).starts_with("C of X was not measured in both /a/ and /ɯ/"));

    let reference = target("S2", "a", TargetKind::Ratio).unwrap();
    let without = reference.of_body(|name| name != "GGm").unwrap();
    assert_eq!(without.active_names(), reference.active_names());
    assert_eq!(without.muscles.len(), 7);
    assert_eq!(reference.of_body(|name| name != "GGa"), Err("GGa".to_owned()));
}

#[test]
fn a_stretch_that_no_muscle_can_have_is_refused() {
    let table = "subject,vowel,GGa_mm,GGp_mm\nX,ɯ,46,45\nX,a,41,150\n";
    let data = Dataset::from_reader(table.as_bytes(), "my.csv").unwrap();
    let target = Target::new(&data, "X", &vowel("a"), TargetKind::Stretch, &TargetOptions::default());
    let told = message(target);
    assert!(told.contains("GGp") && told.contains("1.7"), "{told}");
}
