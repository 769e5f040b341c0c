//! `tongue-fit scene` as its users meet it.

use serde_json::{Value, json};

use super::run::{json, refused, run};

#[test]
fn every_listed_scene_can_be_explained_in_100_columns() {
    let folder = tempfile::tempdir().unwrap();
    let list = json(folder.path(), "scene list --json");
    let names: Vec<&str> =
        list["scenes"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert!(names.len() >= 15 && names.contains(&"vowel-a"), "{names:?}");
    for name in names {
        let done = run(folder.path(), &format!("scene explain {name}"));
        assert_eq!(done.status, Some(0), "{name}");
        for line in done.out.lines() {
            assert!(line.chars().count() <= 100, "{name}: {line}");
        }
    }
}

#[test]
fn a_run_gives_the_lengths_of_simulate_and_writes_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = json(folder.path(), "scene run vowel-a --json --out out");
    let tensions = "--tension GGa=12 --tension SGm=11.5 --tension HGa=4.5";
    let simulated = json(folder.path(), &format!("simulate --json {tensions}"));
    for muscle in scene["muscles"].as_array().unwrap() {
        let name = muscle["muscle"].as_str().unwrap();
        assert_eq!(muscle["length_mm"], simulated["lengths_mm"][name], "{name}");
    }
    let written: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/vowel-a.json")).unwrap())
            .unwrap();
    assert_eq!(written, scene);
    let picture = std::fs::read_to_string(folder.path().join("out/vowel-a.svg")).unwrap();
    assert!(roxmltree::Document::parse(&picture).is_ok());
}

#[test]
fn a_mesh_that_was_printed_is_a_body_again_and_no_result_takes_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = run(folder.path(), "mesh --json");
    std::fs::write(folder.path().join("mesh.json"), &mesh.out).unwrap();
    let scene = |name: &str, body: &str| {
        let effects =
            "[tensions_n]\nGGp = 20.0\n[effects]\nincompressibility = true\njaw = { opening_deg = 3.0 }\n";
        let text = format!("title = \"t\"\nwant = \"lengths\"\n{body}\n{effects}");
        std::fs::write(folder.path().join(name), text).unwrap();
    };
    scene("mesh.toml", "[body.mesh]\nfile = \"mesh.json\"");
    scene("own.toml", "[body.tongue]");
    let [a, b] = ["mesh", "own"].map(|name| json(folder.path(), &format!("scene run {name}.toml --json")));
    assert_eq!((&a["muscles"], &a["positions_m"]), (&b["muscles"], &b["positions_m"]));
    // The results of mesh.toml would have the name of its mesh.
    let message = refused(folder.path(), "scene run mesh.toml --out .");
    assert!(message.contains("mesh.json") && message.contains("--out"), "{message}");
    assert_eq!(std::fs::read_to_string(folder.path().join("mesh.json")).unwrap(), mesh.out);
}

#[test]
fn a_body_that_lies_wrong_in_the_head_or_is_of_another_size_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut body: Value = serde_json::from_str(&run(folder.path(), "mesh --json").out).unwrap();
    // Keys that follow from the nodes are left out, and where nodes are no longer fixed, the bones too.
    for key in ["kappa_s_j", "node_mass_kg", "rest_lengths_mm"] {
        body.as_object_mut().unwrap().remove(key);
    }
    for connection in body["connections"].as_array_mut().unwrap() {
        *connection = json!({ "nodes": connection["nodes"] });
    }
    let told = |change: &dyn Fn(&mut Value)| {
        let mut body = body.clone();
        change(&mut body);
        std::fs::write(folder.path().join("body.json"), body.to_string()).unwrap();
        let done = run(folder.path(), "mesh --mesh body.json");
        assert_eq!(done.status, Some(0), "{}", done.err);
        done.err
    };
    let moved = |to: fn(f64, f64) -> [f64; 2]| {
        told(&move |body| {
            let at = |place: &Value| [0, 1].map(|axis| place[axis].as_f64().unwrap());
            for place in body["nodes_m"].as_array_mut().unwrap() {
                let [x, y] = at(place);
                *place = to(x, y).to_vec().into();
            }
            let [a, b] = [to(1.0, 0.0), to(0.0, 1.0)];
            if a[0] * b[1] < a[1] * b[0] {
                body["triangles"]
                    .as_array_mut()
                    .unwrap()
                    .iter_mut()
                    .for_each(|t| t.as_array_mut().unwrap().reverse());
            }
        })
    };
    assert_eq!(moved(|x, y| [x, y]), "");
    for (said, part) in [
        (moved(|x, y| [-x, y]), "the mental spine lies behind the hyoid"),
        (moved(|x, y| [x, -y]), "the tissue lies below the mental spine and the hyoid"),
        (moved(|x, y| [y, x]), "lie one above the other"),
        (moved(|x, y| [2.0 * x, 2.0 * y]), "all muscles are 2.0 times as long as an adult's"),
    ] {
        assert!(said.contains(part) && said.matches("body.json: ").count() == 1, "{part}: {said}");
    }
    let exchanged = told(&|body| {
        let muscles = body["muscles"].as_object_mut().unwrap();
        let [a, b] = ["GGa", "SGm"].map(|name| muscles[name].clone());
        (muscles["GGa"], muscles["SGm"]) = (b, a);
    });
    assert!(exchanged.contains("GGa and SGm are exchanged"), "{exchanged}");
    let free = told(&|body| (body["bones"], body["fixed"]) = (json!({}), json!([0])));
    assert!(free.contains("only one node is held"), "{free}");
}

#[test]
fn reading_a_mesh_tells_what_to_look_at() {
    for (mesh, told) in
        [("millimetres.msh' --mesh-unit mm", None), ("broken/thin.msh'", Some("the smallest angle is"))]
    {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh/");
        let done = run(std::path::Path::new("."), &format!("mesh --mesh '{path}{mesh}"));
        assert!(done.status == Some(0) && done.out.contains("GGa    "), "{}", done.out);
        assert!(told.map_or(done.err.is_empty(), |told| done.err.contains(told)), "{}", done.err);
    }
}
