//! The crates are layers: each may use only those below it.

use std::fs;
use std::path::Path;

/// The crates from the lowest to the highest. `sound` and other crates that use none of the project's are in
/// no layer.
const LAYERS: [&str; 5] = ["core", "input", "infer", "files", "study"];

fn dependencies(manifest: &Path) -> Vec<String> {
    let manifest: toml::Table = fs::read_to_string(manifest).unwrap().parse().unwrap();
    let tables = ["dependencies", "dev-dependencies", "build-dependencies"].map(|t| manifest.get(t));
    let names = tables.into_iter().flatten().filter_map(toml::Value::as_table).flat_map(toml::Table::keys);
    names.filter_map(|name| name.strip_prefix("tongue-").map(str::to_owned)).collect()
}

#[test]
fn no_crate_imports_from_a_layer_above_its_own() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let place = |name: &str| LAYERS.iter().position(|layer| *layer == name);
    let mut seen = 0;
    for entry in fs::read_dir(&crates).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let used = dependencies(&crates.join(&name).join("Cargo.toml"));
        match place(&name) {
            Some(own) => {
                seen += 1;
                for other in used.iter().filter_map(|other| place(other)) {
                    assert!(other < own, "the crate {name} uses {}, which stands above it", LAYERS[other]);
                }
            }
            None => {
                let known: Vec<_> = used.iter().filter(|other| place(other).is_some()).collect();
                assert!(known.is_empty(), "the crate {name} uses {known:?}: give it a place in LAYERS");
            }
        }
    }
    assert_eq!(seen, LAYERS.len(), "a layer has no crate");
}

#[test]
fn the_program_reaches_the_crates_through_the_facade() {
    for (path, source) in super::run::sources("src/cli") {
        for import in LAYERS.map(|layer| format!("tongue_{layer}::")) {
            assert!(!source.contains(&import), "{path}: use tongue_fit:: in place of {import}");
        }
    }
}
