//! Gravity, contact and prescribed displacements of bones against exact solutions.

use std::collections::BTreeSet;

use crate::fixtures;
use nalgebra::{SVector, Vector2};
use tongue_core::effect::lumped_masses;
use tongue_fit::body::Mesh;
use tongue_fit::effect::{Configuration, Contact, Effect, Gravity};
use tongue_fit::statics::{FromRest, SolveSettings, Workspace, trace};
use tongue_fit::system::{self, Additions, Model, PrescribedDisplacement, System};

/// The equilibrium without tensions.
fn solved<const D: usize>(system: &System<D>) -> Workspace<D> {
    fixtures::solved(system, &vec![0.0; system.muscle_count()])
}

fn pushed<const D: usize>(effects: Vec<Box<dyn Effect<D>>>) -> Additions<D> {
    Additions { effects, ..Additions::default() }
}

/// A hanging row of springs, each of which carries the weight below it.
#[test]
fn a_hanging_chain_stretches_by_the_weight_below_each_link() {
    let (links, side, mass, g) = (6, 0.01, 0.4, 9.81);
    let chain = Mesh::<2> {
        nodes: (0..=links).map(|i| SVector::from([0.0, -side * f64::from(i)])).collect(),
        connections: (0..links as usize).map(|i| [i, i + 1]).collect(),
        fixed: vec![0],
        ..Mesh::default()
    };
    let model = Model::default();
    let k = system::coefficients(&chain, &model).unwrap().tissue_stiffness;
    let masses: Vec<_> = (1..=links as usize).map(|n| (n, mass)).collect();
    let gravity = Gravity::new(&masses, SVector::from([0.0, -g]), &chain.nodes);
    let system = System::with_additions(&chain, &model, &[], pushed(vec![Box::new(gravity)])).unwrap();
    let workspace = solved(&system);
    let mut y = 0.0;
    for i in 1..=links {
        y -= side + f64::from(links - i + 1) * mass * g / k;
        let p = workspace.positions()[i as usize];
        assert!((p.y - y).abs() < 1e-12 && p.x.abs() < 1e-12, "link {i}: {p} {y}");
    }
}

#[test]
fn a_trace_that_finds_no_equilibrium_without_tensions_does_not_know_how_loads_lead_to_its_shape() {
    let mesh = fixtures::lattice(5, 4, 5.5e-3);
    let gravity = Gravity::new(&lumped_masses(&mesh, 1e3), Vector2::new(0.0, -9.81), &mesh.nodes);
    let system =
        System::with_additions(&mesh, &Model::default(), &[], pushed(vec![Box::new(gravity)])).unwrap();
    let none = SolveSettings { max_iterations: 0, load_steps: 0, ..SolveSettings::default() };
    let tensions = vec![0.0; system.muscle_count()];
    let found = trace(&system, &mut Workspace::new(&system), &tensions, &none);
    assert_eq!(found.from_rest, FromRest::NotKnown { reached: 0.0 });
}

#[test]
fn the_bone_carries_the_whole_weight_in_the_plane_and_in_space() {
    fn check<const D: usize>(mesh: &Mesh<D>, measure: f64) {
        let mut down = SVector::<f64, D>::zeros();
        down[1] = -9.81;
        let gravity = Gravity::new(&lumped_masses(mesh, 1e3), down, &mesh.nodes);
        let system =
            System::with_additions(mesh, &Model::default(), &[], pushed(vec![Box::new(gravity)])).unwrap();
        let workspace = solved(&system);
        let on_bone: SVector<f64, D> = mesh.fixed.iter().map(|&n| workspace.force()[n]).sum();
        assert!((on_bone - down * (1e3 * measure)).norm() < 1e-8, "{on_bone}");
    }
    let side: f64 = 5.5e-3;
    check(&fixtures::lattice(5, 4, side), 24.0 * 0.75f64.sqrt() / 2.0 * side * side);
    check(&fixtures::block(3, side), (3.0 * side).powi(3));
}

