//! Names of variants, and suggestions for names that nothing has.

use tongue_core::choice::{name_of, named, names, nearest};

#[derive(Debug, PartialEq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Way {
    Straight,
    BySide,
}

#[test]
fn a_choice_has_the_names_of_its_variants() {
    assert_eq!(names::<Way>(), ["straight", "by-side"]);
    assert_eq!(named("straight"), Some(Way::Straight));
    assert_eq!(named::<Way>("Straight"), None);
    assert_eq!(name_of(&Way::BySide), "by-side");
    assert!(names::<f64>().is_empty());
}

#[test]
fn suggests_the_nearest_name_and_nothing_far() {
    let names = ["GGa", "GGm", "SGp"];
    assert_eq!(nearest("gga", names), Some("GGa"));
    assert_eq!(nearest("SGpp", names), Some("SGp"));
    assert_eq!(nearest("masseter", names), None);
}
