//! Properties of every mesh, load and material in range, tested on random cases. Failing cases are stored in `proptest-regressions/` and
//! tested first in later runs.

use crate::fixtures;
use crate::fixtures::bodies::{lattice, place};
use nalgebra::SVector;
use proptest::prelude::*;
use tongue_fit::body::json::{self, MeshRecord};
use tongue_fit::body::{Body, Bone, ContinuumSettings, Mesh, MuscleChain, Unit, gmsh};
use tongue_fit::effect::Configuration;
use tongue_fit::statics::{SolveSettings, SolveStatus, Stability, Workspace, solve};
use tongue_fit::system::{Model, SpaceModel, System};

/// A lattice whose free nodes are moved by up to 0.3 of a side, so that no triangle is inverted.
fn body() -> impl Strategy<Value = Mesh<2>> {
    (2usize..8, 3usize..7, 1e-3..1e-2, prop::collection::vec((-0.3..0.3, -0.3..0.3), 56)).prop_map(
        |(columns, rows, side, moves)| {
            let mut mesh = lattice(columns, rows, side);
            for (p, (dx, dy)) in mesh.nodes.iter_mut().zip(moves).skip(columns) {
                *p += SVector::from([dx, dy]) * side * 0.7;
            }
            mesh
        },
    )
}

/// Soft to hard materials, with Poisson's ratios from nearly 0.25 (springs alone) to nearly 0.5.
fn material() -> impl Strategy<Value = Model> {
    (2.0..6.0f64, 0.26..0.499f64).prop_map(|(log_e, poisson_ratio)| Model {
        young_modulus: 10f64.powf(log_e),
        poisson_ratio,
        ..Model::default()
    })
}

fn system(mesh: &Mesh<2>, model: &Model) -> System<2> {
    System::new(mesh, model, &[0]).unwrap()
}

/// The mesh with a muscle that leaves it at a node and bends on its path to a bone.
fn with_a_bent_muscle<const D: usize>(mut mesh: Mesh<D>, from: usize, way: &[SVector<f64, D>]) -> Mesh<D> {
    let mut nodes = vec![from];
    for step in way {
        nodes.push(mesh.nodes.len());
        mesh.nodes.push(mesh.nodes[from] + step);
    }
    mesh.fixed.push(mesh.nodes.len() - 1);
    mesh.muscles.push(MuscleChain { name: "bent".to_owned(), nodes });
    mesh.connect();
    mesh
}

/// Without tension every muscle keeps its length.
fn rests<const D: usize>(system: &System<D>) -> Result<(), TestCaseError> {
    let mut workspace = Workspace::new(system);
    let tensions = vec![0.0; system.muscle_count()];
    let s = solve(system, &mut workspace, &tensions, &SolveSettings::default());
    prop_assert_eq!(s.status, SolveStatus::Converged);
    let moved = tongue_core::body::largest_distance(workspace.positions(), system.rest());
    prop_assert!(moved < 1e-9, "{moved:e} m");
    for muscle in 0..system.muscle_count() {
        let stretch = system.length(workspace.positions(), muscle) / system.length(system.rest(), muscle);
        prop_assert!((stretch - 1.0).abs() < 1e-9, "muscle {muscle}: {stretch}");
    }
    Ok(())
}

/// The mesh stays at rest without contracting muscles, with all of them contracting, and as a continuum.
fn rests_in_every_form<const D: usize>(mesh: &Mesh<D>) -> Result<(), TestCaseError> {
    let all: Vec<usize> = (0..mesh.muscles.len()).collect();
    rests(&System::new(mesh, &Model::default(), &[]).unwrap())?;
    rests(&System::new(mesh, &Model::default(), &all).unwrap())?;
    if let Ok(body) = Body::new("", mesh.clone()).into_continuum(&ContinuumSettings::default()) {
        let model = Model::default();
        rests(&System::new(&body.mesh, &model, &all).unwrap())?;
    }
    Ok(())
}

