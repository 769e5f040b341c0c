//! The body in motion: its final state, its speed, the limit of the step, and conservation laws.

use crate::fixtures;
use nalgebra::SVector;
use tongue_core::body::largest_distance;
use tongue_core::dynamics::{Integrator, Spectrum, State, StepCounts};
use tongue_core::effect::Incompressibility;
use tongue_fit::body::Body;
use tongue_fit::dynamics::{
    Control, IntegrationMethod, Motion, MotionStatus, Observer, Tensions, run, sample_times,
};
use tongue_fit::system::{Additions, Model, System};

fn reference() -> (System<2>, Vec<f64>) {
    of(Additions::default())
}

/// The reference tongue with kappa_s as printed in table 4.2.
fn printed() -> (System<2>, Vec<f64>) {
    let mesh = fixtures::tongue();
    let area = Box::new(Incompressibility::new(1.46e3, &mesh.cells, &mesh.nodes));
    of(Additions { effects: vec![area], incompressible: false, ..Additions::default() })
}

/// Mass of a node as printed in table 4.2, kg.
const PRINTED_MASS: f64 = 2.2e-4;

fn of(additions: Additions<2>) -> (System<2>, Vec<f64>) {
    let mesh = fixtures::tongue();
    let (muscles, tensions) = fixtures::pulling(&mesh, &fixtures::PUBLISHED_A);
    (System::with_additions(&mesh, &Model::default(), &muscles, additions).unwrap(), tensions)
}

#[derive(Default)]
struct Keep(Vec<Vec<SVector<f64, 2>>>);

impl Observer<2> for Keep {
    fn sample(&mut self, _time: f64, positions: &[SVector<f64, 2>]) {
        self.0.push(positions.to_vec());
    }
}

#[test]
fn in_the_long_run_the_body_comes_to_the_equilibrium() {
    let springs = fixtures::lattice(5, 4, 5.5e-3);
    let continuum = fixtures::held_at_a_corner(springs.clone(), 5.5e-3);
    for mesh in [springs, continuum] {
        let system = System::new(&mesh, &Model::default(), &[0]).unwrap();
        let tensions = vec![4.0];
        let goal = fixtures::solved_to(1e-11, &system, &tensions);
        assert!(largest_distance(&goal, system.rest()) > 1e-4);
        let motion = Motion::new(&system, Tensions::ramp(tensions, 0.3)).unwrap();
        for (method, control) in [
            (IntegrationMethod::TrBdf2, Control::Adaptive(1e-9)),
            (IntegrationMethod::TrBdf2, Control::Fixed(0.1)),
        ] {
            let mut integrator = method.checked_integrator(&motion, control).unwrap();
            let mut state = motion.at_rest();
            let outcome = run(&motion, integrator.as_mut(), &mut state, 60.0, &[], &mut ());
            assert_eq!(outcome.status, MotionStatus::Completed, "{method} {control:?}");
            let left = largest_distance(&state.positions, &goal);
            assert!(left < 1e-9, "{method} {control:?}: {left:e} m from the equilibrium");
        }
    }
}

#[test]
fn energy_never_grows_without_tension() {
    // Dampers are soft, so that the body swings; the slack muscle has its internal states.
    let mesh = fixtures::lattice(4, 4, 5.5e-3);
    let model = Model { viscosity: 20.0, ..Model::default() };
    let system = System::new(&mesh, &model, &[0]).unwrap();
    for method in IntegrationMethod::ALL {
        let motion = Motion::new(&system, Tensions::constant(vec![0.0])).unwrap();
        let dt = method.step_limit(&motion).map_or(1e-4, |limit| 0.2 * limit);
        let mut integrator = method.checked_integrator(&motion, Control::Fixed(dt)).unwrap();
        let mut state = motion.at_rest();
        state.positions = fixtures::shaken(&mesh, 4e-4);
        let (start, mut counts) = (motion.energy(&state), StepCounts::default());
        let mut energy = start;
        for step in 0..400 {
            integrator.step(&motion, &mut state, f64::INFINITY, &mut counts).unwrap();
            let now = motion.energy(&state);
            assert!(now <= energy * (1.0 + 1e-9), "{method}: step {step}: {energy:e} J -> {now:e} J");
            energy = now;
        }
        assert!(energy < 0.9 * start, "{method}: {start:e} J -> {energy:e} J");
    }
}

