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
    let plan = json(folder.path(), "scene explain vowel-a --json");
    let inertia = plan["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "inertia").unwrap();
    assert_eq!(inertia["simulated"], false);
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
    assert!(scene["time_by_effect"].as_array().unwrap().len() == 3);
    let written: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/vowel-a.json")).unwrap())
            .unwrap();
    assert_eq!(written, scene);
    let picture = std::fs::read_to_string(folder.path().join("out/vowel-a.svg")).unwrap();
    assert!(roxmltree::Document::parse(&picture).is_ok());
}

#[test]
fn a_mesh_file_is_the_body_that_it_was_printed_from() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = run(folder.path(), "mesh --json");
    std::fs::write(folder.path().join("mesh.json"), &mesh.out).unwrap();
    let scene = |body: &str| {
        format!(
            "title = \"t\"\nwant = \"lengths\"\n{body}\n[tensions_n]\nGGp = 20.0\n[effects]\nincompressibility = true\n"
        )
    };
    std::fs::write(folder.path().join("a.toml"), scene("[body.mesh]\nfile = \"mesh.json\"")).unwrap();
    std::fs::write(folder.path().join("b.toml"), scene("[body.tongue]")).unwrap();
    let [a, b] = ["a.toml", "b.toml"].map(|file| json(folder.path(), &format!("scene run {file} --json")));
    assert_eq!(a["muscles"], b["muscles"]);
    assert_eq!(a["positions_m"], b["positions_m"]);

    let mut bare = mesh.record();
    bare["triangles"] = Value::Array(Vec::new());
    std::fs::write(folder.path().join("bare.json"), bare.to_string()).unwrap();
    std::fs::write(folder.path().join("bare.toml"), scene("[body.mesh]\nfile = \"bare.json\"")).unwrap();
    let message = refused(folder.path(), "scene run bare.toml");
    assert!(message.contains("bare.json") && message.contains("no triangles"), "{message}");

    // The results of mesh.toml would have the name of its mesh.
    std::fs::copy(folder.path().join("a.toml"), folder.path().join("mesh.toml")).unwrap();
    let message = refused(folder.path(), "scene run mesh.toml --out .");
    assert!(message.contains("mesh.json") && message.contains("--out"), "{message}");
    assert_eq!(std::fs::read_to_string(folder.path().join("mesh.json")).unwrap(), mesh.out);
}
