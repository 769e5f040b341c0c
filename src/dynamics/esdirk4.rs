//! ESDIRK4(3)6L\[2\]SA: order four with an embedded formula of order three, six stages, L-stable.
//!
//! Kennedy and Carpenter (2003), Additive Runge-Kutta schemes for convection-diffusion-reaction equations, the implicit part
//! of ARK4(3)6L\[2\]SA.

use super::esdirk::Tableau;

const B: [f64; 5] = [82889.0 / 524892.0, 0.0, 15625.0 / 83664.0, 69875.0 / 102672.0, -2260.0 / 8211.0];

/// The coefficients.
pub static TABLEAU: Tableau = Tableau {
    name: "esdirk4",
    order: 4,
    estimate_power: 4,
    gamma: 0.25,
    nodes: &[0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0],
    before: &[
        &[0.25],
        &[8611.0 / 62500.0, -1743.0 / 31250.0],
        &[5012029.0 / 34652500.0, -2922.0 / 441375.0, 174375.0 / 388108.0],
        &[
            15267082809.0 / 155376265600.0,
            -71443401.0 / 120774400.0,
            730878875.0 / 902184768.0,
            2285395.0 / 8070912.0,
        ],
        &B,
    ],
    error: &[
        B[0] - 4586570599.0 / 29645900160.0,
        0.0,
        B[2] - 178811875.0 / 945068544.0,
        B[3] - 814220225.0 / 1159782912.0,
        B[4] + 3700637.0 / 11593932.0,
        0.25 - 61727.0 / 225920.0,
    ],
};

#[cfg(test)]
mod tests {
    use super::super::esdirk::tests::{order_conditions, weights};
    use super::*;

    #[test]
    fn the_result_has_order_four_and_the_embedded_formula_three() {
        let (result, embedded) = weights(&TABLEAU);
        assert!(order_conditions(&TABLEAU, &result).iter().all(|r| r.abs() < 1e-14));
        let of_embedded = order_conditions(&TABLEAU, &embedded);
        assert!(of_embedded[..4].iter().all(|r| r.abs() < 1e-14));
        assert!(of_embedded[4..].iter().any(|r| r.abs() > 1e-4));
    }
}
