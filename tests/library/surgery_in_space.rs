//! After surgery of bodies in space the remaining muscles pull as before. `scenes_in_space` tests what cannot be operated.

use nalgebra::Vector3;
use tongue_fit::body::{Body, Filling, Region, Side, artisynth};
use tongue_fit::system::{MusclesAs, SpaceModel, System};

use crate::fixtures::solved;
use crate::fixtures::space_block::space_block;
use crate::tongue_in_space::folder;

const SIDE: f64 = 1e-2;

/// Displacement of a node at activations by name, mm.
fn way(body: &Body<3>, model: &SpaceModel, node: usize, given: &[(&str, f64)]) -> Vector3<f64> {
    let system = System::in_space(body, model).unwrap();
    let known: Vec<(&str, f64)> =
        given.iter().copied().filter(|(name, _)| body.both_sides(name).is_ok()).collect();
    let w = solved(&system, &body.activations(&known).unwrap());
    (w.positions()[node] - body.mesh.nodes[node]) * 1e3
}

/// Displacement of a node after surgery of some elements, mm.
fn way_after(
    body: &Body<3>,
    model: &SpaceModel,
    elements: &std::collections::BTreeSet<usize>,
    filling: Filling,
    (node, given): (usize, &[(&str, f64)]),
) -> Vector3<f64> {
    let operated = body.operated(elements, filling).unwrap();
    way(&operated.body, model, node, given)
}

#[test]
fn regions_hold_what_lies_in_them_and_one_side_is_the_image_of_the_other() {
    let body = space_block(SIDE);
    let left = body.elements_in(&Region::Muscle("A_L".into()), None).unwrap();
    assert_eq!(left.iter().copied().collect::<Vec<_>>(), [0, 1]);
    let far = Region::Box([Vector3::new(1.2 * SIDE, -1.0, -1.0), Vector3::new(1.0, 1.0, 1.0)]);
    let [l, r] = [Side::Left, Side::Right].map(|side| body.elements_in(&far, Some(side)).unwrap());
    assert_eq!((l.len(), r.len()), (1, 1));
    // After surgery on the right the end moves as the mirror image of its motion after surgery on the left.
    let end = 5 + 9;
    for filling in [Filling::Removed, Filling::Scar(10.0), Filling::Flap] {
        let model = SpaceModel::default();
        let [a, b] = [&l, &r].map(|e| way_after(&body, &model, e, filling, (end, &[("A", 0.2)])));
        assert!(a.y.abs() > 0.01, "{filling:?} {a}");
        assert!((a - Vector3::new(b.x, -b.y, b.z)).norm() < 1e-6, "{filling:?} {a} {b}");
    }
    // A flap is tissue without active muscles, and so is a scar as stiff as the tongue.
    let model = SpaceModel::default();
    let [flap, silent, soft] = [Filling::Flap, Filling::Silent, Filling::Scar(1.0)]
        .map(|filling| way_after(&body, &model, &l, filling, (end, &[("A", 0.2)])));
    assert!((flap - silent).norm() < 1e-9 && (flap - soft).norm() < 1e-9);
}

/// Against the displacements of the tip (x back, y, z up, mm) of ArtiSynth's tongue with GGP at 0.15 and TRANS at 0.1, from an independent
/// program.
#[test]
fn one_side_of_artisynths_tongue_operated() {
    let Some(folder) = folder() else { return };
    let body = artisynth::read(&folder).unwrap();
    let (tip, lines) = (919, SpaceModel { muscles: MusclesAs::Lines, ..SpaceModel::default() });
    let near = |what: &str, found: Vector3<f64>, [x, y, z]: [f64; 3], most: f64| {
        let other = Vector3::new(x, y, z);
        let apart = (found - other).norm() / other.norm();
        assert!(apart < most, "{what}: {found:.2?} of {other:.2?}, {apart}");
    };
    for (kind, model, of_muscles, of_regions) in
        [("lines", &lines, 0.15, 0.15), ("stress", &SpaceModel::default(), 0.01, 0.11)]
    {
        let whole = way(&body, model, tip, &[("GGP", 0.15), ("TRANS", 0.1)]);
        near(&format!("{kind}: whole"), whole, [-8.03, 0.0, -8.67], of_muscles);
        let off = way(&body, model, tip, &[("GGP_R", 0.15), ("TRANS", 0.1)]);
        near(&format!("{kind}: GGP left off"), off, [-6.13, -0.78, -4.76], of_muscles);
        let off = way(&body, model, tip, &[("GGP_R", 0.15), ("TRANS_R", 0.1)]);
        near(&format!("{kind}: GGP and TRANS left off"), off, [-4.47, -4.45, -4.78], of_muscles);
        // The mobile tongue is the upper half of the front 60 % of the body.
        let nodes = || body.mesh.nodes[..946].iter().copied();
        let low = nodes().reduce(|a, b| a.inf(&b)).unwrap();
        let high = nodes().reduce(|a, b| a.sup(&b)).unwrap();
        let corner = Vector3::new(low.x + 0.6 * (high.x - low.x), 1.0, 1.0);
        let floor = Vector3::new(-1.0, -1.0, 0.5 * (low.z + high.z));
        let elements = body.elements_in(&Region::Box([floor, corner]), Some(Side::Left)).unwrap();
        let given = (tip, &[("GGP", 0.15), ("TRANS", 0.1)][..]);
        for (what, filling, other) in [
            ("scar", Filling::Scar(10.0), [-5.54, -3.02, -6.94]),
            ("flap", Filling::Flap, [-6.56, -2.75, -8.37]),
            ("removed", Filling::Removed, [-8.56, 4.36, -10.02]),
        ] {
            let found = way_after(&body, model, &elements, filling, given);
            // The tolerance is wide, because the exact region of the other program is not known.
            near(&format!("{kind}: {what}, {} elements", elements.len()), found, other, of_regions);
            assert_eq!(found.y.signum(), other[1].signum(), "{what} {found}");
        }
    }
}
