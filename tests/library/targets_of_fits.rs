//! Which muscles contract, what is fitted, and the published facts with which answers are compared.

use tongue_fit::measured::{
    Dataset, Lengths, Muscles, ReadError, Target, TargetKind, TargetOptions, Thesis, Vowel,
};
use tongue_input::measured::lengths::rest_distance::{RestDistance, distance, measure, nearest};
use tongue_input::measured::muscles::PALETTE;
use tongue_input::measured::published_patterns::{ACTIVE_N, Patterns};
use tongue_input::measured::thesis::ThesisRow;

use crate::fixtures::{PUBLISHED_A, says, target, vowel};
use crate::lengths_are_refused::dataset;

fn strings(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

fn chosen(muscles: Option<&[&str]>, label: &str, subject: &str) -> Result<Target, ReadError> {
    let options = TargetOptions { muscles: muscles.map(strings), baseline: None };
    Target::new(&Dataset::reference().unwrap(), subject, &vowel(label), TargetKind::Ratio, &options)
}

#[test]
fn s2_a_is_the_target_of_the_thesis_and_all_twelve_rows_beside_a_baseline_have_one() {
    let t = target("S2", "a", TargetKind::Ratio);
    let names = |positions: &[usize]| positions.iter().map(|&m| t.muscles[m].as_str()).collect::<Vec<_>>();
    assert_eq!((t.active_names(), names(&t.fitted)), (vec!["GGa", "SGm", "HGa"], vec!["SGm", "HGa"]));
    assert_eq!(t.baseline, Vowel::unrounded_u());
    let of_active = t.active.iter().map(|&m| t.values[m]).collect::<Vec<_>>();
    assert_eq!(of_active, [1.0, 23.0 / 41.0, 33.0 / 41.0]);
    let uncertain: Vec<usize> = (0..8).filter(|&m| t.activation[m].uncertain).collect();
    assert_eq!(names(&uncertain), ["SGp"]);
    let thesis = Thesis::reference();
    for (name, ours) in t.muscles.iter().zip(&t.values) {
        let theirs = thesis.row(name).unwrap().measured_ratio_a;
        assert!((ours - theirs).abs() <= 0.005, "{name}: {ours} against {theirs} in table 4.7");
    }
    let stretch = target("S2", "a", TargetKind::Stretch);
    assert_eq!(
        (&stretch.fitted, stretch.values[0], stretch.values[7]),
        (&t.active, 41.0 / 46.0, 35.0 / 31.0)
    );
    for subject in ["S1", "S2", "S3"] {
        for (label, kind) in ["i", "e", "a", "o"].into_iter().flat_map(|l| TargetKind::ALL.map(|k| (l, k))) {
            let t = target(subject, label, kind);
            assert!(!t.fitted.is_empty() && t.active.iter().all(|&m| t.activation[m].change_mm < 0.0));
        }
    }
    let data = Dataset::reference().unwrap();
    let options = TargetOptions { muscles: Some(strings(&["hga", "GGa"])), baseline: Some(vowel("e")) };
    let t = Target::new(&data, "S4", &vowel("a"), TargetKind::Ratio, &options).unwrap();
    assert_eq!((t.baseline.label(), t.active_names()), ("e", vec!["GGa", "HGa"]));
    let lengths: Vec<Option<f64>> = t.baseline_mm.iter().copied().map(Some).collect();
    assert_eq!(lengths, data.row("S4", &vowel("e")).unwrap().length_mm);
}

#[test]
fn a_quantity_has_a_name_and_ratios_ignore_scale() {
    for kind in TargetKind::ALL {
        assert_eq!(kind.name().to_uppercase().parse::<TargetKind>().unwrap(), kind);
        assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
    }
    let message = "rato".parse::<TargetKind>().unwrap_err().to_string();
    assert_eq!(message, "unknown target kind \"rato\"; did you mean \"ratio\"? (known: ratio, stretch)");
    let lengths = [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0];
    // 1/1024 is a power of two, so the quotients are exact.
    let scaled = lengths.map(|l| l / 1024.0);
    let ratio = TargetKind::Ratio;
    assert_eq!(ratio.values(&lengths, &lengths, 0), ratio.values(&scaled, &lengths, 0));
    assert_eq!(TargetKind::Stretch.values(&lengths, &lengths, 0), [1.0; 8]);
    assert_eq!(ratio.values(&lengths, &lengths, 4)[4], 1.0);
}

#[test]
fn targets_that_cannot_be_fitted_are_refused_with_advice() {
    let other = |table: &str, muscles: Option<&[&str]>| {
        let options = TargetOptions { muscles: muscles.map(strings), baseline: None };
        Target::new(&dataset(table), "X", &vowel("a"), TargetKind::Stretch, &options)
    };
    for (refused, expected) in [
        (chosen(None, "u", "S2"), "/ɯ/ of S2 is the baseline itself, so there is nothing to fit; choose"),
        (
            chosen(None, "a", "S4"),
            "S4 has no row for the baseline vowel /ɯ/ in targets/takano2007_lengths.csv (built in); it has /i/, /e/, /a/, /o/: \
             choose one of these as the baseline instead",
        ),
        (chosen(Some(&[]), "a", "S2"), "the list of contracting muscles is empty; name at least one of"),
        (chosen(Some(&["SGm", "GGa", "SGm"]), "a", "S2"), "muscle SGm is listed twice"),
        (chosen(Some(&["GGa"]), "a", "S2"), "only GGa contracts in /a/ of S2, and its ratio to itself is"),
        (chosen(Some(&["GGx"]), "a", "S2"), "unknown muscle \"GGx\"; did you mean"),
        (other("subject,vowel,GGa_mm\nX,ɯ,46\nX,a,46\n", None), "name the muscles that may with --muscles"),
        (other("subject,vowel,GGa_mm,C_mm\nX,ɯ,46,\nX,a,41,33\n", Some(&["C"])), "C of X was not measured"),
        (
            other("subject,vowel,GGa_mm,GGp_mm\nX,ɯ,46,45\nX,a,41,150\n", None),
            "GGp of X is 150 mm in /a/ and 45 mm in /ɯ/, but no muscle of a tongue changes its length to less than 0.5 or more \
             than 1.7 times",
        ),
    ] {
        says(refused, expected);
    }
}

#[test]
fn a_change_is_uncertain_within_both_half_widths_and_what_was_not_measured_is_left_out() {
    let data = dataset(
        "subject,vowel,A_mm,B_mm,C_mm,D_mm,E_mm,half_width_mm\n\
         X,ɯ,43.1,43.1,43.1,43.1,NA,0.5\nX,a,42.1,42.099,44.1,NA,40,0.5\nX,e,42.1,40.8,45,43.1,40,2\n",
    );
    let rows_of = |label: &str| {
        let all = data.row("X", &vowel(label)).unwrap().activation(data.baseline("X").unwrap());
        all.into_iter().map(|a| a.map(|a| (a.contracting, a.uncertain))).collect::<Vec<_>>()
    };
    assert_eq!(rows_of("a"), [Some((true, true)), Some((true, false)), Some((false, true)), None, None]);
    let wide = [Some((true, true)), Some((true, true)), Some((false, true)), Some((false, true)), None];
    assert_eq!(rows_of("e"), wide);
    // A millimetre is within rounding: the muscle contracts and is marked as uncertain.
    let data = Dataset::reference().unwrap();
    let baseline = data.baseline("S2").unwrap();
    let mut measured = Lengths { vowel: vowel("a"), ..baseline.clone() };
    measured.length_mm[4] = measured.length_mm[4].map(|mm| mm - 1.0);
    let t = Target::from_lengths(&measured, baseline, TargetKind::Stretch, None).unwrap();
    assert!(t.active_names() == ["SGm"] && t.activation[4].uncertain);

    let data = dataset("subject,vowel,GGa_mm,B_mm,C_mm,D_mm\nX,ɯ,46,56,,25\nX,a,41,50,33,\n");
    let t = data.ratios("X", "a").unwrap();
    assert_eq!((t.muscles.join(" "), t.not_measured.join(" ")), ("GGa B".into(), "C D".into()));
    assert_eq!(t.of_body(|_| true).unwrap(), t);
    assert_eq!(t.of_body(|name| name != "B"), Err("B".to_owned()), "it contracts");
    let reference = target("S2", "a", TargetKind::Ratio);
    let without = reference.of_body(|name| name != "GGm").unwrap();
    assert_eq!((without.active_names(), without.muscles.len()), (reference.active_names(), 7));
    assert_eq!(reference.of_body(|name| name != "GGa"), Err("GGa".to_owned()));
}

#[test]
fn the_built_in_tables_are_those_of_the_thesis_whose_rest_is_nearest_to_u_of_s1() {
    let thesis = Thesis::reference();
    let column = |of: fn(&ThesisRow) -> f64| thesis.rows().iter().map(of).collect::<Vec<_>>();
    let rest = column(|r| r.rest_length_mm);
    assert_eq!(rest, [42.7, 57.8, 47.9, 56.3, 23.0, 33.2, 31.0, 32.9]);
    assert_eq!(column(|r| r.measured_ratio_a), [1.00, 1.51, 1.29, 1.44, 0.56, 1.07, 0.80, 0.85]);
    assert_eq!(column(|r| r.simulated_ratio_a), [1.00, 1.52, 1.31, 1.54, 0.56, 0.97, 0.80, 0.91]);
    assert_eq!(thesis.tensions_a(), PUBLISHED_A);
    assert_eq!(thesis.row("sgm").unwrap().rest_length_mm, 23.0);
    assert!(thesis.row("mylohyoid").is_none());

    let names: Vec<String> = thesis.rows().iter().map(|r| r.muscle.clone()).collect();
    let data = Dataset::reference().unwrap();
    // docs/model.md has 0.118, and 0.126 for the /ɯ/ of S2, which the thesis names.
    let found = nearest(&names, &rest, &data, "GGa").unwrap();
    assert_eq!((found.subject.as_str(), found.vowel), ("S1", Vowel::unrounded_u()));
    let s2 = distance(&names, &rest, data.baseline("S2").unwrap(), "GGa").unwrap();
    for (found, rms, largest) in [(found.distance, 0.118, 0.19), (s2, 0.126, 0.23)] {
        assert!((found.rms_ratio - rms).abs() < 5e-4 && (found.largest_relative - largest).abs() < 5e-3);
    }
    assert_eq!(
        measure(7, "GGa"),
        "root mean square difference of the seven ratios to GGa, model at rest less measured row"
    );
    // Muscles that were not measured are left out.
    let data = dataset("subject,vowel,GGa_mm,B_mm\nX,a,40,20\nX,e,40,NA\n");
    let of = |n: usize, reference: &str| {
        distance(&strings(&["GGa", "B", "C"]), &[4.0, 3.0, 1.0], &data.rows[n].lengths, reference)
    };
    assert_eq!(of(0, "GGa"), Some(RestDistance { rms_ratio: 0.25, largest_relative: 0.5, ratios: 1 }));
    assert_eq!((of(1, "GGa"), of(0, "C")), (None, None));
}

#[test]
fn published_patterns_count_portions_for_their_muscle_and_say_nothing_of_other_vowels_and_muscles() {
    let (patterns, muscles) = (Patterns::reference(), Muscles::built_in());
    let all: Vec<String> = muscles.all().iter().map(|m| m.name.clone()).collect();
    let check = |label: &str, names: &[String], tensions: &[(usize, f64)]| {
        let mut each = vec![0.0; names.len()];
        tensions.iter().for_each(|(m, t)| each[*m] = *t);
        patterns.check(&vowel(label), names, &each)
    };
    let some = strings(&["GGa", "mylohyoid"]);
    for (label, names, tensions, [found, missing, unexpected]) in [
        ("a", &all, &[(0, 12.0), (4, 11.5), (6, 4.5)][..], [&["GGa", "HG", "SG"][..], &[], &[]]),
        ("i", &all, &[(7, 1.0), (2, 0.5 * ACTIVE_N)], [&[], &["GGa", "GGp", "SG"], &["HG"]]),
        ("u", &some, &[(0, 1.0), (1, 1.0)], [&["GGa"], &[], &[]]),
    ] {
        let comparison = check(label, names, tensions).unwrap();
        assert_eq!(
            [comparison.found, comparison.missing, comparison.unexpected],
            [found, missing, unexpected].map(strings)
        );
    }
    assert_eq!(check("ə", &all, &[(0, 1.0)]), None);
    assert_eq!(patterns.muscles(&Vowel::unrounded_u()), ["GGa", "SG"]);
}

#[test]
fn muscles_have_the_capacities_of_their_whole_and_unknown_ones_names_and_colours_of_their_own() {
    let muscles = Muscles::built_in();
    let all: Vec<String> = muscles.all().iter().map(|m| m.name.clone()).collect();
    assert_eq!(all, ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
    assert!(muscles.all().iter().zip(PALETTE).all(|(info, colour)| info.colour == colour));
    let asked = strings(&["T1", "gga", "T2", "SGm", "T3", "T4", "T5", "T6", "T7", "T8", "T9"]);
    for (names, expected) in [
        (
            &all,
            &[
                ("GGa", vec![0], 18.0),
                ("GGm", vec![1], 12.0),
                ("GGp", vec![2], 37.0),
                ("styloglossus", vec![3, 4, 5], 24.0),
                ("hyoglossus", vec![6, 7], 65.0),
            ][..],
        ),
        (&asked, &[("GGa", vec![1], 18.0), ("styloglossus", vec![3], 24.0)]),
    ] {
        let found = muscles.capacities(names);
        let found: Vec<_> =
            found.iter().map(|c| (c.muscle.as_str(), c.portions.clone(), c.capacity_n)).collect();
        assert_eq!(found, expected);
    }
    assert_eq!((muscles.published(" hGA "), muscles.published("mylohyoid")), (Some((6, "HGa")), None));
    let infos = muscles.info(&asked);
    assert_eq!(infos.iter().map(|i| &i.name).collect::<Vec<_>>(), asked.iter().collect::<Vec<_>>());
    let mut colours: Vec<String> = infos[..8].iter().map(|i| i.colour.clone()).collect();
    colours.sort();
    colours.dedup();
    assert!(colours.len() == 8 && muscles.get("T1").is_none());
}
