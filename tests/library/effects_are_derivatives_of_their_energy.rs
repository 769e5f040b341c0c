//! For every effect: its force is minus the derivative of its energy, its stiffness is minus the derivative of its force, its convex
//! stiffness has no negative eigenvalue, and its derivative by tensions is correct. In motion its damping is minus the derivative of its
//! viscous force, and the same holds for effects with internal states.
//!
//! The systems have every effect. The test fails if an effect with a file in crates/core/src/effect is in none of them.

use std::collections::BTreeSet;
use std::path::Path;

use crate::fixtures;
use nalgebra::{DMatrix, SVector, Vector2};
use tongue_core::effect::{SymmetryPlane, lumped_masses};
use tongue_core::sparse::BlockMatrix;
use tongue_fit::body::{Body, Mesh};
use tongue_fit::effect::{Configuration, Contact, Effect, Gravity, Tangent};
use tongue_fit::system::{Additions, Model, MusclesAs, SpaceModel, System};

fn stiffness<const D: usize>(
    system: &System<D>,
    effect: &dyn Effect<D>,
    at: Configuration<'_, D>,
    tangent: Tangent,
) -> DMatrix<f64> {
    let mut k = BlockMatrix::zeros(system.pattern());
    effect.add_stiffness(at, tangent, &mut k);
    fixtures::dense(system.pattern(), &k)
}

fn force<const D: usize>(effect: &dyn Effect<D>, at: Configuration<'_, D>) -> Vec<SVector<f64, D>> {
    let mut f = vec![SVector::zeros(); at.positions.len()];
    effect.add_force(at, &mut f);
    f
}

/// External effects, whose forces need not cancel.
const FROM_OUTSIDE: [&str; 3] = ["gravity", "contact", "mirror"];

/// Weight, a symmetry plane that holds three free nodes, and a bent wall close above the highest nodes.
fn additions<const D: usize>(mesh: &Mesh<D>, side: f64) -> Additions<D> {
    let [width, height] = [0, 1].map(|d| mesh.nodes.iter().map(|p| p[d]).fold(0.0, f64::max));
    let wall = [[-1.0, 2.0], [0.4 * width / side, 1.2], [0.6 * width / side, 1.3], [width / side + 1.0, 2.0]];
    let wall = wall.map(|[x, up]| Vector2::new(side * x, height + 0.25 * side * up)).to_vec();
    let masses = lumped_masses(mesh, 1e3);
    let is_free = |n: &usize| mesh.fixed.binary_search(n).is_err();
    let inside = mesh.in_tissue();
    let free: Vec<usize> = (0..mesh.nodes.len()).filter(|n| inside[*n]).filter(is_free).collect();
    Additions {
        effects: vec![
            Box::new(Gravity::new(&masses, SVector::repeat(9.81), &mesh.nodes)),
            Box::new(SymmetryPlane::new(D - 1, 1e3, &free[..3], &mesh.nodes)),
            Box::new(Contact::new(wall, &mesh.surface_nodes(), 2.67e3, 0.5 * side)),
        ],
        ..Additions::default()
    }
}

fn check_all<const D: usize>(mesh: &Mesh<D>, side: f64) -> Vec<&'static str> {
    let model = Model::default();
    let system = System::with_additions(mesh, &model, &[0], additions(mesh, side)).unwrap();
    // Nodes of quadratic elements are half as far apart.
    let far = if mesh.continuum.is_some() { 0.03 } else { 0.08 };
    check_system(&system, &fixtures::shaken(mesh, far * side), side, &[7.5], 1.0)
}

type Forces<'a, const D: usize> = &'a dyn Fn(&[SVector<f64, D>]) -> Vec<SVector<f64, D>>;

/// Differences between a force and minus the derivative of the energy, N, and between a stiffness and minus the derivative of the force,
/// N/m.
fn errors<const D: usize>(
    nodes: &[usize],
    x: &[SVector<f64, D>],
    step: f64,
    energy: &dyn Fn(&[SVector<f64, D>]) -> f64,
    force: Forces<'_, D>,
    stiffness: &DMatrix<f64>,
) -> [f64; 2] {
    let coordinates: Vec<(usize, usize)> =
        nodes.iter().flat_map(|&node| (0..D).map(move |d| (node, d))).collect();
    let (here, mut errors) = (force(x), [0.0_f64; 2]);
    let mut differs = |which: usize, by: f64| {
        errors[which] = errors[which].max(if by.is_nan() { f64::INFINITY } else { by.abs() });
    };
    for (column, &(node, d)) in coordinates.iter().enumerate() {
        let [up, down] = [step, -step].map(|by| {
            let mut x = x.to_vec();
            x[node][d] += by;
            x
        });
        differs(0, (energy(&up) - energy(&down)) / (2.0 * step) + here[node][d]);
        let (up, down) = (force(&up), force(&down));
        for (row, &(other, e)) in coordinates.iter().enumerate() {
            differs(1, (up[other][e] - down[other][e]) / (2.0 * step) + stiffness[(row, column)]);
        }
    }
    errors
}

