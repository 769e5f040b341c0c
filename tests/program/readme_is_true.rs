//! What the README shows, the program prints.

use std::process::Command;

const README: &str = include_str!("../../README.md");

#[test]
fn the_table_in_the_readme_is_what_the_main_command_prints() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(assert_cmd::cargo::cargo_bin("tongue-fit"))
        .args(["--vowel", "a"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let shown = README.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    // All but the milliseconds, which are the machine's.
    let lines = |text: &str| -> Vec<String> {
        text.lines().map(|l| l.split(" equilibria in ").next().unwrap_or(l).to_owned()).collect()
    };
    assert_eq!(lines(shown), lines(&printed));
}

#[test]
fn every_file_that_the_readme_links_to_exists() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let targets = README.split("](").skip(1).chain(README.split("src=\"").skip(1));
    let mut seen = 0;
    for target in targets {
        let path = target.split([')', '"']).next().unwrap();
        if !path.starts_with("http") && !path.starts_with('#') {
            assert!(root.join(path).exists(), "{path}");
            seen += 1;
        }
    }
    assert!(seen >= 4);
}
