//! The mesh has the published numbers of the thesis, keeps the anatomy at any spacing, and faults are reported.

use tongue_core::body::MeshFault;
use tongue_fit::body::{
    Anatomy, Body, Cells, DEFAULT_SPACING_M, MANDIBLE, Mesh, MuscleChain, Quality, REFERENCE, build, json,
};
use tongue_fit::measured::Thesis;
use tongue_fit::system::{Model, System};

use crate::fixtures;

const AREA_M2: f64 = 2.46e-3;

fn mesh(h_mm: f64) -> Mesh<2> {
    build(&Anatomy::reference().unwrap(), h_mm * 1e-3).unwrap()
}

fn assert_published_lengths(mesh: &Mesh<2>) {
    let thesis = Thesis::reference();
    assert_eq!(thesis.rows().len(), mesh.muscles.len());
    for (row, muscle) in thesis.rows().iter().zip(&mesh.muscles) {
        let (name, built_mm) = (&row.muscle, mesh.distance(muscle.ends()) * 1e3);
        assert_eq!(name, &muscle.name);
        assert!((built_mm - row.rest_length_mm).abs() < 0.1, "{name}: {built_mm} mm");
    }
}

#[test]
fn the_default_mesh_has_every_published_number() {
    let mesh = mesh(DEFAULT_SPACING_M * 1e3);
    let q = Quality::of(&mesh);
    assert_eq!((q.nodes, q.cells, q.boundary_nodes, q.nodes_outside_tissue), (123, 188, 32, 12));
    assert_eq!(q.connections, 298 + 12, "triangle edges, and one connection for each node outside");
    assert!((q.area_m2 / AREA_M2 - 1.0).abs() < 0.005, "area {} m²", q.area_m2);
    assert!((5.35e-3..5.65e-3).contains(&q.mean_connection_m), "mean connection {} m", q.mean_connection_m);
    assert!(q.smallest_angle_deg > 15.0, "smallest angle {}", q.smallest_angle_deg);
    assert!(q.shortest_connection_m > 2.5e-3, "shortest connection {} m", q.shortest_connection_m);
    assert_published_lengths(&mesh);
    let in_tissue: Vec<usize> = mesh.cells.iter().flatten().copied().collect();
    assert_eq!(in_tissue.iter().max(), Some(&110), "tissue nodes come first");
}

#[test]
fn bones_hold_the_ends_of_muscles_which_share_nodes_where_they_cross_or_join() {
    let mesh = mesh(5.5);
    let chain = |name: &str| &mesh.muscles.iter().find(|m| m.name == name).unwrap().nodes;
    let mut bones = vec![chain("GGa")[0], chain("HGa")[0], chain("HGp")[0], chain("SGp")[0]];
    bones.sort_unstable();
    assert_eq!(mesh.fixed, bones);
    assert_eq!(chain("GGa")[0], chain("GGm")[0]);
    assert_eq!(chain("GGa")[0], chain("GGp")[0]);
    for (a, b) in
        [("GGa", "SGa"), ("GGm", "SGa"), ("GGp", "HGa"), ("GGp", "HGp"), ("SGp", "SGm"), ("SGm", "SGa")]
    {
        assert_eq!(chain(a).iter().filter(|n| chain(b).contains(n)).count(), 1, "{a} and {b}");
    }
}

/// Spacings between the round ones put some crossings of lines close to other nodes.
#[test]
fn every_spacing_keeps_area_lengths_and_good_triangles() {
    let anatomy = Anatomy::reference().unwrap();
    let between = (0..100).map(|i| 15.0 * 0.98_f64.powi(i));
    for h_mm in [11.0, 5.5, 2.75, 1.4].into_iter().chain(between) {
        let mesh = build(&anatomy, h_mm * 1e-3).unwrap_or_else(|e| panic!("{h_mm} mm: {e}"));
        let q = Quality::of(&mesh);
        assert!(q.smallest_angle_deg > 15.0, "{h_mm} mm: smallest angle {}", q.smallest_angle_deg);
        assert!((q.area_m2 / AREA_M2 - 1.0).abs() < 0.005, "{h_mm} mm: area {}", q.area_m2);
        let is_round = [11.0, 5.5, 2.75, 1.4].contains(&h_mm);
        let [shortest, mean] = [q.shortest_connection_m, q.mean_connection_m].map(|m| m * 1e3 / h_mm);
        assert!(!is_round || (shortest > 0.45 && (mean - 1.0).abs() < 0.06), "{h_mm} mm: {shortest} {mean}");
        // Euler's formula for a disc without holes and with trees of connections outside, each of which adds a node.
        assert_eq!(q.connections + 1, q.nodes + q.cells, "{h_mm} mm");
        assert_published_lengths(&mesh);
        mesh.check().unwrap();
    }
}

#[test]
fn a_spacing_out_of_range_is_refused_with_the_range() {
    let anatomy = Anatomy::reference().unwrap();
    for h in [0.0, -5.5e-3, f64::NAN, f64::INFINITY, 5.5, 1e-5] {
        fixtures::says(build(&anatomy, h), "the mesh spacing; 0.22 to 15.0 mm");
    }
    fixtures::says(build(&anatomy, 2.1e-4), "the mesh spacing; 0.22 to 15.0 mm");
}

