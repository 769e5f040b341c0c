//! Newton's method against exact solutions and the minimum of the energy, and its status where there is no equilibrium.

use crate::fixtures::{self, says, tongue};
use nalgebra::SVector;
use tongue_fit::body::Mesh;
use tongue_fit::effect::Configuration;
use tongue_fit::statics::{Connection, FromRest, SolveSettings, SolveStatus, Workspace, solve, trace};
use tongue_fit::system::{Model, System};

const PUBLISHED: [f64; 8] = [12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];

/// A muscle of `n` connections of 1 cm between a bone and a free end, and the equilibrium of the end: each connection has the length `l0 -
/// F/k`.
fn rope(n: usize, tension: f64) -> (Mesh<2>, f64) {
    let mesh = fixtures::rope(n, 0.01);
    let k = tongue_fit::system::coefficients(&mesh, &Model::default()).unwrap().muscle_parallel_stiffness;
    (mesh, n as f64 * (0.01 - tension / k))
}

#[test]
fn a_contracting_rope_shortens_by_f_over_k_a_connection() {
    let (mesh, exact) = rope(5, 8.0);
    let system = System::new(&mesh, &Model::default(), &[0]).unwrap();
    let (solution, workspace) = fixtures::solve(&system, &[8.0]);
    assert_eq!(solution.status, SolveStatus::Converged, "{solution:?}");
    assert!((system.length(workspace.positions(), 0) - exact).abs() < 1e-12);
    // The mesh has no cells.
    assert_eq!(system.cell_ratios(workspace.positions()), (1.0, 1.0));
    assert_eq!(system.tissue_ratios(workspace.positions()), (1.0, 1.0));
    // The inner nodes of the straight path are placed evenly.
    for (i, p) in workspace.positions().iter().enumerate() {
        assert!((p.x - exact * i as f64 / 5.0).abs() < 1e-12 && p.y == 0.0, "node {i} at {p}");
    }
}

#[test]
fn the_tongue_rests_where_every_free_node_is_in_balance_and_the_energy_is_least() {
    let system = System::new(&tongue(), &Model::default(), &[0, 4, 6]).unwrap();
    let (solution, workspace) = fixtures::solve(&system, &PUBLISHED);
    assert_eq!(solution.status, SolveStatus::Converged);
    assert!(solution.max_residual_force < 1e-9, "{solution:?}");
    let (smallest, largest) = system.cell_ratios(workspace.positions());
    assert!(smallest > 0.95 && largest < 1.05, "areas at {smallest} to {largest}");
    let energy = |x: &[SVector<f64, 2>]| system.energy(Configuration { positions: x, tensions: &PUBLISHED });
    let least = energy(workspace.positions());
    for seed in 0..50usize {
        let mut moved = workspace.positions().to_vec();
        for (i, p) in moved.iter_mut().enumerate() {
            if system.pattern().unknown(i).is_some() {
                p.x += 1e-5 * ((seed * 131 + i * 17) as f64).sin();
                p.y += 1e-5 * ((seed * 37 + i * 101) as f64).cos();
            }
        }
        assert!(energy(&moved) > least, "seed {seed}: {:e} below", least - energy(&moved));
    }
    // The forces on all nodes, with the reactions of bones, add up to zero.
    let total: SVector<f64, 2> = workspace.force().iter().sum();
    assert!(total.norm() < 1e-10, "{total}");
}

/// Work counts of ordinary solves, by which a loss of speed is seen without timing.
#[test]
fn the_published_load_takes_as_many_factorisations_as_before_and_a_neighbour_fewer() {
    let system = System::new(&tongue(), &Model::default(), &[0, 4, 6]).unwrap();
    let (cold, mut workspace) = fixtures::solve(&system, &PUBLISHED);
    assert!(cold.iterations <= 9 && cold.factorisations <= 7, "{cold:?}");
    let near = workspace.positions().to_vec();
    workspace.start_from(&near);
    let neighbour = [12.3, 0.0, 0.0, 0.0, 11.3, 0.0, 4.7, 0.0];
    let warm = solve(&system, &mut workspace, &neighbour, &SolveSettings::default());
    assert_eq!(warm.status, SolveStatus::Converged);
    assert!(warm.iterations <= 5 && warm.factorisations <= 2, "{warm:?}");
}

