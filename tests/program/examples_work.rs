//! Every program in `examples/` runs, prints its results and writes its files.

use std::path::Path;
use std::process::{Command, Output};
use std::{env, fs};

/// Runs an example with the folder as its argument, in the profile that this test was built in.
fn made_by(name: &str, folder: &Path) -> Output {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["run", "--quiet", "--locked", "--offline", "--example", name]);
    if env::current_exe().unwrap().components().any(|part| part.as_os_str() == "release") {
        cargo.arg("--release");
    }
    let output = cargo.arg("--").arg(folder).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs an example, checks its files and returns its output.
fn run(name: &str, files: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = made_by(name, folder.path());
    for file in files {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(text.contains(name) || *file == "my.csv", "{file} does not say that {name} made it");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), files.len());
    String::from_utf8(output.stdout).unwrap()
}

/// The number that follows a text.
fn number(text: &str, before: &str) -> f64 {
    let rest = text.split(before).nth(1).unwrap_or_else(|| panic!("no \"{before}\" in {text}"));
    let end = rest.trim_start().find(|c: char| !(c.is_ascii_digit() || ".-".contains(c))).unwrap();
    rest.trim_start()[..end].parse().unwrap()
}

#[test]
fn data_of_ones_own_are_fitted() {
    let said = run("own_data", &["my.csv", "fit.json", "tongue.svg"]);
    assert!(said.contains("contracting: GGa, SGm, HGa") && said.contains("Converged"), "{said}");
    // The stretch in the table, to the digits printed.
    assert!(said.contains(&format!("{:.3} of its length", 40.5 / 44.0)), "{said}");
    assert!(said.contains(&format!("{:.3} of its length", 31.5 / 32.5)), "{said}");
}

#[test]
fn a_body_of_ones_own_shortens_where_it_is_pulled() {
    let said = run("own_body", &["tongue.svg", "tongue.msh"]);
    assert!(said.contains("did you mean \"hyoglossus\"?") && !said.contains("do not trust"), "{said}");
    let lengths = ["0.0", "5.0", "10.0", "20.0"].map(|n| number(&said, &format!("{n} N per metre: ")));
    assert!(lengths.windows(2).all(|w| w[1] < w[0]) && lengths[3] < 0.9, "{lengths:?}");
}

#[test]
fn a_scene_meets_the_palate() {
    let said = run("scene", &["scene.json"]);
    assert!(said.contains("converged: true"), "{said}");
    assert!(number(&said, "on the palate: ") > 0.5, "{said}");
}

#[test]
fn the_valley_is_followed_to_both_ends_without_misfit() {
    let said = run("valley", &["valley.csv", "valley.svg"]);
    assert!(said.contains("2 ratios, 3 tensions") && said.contains("it ends: HGa is slack;"), "{said}");
    let misfit = |line: &str| line.split("misfit ").nth(1)?.split(',').next()?.parse().ok();
    let misfits: Vec<f64> = said.lines().filter_map(misfit).collect();
    assert!(misfits.len() > 5 && misfits.iter().all(|m| *m < 1e-6), "{said}");
}

#[test]
fn tensions_of_a_solid_come_back() {
    let said = run("three_dimensions", &["block.svg", "block.vtu"]);
    for line in ["from 2 lengths", "from 18 surface points"] {
        let found = said.lines().find(|l| l.starts_with(line)).unwrap();
        assert_eq!((number(found, "lengthwise "), number(found, "across ")), (0.23, 0.11), "{found}");
    }
}

/// The recording in `targets/recordings` is the output of the example, up to rounding.
#[test]
fn the_synthetic_recording_is_that_of_the_example() {
    let folder = tempfile::tempdir().unwrap();
    made_by("synthetic_recording", folder.path());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("targets/recordings");
    for file in ["synthetic.tsv", "synthetic_tensions.csv"] {
        let [made, kept] = [folder.path(), root.as_path()].map(|f| fs::read_to_string(f.join(file)).unwrap());
        let cells = |text: &str| text.split(['\t', ',', '\n']).map(str::to_owned).collect::<Vec<_>>();
        let (made, kept) = (cells(&made), cells(&kept));
        assert_eq!(made.len(), kept.len());
        for (a, b) in made.iter().zip(&kept) {
            let apart = a.parse::<f64>().ok().zip(b.parse::<f64>().ok()).map(|(a, b)| (a - b).abs());
            assert!(a == b || apart.is_some_and(|d| d < 2e-4), "{file}: {a} {b}");
        }
    }
}