#[test]
fn a_mesh_of_more_nodes_than_the_memory_has_room_for_is_refused() {
    // A strip of squares, each of two triangles, that is held along its lower side.
    let squares = 30_000;
    let columns = 0..=squares;
    let nodes = columns.clone().flat_map(|i| [[1e-5 * f64::from(i), 0.0], [1e-5 * f64::from(i), 1e-5]]);
    let firsts = || (0..squares as usize).map(|i| 2 * i);
    let triangles: Vec<[usize; 3]> = firsts().flat_map(|a| [[a, a + 2, a + 3], [a, a + 3, a + 1]]).collect();
    let sides = firsts().flat_map(|a| [[a, a + 1], [a, a + 2], [a, a + 3], [a + 1, a + 3]]);
    let last = 2 * squares as usize;
    let mesh = Mesh {
        nodes: nodes.map(Into::into).collect(),
        cells: cells(&triangles),
        connections: sides.chain([[last, last + 1]]).collect(),
        fixed: firsts().chain([last]).collect(),
        ..Mesh::default()
    };
    assert_eq!(mesh.nodes.len(), 60_002);
    let system = System::new(&mesh, &Model::default(), &[]);
    fixtures::says(system, "the number of nodes of the body in the plane; to 60000");
}

/// A unit square of two triangles with one muscle along its diagonal.
fn square() -> Mesh<2> {
    Mesh {
        nodes: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Into::into).to_vec(),
        cells: cells(&[[0, 1, 2], [0, 2, 3]]),
        connections: vec![[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]],
        muscles: vec![MuscleChain { name: "M".into(), nodes: vec![0, 2] }],
        fixed: vec![0, 3],
        ..Mesh::default()
    }
}

fn cells(of: &[[usize; 3]]) -> Cells<2> {
    let mut cells = Cells::new();
    of.iter().for_each(|c| assert!(cells.push(c)));
    cells
}

#[test]
fn check_finds_every_kind_of_fault() {
    type Breaks = fn(&mut Mesh<2>);
    let cases: [(Breaks, &str); 15] = [
        (|m| m.nodes[1].x = f64::NAN, "the position of node 1 is not finite"),
        (
            |m| m.connections[4] = [2, 9],
            "connection 4 refers to node 9, but there are 4 nodes (numbered from 0)",
        ),
        (|m| m.cells = cells(&[[0, 1, 7]]), "cell 0 refers to node 7"),
        (|m| m.muscles[0].nodes = vec![0, 4], "muscle M refers to node 4"),
        (|m| m.fixed = vec![4], "the list of fixed nodes refers to node 4"),
        (|m| m.cells = cells(&[[0, 1, 2], [0, 3, 2]]), "cell 1 is turned inside out"),
        (|m| m.nodes[1] = [0.5, 0.5].into(), "cell 0 has no area or volume"),
        (|m| m.cells = cells(&[[0, 1, 2], [1, 2, 0]]), "cell 1 repeats an earlier one"),
        (|m| m.connections[1] = [2, 0], "connection 1 joins nodes in descending order"),
        (|m| m.connections.push([0, 1]), "connection 5 repeats an earlier one"),
        (|m| m.nodes[1] = m.nodes[0], "connection 0 has no length"),
        (|m| m.connections.retain(|c| *c != [1, 2]), "nodes 1 and 2 of cell 0 are not connected"),
        (|m| m.muscles[0].nodes.truncate(1), "muscle M has 1 nodes; it needs at least two"),
        (
            |m| m.muscles[0].nodes = vec![1, 3],
            "muscle M steps from node 1 to node 3, which are not connected",
        ),
        (|m| m.fixed = vec![3, 0], "entry 1 of the fixed nodes is not above the one before"),
    ];
    square().check().unwrap();
    for (breaks, fault) in cases {
        let mut mesh = square();
        breaks(&mut mesh);
        let found = mesh.check().unwrap_err().to_string();
        assert!(found.starts_with(fault), "{found}");
    }
}

#[test]
fn check_knows_a_tetrahedron_from_its_mirror_image() {
    let mut block = fixtures::block(1, 1.0);
    assert_eq!(block.check(), Ok(()));
    let mut corners = block.cells.iter().map(<[usize]>::to_vec).collect::<Vec<_>>();
    corners[2].swap(1, 2);
    block.cells = Cells::new();
    corners.iter().for_each(|cell| assert!(block.cells.push(cell)));
    assert_eq!(block.check(), Err(MeshFault::Inverted { cell: 2 }));
}

