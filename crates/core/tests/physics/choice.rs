//! Suggestions for names that nothing has.

use tongue_core::choice::nearest;

#[test]
fn suggests_the_nearest_name_and_nothing_far() {
    let names = ["GGa", "GGm", "SGp"];
    assert_eq!(nearest("gga", names), Some("GGa"));
    assert_eq!(nearest("SGpp", names), Some("SGp"));
    assert_eq!(nearest("masseter", names), None);
}
