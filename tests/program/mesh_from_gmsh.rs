//! A mesh from Gmsh in every command: the same answers as from the original body, and exit statuses for
//! faults.

use std::path::Path;
use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use serde_json::Value;

fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gmsh").join(name).display().to_string()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("tongue-fit").unwrap().current_dir(folder).args(arguments).output().unwrap()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let done = run(folder, arguments);
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

/// Exit status and message of a command that is refused.
fn refused(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let done = run(folder, arguments);
    assert!(done.stdout.is_empty(), "{}", String::from_utf8_lossy(&done.stdout));
    (done.status.code(), String::from_utf8(done.stderr).unwrap())
}

#[test]
fn reading_a_mesh_tells_what_to_look_at_and_refuses_what_cannot_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = |name: &str, more: &[&str]| {
        let done = run(folder.path(), &[&["mesh", "--mesh", &fixture(name)], more].concat());
        (done.status.code(), String::from_utf8(done.stdout).unwrap(), String::from_utf8(done.stderr).unwrap())
    };
    let (status, text, notes) = mesh("millimetres.msh", &["--mesh-unit", "mm"]);
    assert!(
        status == Some(0) && text.contains("GGa                         42.7 mm") && notes.is_empty(),
        "{text}{notes}"
    );
    let (status, _, notes) = mesh("broken/thin.msh", &[]);
    assert!(
        status == Some(0) && notes.contains("the smallest angle is") && notes.contains("no muscle GGm"),
        "{notes}"
    );
    for (name, told) in [
        ("broken/no_bone.msh", "no_bone.msh: no bone holds the body"),
        ("broken/misspelt.msh", "misspelt.msh:6: the physical group \"GGaa\""),
        ("millimetres.msh", "--mesh-unit mm"),
    ] {
        let (status, text, notes) = mesh(name, &[]);
        assert!(status == Some(1) && text.is_empty() && notes.contains(told), "{name}: {notes}");
    }
}

#[test]
fn every_command_takes_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let file = fixture("tongue_41.msh");
    let mesh = json(folder.path(), &["mesh", "--mesh", &file, "--json"]);
    assert_eq!(mesh["triangles"].as_array().unwrap().len(), 180);
    let simulated = json(folder.path(), &["simulate", "--mesh", &file, "--tension", "GGa=10", "--json"]);
    assert!(simulated["stretches"]["GGa"].as_f64().unwrap() < 0.9);
    let moved = [
        "simulate",
        "--mesh",
        &file,
        "--tension",
        "GGa=10",
        "--trajectory",
        "--t-end",
        "0.01",
        "--frames",
        "2",
        "--json",
    ];
    assert_eq!(json(folder.path(), &moved)["status"], "completed");
    let fit = json(folder.path(), &["--vowel", "a", "--mesh", &file, "--json"]);
    assert_eq!(fit["status"], "converged");
    let own = json(folder.path(), &["--vowel", "a", "--json"]);
    for muscle in ["GGa", "SGm", "HGa"] {
        let tension = |fit: &Value| fit["tensions_n"][muscle].as_f64().unwrap();
        assert!(
            (tension(&fit) - tension(&own)).abs() < 1.0,
            "{muscle}: {} against {}",
            tension(&fit),
            tension(&own)
        );
    }
    let batch = [
        "batch",
        "--mesh",
        &file,
        "--subjects",
        "S2",
        "--vowels",
        "a",
        "--draws",
        "2",
        "--subsets",
        "1",
        "--json",
    ];
    assert!(!json(folder.path(), &batch)["fits"].as_array().unwrap().is_empty());
}

