//! A mesh from Gmsh in every command: the same answers as from the original body, and exit statuses for
//! faults.

use super::run::{json, run};

fn fixture(name: &str) -> String {
    format!("{}/tests/gmsh/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn reading_a_mesh_tells_what_to_look_at() {
    for (mesh, told) in
        [("millimetres.msh' --mesh-unit mm", None), ("broken/thin.msh'", Some("the smallest angle is"))]
    {
        let done = run(std::path::Path::new("."), &format!("mesh --mesh '{}", fixture(mesh)));
        assert!(done.status == Some(0) && done.out.contains("GGa    "), "{}", done.out);
        assert!(told.map_or(done.err.is_empty(), |told| done.err.contains(told)), "{}", done.err);
    }
}

#[test]
fn a_scene_takes_a_mesh_in_the_plane_and_in_space() {
    let folder = tempfile::tempdir().unwrap();
    json(folder.path(), "mesh --json --out .");
    let scene = |name: &str, body: &str, muscle: &str, more: &str| {
        let text = format!(
            "title = \"t\"\nwant = \"lengths\"\n{body}\n[tensions_n]\n{muscle}\n[effects]\nincompressibility = true\n{more}"
        );
        std::fs::write(folder.path().join(name), text).unwrap();
        json(folder.path(), &format!("scene run {name} --json"))
    };
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
}