#[test]
fn a_bad_anatomy_is_refused_with_line_and_column() {
    let cases = [
        ("GGa = [[0.000, 0.000]", "\" \" = [[0.000, 0.000]", "the muscle name"),
        ("GGm = ", "gga = ", "the muscles GGa and gga differ only by upper and lower case"),
        ("[46.73, 24.45]", "[46.73, nan]", "not finite"),
        ("[46.73, 24.45]", "[46.73, \"x\"]", "string"),
        ("[46.73, 24.45]", "[46.20, 32.50]", "repeats"),
        ("[46.73, 24.45]", "[-30.0, 24.45]", "crosses itself"),
        ("[27.532, 26.245]", "[37.625, -3.066]", "same point"),
        ("[1.490, 42.674]", "[-11.330, 30.030]", "leaves the tissue"),
        ("HGp = [[47.000, -9.000], [42.706, 23.619]]", "HGp = [[47.0, -9.0], [60.0, -9.0]]", "not reach"),
        ("HGp = [[47.000, -9.000]", "HGp = [[47.000, -9.500]", "on no bone"),
        ("HGp = [[47.000, -9.000]", "HGp = [[44.0, 0.0], [47.000, -9.000]", "3 values in place of exactly"),
        ("[46.73, 24.45]", "[46.73, 24.45, 0.0]", "3 values in place of exactly 2"),
        ("[bones]", "[bones]\npalate = [[20.0, 70.0]]", "palate"),
        ("[bones]", "[bone]", "bone"),
        ("outline = [", "outline = [[0.0, 0.0]]\nrest = [", "rest"),
    ];
    fixtures::says(Anatomy::from_toml("[outline]\nrest = 5x\n", "my.toml"), "my.toml:2:8: ");
    for (from, to, says) in cases {
        assert!(REFERENCE.contains(from), "{from}");
        let error = Anatomy::from_toml(&REFERENCE.replacen(from, to, 1), "my.toml").unwrap_err();
        let message = error.to_string();
        let place: Vec<&str> = message.splitn(4, ':').collect();
        let [line, column] = [1, 2].map(|i| place[i].parse::<usize>().expect(&message));
        assert!(place[0] == "my.toml" && line > 1 && column > 0, "{message}");
        assert!(message.contains(says), "expected \"{says}\": {message}");
    }
}

#[test]
fn a_further_point_of_the_outline_can_be_put_on_bone() {
    let text = REFERENCE.replacen("[bones]", "[bones]\nmandible = [[-6.34, 17.10]]", 1);
    let mesh = build(&Anatomy::from_toml(&text, "my.toml").unwrap(), DEFAULT_SPACING_M).unwrap();
    assert_eq!(mesh.fixed.len(), 5);
    let at = tongue_core::body::Point::new(-6.34e-3, 17.10e-3);
    assert!(mesh.fixed.iter().any(|n| (mesh.nodes[*n] - at).norm() < 1e-12));
}

#[test]
fn a_body_is_read_back_from_its_json_with_its_bones() {
    let body = Body::tongue(DEFAULT_SPACING_M).unwrap();
    let record = json::MeshRecord::of(&body, &Model::default()).unwrap();
    let text = serde_json::to_string(&record).unwrap();
    let back = json::read(&text, "my.json").unwrap();
    assert_eq!((&back.mesh, &back.bones), (&body.mesh, &body.bones));
    assert_eq!(back.bone(MANDIBLE).len(), 1);
    let free = (0..).find(|n| !body.mesh.fixed.contains(n)).unwrap();
    let wrong = text.replacen("\"bones\":{\"hyoid\":[", &format!("\"bones\":{{\"hyoid\":[{free},"), 1);
    fixtures::says(json::read(&wrong, "my.json"), "my.json; bone \"hyoid\"");
    // Values that the program computes must be those of the body, with any Poisson's ratio, or be left out.
    let soft = Model { poisson_ratio: 0.3, ..Model::default() };
    let of_soft = serde_json::to_string(&json::MeshRecord::of(&body, &soft).unwrap()).unwrap();
    assert_eq!(json::read(&of_soft, "my.json").unwrap().mesh, body.mesh);
    let mut bare: serde_json::Value = serde_json::from_str(&text).unwrap();
    let computed = ["kappa_s_j", "node_mass_kg", "rest_lengths_mm", "quality"];
    computed.iter().for_each(|key| drop(bare.as_object_mut().unwrap().remove(*key)));
    for connection in bare["connections"].as_array_mut().unwrap() {
        *connection = serde_json::json!({ "nodes": connection["nodes"] });
    }
    assert_eq!(json::read(&bare.to_string(), "my.json").unwrap().mesh, body.mesh);
    for (key, to, expected) in [
        ("\"stiffness_n_per_m\":", "-", "my.json; stiffness_n_per_m of connection 0; program computes it"),
        ("\"rest_length_m\":", "1", "my.json; rest_length_m of connection 0"),
        ("\"kappa_s_j\":", "5", "my.json; kappa_s_j = 51.5"),
        ("\"node_mass_kg\":", "1", "my.json; node_mass_kg"),
        ("\"rest_lengths_mm\":{\"GGa\":", "1", "my.json; rest_lengths_mm of GGa"),
    ] {
        let edited = text.replacen(key, &format!("{key}{to}"), 1);
        assert!(edited != text, "{key}");
        fixtures::says(json::read(&edited, "my.json"), expected);
    }
}
