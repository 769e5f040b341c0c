//! Whatever the text, reading an anatomy ends in an anatomy or in an error, and meshing it in a mesh that passes its checks or
//! in an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::body::{self, Anatomy};

fuzz_target!(|text: &str| {
    let Ok(anatomy) = Anatomy::from_toml(text, "fuzz.toml") else { return };
    if let Ok(mesh) = body::build(&anatomy, body::DEFAULT_SPACING_M) {
        mesh.check().expect("a mesh that was built passes its checks");
    }
});