/// A block on a bone is pressed against a bent wall above it, softly and hard.
#[test]
fn a_pressed_block_balances_wall_and_bone_and_no_node_passes() {
    let side = 5.5e-3;
    let block = fixtures::lattice(7, 5, side);
    let top = block.nodes.iter().map(|p| p.y).fold(0.0, f64::max);
    let wall: Vec<Vector2<f64>> = [[-0.05, 3e-3], [0.01, 1.5e-3], [0.03, 2.5e-3], [0.09, 2.0e-3]]
        .map(|[x, up]| Vector2::new(x, top + up))
        .to_vec();
    for push in [300.0, 1000.0, 5000.0] {
        let up = SVector::from([0.0, push]);
        let masses = lumped_masses(&block, 1e3);
        let gravity = Gravity::new(&masses, up, &block.nodes);
        let contact = Contact::new(wall.clone(), &block.surface_nodes(), 2.67e3, 1e-3);
        let effects: Vec<Box<dyn Effect<2>>> = vec![Box::new(gravity), Box::new(contact.clone())];
        let system = System::with_additions(&block, &Model::default(), &[], pushed(effects)).unwrap();
        let workspace = solved(&system);
        let mut from_wall = vec![SVector::zeros(); block.nodes.len()];
        let at = Configuration { positions: workspace.positions(), tensions: &[0.0] };
        contact.add_force(at, &mut from_wall);
        let wall_force: SVector<f64, 2> = from_wall.iter().sum();
        let on_bone: SVector<f64, 2> = block.fixed.iter().map(|&n| workspace.force()[n]).sum();
        let weight = up * masses.iter().map(|m| m.1).sum::<f64>();
        assert!((weight + wall_force - on_bone).norm() < 1e-7, "{weight} {wall_force} {on_bone}");
        assert!(wall_force.y < -1e-3, "at {push} the wall is not touched");
        for p in workspace.positions() {
            let over = wall.windows(2).find(|w| w[0].x <= p.x && p.x <= w[1].x).unwrap();
            let height = over[0].y + (over[1].y - over[0].y) * (p.x - over[0].x) / (over[1].x - over[0].x);
            assert!(p.y < height, "at {push} {p} is through the wall");
        }
    }
}

#[test]
fn a_free_tongue_follows_its_jaw_as_a_rigid_body() {
    let mut tongue = fixtures::tongue();
    // Without hyoid, styloid process and the chains outside, the tongue is held only by the mental spine and its neighbours.
    let spine = (0..tongue.nodes.len()).find(|&n| tongue.nodes[n].norm() < 1e-6).unwrap();
    let joined = tongue.connections.iter().filter(|c| c.contains(&spine)).flatten();
    let inside = tongue.in_tissue();
    let outside = (0..inside.len()).filter(|&n| !inside[n]);
    tongue.fixed = BTreeSet::from_iter(joined.copied().chain(outside)).into_iter().collect();
    tongue.connections.retain(|[a, b]| inside[*a] && inside[*b]);
    tongue.muscles.clear();
    let joint = SVector::from([0.07, 0.085]);
    for angle in [5f64.to_radians(), -40f64.to_radians(), 120f64.to_radians()] {
        let jaw = PrescribedDisplacement::Turned { joint, angle };
        let displaced = tongue.fixed.iter().map(|&n| (n, jaw.place(tongue.nodes[n]))).collect();
        let additions = Additions { displaced, ..Additions::default() };
        let system = System::with_additions(&tongue, &Model::default(), &[], additions).unwrap();
        let workspace = solved(&system);
        for (p, rest) in workspace.positions().iter().zip(&tongue.nodes) {
            assert!((p - jaw.place(*rest)).norm() < 1e-9, "{angle}: {p} {rest}");
        }
    }
}

#[test]
fn only_bones_can_be_displaced() {
    let block = fixtures::lattice(3, 3, 5.5e-3);
    let additions = Additions { displaced: vec![(5, SVector::zeros())], ..Additions::default() };
    fixtures::says(
        System::with_additions(&block, &Model::default(), &[], additions),
        "node 5; no bone holds it",
    );
}