#[test]
fn the_built_in_bodies_are_at_rest_without_tension() {
    for spacing in [4e-3, 5.5e-3, 8e-3] {
        rests_in_every_form(&Body::tongue(spacing).unwrap().mesh).unwrap();
    }
    rests(&System::in_space(&Body::tongue_in_space(1).unwrap(), &SpaceModel::default()).unwrap()).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn a_rigid_motion_costs_no_energy(
        mesh in body(), model in material(), angle in -3.1..3.1f64, x in -1.0..1.0f64, y in -1.0..1.0f64,
    ) {
        let system = system(&mesh, &model);
        let moved: Vec<_> = mesh.nodes.iter().map(|p| place(p, angle, false, SVector::from([x, y]))).collect();
        let energy = system.energy(Configuration { positions: &moved, tensions: &[0.0] });
        // Rounding of the energy: the squared rounding of positions times the stiffness.
        let c = system.coefficients();
        prop_assert!(energy.abs() < 1e-20 * (c.tissue_stiffness + c.kappa * 1e6 + 1.0) * 1e3, "{energy:e}");
    }

    #[test]
    fn a_solve_ends_in_a_stable_equilibrium_or_says_why_and_never_turns_a_cell_over(
        mesh in body(), model in material(), log_load in -3.0..4.0f64, sign in prop::bool::weighted(0.8),
    ) {
        let system = system(&mesh, &model);
        let load = if sign { 1.0 } else { -1.0 } * 10f64.powf(log_load);
        let mut workspace = Workspace::new(&system);
        let settings = SolveSettings { certify: true, ..SolveSettings::default() };
        let s = solve(&system, &mut workspace, &[load], &settings);
        prop_assert!(workspace.positions().iter().all(|p| p.iter().all(|c| c.is_finite())));
        prop_assert!(system.cell_ratios(workspace.positions()).0 > 0.0, "{s:?}");
        prop_assert!((0.0..=1.0).contains(&s.load_reached));
        if s.status == SolveStatus::Converged {
            prop_assert!(matches!(s.stability, Stability::Stable | Stability::Neutral), "{s:?}");
            prop_assert!(s.load_reached == 1.0);
        }
        // Loads within the forces of muscles on tissue of this stiffness must converge.
        if load.abs() < 0.1 * system.coefficients().tissue_stiffness * 1e-3 {
            prop_assert_eq!(s.status, SolveStatus::Converged, "{:?}", s);
        }
    }

    #[test]
    fn the_energy_of_a_found_equilibrium_is_not_above_that_of_rest(
        mesh in body(), model in material(), load in 0.0..50.0f64,
    ) {
        let system = system(&mesh, &model);
        let mut workspace = Workspace::new(&system);
        let s = solve(&system, &mut workspace, &[load], &SolveSettings::default());
        let energy = |x: &[SVector<f64, 2>]| system.energy(Configuration { positions: x, tensions: &[load] });
        if s.status == SolveStatus::Converged {
            let (found, rest) = (energy(workspace.positions()), energy(system.rest()));
            prop_assert!(found <= rest + 1e-12 * rest.abs().max(found.abs()), "{found:e} {rest:e}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_body_that_is_accepted_is_at_rest_without_tension(
        mesh in body(), at in any::<prop::sample::Index>(), bends in prop::collection::vec((-1.0..1.0, -1.0..1.0, -1.0..1.0), 1..5),
    ) {
        let (columns, side) = (mesh.nodes.iter().filter(|p| p.y == 0.0).count(), mesh.nodes[1].x);
        let top = mesh.nodes.len() - columns;
        let way = |d: usize, (x, y, z): (f64, f64, f64)| [3.0 * x, 4.0 + d as f64 + 3.0 * y.abs(), z].map(|c| c * side);
        let plane: Vec<_> = bends.iter().enumerate().map(|(d, b)| SVector::from_row_slice(&way(d, *b)[..2])).collect();
        let mesh = with_a_bent_muscle(mesh, top + at.index(columns), &plane);
        rests_in_every_form(&mesh)?;
        let bones = [Bone { name: "bone".to_owned(), nodes: mesh.fixed.clone() }];
        let read = gmsh::read(gmsh::write(&mesh, &bones).as_bytes(), "m.msh", Unit::M).unwrap().body.flat().unwrap();
        rests_in_every_form(&read.mesh)?;
        let record = serde_json::to_string(&MeshRecord::of(&Body::new("", mesh), &Model::default()).unwrap()).unwrap();
        rests_in_every_form(&json::read(&record, "body.json").unwrap().mesh)?;
        let block = fixtures::block(2, side);
        let highest = (0..block.nodes.len()).max_by(|&a, &b| block.nodes[a].z.total_cmp(&block.nodes[b].z)).unwrap();
        let space: Vec<_> = bends.iter().enumerate().map(|(d, b)| { let [x, z, y] = way(d, *b); [x, y, z].into() }).collect();
        rests_in_every_form(&with_a_bent_muscle(block, highest, &space))?;
    }
}
