//! Tensions over time, and the coefficients of TR-BDF2.

use tongue_core::dynamics::Tensions;
use tongue_core::dynamics::tr_bdf2::{EMBEDDED, GAMMA, NODES, STAGES, W};

#[test]
fn a_table_is_linear_between_its_times_and_constant_outside() {
    let table = Tensions { times: vec![1.0, 2.0, 4.0], values: vec![vec![0.0], vec![10.0], vec![6.0]] };
    let at = |t| {
        let mut out = [f64::NAN];
        table.write_at(t, &mut out);
        out[0]
    };
    assert_eq!([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(at), [0.0, 0.0, 5.0, 10.0, 8.0, 6.0, 6.0]);
    assert_eq!([0.0, 1.0, 3.9, 4.0].map(|t| table.next_kink(t)), [1.0, 2.0, 4.0, f64::INFINITY]);
}

#[test]
fn a_ramp_ends_where_it_says_and_a_ramp_of_no_time_is_a_step() {
    let mut out = [0.0];
    let ramp = Tensions::ramp(vec![8.0], 0.5);
    ramp.write_at(0.125, &mut out);
    assert_eq!(out, [2.0]);
    ramp.write_at(0.5, &mut out);
    assert_eq!(out, [8.0]);
    Tensions::ramp(vec![8.0], 0.0).write_at(0.0, &mut out);
    assert_eq!(out, [8.0]);
}

fn order_conditions(b: [f64; STAGES]) -> [f64; 4] {
    let sum = |f: &dyn Fn(usize) -> f64| (0..STAGES).map(|i| b[i] * f(i)).sum::<f64>();
    let a_c = [0.0, GAMMA * NODES[1], W * NODES[1] + GAMMA];
    [
        sum(&|_| 1.0) - 1.0,
        sum(&|i| NODES[i]) - 1.0 / 2.0,
        sum(&|i| NODES[i] * NODES[i]) - 1.0 / 3.0,
        sum(&|i| a_c[i]) - 1.0 / 6.0,
    ]
}

#[test]
fn the_result_has_order_two_and_the_embedded_formula_three() {
    let of_result = order_conditions([W, W, GAMMA]);
    assert!(of_result[..2].iter().all(|r| r.abs() < 1e-15) && of_result[2].abs() > 1e-3);
    assert!(order_conditions(EMBEDDED).iter().all(|r| r.abs() < 1e-15));
}