#[test]
fn a_pushed_path_stays_straight_and_in_balance() {
    // HGa and GGp together push towards the hyoid, so that HGp shortens although it does not contract.
    let mesh = tongue();
    let system = System::new(&mesh, &Model::default(), &[2, 5, 6]).unwrap();
    let (solution, workspace) = fixtures::solve(&system, &[0.0, 0.0, 20.0, 0.0, 0.0, 20.0, 30.0, 0.0]);
    assert_eq!(solution.status, SolveStatus::Converged, "{solution:?}");
    for path in system.paths() {
        let [a, b] = path.ends().map(|n| workspace.positions()[n]);
        for node in path.inner_nodes() {
            let p = workspace.positions()[node];
            assert!((p - a).perp(&(b - a)).abs() / (b - a).norm() < 1e-12);
        }
    }
}

#[test]
fn whatever_the_tensions_a_solve_ends_in_a_status_with_finite_positions() {
    let system = System::new(&tongue(), &Model::default(), &[0, 1, 2, 3, 4, 5, 6, 7]).unwrap();
    let cases = [[1e9; 8], [f64::NAN; 8], [f64::INFINITY; 8], [200.0; 8], [-50.0; 8]];
    for tensions in cases {
        let (solution, workspace) = fixtures::solve(&system, &tensions);
        assert!(workspace.positions().iter().all(|p| p.iter().all(|c| c.is_finite())), "{tensions:?}");
        assert_eq!(solution.status == SolveStatus::NotFinite, !tensions[0].is_finite(), "{solution:?}");
        assert!(system.cell_ratios(workspace.positions()).0 > 0.0, "{tensions:?} turned a triangle over");
    }
    let (solution, _) = fixtures::solve(&system, &[1.0; 3]);
    assert_eq!(solution.status, SolveStatus::NotFinite, "a wrong number of tensions");
}

#[test]
fn a_trace_counts_all_that_it_took_and_says_where_it_stopped() {
    let system = System::new(&tongue(), &Model::default(), &[0, 4, 6]).unwrap();
    let (direct, mut workspace) = fixtures::solve(&system, &PUBLISHED);
    let whole = trace(&system, &mut workspace, &PUBLISHED, &SolveSettings::default());
    assert_eq!((whole.from_rest, whole.solution.connection), (FromRest::Branch, Connection::Traced));
    assert!(whole.solution.iterations > 10 * direct.iterations, "{whole:?}");
    let few = SolveSettings { most_solves: 10, ..SolveSettings::default() };
    let part = trace(&system, &mut workspace, &PUBLISHED, &few);
    let not_known = FromRest::NotKnown { reached: 0.5 };
    assert_eq!((part.from_rest, part.solution.connection), (not_known, Connection::Direct));
    assert_eq!(part.solution.status, SolveStatus::Converged);
}

#[test]
fn a_body_without_bone_is_refused() {
    let mut mesh = tongue();
    mesh.fixed.clear();
    says(System::new(&mesh, &Model::default(), &[0]), "is joined to no bone");
}

/// Regression: a trace that had found the end of a branch left a step on the bones, which stopped every later solve.
#[test]
fn a_solve_after_a_trace_is_bit_for_bit_one_on_a_new_workspace() {
    let mesh = fixtures::bodies::truss(0.02, 0.01, 0.03, 40);
    let system = System::new(&mesh, &Model::default(), &[0]).unwrap();
    let mut used = Workspace::new(&system);
    let below = trace(&system, &mut used, &[2.0], &SolveSettings::default());
    assert_eq!((below.from_rest, below.solution.connection), (FromRest::Branch, Connection::Traced));
    assert!(trace(&system, &mut used, &[4.0], &SolveSettings::default()).from_rest.critical().is_some());
    used.start_from_rest(&system);
    let mut new = Workspace::new(&system);
    let again = solve(&system, &mut used, &[1.0], &SolveSettings::default());
    assert_eq!(again, solve(&system, &mut new, &[1.0], &SolveSettings::default()));
    assert_eq!(used.positions(), new.positions());
}
