//! Tails of the normal distribution, and tensions of normal scores.

use tongue_infer::posterior::parameters::{tension, upper_tail};

#[test]
fn tails_are_those_of_the_tables() {
    // Abramowitz and Stegun 1964, table 26.1.
    for (x, p) in
        [(0.5, 0.308_537_538_725_987), (1.0, 0.158_655_253_931_457), (3.0, 1.349_898_031_630_095e-3)]
    {
        assert!((upper_tail(x) / p - 1.0).abs() < 1e-12, "{x}");
    }
    assert!((upper_tail(5.0) / 2.866_515_718_791_94e-7 - 1.0).abs() < 1e-12);
}

#[test]
fn a_tension_has_the_tail_of_its_score_and_the_slope_is_the_derivative() {
    for n in -44..=52 {
        let g = f64::from(n) * 0.1;
        let (z, slope) = tension(g);
        // The probability of tensions above it is that of scores above the score.
        assert!((2.0 * upper_tail(z) / upper_tail(g) - 1.0).abs() < 1e-9, "{g}: {z}");
        let h = 1e-5;
        let difference = (tension(g + h).0 - tension(g - h).0) / (2.0 * h);
        assert!((slope / difference - 1.0).abs() < 1e-6, "{g}: {slope} {difference}");
    }
    assert!((tension(0.0).0 - 0.674_489_750_196_081_7).abs() < 1e-14);
    assert!(tension(1.96).0 > 2.2 && tension(1.96).0 < 2.25);
}
