//! Crates are layers, each of which uses only the lower ones: those before it in [`LAYERS`] and in the table of CONTRIBUTING.md. The facade
//! stays small enough to be learned: few items, no two types of the same name, few kinds of errors.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The crates from the lowest to the highest. `sound` and other crates that use none of the project's crates are in no layer.
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

/// The names that the facade re-exports, each with its path.
fn facade_names() -> Vec<String> {
    let source = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    let code: Vec<&str> = source.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
    let mut names = Vec::new();
    for statement in code.join("\n").split("pub use ").skip(1) {
        let tree = statement.split_once(';').unwrap().0;
        if tree.starts_with("crate::") {
            continue; // The prelude names what stands elsewhere already.
        }
        let (path, leaves) = match tree.split_once('{') {
            Some((path, leaves)) => (path.trim_end_matches("::"), leaves.trim_end_matches('}')),
            None => tree.rsplit_once("::").unwrap(),
        };
        for leaf in leaves.split(',').map(str::trim).filter(|leaf| !leaf.is_empty()) {
            names.push(format!("{path}::{leaf}"));
        }
    }
    names
}

#[test]
fn the_facade_offers_at_most_220_items_by_name() {
    let names = facade_names();
    assert!(names.len() > 150, "only {} names were found: is the facade still lists of names?", names.len());
    assert!(names.len() <= 220, "{} items: leave out what no user of the library needs", names.len());
    // A module or a star would hide what it offers.
    let is_whole =
        |n: &&String| n.ends_with('*') || (n.matches("::").count() == 1 && !n.ends_with("VERSION"));
    let whole: Vec<_> = names.iter().filter(is_whole).collect();
    assert!(whole.is_empty(), "name what is meant in place of {whole:?}");
}

#[test]
fn the_facade_has_at_most_twelve_types_of_errors() {
    let names = facade_names();
    let errors: Vec<_> = names.iter().filter(|n| n.ends_with("Error")).collect();
    assert!(errors.len() <= 12, "{} types of errors: {errors:?}", errors.len());
}

/// The names of types, each with the files that define it, except types inside functions and tests.
fn types() -> BTreeMap<String, Vec<String>> {
    let kinds = ["struct ", "enum ", "trait ", "type ", "union "];
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (path, source) in ["src", "crates"].into_iter().flat_map(super::run::sources) {
        for line in source.lines().take_while(|line| *line != "mod tests {") {
            let code =
                line.strip_prefix("pub").map_or(line, |l| l.split_once(' ').map_or(l, |(_, rest)| rest));
            let Some(rest) = kinds.into_iter().find_map(|kind| code.strip_prefix(kind)) else { continue };
            let name = rest.split(|c: char| !c.is_alphanumeric()).next().unwrap();
            all.entry(name.to_owned()).or_default().push(path.clone());
        }
    }
    all
}

#[test]
fn names_of_types_have_one_meaning_in_all_crates_and_there_are_few_types_of_errors() {
    let types = types();
    assert!(types.len() > 600, "only {} types were found", types.len());
    // Each command of the program has its `Arguments`.
    let several = types.iter().filter(|(name, paths)| paths.len() > 1 && *name != "Arguments");
    let several: Vec<_> = several.collect();
    assert!(several.is_empty(), "names with several meanings: {several:?}");
    let errors: Vec<_> = types.keys().filter(|name| name.ends_with("Error")).collect();
    assert!(errors.len() <= 15, "{} types of errors: {errors:?}", errors.len());
}

/// The names of types and constants that a file imports from its own crate, except for its tests and for re-exports.
fn imports(source: &str) -> Vec<&str> {
    let code = source.split("\nmod tests {").next().unwrap();
    let uses = code.split("\nuse ").skip(1).filter_map(|rest| rest.split(';').next());
    let own = uses.filter(|path| path.starts_with("super::") || path.starts_with("crate::"));
    own.flat_map(|path| path.split(|c: char| !c.is_alphanumeric() && c != '_'))
        .filter(|word| word.starts_with(char::is_uppercase))
        .collect()
}

#[test]
fn no_files_of_a_crate_take_types_and_constants_from_each_other_in_a_circle() {
    // A mod.rs has what its files share and re-exports what they offer, so that arrows to and from it would always be circles.
    let is_face = |path: &str| ["mod.rs", "lib.rs", "main.rs"].iter().any(|end| path.ends_with(end));
    let all = ["src", "crates", "python/src"].into_iter().flat_map(super::run::sources);
    // The crate of each file, its path in the crate, and its source.
    let files: Vec<(String, String, String)> = Vec::from_iter(all.filter_map(|(path, source)| {
        let (of_crate, file) = path.strip_prefix(env!("CARGO_MANIFEST_DIR"))?.split_once("/src/")?;
        (!is_face(file)).then(|| (of_crate.to_owned(), file.to_owned(), source))
    }));
    let mut defined: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
    for (number, (of_crate, _, source)) in files.iter().enumerate() {
        for line in source.lines().filter_map(|line| line.strip_prefix("pub")) {
            let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty());
            let is_item = |word: &str| ["struct", "enum", "trait", "type", "const", "static"].contains(&word);
            if words.by_ref().take(4).any(is_item)
                && let Some(name) = words.next()
            {
                defined.entry((of_crate, name)).or_default().push(number);
            }
        }
    }
    let mut uses: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, (of_crate, _, source)) in files.iter().enumerate() {
        let known = imports(source).into_iter().filter_map(|name| defined.get(&(of_crate.as_str(), name)));
        let only = known.filter(|places| places.len() == 1 && places[0] != number).map(|places| places[0]);
        uses.insert(number, only.collect());
    }
    assert!(uses.values().map(Vec::len).sum::<usize>() > 1000, "few imports were found");
    // Files that use none of the remaining ones are taken away, until only circles and files that use them are left.
    while let Some(&free) = uses.keys().find(|n| !uses[*n].iter().any(|used| uses.contains_key(used))) {
        uses.remove(&free);
    }
    let left: Vec<&str> = uses.keys().map(|number| files[*number].1.as_str()).collect();
    assert!(
        left.is_empty(),
        "a circle, or files that use one: {left:?}; move what both use to the lower file"
    );
}
