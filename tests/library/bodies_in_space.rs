//! Hexahedra and muscles with directions: exact solutions, symmetry of the sides, and refused input.

use std::path::PathBuf;

use nalgebra::{Matrix3, Rotation3, Vector3};
use tongue_core::body::largest_distance;
use tongue_core::effect::Hexahedra;
use tongue_fit::body::Body;
use tongue_fit::effect::{Configuration, Effect};
use tongue_fit::material::MooneyRivlin;
use tongue_fit::system::{MusclesAs, SpaceModel, System};
use tongue_input::bodies::artisynth::{self, ArtisynthFiles, Text};

use crate::fixtures::artisynth::files;
use crate::fixtures::space_block::{hexahedra, space_block};
use crate::fixtures::{says, solved, solved_to};

const SIDE: f64 = 5.5e-3;

fn energy(effect: &Hexahedra, positions: &[Vector3<f64>]) -> f64 {
    effect.energy(Configuration { positions, tensions: &[] })
}

#[test]
fn an_even_deformation_costs_what_the_law_says_and_turning_nothing() {
    let body = space_block(SIDE);
    let law = MooneyRivlin::TONGUE;
    let tissue = Hexahedra::new(law, &body.mesh.hexahedra, &body.mesh.nodes).unwrap();
    let f = Matrix3::new(1.1, 0.2, 0.0, -0.1, 0.95, 0.15, 0.05, 0.0, 1.02);
    let x: Vec<_> = body.mesh.nodes.iter().map(|p| f * p + Vector3::new(0.1, 0.2, -0.3)).collect();
    let volume: f64 = body.mesh.hexahedron_volumes().sum();
    let j = f.determinant();
    let distortion = j.powf(-2.0 / 3.0) * f.norm_squared() - 3.0;
    let density = law.c10 * distortion + law.c20 * distortion.powi(2) + 0.5 * law.bulk * (j - 1.0).powi(2);
    let found = energy(&tissue, &x);
    assert!((found / (density * volume) - 1.0).abs() < 1e-12, "{found}");
    let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
    let turned: Vec<_> = x.iter().map(|p| turn * p).collect();
    assert!((energy(&tissue, &turned) / found - 1.0).abs() < 1e-12);
    // One corner is inverted.
    let mut over = x;
    over[17] = over[0];
    assert_eq!(energy(&tissue, &over), f64::INFINITY);
}

/// Deflection of a beam of hexahedra along x that is fixed at x = 0, by a force on its other end.
fn deflection(law: MooneyRivlin, parts: [usize; 2]) -> f64 {
    let (length, height, width) = (40e-3, 5e-3, 5e-3);
    let [along, up] = parts;
    let place = |[x, y, z]: [f64; 3]| [length * x / along as f64, width * y, height * z / up as f64];
    let mut body = Body { mesh: hexahedra([along, 1, up], place), ..Body::default() };
    body.mesh.fixed = (0..body.mesh.nodes.len()).filter(|&n| body.mesh.nodes[n].x == 0.0).collect();
    let force = 1e-5;
    body.mesh.connect();
    let share = force / (2 * (up + 1)) as f64;
    let end: Vec<(usize, f64)> =
        (0..body.mesh.nodes.len()).filter(|&n| body.mesh.nodes[n].x == length).map(|n| (n, share)).collect();
    let weight = tongue_fit::effect::Gravity::new(&end, Vector3::new(0.0, 0.0, 1.0), &body.mesh.nodes);
    let additions = tongue_fit::system::Additions { effects: vec![Box::new(weight)], ..Default::default() };
    let model = SpaceModel { law, ..SpaceModel::default() };
    let system = System::in_space_with(&body, &model, additions).unwrap();
    let positions = solved_to(1e-13, &system, &[]);
    let tip = up * 2 * (along + 1) + along;
    let found = positions[tip].z - body.mesh.nodes[tip].z;
    // Timoshenko's beam: bending and shear.
    let young = 4.0 * law.c10 * (1.0 + law.poisson_ratio());
    let moment = width * height.powi(3) / 12.0;
    let shear = 2.0 * law.c10 * width * height * 5.0 / 6.0;
    found / (force * (length.powi(3) / (3.0 * young * moment) + length / shear))
}

