//! Files of the real Gmsh (tests/gmsh/make_meshes.py) are read as Gmsh reads them, and invalid meshes are refused.

use crate::fixtures;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use tongue_fit::body::gmsh::Content;
use tongue_fit::body::{self, Body, BodyError, Bone, Mesh, Quality};
use tongue_fit::system::{Model, System};
use tongue_input::bodies::gmsh::{self, Unit};

const FORMS: [&str; 4] = ["41", "41_binary", "22", "22_binary"];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gmsh").join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn read(name: &str) -> Result<Content, BodyError> {
    gmsh::read(&bytes(name), name, Unit::M)
}

fn flat(name: &str) -> Body<2> {
    read(name).unwrap().body.flat().unwrap()
}

fn solid(name: &str) -> Body<3> {
    read(name).unwrap().body.solid().unwrap()
}

/// A body after writing and reading.
fn written<const D: usize>(mesh: &Mesh<D>, bones: &[Bone]) -> Content {
    gmsh::read(gmsh::write(mesh, bones).as_bytes(), "own", Unit::M).unwrap()
}

/// A mesh read through Gmsh's own interface: positions by tag, and the elements of each group.
#[derive(serde::Deserialize)]
struct Said {
    nodes_m: BTreeMap<u64, [f64; 3]>,
    groups: Vec<SaidGroup>,
}

#[derive(serde::Deserialize)]
struct SaidGroup {
    dimension: usize,
    name: String,
    elements: Vec<Vec<u64>>,
}

impl Said {
    fn of(name: &str) -> Self {
        serde_json::from_slice(&bytes(name)).unwrap()
    }

    fn elements(&self, dimension: usize, name: &str) -> BTreeSet<BTreeSet<u64>> {
        let group = self.groups.iter().find(|g| g.dimension == dimension && g.name == name).expect(name);
        group.elements.iter().map(|e| e.iter().copied().collect()).collect()
    }
}

fn assert_as_gmsh_says<const D: usize>(body: &Body<D>, own: &[u64], said: &Said) {
    let tags = |nodes: &[usize]| nodes.iter().map(|n| own[*n]).collect::<BTreeSet<u64>>();
    for (x, tag) in body.mesh.nodes.iter().zip(own) {
        let given = said.nodes_m[tag];
        assert!((0..D).all(|d| (x[d] - given[d]).abs() <= LAST_BIT_M), "node {tag}: {x} against {given:?}");
    }
    let cells: BTreeSet<_> = body.mesh.cells.iter().map(tags).collect();
    assert_eq!(cells, said.elements(D, "tissue"));
    assert_eq!(cells.len(), body.mesh.cells.len());
    for muscle in &body.mesh.muscles {
        let name = if D == 2 { muscle.name.clone() } else { format!("muscle:{}", muscle.name) };
        let lines: BTreeSet<_> = muscle.nodes.windows(2).map(tags).collect();
        assert_eq!(lines, said.elements(1, &name), "{name}");
    }
    for bone in &body.bones {
        let dimension = if D == 2 { 0 } else { 2 };
        let held = said.elements(dimension, &format!("bone:{}", bone.name)).into_iter().flatten().collect();
        assert_eq!(tags(&bone.nodes), held, "{}", bone.name);
    }
    let used: BTreeSet<u64> = said.groups.iter().flat_map(|g| g.elements.iter().flatten().copied()).collect();
    assert_eq!(own, used.into_iter().collect::<Vec<_>>(), "no node of an element is lost");
}

/// Gmsh writes 16 digits as text, and its scaled coordinates in binary differ in the last bit.
const LAST_BIT_M: f64 = 2e-17;

fn assert_same<const D: usize>(a: &Mesh<D>, b: &Mesh<D>) {
    assert!(a.nodes.iter().zip(&b.nodes).all(|(p, q)| (p - q).amax() <= LAST_BIT_M));
    assert_eq!(a, &Mesh { nodes: a.nodes.clone(), ..b.clone() });
}

/// Stretch of a muscle at a tension, N.
fn stretch<const D: usize>(mesh: &Mesh<D>, muscle: usize, tension: f64) -> f64 {
    let system = System::new(mesh, &Model::default(), &[muscle]).unwrap();
    let mut tensions = vec![0.0; system.muscle_count()];
    tensions[muscle] = tension;
    let workspace = fixtures::solved(&system, &tensions);
    system.length(workspace.positions(), muscle) / system.length(system.rest(), muscle)
}

