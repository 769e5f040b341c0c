//! Bodies of hexahedra from files of the real Gmsh (tests/gmsh/make_meshes.py): muscles are overlapping groups of volumes, with directions
//! from views and from curves.

use std::path::Path;

use nalgebra::Vector3;
use tongue_core::body::largest_distance;
use tongue_fit::body::gmsh::read_space;
use tongue_fit::body::{Body, Side, Unit};
use tongue_fit::system::{SpaceModel, System};
use tongue_input::bodies::gmsh;

use crate::fixtures::{self, solved};

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gmsh").join(name)).unwrap()
}

fn body() -> Body<3> {
    read_space(&bytes("hexahedra_41.msh"), "block.msh", Unit::M).unwrap()
}

#[test]
fn a_block_of_gmsh_has_its_hexahedra_regions_and_directions() {
    let body = body();
    let volume: f64 = body.mesh.hexahedron_volumes().sum();
    assert_eq!((body.mesh.hexahedra.len(), body.mesh.nodes.len(), body.mesh.fixed.len()), (48, 105, 15));
    assert!((volume / 48e-6 - 1.0).abs() < 1e-9, "{volume}");
    assert_eq!(body.bones.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), ["mandible"]);
    let found: Vec<_> = body.muscles.iter().map(|m| (m.name.as_str(), m.side, m.region.len())).collect();
    assert_eq!(found, [("A_L", Side::Left, 24), ("A_R", Side::Right, 24), ("M", Side::Middle, 48)]);
    // Two stresses are given; the third is the force times the length of the fibre over the volume.
    for (muscle, stress) in body.muscles.iter().zip([20e3, 20e3, 4.0 * 60e-3 / 48e-6]) {
        assert!((muscle.stress_pa / stress - 1.0).abs() < 1e-9, "{} {}", muscle.name, muscle.stress_pa);
    }
    for (number, y) in [-0.2, 0.2, 0.0].into_iter().enumerate() {
        let expected = Vector3::new(1.0, y, 0.0).normalize();
        for &element in &body.muscles[number].region {
            let y_of = |&n: &usize| body.mesh.nodes[n].y;
            assert!(number == 2 || body.mesh.hexahedra[element].iter().map(y_of).sum::<f64>() * y > 0.0);
            for direction in body.directions(number, element) {
                assert!(direction.unwrap().cross(&expected).norm() < 1e-9, "{direction:?}");
            }
        }
    }
    let binary = read_space(&bytes("hexahedra_41_binary.msh"), "block.msh", Unit::M).unwrap();
    let apart = largest_distance(&binary.mesh.nodes, &body.mesh.nodes);
    assert!(apart < 1e-15, "{apart}");
    assert_eq!((binary.mesh.hexahedra, binary.bones), (body.mesh.hexahedra, body.bones));
    for (a, b) in binary.muscles.iter().zip(&body.muscles) {
        assert_eq!((&a.name, &a.region, &a.directions), (&b.name, &b.region, &b.directions));
    }
}

#[test]
fn the_sign_of_a_direction_says_nothing() {
    let text = String::from_utf8(bytes("hexahedra_41.msh")).unwrap();
    let mut is_turned = false;
    let lines = text.lines().map(|line| match line.strip_suffix(" 1 -0.2 0") {
        Some(tag) => {
            is_turned = !is_turned;
            format!("{tag} {}\n", if is_turned { "-1 0.2 0" } else { "1 -0.2 0" })
        }
        None => line.to_owned() + "\n",
    });
    let turned = read_space(lines.collect::<String>().as_bytes(), "b.msh", Unit::M).unwrap();
    assert!(turned.muscles[0].directions != body().muscles[0].directions);
    let way = |body: &Body<3>| {
        let [a, b] = body.mesh.muscles[0].ends().map(|node| body.mesh.nodes[node]);
        (b - a).dot(&Vector3::new(1.0, -0.2, 0.0)).abs()
    };
    assert!((way(&turned) - way(&body())).abs() < 1e-12, "{} {}", way(&turned), way(&body()));
    // The directions at nodes differ in sign and slightly in direction.
    let (before, view) = text.split_once("$ElementData\n2\n\"fibre:A_L\"").unwrap();
    let (_, after) = view.split_once("$EndElementData\n").unwrap();
    let vector = |tag: usize| if tag.is_multiple_of(2) { "1 -0.2 0" } else { "-1 0.2 0.1" };
    let rows: String = (1..1000).map(|tag| format!("{tag} {}\n", vector(tag))).collect();
    let text =
        format!("{before}$NodeData\n1\n\"fibre:A_L\"\n1\n0\n3\n0\n3\n999\n{rows}$EndNodeData\n{after}");
    let of_nodes = read_space(text.as_bytes(), "b.msh", Unit::M).unwrap();
    for &element in &of_nodes.muscles[0].region {
        for direction in of_nodes.directions(0, element) {
            let across = direction.unwrap().cross(&Vector3::new(1.0, -0.2, 0.0).normalize());
            assert!(across.norm() < 0.11, "{direction:?}");
        }
    }
}