#[test]
fn explicit_runs_diverge_beyond_the_stability_limit() {
    let mesh = fixtures::lattice(4, 4, 5.5e-3);
    for viscosity in [0.0, 5.0, 3000.0] {
        let model = Model { viscosity, ..Model::default() };
        let system = System::new(&mesh, &model, &[]).unwrap();
        let motion = Motion::new(&system, Tensions::constant(vec![0.0])).unwrap();
        let method = IntegrationMethod::Verlet;
        let limit = method.step_limit(&motion).unwrap();
        let status = |part: f64| {
            let mut integrator = method.integrator(&motion, Control::Fixed(part * limit)).unwrap();
            let mut state = motion.at_rest();
            // The displacements are so small that the body is as stiff as at rest.
            state.positions = fixtures::shaken(&mesh, 1e-9);
            run(&motion, integrator.as_mut(), &mut state, 3000.0 * limit, &[], &mut ()).status
        };
        assert_eq!(status(0.98), MotionStatus::Completed, "{method} at viscosity {viscosity}");
        assert_ne!(status(1.05), MotionStatus::Completed, "{method} at viscosity {viscosity}");
    }
}

#[test]
fn an_explicit_run_of_a_loaded_body_ends_where_an_implicit_one_does_or_says_that_its_steps_grow() {
    let mesh = Body::tongue(11e-3).unwrap().mesh;
    let system = System::new(&mesh, &Model::default(), &[0]).unwrap();
    let end = |motion: &Motion<'_, 2>, method: IntegrationMethod, control| {
        let mut integrator = method.integrator(motion, control).unwrap();
        let mut state = motion.at_rest();
        let outcome = run(motion, integrator.as_mut(), &mut state, 0.3, &[], &mut ());
        (outcome, state.positions)
    };
    for load in [100.0, 300.0, 1000.0] {
        let mut tensions = vec![0.0; system.muscle_count()];
        tensions[0] = load;
        let motion = Motion::new(&system, Tensions::constant(tensions)).unwrap();
        let (_, expected) = end(&motion, IntegrationMethod::TrBdf2, Control::Adaptive(1e-8));
        let unloaded = Motion::new(&system, Tensions::constant(vec![0.0; system.muscle_count()])).unwrap();
        let method = IntegrationMethod::Verlet;
        let (loaded, at_rest) = (method.step_limit(&motion).unwrap(), method.step_limit(&unloaded).unwrap());
        assert!(loaded < 0.95 * at_rest, "{method} at {load} N: {loaded:e} s, at rest {at_rest:e} s");
        let mut unstable = 0;
        for part in [0.95, 0.98, 0.99, 1.0, 1.01, 1.05] {
            let dt = part * at_rest;
            let refused = method.checked_integrator(&motion, Control::Fixed(dt)).unwrap_err();
            let says = "(as its tensions load it: stiffest mode";
            assert!(part > 1.0 || refused.to_string().contains(says), "{refused}");
            let (outcome, found) = end(&motion, method, Control::Fixed(dt));
            let error = largest_distance(&found, &expected);
            let what = format!("at {load} N and {part} of the limit at rest: {outcome:?}, {error:e} m");
            assert!(outcome.status != MotionStatus::Completed || error < 1e-6, "{what}");
            unstable += usize::from(outcome.status == MotionStatus::Unstable);
            assert!(part < 1.01 || outcome.status != MotionStatus::Completed, "{what}");
        }
        assert!(unstable > 0, "{method} at {load} N: where its steps grow it says so");
        let (outcome, found) = end(&motion, method, Control::Fixed(0.99 * loaded));
        assert_eq!(outcome.status, MotionStatus::Completed);
        assert!(largest_distance(&found, &expected) < 1e-6);
    }
}