#[test]
fn every_format_that_gmsh_writes_is_read_as_gmsh_says() {
    let said = Said::of("tongue.json");
    for form in FORMS {
        let Content { body, tags, concerns } = read(&format!("tongue_{form}.msh")).unwrap();
        let body = body.flat().unwrap();
        assert_as_gmsh_says(&body, &tags, &said);
        // In the order of the tables.
        assert_eq!(body.mesh.muscle_names(), ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
        assert_eq!(body.bones.len(), 3);
        assert_eq!(concerns, [""; 0], "nothing to look at");
        assert_same(&body.mesh, &flat("tongue_41.msh").mesh);
    }
}

#[test]
fn a_tongue_meshed_by_gmsh_is_the_tongue_of_the_anatomy_and_contracts_like_it() {
    let (theirs, ours) = (flat("tongue_41.msh").mesh, fixtures::tongue());
    let area = |mesh: &Mesh<2>| Quality::of(mesh).area_m2;
    assert!((area(&theirs) / area(&ours) - 1.0).abs() < 0.01, "{} against {} m²", area(&theirs), area(&ours));
    for (a, b) in theirs.muscles.iter().zip(&ours.muscles) {
        let length = |mesh: &Mesh<2>, [p, q]: [usize; 2]| (mesh.nodes[p] - mesh.nodes[q]).norm();
        assert!((length(&theirs, a.ends()) - length(&ours, b.ends())).abs() < 1e-4, "{}", a.name);
    }
    let outside = |mesh: &Mesh<2>, name: &str| {
        let inside = mesh.in_tissue();
        let muscle = mesh.muscles.iter().find(|m| m.name == name).unwrap();
        muscle.nodes.iter().filter(|n| !inside[**n]).count()
    };
    assert!(outside(&theirs, "SGp") > 1, "SGp comes from outside the tissue");
    assert_eq!(outside(&theirs, "GGa"), 0);
    let [theirs, ours] = [theirs, ours].map(|mesh| stretch(&mesh, 0, 10.0));
    // Tensions depend on the spacing (README, limits), which is 7 mm here and 5.5 mm there.
    assert!(theirs < 0.95 && (theirs - ours).abs() < 0.01, "{theirs} against {ours}");
}

#[test]
fn a_solid_is_read_and_contracts() {
    let said = Said::of("cylinder.json");
    for form in ["41", "22_binary"] {
        let Content { body, tags, .. } = read(&format!("cylinder_{form}.msh")).unwrap();
        let body = body.solid().unwrap();
        assert_as_gmsh_says(&body, &tags, &said);
        assert_eq!(body.bones.len(), 1);
        let base = body.mesh.nodes.iter().filter(|x| x[2] == 0.0).count();
        assert_eq!(body.bone("base").len(), base);
        assert!(stretch(&body.mesh, 0, 0.05) < 0.999);
    }
    assert_same(&solid("cylinder_41.msh").mesh, &solid("cylinder_22_binary.msh").mesh);
}

#[test]
fn meshes_without_a_body_are_refused_with_place_and_advice() {
    assert!(read("broken/square.msh").is_ok(), "the others differ from this one by their fault alone");
    for (name, place, expected) in [
        ("branch", ":6: ", "where 3 of its lines meet"),
        ("gap", ":6: ", "muscle GGa has gaps: it ends at the nodes"),
        ("loop", ":6: ", "runs in a circle through node"),
        ("not_embedded", ":6: ", "without being one of its nodes, so the muscle would slide"),
        ("apart", ":6: ", "muscle GGa shares no node with the tissue"),
        ("no_tissue", ":8: ", "the physical group \"flesh\" of"),
        ("no_bone", ": ", "no bone holds the body"),
        ("misspelt", ":6: ", "did you mean \"GGa\"?"),
        ("out_of_plane", ": ", "lies at z = 0.005"),
        ("version_40", ":2: ", "the format is 4, but only 4.1 and 2.2 are read"),
        ("quadrangles", ":", "is a quadrangle; only triangles and tetrahedra are read"),
        ("partitioned", ":", "the mesh is partitioned"),
    ] {
        let message = read(&format!("broken/{name}.msh")).expect_err(name).to_string();
        let is_there = message.starts_with(&format!("broken/{name}.msh{place}"));
        assert!(is_there && message.contains(expected), "{name}: {message}");
    }
    let square = String::from_utf8(bytes("broken/square.msh")).unwrap();
    for (from, to, expected) in [
        ("\"tissue\"", "\"Tissues\"", ["\"Tissues\" of surfaces has no meaning", "did you mean \"tissue\"?"]),
        ("\"GGa\"", "\"muscel:M\"", ["\"muscel:M\" of curves", "did you mean \"muscle:M\"?"]),
        ("\"GGa\"", "\"masseter\"", ["may be called GGa to HGp, muscle:NAME, bone:", "\"other:masseter\""]),
        ("\"tissue\"", "\"other:tissue\"", ["no triangle or tetrahedron is in", "it has \"GGa\""]),
        ("3\n1 2 \"GGa\"", "4\n1 2 \"GGa\"\n1 9 \"GGm\"", ["\"GGm\" has no elements", "m.msh:7"]),
        ("\n5 4 11 14", "\n5 4 11 99", ["element 5 refers to node 99, which is not in $Nodes", "m.msh:"]),
    ] {
        let text = square.replacen(from, to, 1);
        assert_ne!(text, square, "{from}");
        let message = gmsh::read(text.as_bytes(), "m.msh", Unit::M).unwrap_err().to_string();
        assert!(expected.iter().all(|t| message.contains(t)), "{message}");
    }
}

#[test]
fn a_muscle_begins_at_the_end_where_a_line_starts_or_else_at_the_lower_tag() {
    let square = String::from_utf8(bytes("broken/square.msh")).unwrap();
    let chain = |lines: &str| {
        let text = square.replacen("1 5 1 1\n3 5 6 \n1 6 1 1\n4 6 7 \n", lines, 1);
        let Content { body, tags, .. } = gmsh::read(text.as_bytes(), "m.msh", Unit::M)?;
        let nodes = body.flat()?.mesh.muscles[0].nodes.clone();
        Ok::<_, BodyError>(nodes.into_iter().map(|n| tags[n]).collect::<Vec<u64>>())
    };
    for (lines, expected) in [
        ("1 5 1 1\n3 6 5 \n1 6 1 1\n4 6 7 \n", [5, 6, 7]),
        ("1 5 1 1\n3 5 6 \n1 6 1 1\n4 7 6 \n", [5, 6, 7]),
        ("1 5 1 1\n3 6 5 \n1 6 1 1\n4 7 6 \n", [7, 6, 5]),
        ("1 6 1 1\n4 6 7 \n1 5 1 1\n3 6 5 \n", [5, 6, 7]),
    ] {
        assert_eq!(chain(lines).unwrap(), expected, "{lines}");
    }
    let circle = chain("1 5 1 1\n3 5 5 \n1 6 1 1\n4 6 7 \n").unwrap_err().to_string();
    assert!(circle.contains("runs in a circle through node 5"), "{circle}");
}

#[test]
fn quadratic_elements_are_read_by_their_corners_and_higher_orders_are_refused() {
    let [first, second] = &["broken/square.msh", "second_order.msh"].map(|name| flat(name).mesh);
    let counts = |mesh: &Mesh<2>| [mesh.cells.len(), mesh.nodes.len(), mesh.muscles.len()];
    assert_eq!(counts(second), counts(first));
    let sizes = |mesh: &Mesh<2>| [Quality::of(mesh).area_m2, mesh.distance(mesh.muscles[0].ends())];
    assert!(sizes(second).iter().zip(sizes(first)).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));

    // If the middle of one side is moved, the body is the same, and the curved side is reported.
    let bends = |c: &String| c.contains("are taken as straight");
    assert!(!read("second_order.msh").unwrap().concerns.iter().any(bends));
    let text = String::from_utf8(bytes("second_order.msh")).unwrap();
    let curved = text.replace("0.04 0.009999999999984759 0", "0.043 0.009999999999984759 0");
    let curved = gmsh::read(curved.as_bytes(), "", Unit::M).unwrap();
    let message = curved.concerns.concat();
    assert_eq!(&curved.body.flat().unwrap().mesh, second);
    assert!(message.contains("taken as straight (1 of them, by up to 3.00 mm)"), "{message}");

    // The six-node triangles are declared as ten-node ones.
    let header = text.lines().find(|l| l.starts_with("2 1 9 ")).unwrap();
    let third = text.replace(header, &header.replace("2 1 9 ", "2 1 21 "));
    fixtures::says(gmsh::read(third.as_bytes(), "third.msh", Unit::M), "third.msh:; Mesh.ElementOrder = 1");
}

