//! The linear finite elements: `K_CST` at small strain, exact for homogeneous deformation, and never
//! inverted.

use crate::fixtures;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector};
use tongue_core::geometry::simplex;
use tongue_core::sparse::{BlockMatrix, Pattern};
use tongue_core::system::locking::bending_kept;
use tongue_fit::body::{Cells, Mesh};
use tongue_fit::dynamics::{self, Control, IntegrationMethod, Motion, Tensions};
use tongue_fit::effect::{Configuration, Effect, FiniteElements, Tangent};
use tongue_fit::material::Constants;
use tongue_fit::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{Model, System, TissueModel};

const FE: Model = Model { constants: Constants::TONGUE, tissue: TissueModel::FiniteElement };

/// `B^T C B` S with the strain-displacement matrix and the plane-strain elasticity matrix of thesis
/// 3.38-3.42.
fn k_cst(x: [[f64; 2]; 3]) -> SMatrix<f64, 6, 6> {
    let (e, nu) = (6.9e3, 0.49);
    let c = Matrix3::new(1.0 - nu, nu, 0.0, nu, 1.0 - nu, 0.0, 0.0, 0.0, 0.5 - nu)
        * (e / (1.0 + nu) / (1.0 - 2.0 * nu));
    let [[x1, y1], [x2, y2], [x3, y3]] = x;
    let twice = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1);
    #[rustfmt::skip]
    let b = SMatrix::<f64, 3, 6>::from_row_slice(&[
        y2 - y3, 0.0, y3 - y1, 0.0, y1 - y2, 0.0,
        0.0, x3 - x2, 0.0, x1 - x3, 0.0, x2 - x1,
        x3 - x2, y2 - y3, x1 - x3, y3 - y1, x2 - x1, y1 - y2,
    ]) / twice;
    b.transpose() * c * b * (0.5 * twice)
}

#[test]
fn the_stiffness_at_rest_is_that_of_the_constant_strain_triangle() {
    let corners = [[0.0, 0.0], [6.1e-3, 0.4e-3], [1.9e-3, 4.7e-3]];
    let x: Vec<SVector<f64, 2>> = corners.map(SVector::from).to_vec();
    let mut cells = Cells::new();
    cells.push(&[0, 1, 2]);
    let mut element = FiniteElements::new((&Constants::TONGUE).into(), 0.0, &cells, &x);
    let pattern = Pattern::new(3, &[true; 3], [vec![0, 1, 2]]);
    Effect::<2>::bind(&mut element, &pattern);
    let expected = k_cst(corners);
    for tangent in [Tangent::Exact, Tangent::Convex] {
        let mut k = BlockMatrix::<2>::zeros(&pattern);
        element.add_stiffness(Configuration { positions: &x, tensions: &[] }, tangent, &mut k);
        let k = fixtures::dense(&pattern, &k);
        let place = |i: usize| 2 * pattern.unknown(i / 2).unwrap() + i % 2;
        for i in 0..6 {
            for j in 0..6 {
                let (ours, theirs) = (k[(place(i), place(j))], expected[(i, j)]);
                assert!((ours - theirs).abs() < 1e-11 * expected.amax(), "{tangent:?} {ours} {theirs}");
            }
        }
    }
}