#[test]
fn a_nearly_incompressible_beam_bends_as_much_as_a_compressible_one() {
    let soft = MooneyRivlin { c10: 1037.0, c20: 0.0, bulk: 2074.0 };
    let stiff = MooneyRivlin { bulk: 1e4 * 2074.0, ..soft };
    let [compressible, incompressible] = [soft, stiff].map(|law| deflection(law, [16, 4]));
    // Elements without a mean volume would have a twentieth of it at nu 0.49995.
    for (part, expected) in [(compressible, 0.91), (incompressible, 0.86)] {
        assert!((part - expected).abs() < 5e-3, "{compressible} {incompressible}");
    }
}

#[test]
fn both_sides_alike_is_solved_on_one_half_with_the_same_answer() {
    let body = space_block(SIDE);
    let half = body.half().unwrap();
    assert_eq!((half.body.mesh.hexahedra.len(), half.plane.len(), half.muscles.len()), (2, 6, 2));
    for muscles in [MusclesAs::Stress, MusclesAs::Lines] {
        let model = SpaceModel { muscles, stiffening: 9.0, ..SpaceModel::default() };
        let (whole, left) =
            (System::in_space(&body, &model).unwrap(), System::of_half(&half, &model).unwrap());
        let activations = body.activations(&[("A", 0.2), ("m", 0.1)]).unwrap();
        let of_half = half.activations(&activations).unwrap();
        let (w, l) = (solved(&whole, &activations), solved(&left, &of_half));
        let apart = largest_distance(&half.positions_of_whole(l.positions()), w.positions());
        assert!(apart < 1e-7, "{apart}");
        assert!(largest_distance(w.positions(), &body.mesh.nodes) > 1e-4);
    }
    let one_side = body.activations(&[("A_L", 0.2)]).unwrap();
    assert_eq!(half.activations(&one_side), None);
    let muscle = |name: &str| body.muscles.iter().position(|m| m.name == name).unwrap();
    // A muscle in the middle has elements on one side only.
    let mut one_sided = body.clone();
    let is_left =
        |e: &usize| body.mesh.hexahedra[*e].iter().map(|&n| body.mesh.nodes[n].y).sum::<f64>() < 0.0;
    one_sided.muscles[muscle("M")].region.retain(is_left);
    one_sided.muscles[muscle("M")].directions.clear();
    assert_eq!(one_sided.half(), None);
    // The two sides of a muscle have different directions of fibres.
    let mut turned = body.clone();
    for (name, direction) in [("A_L", Vector3::x()), ("A_R", Vector3::z())] {
        let own = &mut turned.muscles[muscle(name)];
        own.directions = own.region.iter().map(|_| [Some(direction); 8]).collect();
    }
    assert_eq!(turned.half(), None);
    let mut bent = body;
    bent.mesh.nodes[2].y -= SIDE / 50.0;
    assert_eq!(bent.half(), None);
}

