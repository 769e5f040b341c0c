//! Refusals of numbers beyond their limits.

use tongue_core::limits::{COORDINATE_MM, POSTERIOR_DRAWS, STIFFENING, YOUNG_MODULUS};

#[test]
fn a_number_beyond_its_limits_is_refused_with_the_reason() {
    assert_eq!(POSTERIOR_DRAWS.check(200.0), Ok(()));
    let message = COORDINATE_MM.check(1e6).unwrap_err().to_string();
    assert_eq!(
        message,
        "a coordinate is 1000000 mm; it must be from -1000 to 1000 mm: a tongue is smaller; is the unit right?"
    );
    assert!(STIFFENING.check(f64::NAN).is_err());
    let message = YOUNG_MODULUS.check(0.0).unwrap_err().to_string();
    assert!(message.contains("from 1e-6 to 1e12 Pa"), "{message}");
}
