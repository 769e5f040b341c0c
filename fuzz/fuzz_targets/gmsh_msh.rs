//! Whatever the bytes, reading a Gmsh mesh ends in a body that passes its checks or in an error, and a body that is written
//! reads back the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::body::Body;
use tongue_fit::body::gmsh::{self, File, Unit};

fuzz_target!(|bytes: &[u8]| match gmsh::read(bytes, "fuzz.msh", Unit::M) {
    Ok(File::Flat(content)) => hold(&content.body),
    Ok(File::Solid(content)) => hold(&content.body),
    Err(error) => assert!(!error.to_string().is_empty()),
});

fn hold<const D: usize>(body: &Body<D>) {
    body.mesh.check().expect("a body that was read passes its checks");
    let again = gmsh::read(gmsh::write(&body.mesh, &body.bones).as_bytes(), "again.msh", Unit::M);
    let cells = match again.expect("what was written is read") {
        File::Flat(again) => again.body.mesh.cells.len(),
        File::Solid(again) => again.body.mesh.cells.len(),
    };
    assert_eq!(cells, body.mesh.cells.len());
}