/// Velocities `G x`: the viscous forces do the work of Newtonian stress, `-2 η d:d V`, which is zero if `G`
/// is a rotation.
fn flow<const D: usize>(mesh: &Mesh<D>, side: f64, gradient: SMatrix<f64, D, D>) {
    let system = System::new(mesh, &FE, &[]).unwrap();
    let elements = system.effects().iter().find(|e| e.name() == "finite elements").unwrap();
    let x = fixtures::shaken(mesh, 0.08 * side);
    let at = Configuration { positions: &x, tensions: &[0.0] };
    let forces = |gradient: SMatrix<f64, D, D>| {
        let velocities: Vec<_> = x.iter().map(|x| gradient * x).collect();
        let mut force = vec![SVector::zeros(); x.len()];
        elements.add_viscous_force(at, &velocities, &mut force);
        let power: f64 = force.iter().zip(&velocities).map(|(f, v)| f.dot(v)).sum();
        (power, force.iter().map(SVector::norm).fold(0.0, f64::max))
    };
    let volume: f64 = mesh.cells.iter().map(|c| simplex::measure(&simplex::corners(&x, c))).sum();
    let rate = 0.5 * (gradient + gradient.transpose());
    let expected = -2.0 * Constants::TONGUE.viscosity * rate.norm_squared() * volume;
    let (power, largest) = forces(gradient);
    assert!((power / expected - 1.0).abs() < 1e-12, "{D}D: {power} W, not {expected}");
    let (_, turning) = forces(gradient - rate);
    assert!(turning < 1e-12 * largest, "{D}D: a turning body is held by {turning:e} N");
}

#[test]
fn a_flowing_element_resists_as_a_newtonian_fluid() {
    flow(&fixtures::lattice(4, 4, 5.5e-3), 5.5e-3, Matrix2::new(0.3, 1.1, -0.4, 0.2));
    let gradient = Matrix3::new(0.3, 1.1, 0.0, -0.4, 0.2, 0.7, 0.1, 0.5, -0.6);
    flow(&fixtures::block(2, 5.5e-3), 5.5e-3, gradient);
}

/// A triangle on two bones whose tip is released from simple shear: neo-Hookean tissue with this viscosity
/// returns along the same line as `exp(-t μ/η)` for any shear; a small mass has no effect.
#[test]
fn shear_relaxes_with_viscosity_over_shear_modulus() {
    let mut cells = Cells::new();
    cells.push(&[0, 1, 2]);
    let nodes = [[0.0, 0.0], [5e-3, 0.0], [2e-3, 4e-3]].map(SVector::from).to_vec();
    let connections = vec![[0, 1], [0, 2], [1, 2]];
    let mesh = Mesh {
        nodes,
        cells,
        connections,
        muscles: Vec::new(),
        fixed: vec![0, 1],
        continuum: None,
        hexahedra: Vec::new(),
    };
    let system = System::new(&mesh, &FE, &[]).unwrap();
    let motion = Motion::with_mass(&system, Tensions::Constant(Vec::new()), 1e-6).unwrap();
    let (_, mu) = Constants::TONGUE.lame();
    let time = Constants::TONGUE.viscosity / mu;
    for shear in [0.01, 0.7] {
        let mut state = motion.at_rest();
        state.positions[2].x += shear * 4e-3;
        let mut integrator = IntegrationMethod::TrBdf2.checked(&motion, Control::Adaptive(1e-12)).unwrap();
        let outcome = dynamics::run(&motion, integrator.as_mut(), &mut state, 1.5 * time, &[], &mut ());
        assert_eq!(outcome.status, dynamics::MotionStatus::Completed);
        let left = (state.positions[2] - mesh.nodes[2]) / (shear * 4e-3);
        assert!((left.x / (-1.5f64).exp() - 1.0).abs() < 1e-4, "{left}");
        assert!(left.y.abs() < 1e-6, "{left}");
    }
}

