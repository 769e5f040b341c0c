//! Every effect that a system can simulate: its force is minus the derivative of its energy, its stiffness minus the
//! derivative of its force, its convex stiffness has no negative eigenvalue, and its tension derivative is what it says.
//!
//! The list of effects is taken from a system with everything switched on, so a new effect is covered by being used.

mod common;

use nalgebra::{DMatrix, SVector};
use tongue_fit::effect::{Configuration, Effect, Tangent};
use tongue_fit::mesh::Mesh;
use tongue_fit::sparse::BlockMatrix;
use tongue_fit::system::{Model, System, TissueModel};

fn dense<const D: usize>(system: &System<D>, k: &BlockMatrix<D>) -> DMatrix<f64> {
    let n = system.pattern().unknowns();
    let mut out = DMatrix::zeros(n * D, n * D);
    let mut column = vec![SVector::zeros(); n];
    for j in 0..n * D {
        let mut unit = vec![SVector::<f64, D>::zeros(); n];
        unit[j / D][j % D] = 1.0;
        k.multiply(system.pattern(), &unit, &mut column);
        for i in 0..n * D {
            out[(i, j)] = column[i / D][i % D];
        }
    }
    out
}

fn stiffness<const D: usize>(
    system: &System<D>,
    effect: &dyn Effect<D>,
    at: Configuration<'_, D>,
    tangent: Tangent,
) -> DMatrix<f64> {
    let mut k = BlockMatrix::zeros(system.pattern());
    effect.add_stiffness(at, tangent, &mut k);
    dense(system, &k)
}

fn force<const D: usize>(effect: &dyn Effect<D>, at: Configuration<'_, D>) -> Vec<SVector<f64, D>> {
    let mut f = vec![SVector::zeros(); at.positions.len()];
    effect.add_force(at, &mut f);
    f
}

fn check_all<const D: usize>(mesh: &Mesh<D>, side: f64, tissue: TissueModel) -> Vec<&'static str> {
    let system = System::new(mesh, &Model { tissue, ..Model::default() }, &[0]).unwrap();
    let tensions = [7.5];
    let x = common::shaken(mesh, 0.08 * side);
    let at = Configuration { positions: &x, tensions: &tensions };
    let step = 1e-6 * side;
    let nodes = system.pattern().nodes().to_vec();
    for effect in system.effects() {
        let effect = effect.as_ref();
        let here = force(effect, at);
        let exact = stiffness(&system, effect, at, Tangent::Exact);
        let scale = exact.amax().max(1.0);
        for (u, &node) in nodes.iter().enumerate() {
            for d in 0..D {
                let (mut up, mut down) = (x.clone(), x.clone());
                up[node][d] += step;
                down[node][d] -= step;
                let up = Configuration { positions: &up, tensions: &tensions };
                let down = Configuration { positions: &down, tensions: &tensions };
                let slope = (effect.energy(up) - effect.energy(down)) / (2.0 * step);
                let error = (slope + here[node][d]).abs();
                assert!(error < 1e-5, "{} in {D}D: force off by {error:e} N", effect.name());
                let (fu, fd) = (force(effect, up), force(effect, down));
                for (v, &other) in nodes.iter().enumerate() {
                    for e in 0..D {
                        let change = -(fu[other][e] - fd[other][e]) / (2.0 * step);
                        let error = (change - exact[(v * D + e, u * D + d)]).abs() / scale;
                        assert!(error < 1e-6, "{} in {D}D: stiffness off by {error:e}", effect.name());
                    }
                }
            }
        }
        let convex = stiffness(&system, effect, at, Tangent::Convex).symmetric_eigenvalues();
        assert!(convex.min() > -1e-9 * scale, "{}: convex stiffness is not", effect.name());

        let mut per_tension = vec![SVector::zeros(); x.len()];
        effect.add_force_per_tension(at, 0, &mut per_tension);
        let more = force(effect, Configuration { positions: &x, tensions: &[8.5] });
        for ((more, here), derivative) in more.iter().zip(&here).zip(&per_tension) {
            assert!((more - here - derivative).norm() < 1e-12, "{}: tension derivative", effect.name());
        }
        let total: SVector<f64, D> = here.iter().sum();
        assert!(total.norm() < 1e-9, "{}: inner forces do not cancel", effect.name());
    }
    system.effects().iter().map(|e| e.name()).collect()
}

#[test]
fn in_the_plane_and_in_space() {
    let kinds = [
        (TissueModel::MassSpring, ["tissue", "muscle", "incompressibility", "bone"]),
        (TissueModel::FiniteElement, ["tissue", "muscle", "finite elements", "bone"]),
    ];
    for (tissue, all) in kinds {
        assert_eq!(check_all(&common::lattice(4, 4, 5.5e-3), 5.5e-3, tissue), all);
        assert_eq!(check_all(&common::block(2, 5.5e-3), 5.5e-3, tissue), all);
    }
}

#[test]
fn moving_the_whole_body_costs_no_energy_and_neither_does_turning_it() {
    let mesh = common::lattice(4, 4, 5.5e-3);
    let x = common::shaken(&mesh, 5e-4);
    let turn = nalgebra::Rotation2::new(0.7);
    let turned: Vec<_> = x.iter().map(|p| turn * p + SVector::from([0.02, -0.01])).collect();
    let tensions = [7.5];
    for tissue in [TissueModel::MassSpring, TissueModel::FiniteElement] {
        let system = System::new(&mesh, &Model { tissue, ..Model::default() }, &[0]).unwrap();
        for effect in system.effects() {
            let before = effect.energy(Configuration { positions: &x, tensions: &tensions });
            let after = effect.energy(Configuration { positions: &turned, tensions: &tensions });
            assert!((before - after).abs() < 1e-14, "{}: {before} {after}", effect.name());
        }
    }
}
