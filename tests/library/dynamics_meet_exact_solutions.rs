//! Every integrator against exact motions, with its order: a mass on a spring, creep of a Kelvin-Voigt element, and a three-element muscle
//! after a step of its tension.

use crate::fixtures;
use nalgebra::{Matrix3, Vector3};
use tongue_fit::dynamics::{Control, IntegrationMethod, Motion, MotionStatus, State, Tensions, run};
use tongue_fit::system::{Model, System};

/// Tension, N per metre of thickness.
const PULL: f64 = 3.0;
/// Mass of a node, kg: the consistent mass in the tongue.
const MASS: f64 = 2.2e-2;

/// A bar between a bone and a free node.
fn bar(viscosity: f64, contracts: bool) -> System<2> {
    let model = Model { viscosity, ..Model::default() };
    System::new(&fixtures::rope(1, 5e-3), &model, if contracts { &[0] } else { &[] }).unwrap()
}

/// Displacement of the free end at `t_end`, m.
fn travel(motion: &Motion<'_, 2>, start: &State<2>, method: IntegrationMethod, dt: f64, t_end: f64) -> f64 {
    let mut integrator = method.integrator(motion, Control::Fixed(dt)).unwrap();
    let mut state = start.clone();
    let outcome = run(motion, integrator.as_mut(), &mut state, t_end, &[], &mut ());
    assert_eq!((outcome.status, outcome.time_s), (MotionStatus::Completed, t_end), "{method}");
    assert_eq!(state.positions[1].y, 0.0);
    state.positions[1].x - motion.system.rest()[1].x
}

/// Halves the step and expects the error to fall by a factor of four (the exponent may be off by 12 %).
fn expect_order(
    motion: &Motion<'_, 2>,
    start: &State<2>,
    method: IntegrationMethod,
    dt: f64,
    t_end: f64,
    exact: f64,
) {
    let error = |dt| (travel(motion, start, method, dt, t_end) - exact).abs();
    let (coarse, fine) = (error(dt), error(0.5 * dt));
    assert!(fine < 0.1 * exact.abs(), "{method}: error {fine:e} m of {exact:e} m");
    let observed = (coarse / fine).log2();
    assert!((observed - 2.0).abs() < 0.24, "{method}: order {observed}, not 2");
}

#[test]
fn a_mass_on_a_spring_oscillates() {
    let system = bar(0.0, false);
    let motion = Motion::with_mass(&system, Tensions::constant(vec![0.0]), MASS).unwrap();
    let omega = (system.coefficients().tissue_stiffness / motion.mass).sqrt();
    let mut start = motion.at_rest();
    let amplitude = 1e-3;
    start.positions[1].x += amplitude;
    // At this time phase and amplitude both affect the position.
    let t_end = 7.0 / omega;
    let exact = amplitude * 7.0f64.cos();
    for method in IntegrationMethod::ALL {
        expect_order(&motion, &start, method, t_end / 200.0, t_end, exact);
    }
}

#[test]
fn a_kelvin_voigt_element_creeps() {
    // Motion after release from a stretch, `m x'' + b x' + k x = 0`, with two real rates.
    let system = bar(30.0, false);
    let motion = Motion::with_mass(&system, Tensions::constant(vec![0.0]), MASS).unwrap();
    let c = system.coefficients();
    let (m, b, k) = (motion.mass, c.tissue_damping, c.tissue_stiffness);
    let root = (b * b - 4.0 * m * k).sqrt();
    let (fast, slow) = ((-b - root) / (2.0 * m), (-b + root) / (2.0 * m));
    assert!(fast < 1.5 * slow && slow < 0.0, "{fast} {slow}");
    let mut start = motion.at_rest();
    let amplitude = 1e-3;
    start.positions[1].x += amplitude;
    let t_end = -1.5 / slow;
    let exact = amplitude * (fast * (slow * t_end).exp() - slow * (fast * t_end).exp()) / (fast - slow);
    for method in IntegrationMethod::ALL {
        expect_order(&motion, &start, method, t_end / 60.0, t_end, exact);
    }
}