#[test]
fn a_run_shorter_than_any_motion_and_kinks_closer_than_any_step_end_at_once() {
    let system = System::new(&fixtures::lattice(4, 4, 5.5e-3), &Model::default(), &[0]).unwrap();
    let table = |times: &[f64]| Tensions { times: times.to_vec(), values: vec![vec![1.0]; times.len()] };
    let least = f64::from_bits(1);
    let cases = [
        (Tensions::constant(vec![1.0]), 1e-320),
        (Tensions::ramp(vec![1.0], 1e-320), 1e-3),
        (table(&[least, 0.5e-3]), 1e-3),
        (table(&[0.5e-3, 0.5e-3 + 1e-19, 0.6e-3]), 1e-3),
        (Tensions::constant(vec![1.0]), 1e-14),
    ];
    for (tensions, t_end) in cases {
        let motion = Motion::new(&system, tensions.clone()).unwrap();
        for (method, control) in [
            (IntegrationMethod::TrBdf2, Control::Adaptive(1e-9)),
            (IntegrationMethod::TrBdf2, Control::Adaptive(f64::from_bits(1))),
            (IntegrationMethod::TrBdf2, Control::Fixed(1e-4)),
            (IntegrationMethod::Verlet, Control::Fixed(1e-7)),
        ] {
            let mut integrator = method.checked_integrator(&motion, control).unwrap();
            let mut state = motion.at_rest();
            let outcome = run(&motion, integrator.as_mut(), &mut state, t_end, &[], &mut ());
            let hopeless = control == Control::Adaptive(f64::from_bits(1)) && t_end > 1e-15;
            let expected = if hopeless { MotionStatus::StepTooSmall } else { MotionStatus::Completed };
            assert_eq!(outcome.status, expected, "{method} {control:?} {tensions:?} to {t_end:e} s");
            assert!(state.positions.iter().flatten().all(|x| x.is_finite()));
        }
    }
    let motion = Motion::new(&system, table(&[0.0])).unwrap();
    fixtures::says(IntegrationMethod::Verlet.integrator(&motion, Control::Fixed(1e-320)), "the step is 0.00");
}

#[test]
fn every_sample_is_shown_where_a_kink_lies_a_bit_before_the_end() {
    let system = System::new(&fixtures::lattice(4, 4, 5.5e-3), &Model::default(), &[0]).unwrap();
    let t_end = 0.1 + 0.2;
    let motion = Motion::new(&system, Tensions::ramp(vec![1.0], 0.3)).unwrap();
    assert!(t_end > 0.3 && t_end - 0.3 < 1e-15);
    let mut integrator =
        IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-9)).unwrap();
    let (mut state, mut kept) = (motion.at_rest(), Keep::default());
    let times = sample_times(t_end, 5);
    let outcome = run(&motion, integrator.as_mut(), &mut state, t_end, &times, &mut kept);
    assert_eq!((outcome.status, outcome.time_s), (MotionStatus::Completed, t_end));
    assert_eq!(kept.0.len(), times.len());
    assert_eq!(kept.0.last(), Some(&state.positions));
}

/// An integrator that leaves a velocity of NaN.
#[derive(Debug)]
struct Spoiling;

impl Integrator<2> for Spoiling {
    fn step(
        &mut self,
        motion: &Motion<'_, 2>,
        state: &mut State<2>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), MotionStatus> {
        counts.steps += 1;
        state.time = until;
        state.velocities[motion.system.pattern().nodes()[0]].x = f64::NAN;
        Ok(())
    }
}

#[test]
fn a_velocity_that_is_not_a_number_ends_the_run_and_is_not_left_behind() {
    let system = System::new(&fixtures::lattice(4, 4, 5.5e-3), &Model::default(), &[0]).unwrap();
    let motion = Motion::new(&system, Tensions::constant(vec![1.0])).unwrap();
    let mut state = motion.at_rest();
    let outcome = run(&motion, &mut Spoiling, &mut state, 1e-3, &[], &mut ());
    assert_eq!((outcome.status, outcome.time_s), (MotionStatus::NotFinite, 0.0));
    assert_eq!(state, motion.at_rest());
}

#[test]
fn the_limits_explain_the_steps_of_the_thesis() {
    let limit = |(system, tensions): (System<2>, Vec<f64>), mass| {
        let none = Tensions::constant(vec![0.0; tensions.len()]);
        let motion = Motion::with_mass(&system, none, mass).unwrap();
        (IntegrationMethod::Verlet.step_limit(&motion).unwrap(), Spectrum::of(&motion, &motion.at_rest()))
    };
    // With table 4.2 as printed, dampers allow 1.25e-8 s (the velocity is predicted over the full step) and the area term 9.5e-7 s.
    let (printed, spectrum) = limit(printed(), PRINTED_MASS);
    assert!((1.0e-8..1.4e-8).contains(&printed), "{printed:e}");
    let area = 2.0 / spectrum.stiffness.sqrt();
    assert!((7.5e-7..1.1e-6).contains(&area), "{area:e}");
    // With a hundred times the mass, dampers allow a hundred times the step; kappa is a thousandth.
    let (consistent, spectrum) = limit(reference(), reference().0.coefficients().node_mass);
    assert!((consistent / printed / 100.0 - 1.0).abs() < 0.1, "{consistent:e}");
    let area = 2.0 / spectrum.stiffness.sqrt();
    assert!((2.3e-4..3.5e-4).contains(&area), "{area:e}");
}