#[test]
fn incompatible_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = fixture("tongue_41.msh");
    let refused = |arguments: &[&str]| refused(folder.path(), arguments);
    for other in [["--h", "4mm"], ["--anatomy", "a.toml"]] {
        assert_eq!(refused(&[&["mesh", "--mesh", &file][..], &other].concat()).0, Some(2), "{other:?}");
    }
    assert_eq!(refused(&["mesh", "--mesh-unit", "mm"]).0, Some(2), "a unit of no file");
    let (status, message) =
        refused(&["simulate", "--mesh", &fixture("millimetres.msh"), "--tension", "GGa=1"]);
    assert!(status == Some(1) && message.contains("--mesh-unit mm"), "{message}");
    let (status, message) =
        refused(&["simulate", "--mesh", &fixture("cylinder_41.msh"), "--tension", "GGa=1"]);
    assert!(status == Some(1) && message.contains("[body.mesh] file ="), "{message}");
    let in_cm = tongue_fit::body::REFERENCE
        .lines()
        .map(|line| if line.starts_with('#') { String::new() } else { tenfold_smaller(line) + "\n" })
        .collect::<String>();
    std::fs::write(folder.path().join("cm.toml"), in_cm).unwrap();
    let (status, message) = refused(&["mesh", "--anatomy", "cm.toml"]);
    let says = |what: &str| message.contains(what);
    assert!(
        status == Some(1) && says("cm.toml: the mesh spacing 5.5 mm") && says("millimetres?"),
        "{message}"
    );
    let (status, message) = refused(&["mesh", "--mesh", "missing.msh"]);
    assert!(status == Some(1) && message.contains("missing.msh"), "{message}");
    let (status, message) = refused(&["mesh", "--mesh", &fixture("broken/branch.msh")]);
    assert!(
        status == Some(1) && message.contains("branch.msh:6: muscle GGa branches at node 6"),
        "{message}"
    );
}

#[test]
fn a_scene_takes_a_mesh_in_the_plane_and_in_space() {
    let folder = tempfile::tempdir().unwrap();
    json(folder.path(), &["mesh", "--json", "--out", "."]);
    let scene = |name: &str, body: &str, muscle: &str, more: &str| {
        let text = format!(
            "title = \"t\"\nwant = \"lengths\"\n{body}\n[tensions_n]\n{muscle}\n[effects]\nincompressibility = true\n{more}"
        );
        std::fs::write(folder.path().join(name), text).unwrap();
        json(folder.path(), &["scene", "run", name, "--json"])
    };
    let own = scene("own.toml", "[body.tongue]", "GGp = 20.0", "");
    let same = scene("same.toml", "[body.mesh]\nfile = \"mesh.msh\"", "GGp = 20.0", "");
    assert_eq!(own["positions_m"], same["positions_m"]);
    let jaw = "jaw = { opening_deg = 3.0 }\n";
    let own = scene("own.toml", "[body.tongue]", "GGp = 20.0", jaw);
    let same = scene("same.toml", "[body.mesh]\nfile = \"mesh.msh\"", "GGp = 20.0", jaw);
    assert_eq!(own["positions_m"], same["positions_m"], "the bones keep their names");

    // The groups of bones determine which nodes a jaw carries.
    let theirs = format!("[body.mesh]\nfile = \"{}\"", fixture("tongue_41_binary.msh"));
    let shut = scene("shut.toml", &theirs, "GGp = 20.0", "");
    let open = scene("open.toml", &theirs, "GGp = 20.0", jaw);
    assert_ne!(shut["positions_m"], open["positions_m"]);
    let in_mm = format!("[body.mesh]\nfile = \"{}\"\nunit = \"mm\"", fixture("millimetres.msh"));
    scene("mm.toml", &in_mm, "GGp = 20.0", "");

    let solid = format!("[body.mesh]\nfile = \"{}\"", fixture("cylinder_22_binary.msh"));
    let solid = scene("solid.toml", &solid, "axial = 0.05", "");
    assert_eq!(solid["positions_m"][0].as_array().unwrap().len(), 3);

    let (status, message) = {
        let text = "title = \"t\"\nwant = \"lengths\"\n[body.mesh]\nfile = \"mesh.json\"\nunit = \"mm\"\n";
        std::fs::write(folder.path().join("slip.toml"), text).unwrap();
        refused(folder.path(), &["scene", "run", "slip.toml"])
    };
    assert!(status == Some(1) && message.contains("leave out [body.mesh] unit"), "{message}");
}

/// The text with every number with a decimal point divided by ten, as in a file of centimetres.
fn tenfold_smaller(line: &str) -> String {
    let mut out = String::new();
    for word in line.split_inclusive(&['[', ']', ',', ' ', '='][..]) {
        let number = word.trim_end_matches(&['[', ']', ',', ' ', '='][..]);
        match number.parse::<f64>() {
            Ok(value) if number.contains('.') => out += &format!("{}{}", value / 10.0, &word[number.len()..]),
            _ => out += word,
        }
    }
    out
}
