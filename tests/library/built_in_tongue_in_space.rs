//! The built-in tongue in space: what it is made of, and what each muscle does to it.

use nalgebra::Vector3;
use tongue_core::body::largest_distance;
use tongue_core::geometry::hexahedron;
use tongue_fit::body::{Anatomy, Body};
use tongue_fit::system::{SpaceModel, System};

use crate::fixtures::solved;

#[test]
fn it_is_as_large_as_its_outline_and_widths_say() {
    let body = Body::tongue_in_space(1).unwrap();
    assert_eq!(body.mesh.hexahedra.len(), 672);
    assert_eq!(body.muscles.len(), 21, "ten pairs, and the superior longitudinal once");
    assert_eq!(body.groups().len(), 11);
    let middle: Vec<usize> = (0..body.mesh.nodes.len()).filter(|&n| body.mesh.nodes[n].y == 0.0).collect();
    assert_eq!(middle.len(), 13 * 8);
    // The area of the midsagittal section is that of the outline in the plane, but for corners that are cut off between nodes.
    let anatomy = Anatomy::reference().unwrap();
    let area = anatomy.outline().area();
    let flat: f64 = body
        .mesh
        .hexahedra
        .iter()
        .flat_map(|h| hexahedron::FACES.map(|f| f.map(|i| body.mesh.nodes[h[i]])))
        .filter(|f| f.iter().all(|p| p.y == 0.0))
        .map(|f| 0.5 * (f[2] - f[0]).cross(&(f[3] - f[1])).norm())
        .sum::<f64>()
        / 2.0;
    assert!((flat / area - 1.0).abs() < 0.03, "{flat} {area}");
    let volume: f64 = body.mesh.hexahedron_volumes().sum();
    assert!((1e3 * volume / flat - 36.0).abs() < 2.0, "{volume} {flat}");
    let width = body.mesh.nodes[..117 * 8].iter().map(|p| p.y).fold(0.0, f64::max);
    assert!((0.025..0.033).contains(&width), "{width}");
    assert!(body.muscles.iter().all(|m| (1e3..1e6).contains(&m.stress_pa)), "{:?}", body.muscles);
}

#[test]
fn each_muscle_alone_converges_on_one_half_as_on_the_whole() {
    let body = Body::tongue_in_space(1).unwrap();
    let half = body.half().expect("the same on both sides");
    let model = SpaceModel::default();
    let (whole, left) = (System::in_space(&body, &model).unwrap(), System::of_half(&half, &model).unwrap());
    for name in body.groups() {
        let all = body.activations(&[(&name, 0.1)]).unwrap();
        let l = solved(&left, &half.activations(&all).expect("alike"));
        let positions = half.positions_of_whole(l.positions());
        let (least, most) = left.cell_ratios(l.positions());
        assert!(least > 0.8 && most < 1.2, "{name} {least} {most}");
        if ["GGP", "STY", "TRANS"].contains(&name.as_str()) {
            let apart = largest_distance(solved(&whole, &all).positions(), &positions);
            assert!(apart < 1e-7, "{name} {apart}");
        }
    }
}

#[test]
fn a_finer_mesh_moves_nearly_alike() {
    let model = SpaceModel::default();
    let moved = |fine: usize, name: &str| {
        let body = Body::tongue_in_space(fine).unwrap();
        let half = body.half().unwrap();
        let system = System::of_half(&half, &model).unwrap();
        let activations = half.activations(&body.activations(&[(name, 0.1)]).unwrap()).unwrap();
        let w = solved(&system, &activations);
        let tip = body.tip().unwrap();
        (half.positions_of_whole(w.positions())[tip] - body.mesh.nodes[tip]) * 1e3
    };
    for name in ["GGP", "HG"] {
        let [coarse, fine]: [Vector3<f64>; 2] = [1, 2].map(|fine| moved(fine, name));
        assert!((coarse - fine).norm() < 0.2 * fine.norm(), "{name}: {coarse} {fine}");
    }
}

/// A sample of 200 activations that were tried, half of them with different activations of the sides.
#[test]
fn random_activations_of_all_muscles_converge_without_an_inverted_element() {
    let body = Body::tongue_in_space(1).unwrap();
    let half = body.half().unwrap();
    let left = System::of_half(&half, &SpaceModel::default()).unwrap();
    let mut random = fastrand::Rng::with_seed(18);
    for n in 0..12 {
        let given: Vec<(String, f64)> = body.groups().into_iter().map(|g| (g, 0.5 * random.f64())).collect();
        let activations = half.activations(&body.activations(&given).unwrap()).unwrap();
        let (least, most) = left.cell_ratios(solved(&left, &activations).positions());
        assert!(least > 0.8 && most < 1.3, "{n}: {least} {most}");
    }
}