#[test]
fn tissue_relaxes_with_its_damping_time_and_contracting_muscles_are_slower() {
    // Released from the shape of /a/, the passive body keeps 7 % of it after 3 s, because b/k = 1.12 s.
    let (system, tensions) = reference();
    let shape = fixtures::solved_to(1e-11, &system, &tensions);
    let passive = System::new(&fixtures::tongue(), &Model::default(), &[]).unwrap();
    let slack = Motion::new(&passive, Tensions::constant(vec![0.0; 8])).unwrap();
    let mut released = slack.at_rest();
    released.positions.copy_from_slice(&shape);
    let times = [0.0, 3.0, 6.0, 8.0];
    let mut kept = Keep::default();
    let mut integrator =
        IntegrationMethod::TrBdf2.checked_integrator(&slack, Control::Adaptive(1e-10)).unwrap();
    run(&slack, integrator.as_mut(), &mut released, 8.0, &times, &mut kept);
    let left: Vec<f64> = kept.0.iter().map(|x| largest_distance(x, passive.rest())).collect();
    let time_constant = 2.0 / (left[2] / left[3]).ln();
    let c = passive.coefficients();
    assert!((time_constant - c.tissue_damping / c.tissue_stiffness).abs() < 0.02, "{time_constant} s");
    assert!((0.05..0.09).contains(&(left[1] / left[0])), "{}", left[1] / left[0]);

    // If muscles pull it to the same shape, the contractile dampers (2.1 s for a muscle alone) delay it, too.
    let motion = Motion::new(&system, Tensions::constant(tensions)).unwrap();
    let mut integrator =
        IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-10)).unwrap();
    let mut kept = Keep::default();
    run(&motion, integrator.as_mut(), &mut motion.at_rest(), 8.0, &times, &mut kept);
    let left: Vec<f64> = kept.0.iter().map(|x| largest_distance(x, &shape)).collect();
    let time_constant = 2.0 / (left[2] / left[3]).ln();
    assert!((time_constant - 1.43).abs() < 0.03, "{time_constant} s");
    assert!((left[1] / left[0] - 0.178).abs() < 0.01, "{}", left[1] / left[0]);
}

#[test]
fn steps_and_tolerances_out_of_range_are_refused() {
    let system = System::new(&fixtures::lattice(4, 4, 5.5e-3), &Model::default(), &[0]).unwrap();
    let motion = Motion::new(&system, Tensions::constant(vec![1.0])).unwrap();
    let refused = |method: IntegrationMethod, control| {
        method.checked_integrator(&motion, control).map(drop).unwrap_err().to_string()
    };
    for (bad, method) in
        [0.0, -1e-3, f64::NAN, f64::INFINITY].into_iter().flat_map(|b| IntegrationMethod::ALL.map(|m| (b, m)))
    {
        assert!(refused(method, Control::Fixed(bad)).starts_with(&format!("the step is {bad} s")));
        refused(method, Control::Adaptive(bad));
    }
    let message = refused(IntegrationMethod::Verlet, Control::Adaptive(1e-9));
    assert!(message.starts_with("verlet has no error control"), "{message}");
    assert!(Motion::new(&system, Tensions::constant(vec![])).is_err());
}

#[test]
fn an_adaptive_trajectory_is_right_to_a_tenth_of_a_micrometre_in_few_steps() {
    let (system, tensions) = reference();
    let motion = Motion::new(&system, Tensions::constant(tensions)).unwrap();
    let times = sample_times(3.0, 61);
    let go = |tolerance| {
        let mut integrator =
            IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(tolerance)).unwrap();
        let mut kept = Keep::default();
        let outcome = run(&motion, integrator.as_mut(), &mut motion.at_rest(), 3.0, &times, &mut kept);
        assert_eq!(outcome.status, MotionStatus::Completed);
        assert_eq!(kept.0.len(), times.len());
        (kept.0, outcome.counts)
    };
    let (reference, _) = go(1e-12);
    let (found, counts) = go(1e-9);
    let error = found.iter().zip(&reference).map(|(a, b)| largest_distance(a, b)).fold(0.0, f64::max);
    assert!(error < 1e-7, "{error:e} m");
    assert!(counts.steps < 250 && counts.factorisations < 100, "{counts:?}");
}