/// Checks every effect of a system at positions and tensions, and with the tension of the first muscle larger by `more`.
fn check_system<const D: usize>(
    system: &System<D>,
    x: &[SVector<f64, D>],
    side: f64,
    tensions: &[f64],
    more: f64,
) -> Vec<&'static str> {
    let at = Configuration { positions: x, tensions };
    let step = 1e-6 * side;
    for effect in system.effects() {
        let effect = effect.as_ref();
        let here = force(effect, at);
        let exact = stiffness(system, effect, at, Tangent::Exact);
        let scale = exact.amax().max(1.0);
        let energy = |x: &[SVector<f64, D>]| effect.energy(Configuration { positions: x, tensions });
        let forces = |x: &[SVector<f64, D>]| force(effect, Configuration { positions: x, tensions });
        let [of_force, of_stiffness] = errors(system.pattern().nodes(), x, step, &energy, &forces, &exact);
        assert!(of_force < 1e-5, "{} in {D}D: force off by {of_force:e} N", effect.name());
        assert!(of_stiffness < 1e-6 * scale, "{} in {D}D: stiffness off by {of_stiffness:e}", effect.name());
        let convex = stiffness(system, effect, at, Tangent::Convex).symmetric_eigenvalues();
        assert!(convex.min() > -1e-9 * scale, "{}: convex stiffness is not", effect.name());

        let mut per_tension = vec![SVector::zeros(); x.len()];
        effect.add_force_per_tension(at, 0, &mut per_tension);
        let mut larger = tensions.to_vec();
        larger[0] += more;
        let larger = force(effect, Configuration { positions: x, tensions: &larger });
        for ((larger, here), derivative) in larger.iter().zip(&here).zip(&per_tension) {
            let off = (larger - here - derivative * more).norm();
            assert!(off < 1e-12, "{}: tension derivative", effect.name());
        }
        check_damping(system, effect, at, scale);
        check_internal(system, effect, at, step);
        let total: SVector<f64, D> = here.iter().sum();
        let outside = FROM_OUTSIDE.contains(&effect.name());
        assert_eq!(outside, total.norm() > 1e-3, "{}: acts on nothing here", effect.name());
        assert!(outside || total.norm() < 1e-9, "{}: inner forces do not cancel", effect.name());
    }
    system.effects().iter().map(|e| e.name()).collect()
}

/// Damping is minus the derivative of the viscous force, never adds energy, and does not resist a translation.
fn check_damping<const D: usize>(system: &System<D>, of: &dyn Effect<D>, at: Configuration<'_, D>, k: f64) {
    let viscous = |v: &[SVector<f64, D>]| {
        let mut f = vec![SVector::zeros(); v.len()];
        of.add_viscous_force(at, v, &mut f);
        f
    };
    let weight = 0.5;
    let mut c = BlockMatrix::zeros(system.pattern());
    of.add_damping(at, weight, &mut c);
    let damping = fixtures::dense(system.pattern(), &c) / weight;
    let still = vec![SVector::zeros(); at.positions.len()];
    let [_, error] = errors(system.pattern().nodes(), &still, 1.0, &|_| 0.0, &viscous, &damping);
    assert!(error < 1e-12 * k, "{}: damping off by {error:e}", of.name());
    assert!(damping.symmetric_eigenvalues().min() > -1e-9 * k, "{}: feeds energy", of.name());
    let together = viscous(&vec![SVector::repeat(0.3); at.positions.len()]);
    assert!(together.iter().all(|f| f.norm() < 1e-9), "{}: resists moving as a whole", of.name());
}

/// The force with internal states is minus the derivative of its energy. In settled states its stiffness is minus the derivative of that
/// force, and the states solve their equation.
fn check_internal<const D: usize>(system: &System<D>, of: &dyn Effect<D>, at: Configuration<'_, D>, h: f64) {
    let Some(internal) = of.internal() else { return };
    assert!(internal.count() > 0);
    let known: Vec<f64> = (0..internal.count()).map(|i| 1e-4 * (i as f64).sin()).collect();
    for time_step in [0.0, 0.01, 2.0] {
        let settled = |at: Configuration<'_, D>| {
            let mut s = known.clone();
            internal.update_internal_state(at, time_step, &mut s);
            s
        };
        let states = settled(at);
        let mut rates = vec![0.0; states.len()];
        internal.rates(at, &states, &mut rates);
        for ((s, k), r) in states.iter().zip(&known).zip(&rates) {
            let off = (s - k - time_step * r).abs();
            assert!(off < 1e-15 + 1e-12 * s.abs(), "{}: not settled", of.name());
        }
        let force = |x: &[SVector<f64, D>]| {
            let mut f = vec![SVector::zeros(); x.len()];
            let at = Configuration { positions: x, ..at };
            internal.add_force(at, &settled(at), &mut f);
            f
        };
        let energy = |x: &[SVector<f64, D>]| internal.energy(x, &states);
        let mut k = BlockMatrix::zeros(system.pattern());
        internal.add_stiffness(at, time_step, &states, Tangent::Exact, &mut k);
        let k = fixtures::dense(system.pattern(), &k);
        let [of_force, of_stiffness] = errors(system.pattern().nodes(), at.positions, h, &energy, &force, &k);
        assert!(of_force < 1e-5, "{}: force of states", of.name());
        assert!(of_stiffness < 1e-6 * k.amax().max(1.0), "{}: {of_stiffness:e}", of.name());
    }
}