#[test]
fn a_continuum_is_written_as_elements_of_the_second_order_whose_middles_lie_on_their_edges() {
    fn written<const D: usize>(mesh: &Mesh<D>, kind: &str, edges: &[[usize; 2]]) {
        let text = gmsh::write(mesh, &[]);
        let elements = text.split("$Elements\n").nth(1).unwrap();
        let mut lines = elements.lines().skip(1);
        let header: Vec<&str> = lines.next().unwrap().split(' ').collect();
        assert_eq!(header[2], kind);
        for line in lines.take(header[3].parse().unwrap()) {
            let nodes: Vec<usize> =
                line.split(' ').skip(1).map(|n| n.parse::<usize>().unwrap() - 1).collect();
            assert_eq!(nodes.len(), D + 1 + edges.len());
            for (middle, [a, b]) in nodes[D + 1..].iter().zip(edges) {
                let on_edge = (mesh.nodes[nodes[*a]] + mesh.nodes[nodes[*b]]) * 0.5;
                assert!((mesh.nodes[*middle] - on_edge).norm() < 1e-15, "{line}");
            }
        }
    }
    // The pairs of corners are in the order of Gmsh's manual.
    let plane = fixtures::held_at_a_corner(fixtures::lattice(3, 3, 5e-3), 5e-3);
    written(&plane, "9", &[[0, 1], [1, 2], [2, 0]]);
    let space = fixtures::held_at_a_corner(fixtures::block(1, 5e-3), 5e-3);
    written(&space, "11", &[[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]]);
}