/// Moves every node of the edge of a distorted mesh by a homogeneous deformation; the inner nodes must follow
/// it.
fn patch<const D: usize>(mut mesh: Mesh<D>, side: f64, deformation: SMatrix<f64, D, D>) {
    mesh.fixed.clear();
    let shape = fixtures::shaken(&mesh, 0.1 * side);
    mesh.nodes = shape;
    let inner = fixtures::inner_nodes(&mesh);
    assert!(!inner.is_empty());
    let system_of = |held: Vec<usize>, nodes: Vec<SVector<f64, D>>| {
        System::new(&Mesh { fixed: held, nodes, ..mesh.clone() }, &FE, &[]).unwrap()
    };
    let held: Vec<usize> = (0..mesh.nodes.len()).filter(|n| !inner.contains(n)).collect();
    let system = system_of(held.clone(), mesh.nodes.clone());
    let moved: Vec<_> = mesh.nodes.iter().map(|p| deformation * p).collect();
    // Inner nodes start away from the solution.
    let mut start = moved.clone();
    for (i, &n) in inner.iter().enumerate() {
        start[n][i % D] += 0.15 * side;
    }
    let mut workspace = Workspace::new(&system);
    workspace.start_from(&start);
    let solution =
        statics::solve(&system, &mut workspace, &vec![0.0; mesh.muscles.len()], &SolveSettings::default());
    assert_eq!(solution.status, SolveStatus::Converged);
    for (found, expected) in workspace.positions().iter().zip(&moved) {
        assert!((found - expected).norm() < 1e-10, "{D}D: off by {:e} m", (found - expected).norm());
    }
}

#[test]
fn a_homogeneous_deformation_of_an_irregular_patch_is_reproduced() {
    patch(fixtures::lattice(5, 5, 5.5e-3), 5.5e-3, Matrix2::new(1.2, 0.15, -0.05, 0.85));
    patch(fixtures::block(2, 5.5e-3), 5.5e-3, Matrix3::new(1.15, 0.1, 0.0, -0.05, 0.9, 0.1, 0.05, 0.0, 0.95));
}

#[test]
fn an_inverted_element_has_infinite_energy_and_steps_stop_before_it() {
    let mesh = fixtures::lattice(2, 2, 1.0e-3);
    let elements = FiniteElements::new((&Constants::TONGUE).into(), 0.0, &mesh.cells, &mesh.nodes);
    let energy = |x: &[SVector<f64, 2>]| elements.energy(Configuration { positions: x, tensions: &[] });
    assert!(energy(&mesh.nodes).abs() < 1e-18);
    let mut mirrored = mesh.nodes.clone();
    mirrored.iter_mut().for_each(|p| p.y = -p.y);
    assert_eq!(energy(&mirrored), f64::INFINITY);
    let flat: Vec<_> = mesh.nodes.iter().map(|p| SVector::from([p.x, 0.0])).collect();
    assert_eq!(energy(&flat), f64::INFINITY);
    let step: Vec<_> = mesh.nodes.iter().map(|p| SVector::from([0.0, -2.0 * p.y])).collect();
    let limit = elements.step_limit(Configuration { positions: &mesh.nodes, tensions: &[] }, &step);
    assert!(limit > 0.0 && limit <= 0.45, "{limit}");
    let there: Vec<_> = mesh.nodes.iter().zip(&step).map(|(x, p)| x + p * limit).collect();
    assert!(energy(&there).is_finite());
}

#[test]
fn a_muscle_in_finite_elements_pulls_with_its_tension_alone() {
    let mesh = fixtures::lattice(5, 5, 5.5e-3);
    let system = System::new(&mesh, &FE, &[0]).unwrap();
    let stretched: Vec<_> = mesh.nodes.iter().map(|p| p * 1.1).collect();
    let muscle = system.effects().iter().find(|e| e.name() == "muscle").unwrap();
    let slack = muscle.energy(Configuration { positions: &stretched, tensions: &[0.0] });
    assert_eq!(slack, 0.0);
    let pulled = muscle.energy(Configuration { positions: &stretched, tensions: &[2.0] });
    assert!((pulled - 2.0 * 0.1 * 4.0 * 5.5e-3).abs() < 1e-15);
}

