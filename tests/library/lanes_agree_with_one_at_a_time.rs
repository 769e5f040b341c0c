//! Equilibria solved in lanes and one by one have the same shapes and statuses, and the same bits for any number of threads.

use crate::fixtures::{self, block, tongue};
use nalgebra::SVector;
use tongue_core::body::largest_distance;
use tongue_core::statics::lanes::{LaneEquilibrium, Lanes, Load, UnitChange};
use tongue_fit::body::{self, Anatomy, Body, ContinuumSettings, Mesh};
use tongue_fit::parallel::with_threads;
use tongue_fit::statics::{Solution, SolveSettings, SolveStatus, Stability, Workspace, solve};
use tongue_fit::system::{Model, System};

const ALL: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
const PUBLISHED: [f64; 8] = [12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];
/// Largest difference of positions, m.
const SAME: f64 = 1e-12;
/// The residual is a hundredth of the usual one, so that shapes are known to 1e-9 mm: a newton moves the softest node by millimetres.
const SHARP: SolveSettings = SolveSettings {
    tolerance: 1e-11,
    max_iterations: 200,
    load_steps: 60,
    certify: false,
    most_solves: 600,
    beyond: true,
};

fn all_can_pull() -> System<2> {
    System::new(&tongue(), &Model::default(), &ALL).unwrap()
}

fn one_at_a_time<const D: usize>(
    system: &System<D>,
    load: &Load<'_, D>,
    settings: &SolveSettings,
) -> (Solution, Workspace<D>) {
    let system = load.system.unwrap_or(system);
    let mut w = Workspace::new(system);
    w.displace_bone(system, &system.held(), SVector::zeros());
    load.bones.iter().for_each(|(nodes, shift)| w.displace_bone(system, nodes, *shift));
    if let Some(start) = load.start {
        w.start_from(start);
    }
    let solution = solve(system, &mut w, &load.tensions, settings);
    (solution, w)
}