#[test]
fn reading_tells_of_missing_muscles_thin_cells_bent_parts_and_wrong_units() {
    let concerns = |name: &str, unit| gmsh::read(&bytes(name), "", unit).unwrap().concerns;
    let tells = |name: &str, unit, words: &str| {
        let found = concerns(name, unit);
        assert!(found.iter().any(|c| c.contains(words)), "{name}: {found:?}");
    };
    tells("broken/square.msh", Unit::M, "no muscle GGm, GGp, SGp, SGm, SGa, HGa, HGp: ");
    tells("broken/thin.msh", Unit::M, "the smallest angle is ");
    tells("millimetres.msh", Unit::M, "look like millimetres");
    tells("tongue_41.msh", Unit::Mm, "look like metres");
    assert_eq!(concerns("millimetres.msh", Unit::Mm), [""; 0]);
    let right = gmsh::read(&bytes("millimetres.msh"), "", Unit::Mm).unwrap().body.flat().unwrap();
    assert!((right.mesh.extent() - flat("tongue_41.msh").mesh.extent()).abs() < 1e-3);
    // A node of SGp outside the tissue is moved to the side.
    let mut tongue = fixtures::tongue();
    let inside = tongue.in_tissue();
    let sgp = tongue.muscles.iter().find(|m| m.name == "SGp").unwrap();
    let node = sgp.nodes.iter().copied().find(|n| !inside[*n] && !tongue.fixed.contains(n)).unwrap();
    tongue.nodes[node][0] += 10e-3;
    let bent = written(&tongue, &[]).concerns;
    assert!(bent[0].starts_with("SGp bends outside the tissue"), "{bent:?}");
}

#[test]
fn written_meshes_are_read_back_to_the_last_bit_and_clockwise_triangles_are_turned() {
    let read_back = |mesh: &Mesh<2>, bones: &[Bone]| written(mesh, bones).body.flat().unwrap();
    let mut tongue = fixtures::tongue();
    assert_eq!(read_back(&tongue, &[]).mesh, tongue);
    let solid = fixtures::block(2, 0.02);
    assert_eq!(written(&solid, &[]).body.solid().unwrap().mesh, solid);
    let theirs = flat("tongue_22_binary.msh");
    let back = read_back(&theirs.mesh, &theirs.bones);
    assert_eq!((back.mesh, back.bones), (theirs.mesh, theirs.bones));
    let upright = std::mem::replace(&mut tongue.cells, body::Cells::new());
    upright.iter().for_each(|cell| assert!(tongue.cells.push(&[cell[0], cell[2], cell[1]])));
    assert_eq!(read_back(&tongue, &[]).mesh.cells, upright);
}