/// The stresses of any shape balance the forces on its nodes (Clausius's virial): `sum f xᵀ = - sum V σ`.
fn stresses_balance_forces<const D: usize>(mesh: &Mesh<D>, side: f64) {
    let system = System::new(mesh, &FE, &[]).unwrap();
    let x = fixtures::shaken(mesh, 0.1 * side);
    let continuum = system.effects().iter().find(|e| e.name() == "finite elements").unwrap();
    let mut force = vec![SVector::<f64, D>::zeros(); x.len()];
    continuum.add_force(Configuration { positions: &x, tensions: &[] }, &mut force);
    let of_forces: SMatrix<f64, D, D> = force.iter().zip(&x).map(|(f, x)| f * x.transpose()).sum();
    let stresses = system.stresses(&x);
    assert_eq!(stresses.len(), mesh.cells.len());
    let of_stresses: SMatrix<f64, D, D> = mesh
        .cells
        .iter()
        .zip(&stresses)
        .map(|(cell, s)| s.cauchy_pa * simplex::measure(&simplex::corners(&x, cell)))
        .sum();
    assert!((of_forces + of_stresses).norm() < 1e-12 * of_stresses.norm(), "{of_forces} {of_stresses}");
}

#[test]
fn stresses_balance_the_forces_on_the_nodes() {
    stresses_balance_forces(&fixtures::lattice(4, 4, 5.5e-3), 5.5e-3);
    stresses_balance_forces(&fixtures::block(2, 5.5e-3), 5.5e-3);
}

/// A patch under uniaxial strain has one strain and one stress, that of the law, in all of its cells.
#[test]
fn a_patch_under_homogeneous_strain_has_one_stress() {
    let mesh = fixtures::block(2, 5.5e-3);
    let system = System::new(&mesh, &FE, &[0]).unwrap();
    let stretch = 1.05;
    let moved: Vec<_> = mesh.nodes.iter().map(|p| SVector::from([stretch * p.x, p.y, p.z])).collect();
    let (lambda, mu) = Constants::TONGUE.lame();
    let [along, across] =
        [stretch * stretch, 1.0].map(|square| (mu * (square - 1.0) + lambda * stretch.ln()) / stretch);
    for stress in system.stresses(&moved) {
        assert!((stress.along(&SVector::x()) / along - 1.0).abs() < 1e-9);
        assert!((stress.along(&SVector::z()) / across - 1.0).abs() < 1e-9);
        assert!((stress.von_mises_pa / (along - across) - 1.0).abs() < 1e-9);
        assert!((stress.strain[(0, 0)] - 0.5 * (stretch * stretch - 1.0)).abs() < 1e-12);
    }
    let fibres = mesh.fibres(&moved);
    let with = fibres.iter().flatten().count();
    assert!(with > 0 && fibres.iter().flatten().all(|n| (n - SVector::x()).norm() < 1e-12));
    assert!(with < mesh.cells.len() && system.stresses(&moved).len() == fibres.len());
    let springs = System::new(&mesh, &Model::default(), &[0]).unwrap();
    assert!(springs.stresses(&moved).is_empty());
}

#[test]
fn linear_elements_keep_less_the_nearer_they_are_to_keeping_their_volume() {
    let kept = |tissue, poisson_ratio| {
        let constants = Constants { poisson_ratio, ..Constants::TONGUE };
        bending_kept(&Model { constants, tissue }, 1e-2).unwrap()
    };
    assert_eq!(kept(TissueModel::FiniteElement, 0.45), None);
    assert_eq!(kept(TissueModel::Hexahedra, 0.49), None);
    let found = [0.46, 0.49, 0.499, 0.4999].map(|nu| kept(TissueModel::FiniteElement, nu).unwrap());
    assert!(found.is_sorted_by(|a, b| a > b), "{found:?}");
    // Six tetrahedra have constant strains, of which most change their volume: beyond 0.49 the part
    // that is kept is proportional to the distance from 0.5.
    let [_, _, near, nearer] = found;
    assert!((near / nearer - 10.0).abs() < 0.5, "{found:?}");
    assert!(found[1] < 0.3, "{found:?}");
    assert!(kept(TissueModel::MassSpring, 0.49).is_some_and(|k| k > 0.0));
}
