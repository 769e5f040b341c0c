//! `tongue-fit scene` as its users meet it.

use serde_json::Value;

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
