//! What the README shows, the program prints.

use super::run::run;

const README: &str = include_str!("../../README.md");

#[test]
fn the_table_in_the_readme_is_what_the_main_command_prints() {
    let folder = tempfile::tempdir().unwrap();
    let printed = run(folder.path(), "--vowel a").out;
    let shown = README.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert_eq!(shown, printed);
}

/// The front page's program is compiled and run with the documentation.
#[test]
fn the_program_in_the_readme_is_that_of_the_front_page_and_has_at_most_fifteen_lines() {
    let shown = README.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let page: String = include_str!("../../src/lib.rs")
        .lines()
        .take_while(|line| line.starts_with("//!"))
        .filter(|line| !line.starts_with("//! # "))
        .map(|line| line.trim_start_matches("//!").trim_start().to_owned() + "\n")
        .collect();
    let unindented: String = shown.lines().map(|line| line.trim_start().to_owned() + "\n").collect();
    assert!(page.contains(&format!("```\n{unindented}```")), "{page}");
    let lines = shown.lines().filter(|line| !line.is_empty()).count();
    assert!(lines <= 15, "{lines}");
}

/// The tests of the Python module run its own README.
#[test]
fn the_python_program_in_the_readme_is_one_of_the_modules_own_readme() {
    let shown = README.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert!(include_str!("../../python/README.md").contains(&format!("```python\n{shown}```")), "{shown}");
}

/// The entry for those who cite has the version of the package and names the same sources as the README.
#[test]
fn the_citation_is_of_this_version() {
    let citation = include_str!("../../CITATION.cff");
    assert!(citation.contains(concat!("\nversion: ", env!("CARGO_PKG_VERSION"), "\n")));
    for source in ["Takano", "Kato", "49", "2007", "2014"] {
        assert!(citation.contains(source) && README.contains(source), "{source}");
    }
}