/// The block with a curve for the fibres of M whose nodes are not nodes of the mesh, as Gmsh writes a curve that is not embedded.
fn with_curve(places: &[[f64; 3]]) -> String {
    let text = String::from_utf8(bytes("hexahedra_41.msh")).unwrap();
    let text = text.replacen("6\n1 5 \"fibre:M\"", "7\n1 5 \"other:rim\"\n1 9 \"fibre:M\"", 1);
    let text = text.replacen("12 20 11 2\n", "12 21 11 2\n", 1);
    // The new curve is behind the last one.
    let text = text.replacen("0 2 8 -12 \n", "0 2 8 -12 \n99 0 0 0 0 0 0 1 9 0 \n", 1);
    let section = |text: &str, name: &str, block: String, more: usize| {
        let (before, after) = text.split_once(name).unwrap();
        let (counts, rest) = after.split_once('\n').unwrap();
        let counts: Vec<usize> = counts.split_whitespace().map(|n| n.parse().unwrap()).collect();
        format!("{before}{name}{} {} 1 9999\n{block}{rest}", counts[0] + 1, counts[1] + more)
    };
    let n = places.len();
    let tags: String = (0..n).map(|i| format!("{}\n", 5000 + i)).collect();
    let rows: String = places.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let text = section(&text, "$Nodes\n", format!("1 99 0 {n}\n{tags}{rows}"), n);
    let lines: String = (1..n).map(|i| format!("{} {} {}\n", 7000 + i, 4999 + i, 5000 + i)).collect();
    section(&text, "$Elements\n", format!("1 99 1 {}\n{lines}", n - 1), n - 1)
}

#[test]
fn a_curve_through_a_block_gives_directions() {
    let through: Vec<[f64; 3]> = (1..9).map(|i| [0.0063 * f64::from(i), 1e-3, 9e-3]).collect();
    let without = body();
    let found = read_space(with_curve(&through).as_bytes(), "b.msh", Unit::M).unwrap();
    assert_eq!((&found.mesh.nodes, &found.mesh.fixed), (&without.mesh.nodes, &without.mesh.fixed));
    for &element in &found.muscles[2].region {
        for direction in found.directions(2, element) {
            assert!(direction.unwrap().cross(&Vector3::x()).norm() < 1e-9, "{direction:?}");
        }
    }
    // The stress is the force times the length of the curve over the volume.
    let stress = 4.0 * 0.0063 * 7.0 / 48e-6;
    assert!((found.muscles[2].stress_pa / stress - 1.0).abs() < 1e-9);
    let system = System::in_space(&found, &SpaceModel::default()).unwrap();
    solved(&system, &found.activations(&[("M", 0.2)]).unwrap());
    let leaving: Vec<[f64; 3]> = (1..9).map(|i| [0.01 * f64::from(i), 1e-3, 9e-3]).collect();
    let message = read_space(with_curve(&leaving).as_bytes(), "b.msh", Unit::M).unwrap_err().to_string();
    assert!(message.starts_with("b.msh:") && message.contains("the tissue at node 5006"), "{message}");
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let text = String::from_utf8(bytes("hexahedra_41.msh")).unwrap();
    let says = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        read_space(text.replacen(from, to, 1).as_bytes(), "b.msh", Unit::M).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("A_L 20 kPa", "A_L 20", "b.msh:9: \"muscle:A_L 20\": name the muscle and its strength with a unit"),
        ("A_L 20 kPa", "A_L -20 kPa", "with a unit"),
        ("muscle:A_R 20", "muscle:B_R 20", "muscle A_L has no other side: no group is called \"muscle:A_R"),
        ("1 5 \"fibre:M\"", "1 5 \"fibre:X\"", "fibres are given of X, but no volume is called"),
        ("1 5 \"fibre:M\"", "1 5 \"other:rim\"", "muscle M has a force, but no curves \"fibre:M\""),
        ("\"fibre:A_L\"", "\"other\"", "muscle A_L has no directions"),
        (" 1 -0.2 0\n", " 0 0 0\n", "the view \"fibre:A_L\" has no direction in element"),
        ("bone:mandible", "other:teeth", "no bone holds the body"),
        ("3 2 \"muscle:A_L", "3 2 \"muscel:A_L", "b.msh:9: "),
        ("3 2 \"muscle:A_L", "3 2 \"muscel:A_L", "did you mean \"muscle:A_L 20 kPa\"?"),
        ("\"tissue\"", "\"Tissues\"", "did you mean \"tissue\"?"),
        ("\"tissue\"", "\"other:tissue\"", "no hexahedron is in a physical group called \"tissue\""),
    ] {
        let message = says(from, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
    let exchanged = text.replace("A_L", "A_X").replace("A_R", "A_L").replace("A_X", "A_R");
    fixtures::says(
        read_space(exchanged.as_bytes(), "b.msh", Unit::M),
        "muscle A_L lies at larger y than A_R",
    );
    fixtures::says(read_space(text.as_bytes(), "b.msh", Unit::Mm), "is 0.06 mm across, which no tongue is");
    let second = says("\n3 1 5 ", "\n3 1 12 ");
    assert!(second.contains("Mesh.ElementOrder = 1") && !second.contains("Recombine"), "{second}");
    fixtures::says(read_space(&bytes("cylinder_41.msh"), "c.msh", Unit::M), "is a tetrahedron; Transfinite");
    // The corners of an element are listed from the top downwards.
    let (_, elements) = text.split_once("$Elements").unwrap();
    let line = elements.lines().find(|l| l.split_whitespace().count() == 9).unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    let turned = [&words[..1], &words[5..], &words[1..5]].concat().join(" ");
    let inverted = says(line, &turned);
    assert!(inverted.contains("is turned inside out") && inverted.starts_with("b.msh:"), "{inverted}");
    // Read as a body of simplices, the file is refused.
    let simplices = gmsh::read(text.as_bytes(), "b.msh", Unit::M).unwrap_err().to_string();
    assert!(simplices.contains("is a hexahedron; name a body of hexahedra with --body"), "{simplices}");
}