/// Displacement at `t` of a three-element muscle after a step of its tension at time 0, by the matrix exponential.
fn pulled(system: &System<2>, mass: f64, t: f64) -> f64 {
    let c = system.coefficients();
    let (k1, k2, b) = (c.muscle_parallel_stiffness, c.muscle_series_stiffness, c.contractile_damping);
    // d/dt (e, v, c) = A (e, v, c) + (0, 0, -F/b)
    let a = Matrix3::new(0.0, 1.0, 0.0, -(k1 + k2) / mass, 0.0, k2 / mass, k2 / b, 0.0, -k2 / b);
    let rest = a.try_inverse().unwrap() * Vector3::new(0.0, 0.0, PULL / b);
    (rest - (a * t).exp() * rest).x
}

#[test]
fn the_three_element_muscle_answers_a_step() {
    let system = bar(30.0, true);
    let motion = Motion::with_mass(&system, Tensions::constant(vec![PULL]), MASS).unwrap();
    let start = motion.at_rest();
    let t_end = 0.06;
    let exact = pulled(&system, motion.mass, t_end);
    assert!(exact < -1e-5);
    for method in IntegrationMethod::ALL {
        expect_order(&motion, &start, method, t_end / 400.0, t_end, exact);
    }
}

#[test]
fn without_mass_the_muscle_and_tissue_in_series_answer_with_two_exponentials() {
    // A muscle from a bone to a middle node, and tissue from there to a bone. With little mass, (k1 + k + k2) e + b e' = k2 c and b_cc c' =
    // k2 (e - c) - F, with the eigenvalues of a 2 x 2 matrix as rates.
    let model = Model::default();
    let system = System::new(&fixtures::two_bars(5e-3), &model, &[0]).unwrap();
    let motion = Motion::with_mass(&system, Tensions::constant(vec![PULL]), MASS).unwrap();
    let c = system.coefficients();
    let (k, k1, k2) = (c.tissue_stiffness, c.muscle_parallel_stiffness, c.muscle_series_stiffness);
    let (b, bcc) = (c.tissue_damping, c.contractile_damping);
    let a = nalgebra::Matrix2::new(-(k + k1 + k2) / b, k2 / b, k2 / bcc, -k2 / bcc);
    let rest = a.try_inverse().unwrap() * nalgebra::Vector2::new(0.0, PULL / bcc);
    let mut integrator =
        IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-10)).unwrap();
    let mut state = motion.at_rest();
    for t in [0.2, 1.0, 3.0] {
        let outcome = run(&motion, integrator.as_mut(), &mut state, t, &[], &mut ());
        assert_eq!(outcome.status, MotionStatus::Completed);
        let exact = (rest - (a * t).exp() * rest).x;
        let found = state.positions[1].x - system.rest()[1].x;
        // The mass delays the motion by m/b, which is microseconds.
        assert!((found - exact).abs() < 3e-8, "{t} s: {found} {exact}");
    }
    // The final displacement is F / (k + k1), which does not depend on Q2 and the contractile damper.
    assert!((rest.x + PULL / (k + k1)).abs() < 1e-15);
}

#[test]
fn an_adaptive_run_keeps_to_the_sum_of_the_errors_that_it_allows() {
    let system = System::new(&fixtures::two_bars(5e-3), &Model::default(), &[0]).unwrap();
    let motion = Motion::with_mass(&system, Tensions::constant(vec![PULL]), MASS).unwrap();
    let end = |tolerance| {
        let mut integrator =
            IntegrationMethod::TrBdf2.integrator(&motion, Control::Adaptive(tolerance)).unwrap();
        let mut state = motion.at_rest();
        let outcome = run(&motion, integrator.as_mut(), &mut state, 0.7, &[], &mut ());
        assert_eq!(outcome.status, MotionStatus::Completed);
        (state.positions[1].x, outcome.counts.steps)
    };
    let (reference, _) = end(1e-13);
    let errors = [1e-6, 1e-8, 1e-10].map(|tolerance| {
        let (found, steps) = end(tolerance);
        let error = (found - reference).abs();
        assert!(error < steps as f64 * tolerance, "{error:e} m at {tolerance:e} m a step, {steps} steps");
        error
    });
    // The error of a step grows as h^3, that of the whole run as h^2, hence 100^(2/3) = 21.5.
    assert!(errors[0] > 5.0 * errors[1] && errors[1] > 5.0 * errors[2], "{errors:?}");
}
