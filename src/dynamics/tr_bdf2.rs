//! TR-BDF2: the trapezoidal rule to an inner point, then the second backward differentiation formula; order two, L-stable.
//!
//! Bank, Coughran, Fichtner, Grosse, Rose and Smith (1985); as an ESDIRK method with an embedded formula of order three by
//! Hosea and Shampine (1996).

use super::esdirk::Tableau;

const ROOT_2: f64 = std::f64::consts::SQRT_2;
const GAMMA: f64 = 1.0 - 0.5 * ROOT_2;
const W: f64 = 0.25 * ROOT_2;

/// The coefficients.
pub static TABLEAU: Tableau = Tableau {
    name: "tr-bdf2",
    order: 2,
    estimate_power: 3,
    gamma: GAMMA,
    nodes: &[0.0, 2.0 * GAMMA, 1.0],
    before: &[&[GAMMA], &[W, W]],
    error: &[W - (1.0 - W) / 3.0, W - (3.0 * W + 1.0) / 3.0, GAMMA - GAMMA / 3.0],
};

#[cfg(test)]
mod tests {
    use super::super::esdirk::tests::{order_conditions, weights};
    use super::*;

    #[test]
    fn the_result_has_order_two_and_the_embedded_formula_three() {
        let (result, embedded) = weights(&TABLEAU);
        let of_result = order_conditions(&TABLEAU, &result);
        assert!(of_result[..2].iter().all(|r| r.abs() < 1e-15) && of_result[2].abs() > 1e-3);
        let of_embedded = order_conditions(&TABLEAU, &embedded);
        assert!(of_embedded[..4].iter().all(|r| r.abs() < 1e-15) && of_embedded[4].abs() > 1e-3);
    }
}