#[test]
fn a_body_cut_in_eight_keeps_its_volume_bones_and_regions() {
    let body = space_block(SIDE);
    let fine = body.refined();
    fine.check().unwrap();
    let [volume, again] = [&body, &fine].map(|b| b.mesh.hexahedron_volumes().sum::<f64>());
    assert!((volume / again - 1.0).abs() < 1e-12);
    assert_eq!((fine.mesh.hexahedra.len(), fine.mesh.nodes.len(), fine.mesh.fixed.len()), (32, 75, 15));
    for (coarse, fine_muscle) in body.muscles.iter().zip(&fine.muscles) {
        let of = |b: &Body<3>, region: &[usize]| {
            region.iter().map(|&e| b.mesh.hexahedron_volumes().nth(e).unwrap()).sum::<f64>()
        };
        assert!((of(&body, &coarse.region) / of(&fine, &fine_muscle.region) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn activations_are_named_and_lie_between_0_and_1() {
    let body = space_block(SIDE);
    assert_eq!(body.activations(&[("a", 0.5), ("M", 1.0)]).unwrap(), [0.5, 0.5, 1.0]);
    assert_eq!(body.activations(&[("A_R", 0.5)]).unwrap(), [0.0, 0.5, 0.0]);
    let says = |given: &[(&str, f64)]| body.activations(given).unwrap_err().to_string();
    assert_eq!(says(&[("A", 1.5)]), "the activation of A is 1.5; it must lie between 0 and 1");
    assert!(says(&[("A", f64::NAN)]).contains("between 0 and 1"));
    assert!(says(&[("B", 0.1)]).starts_with("there is no muscle \"B\" in this body"));
    assert!(says(&[("A", 0.1), ("A_L", 0.2)]).contains("A_L is given twice"));
}

#[test]
fn files_of_artisynth_make_a_body() {
    let body = artisynth::body(&files(), "folder").unwrap();
    assert_eq!((body.mesh.hexahedra.len(), body.mesh.fixed.len(), body.muscles.len()), (2, 6, 2));
    let left = &body.muscles[0];
    assert_eq!((&*left.name, &*left.region, left.segments[0].force_n), ("X_L", &[0][..], 2.0));
    assert!((left.stress_pa - 2.0 * 0.02 / 2e-6).abs() < 1e-6);
    assert!(body.half().is_some());
    // The step leads beyond the last element and is as large as a number can be.
    let mut files = files();
    files.muscles.text = files.muscles.text.replace(",,2,2,1", &format!(",,2,2,{}", u64::MAX));
    assert_eq!(artisynth::body(&files, "folder").unwrap().muscles[1].region, [1]);
}

#[test]
fn files_that_are_wrong_are_named_with_their_line() {
    type Part = fn(&mut ArtisynthFiles) -> &mut Text;
    let cases: [(Part, &str, &str, &str); 17] = [
        (|f| &mut f.nodes, "0.02", "x", "a.node:2: \"x\" stands where a coordinate was expected"),
        (|f| &mut f.nodes, "0.02", "inf", "a.node:2: \"inf\" stands where a coordinate was expected"),
        (|f| &mut f.jaw, "0 2 4\n", "", "jawAttachments.txt: it contains nothing that could be read as"),
        (
            |f| &mut f.jaw,
            "0 2 4\n",
            "0 2\n",
            "jawAttachments.txt: a bone needs three nodes or more, and this file has 2",
        ),
        (|f| &mut f.hyoid, "6 8 10", "", "hyoidAttachments.txt: it contains nothing that could be read as"),
        (
            |f| &mut f.hyoid,
            "6",
            "4",
            "hyoidAttachments.txt: node 4 is attached to the jaw too, in folder/jaw",
        ),
        (|f| &mut f.jaw, "2", "3", "jawAttachments.txt: the nodes on the jaw lie 6.7 mm behind those on the"),
        (|f| &mut f.strengths, "4", "0", "MuscleMaxForce.txt:1: \"0\" stands where a force in newtons"),
        (|f| &mut f.elements, "12 11", "13 11", "a.elem:2: node 13 does not exist"),
        (|f| &mut f.muscles, ",,2,2", ",,3,3", "CreateMuscles.mac:6: element 3 does not exist"),
        (|f| &mut f.muscles, ",,2,2,1", ",,2,2,0", "CreateMuscles.mac:6: \"S,ELEM,,2,2,0\" stands where"),
        (|f| &mut f.muscles, "CM,X_R,ELEM\n", "", "CreateMuscles.mac:3: muscle X_R has no elements: no"),
        (|f| &mut f.fibres, "=12", "=99", "Fibers.mac:4: node 99 does not exist"),
        (|f| &mut f.fibres, "FIBER(2,1,2)=12\n", "", "Fibers.mac: fibre 1 of muscle number 2 has no node"),
        (|f| &mut f.strengths, "X 4", "Y 4", "CreateMuscles.mac:2: muscle X_L has no strength: no line X"),
        (|f| &mut f.jaw, "4", "400", "jawAttachments.txt:1: node 400 does not exist"),
        (|f| &mut f.elements, "1 2 4 3 7 8 10 9", "7 8 10 9 1 2 4 3", "a.elem: is not a valid body:"),
    ];
    for (part, from, to, expected) in cases {
        let mut files = files();
        let text = &mut part(&mut files).text;
        assert!(text.contains(from), "{from}");
        *text = text.replacen(from, to, 1);
        let message = artisynth::body(&files, "folder").unwrap_err().to_string();
        assert!(message.starts_with(&format!("folder/{expected}")), "{message}");
    }
    says(artisynth::read(&PathBuf::from("no/such/folder")), "no/such/folder: cannot be read");
}