/// Names of the effects in files that implement `Effect` for any dimension, or in space only.
fn all_effects(of: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/core/src/effect");
    let mut names = BTreeSet::new();
    for file in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
        for effect in text.split(&format!("Effect<{of}> for ")).skip(1) {
            let name = effect.split("fn name(&self)").nth(1).and_then(|rest| rest.split("\n    }").next());
            let words = name.expect("an effect has a name").split('"').skip(1).step_by(2);
            names.extend(words.map(str::to_owned));
        }
    }
    names
}

#[test]
fn all_effects_in_the_plane_and_in_space() {
    fn names<const D: usize>(springs: &Mesh<D>, continuum: Mesh<D>) -> BTreeSet<String> {
        let springs = check_all(springs, 5.5e-3);
        let continuum = fixtures::held_at_a_corner(continuum, 5.5e-3);
        let continuum = check_all(&continuum, 5.5e-3);
        springs.into_iter().chain(continuum).map(str::to_owned).collect()
    }
    let flat = names(&fixtures::lattice(4, 4, 5.5e-3), fixtures::lattice(3, 3, 5.5e-3));
    let solid = names(&fixtures::block(2, 5.5e-3), fixtures::block(1, 5.5e-3));
    assert_eq!(flat, all_effects("D"), "add the effect that is not checked to `additions`");
    assert_eq!(solid, flat);
}

#[test]
fn hexahedra_and_their_muscles() {
    let (side, mut seen) = (5.5e-3, BTreeSet::new());
    let body = fixtures::space_block::space_block(side);
    let body = Body { factors: vec![1.0, 10.0, 0.5, 1.0], ..body };
    for muscles in [MusclesAs::Lines, MusclesAs::Stress] {
        for (stiffening, far) in [(0.0, 0.12), (9.0, 0.12), (9.0, 0.25)] {
            let model = SpaceModel { muscles, stiffening, ..SpaceModel::default() };
            let system = System::in_space(&body, &model).unwrap();
            let x = fixtures::shaken(&body.mesh, far * side);
            seen.extend(check_system(&system, &x, side, &[0.3, 0.2, 0.1], 0.2));
        }
    }
    let only_in_space = all_effects("3");
    assert!(!only_in_space.is_empty());
    let missing: Vec<_> = only_in_space.iter().filter(|name| !seen.contains(name.as_str())).collect();
    assert!(missing.is_empty(), "effects of space that are not checked: {missing:?}");
}

#[test]
fn moving_the_whole_body_costs_no_energy_and_neither_does_turning_it() {
    let lattice = fixtures::lattice(4, 4, 5.5e-3);
    let continuum = fixtures::held_at_a_corner(lattice.clone(), 5.5e-3);
    is_free_to_move(&lattice);
    is_free_to_move(&continuum);
}

fn is_free_to_move(mesh: &Mesh<2>) {
    let x = fixtures::shaken(mesh, 5e-4);
    let turn = nalgebra::Rotation2::new(0.7);
    let turned: Vec<_> = x.iter().map(|p| turn * p + SVector::from([0.02, -0.01])).collect();
    let tensions = [7.5];
    let system = System::new(mesh, &Model::default(), &[0]).unwrap();
    for effect in system.effects() {
        let before = effect.energy(Configuration { positions: &x, tensions: &tensions });
        let after = effect.energy(Configuration { positions: &turned, tensions: &tensions });
        assert!((before - after).abs() < 1e-14, "{}: {before} {after}", effect.name());
    }
}

#[test]
fn crushed_elements_where_the_barrier_acts() {
    fn check<const D: usize>(mesh: Mesh<D>) {
        let side = 5.5e-3;
        let mesh = fixtures::held_at_a_corner(mesh, side);
        let system = System::new(&mesh, &Model::default(), &[0]).unwrap();
        let guarded = |x: &[SVector<f64, D>]| -> usize {
            let at = Configuration { positions: x, tensions: &[7.5] };
            system.effects().iter().filter(|e| e.name() == "barrier").map(|e| e.barrier_active(at)).sum()
        };
        let mut x = fixtures::shaken(&mesh, 0.002 * side);
        assert_eq!(guarded(&x), 0);
        x.iter_mut().for_each(|p| p[0] *= 0.065);
        let elements = mesh.continuum.as_ref().unwrap().elements().len();
        assert_eq!(guarded(&x), elements);
        check_system(&system, &x, side, &[7.5], 1.0);
    }
    check(fixtures::lattice(2, 2, 5.5e-3));
    check(fixtures::block(1, 5.5e-3));
}