/// Compares every answer with that of the scalar solver, and returns the number of answers from lanes.
fn compare<const D: usize>(system: &System<D>, loads: &[Load<'_, D>]) -> usize {
    let answers = Lanes::new(system).solve(loads, &SHARP);
    assert_eq!(answers.len(), loads.len());
    for (i, (load, answer)) in loads.iter().zip(&answers).enumerate() {
        let (solution, w) = one_at_a_time(system, load, &SHARP);
        assert_eq!(answer.solution.status, solution.status, "load {i}: {:?}", load.tensions);
        assert_eq!(answer.solution.guarded, solution.guarded, "load {i}");
        if solution.status == SolveStatus::Converged {
            let apart = largest_distance(&answer.positions, w.positions());
            assert!(apart < SAME, "load {i}: {apart:e} m apart, {:?}", load.tensions);
        }
    }
    answers.iter().filter(|a| !a.alone).count()
}

/// Tensions of all muscles: zero or, with probability 0.5, up to `most`, N/m.
fn draw(random: &mut fastrand::Rng, most: f64) -> Vec<f64> {
    ALL.map(|_| if random.bool() { most * random.f64() } else { 0.0 }).to_vec()
}

#[test]
fn shapes_and_statuses_are_those_of_the_solver_for_one_from_rest() {
    let system = all_can_pull();
    let mut random = fastrand::Rng::with_seed(1);
    for (most, at_least) in [(12.0, 390), (40.0, 360), (120.0, 150)] {
        let loads: Vec<Load<'_, 2>> = (0..400).map(|_| Load::new(draw(&mut random, most))).collect();
        let wide = compare(&system, &loads);
        assert!(wide >= at_least, "only {wide} of 400 loads up to {most} N/m were solved in lanes");
    }
}

#[test]
fn shapes_agree_from_a_neighbour_with_displaced_bones_and_in_separate_bodies() {
    let mesh = tongue();
    let system = all_can_pull();
    let hyoid: Vec<usize> =
        mesh.fixed.iter().copied().filter(|&n| mesh.nodes[n].y < 0.0 || n % 2 == 0).collect();
    let mut random = fastrand::Rng::with_seed(2);
    let mut about = |size: f64| size * (2.0 * random.f64() - 1.0);
    let bodies: Vec<System<2>> = (0..9)
        .map(|_| {
            let mut moved: Mesh<2> = mesh.clone();
            moved.nodes.iter_mut().for_each(|x| *x += SVector::from([about(2e-4), about(2e-4)]));
            let poisson_ratio = 0.47 + about(0.02);
            let model = Model { poisson_ratio, ..Model::default() };
            System::new(&moved, &model, &ALL).unwrap()
        })
        .collect();
    let middle = one_at_a_time(&system, &Load::new(PUBLISHED.to_vec()), &SHARP).1.positions().to_vec();
    let loads: Vec<Load<'_, 2>> = (0..200)
        .map(|i| {
            let mut load = Load::new(PUBLISHED.map(|t| (t + about(0.2) * t.max(5.0)).max(0.0)).to_vec());
            if i % 3 > 0 {
                load.start = Some(&middle);
            }
            if i % 2 > 0 {
                load = load.with_bone(&hyoid, SVector::from([about(1e-3), about(1e-3)]));
            }
            if i % 5 > 2 { Load { system: Some(&bodies[i % 9]), ..load } } else { load }
        })
        .collect();
    let wide = compare(&system, &loads);
    assert!(wide >= 190, "only {wide} of 200");
}

#[test]
fn loads_unsuited_for_lanes_are_solved_one_at_a_time() {
    // Loads at which the barrier acts, a tension of NaN, and a wrong number of tensions.
    let system = all_can_pull();
    let hard = [vec![3000.0; 8], vec![f64::NAN; 8], vec![5.0; 8], vec![1.0; 3], PUBLISHED.to_vec()];
    let loads: Vec<Load<'_, 2>> = hard.into_iter().map(Load::new).collect();
    assert!(compare(&system, &loads) >= 2);
    assert!(Lanes::new(&system).solve(&loads, &SHARP)[0].solution.guarded > 0, "a case without the barrier");
    // A body in space, and a continuum.
    let solid = block(2, 0.01);
    let solid = System::new(&solid, &Model::default(), &[0]).unwrap();
    assert_eq!(compare(&solid, &[Load::new(vec![2.0]), Load::new(vec![3.0])]), 0);
    let continuum = Body::continuum(8e-3, &ContinuumSettings::default()).unwrap();
    let continuum = System::new(&continuum.mesh, &Model::default(), &ALL).unwrap();
    assert!(!Lanes::new(&continuum).are_used());
    assert_eq!(compare(&continuum, &[Load::new(PUBLISHED.to_vec())]), 0);
}

#[test]
fn a_finer_body_and_one_without_incompressible_cells_are_solved_in_lanes_too() {
    let fine = body::build(&Anatomy::reference().unwrap(), 2.7e-3).unwrap();
    let fine = System::new(&fine, &Model::default(), &ALL).unwrap();
    let springs = Model { poisson_ratio: 0.25, ..Model::default() };
    let springs = System::new(&tongue(), &springs, &ALL).unwrap();
    for system in [fine, springs] {
        let mut random = fastrand::Rng::with_seed(3);
        let loads: Vec<Load<'_, 2>> = (0..24).map(|_| Load::new(draw(&mut random, 8.0))).collect();
        assert!(compare(&system, &loads) >= 22);
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let system = all_can_pull();
    let lanes = Lanes::new(&system);
    let mut random = fastrand::Rng::with_seed(4);
    let middle = one_at_a_time(&system, &Load::new(PUBLISHED.to_vec()), &SHARP).1.positions().to_vec();
    let tensions: Vec<Vec<f64>> = (0..333).map(|_| draw(&mut random, 90.0)).collect();
    let load = |i: usize| {
        let load = Load::new(tensions[i].clone());
        // Some chunks begin with factors of other loads.
        Load { start: (i < 200).then_some(&middle[..]), ..load }
    };
    let all = |threads| {
        let keep = |_: usize, shape: &LaneEquilibrium<2>| shape.clone();
        with_threads(threads, || lanes.map(tensions.len(), &SolveSettings::default(), load, keep)).unwrap()
    };
    let one = all(1);
    assert!(one.iter().filter(|a| a.alone).count() < 300);
    // Texts are compared, because the energy of a failed solve may be NaN.
    for threads in [2, 3] {
        assert_eq!(format!("{one:?}"), format!("{:?}", all(threads)), "{threads} threads");
    }
}

#[test]
fn stability_is_checked_if_asked_for() {
    let system = all_can_pull();
    let loads = [vec![0.0; 8], PUBLISHED.to_vec()].map(Load::new);
    let plain = Lanes::new(&system).solve(&loads, &SolveSettings::default());
    assert_eq!(plain[0].solution.stability, Stability::Stable, "no factorisation on the way");
    assert_eq!((plain[1].solution.stability, plain[1].alone), (Stability::Near, false));
    let certain =
        Lanes::new(&system).solve(&loads, &SolveSettings { certify: true, ..SolveSettings::default() });
    assert_eq!((certain[1].solution.stability, certain[1].alone), (Stability::Stable, false));
}

#[test]
fn adjoints_are_the_derivatives_by_tensions_forces_and_bones() {
    let mesh = tongue();
    let system = all_can_pull();
    let bone = [*mesh.fixed.last().unwrap(), mesh.fixed[0]];
    let loads: Vec<Load<'_, 2>> =
        [1.0, 0.5, 300.0].map(|part| Load::new(PUBLISHED.map(|t| t * part).to_vec())).to_vec();
    let lanes = Lanes::new(&system);
    let mut group = lanes.group();
    group.solve(&loads, &SHARP);
    assert!(group.equilibria()[2].solution.guarded > 0 && !group.equilibria()[0].alone);
    let rates = group.length_rates();
    for (load, rates) in loads.iter().zip(&rates) {
        let rates = rates.as_ref().expect("stable");
        let (_, mut w) = one_at_a_time(&system, load, &SHARP);
        let direct = fixtures::length_sensitivities(&system, &mut w);
        for (muscle, rate) in rates.iter().enumerate() {
            for other in ALL {
                let (a, b) = (rate.by_tension[other], direct[(muscle, other)]);
                assert!((a - b).abs() < 1e-8 * direct.amax(), "{muscle} by {other}: {a:e} {b:e}");
            }
            for axis in 0..2 {
                let lengths = |h: f64| {
                    let mut shift = SVector::zeros();
                    shift[axis] = h;
                    let load = Load { start: Some(w.positions()), ..load.clone().with_bone(&bone, shift) };
                    let shape = one_at_a_time(&system, &load, &SHARP).1;
                    system.length(shape.positions(), muscle)
                };
                let difference = (lengths(1e-6) - lengths(-1e-6)) / 2e-6;
                let exact = rate.by_bone(&bone)[axis];
                assert!((exact - difference).abs() < 2e-5, "{muscle}, axis {axis}: {exact} {difference}");
            }
        }
    }
    // Reciprocity: a force on one node moves another node as a force on the other moves the first.
    let (p, q) = (system.pattern().nodes()[3], system.pattern().nodes()[40]);
    let unit = |node: usize| {
        let mut gradient = vec![SVector::zeros(); mesh.nodes.len()];
        gradient[node] = SVector::from([1.0, 0.0]);
        vec![gradient; 3]
    };
    let [to_p, to_q] = [p, q].map(|node| group.adjoint(&unit(node)));
    for (to_p, to_q) in to_p.iter().zip(&to_q) {
        let (a, b) = (to_p.as_ref().unwrap().by_node[q].x, to_q.as_ref().unwrap().by_node[p].x);
        assert!(a != 0.0 && (a - b).abs() < 1e-10 * a.abs(), "{a:e} {b:e}");
    }
}

#[test]
fn motions_are_the_derivatives_of_the_shape_by_tensions_bones_and_the_shape_at_rest() {
    let mesh = tongue();
    let system = all_can_pull();
    let bone = [*mesh.fixed.last().unwrap(), mesh.fixed[0]];
    let lanes = Lanes::new(&system);
    // Every node at rest, on bones, too, moves with a smooth field.
    let field: Vec<SVector<f64, 2>> =
        mesh.nodes.iter().map(|x| SVector::from([0.1 * x.y, 0.2 * x.x - 0.05 * x.y])).collect();
    let changed = |part: f64| {
        let mut moved = mesh.clone();
        moved.nodes.iter_mut().zip(&field).for_each(|(x, d)| *x += d * part);
        System::new(&moved, &Model::default(), &ALL).unwrap()
    };
    let reshaped = lanes.reshaped(&changed(1e-5), field.clone(), 1e-5).expect("a plain body");
    let loads = [0.0, 0.5, 1.0, 300.0].map(|part| Load::new(PUBLISHED.map(|t| t * part).to_vec()));
    let mut group = lanes.group();
    let shapes = group.solve(&loads, &SHARP).to_vec();
    assert!(shapes[3].solution.guarded > 0, "a case with the barrier");
    let changes = [
        UnitChange::Tension(4),
        UnitChange::Bone(&bone, 0),
        UnitChange::Bone(&bone, 1),
        UnitChange::Rest(&reshaped),
    ];
    for change in changes {
        let motions = group.motions(change);
        assert!(motions[3].is_none(), "lanes have no stiffness of the barrier");
        for ((load, shape), motion) in loads.iter().zip(&shapes).zip(&motions).take(3) {
            let motion = motion.as_ref().expect("stable");
            let at = |part: f64| {
                let mut load = Load { start: Some(&shape.positions), ..load.clone() };
                match change {
                    UnitChange::Tension(muscle) => load.tensions[muscle] += part,
                    UnitChange::Bone(nodes, axis) => {
                        let mut shift = SVector::zeros();
                        shift[axis] = 1e-3 * part;
                        load = load.with_bone(nodes, shift);
                    }
                    UnitChange::Rest(_) => {
                        let body = changed(part);
                        return one_at_a_time(&body, &load, &SHARP).1.positions().to_vec();
                    }
                }
                one_at_a_time(&system, &load, &SHARP).1.positions().to_vec()
            };
            let unit = if matches!(change, UnitChange::Bone(..)) { 1e-3 } else { 1.0 };
            let (there, back) = (at(1e-3), at(-1e-3));
            let largest = motion.iter().map(SVector::amax).fold(0.0, f64::max);
            // Inner nodes of straight paths are placed after a solve, from the ends of the path.
            let is_inner =
                |node: &usize| system.pattern().unknown(*node).is_none() && !mesh.fixed.contains(node);
            for node in (0..motion.len()).filter(|node| !is_inner(node)) {
                let difference = (there[node] - back[node]) / (2e-3 * unit);
                let off = (motion[node] - difference).amax();
                assert!(off < 1e-4 * largest, "node {node}: {:?} {difference:?}, {change:?}", motion[node]);
            }
        }
    }
}
