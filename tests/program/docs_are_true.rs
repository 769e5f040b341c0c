//! Every command in the guide and the README works on the files shown there and prints the output shown.
//!
//! The fenced blocks are read. One that opens with a kind and a name (```` ```csv my.csv ````) is a file. In ```` ```console ```` a line
//! that begins with `$ ` is a command, and the lines after it are its output; `...` stands for any lines, or within a line for any text.
//! Commands of one page run in one folder, one after the other, and end with status 0 unless `$ echo $?` and another
//! status follow.
#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;

use super::run::run;

/// Commands that would install something or need another tool; all others must be tongue-fit.
const NOT_RUN: [&str; 2] = ["cargo ", ".ci/"];

struct Block<'a> {
    /// The text after the backquotes that open the block.
    info: &'a str,
    lines: Vec<&'a str>,
}

fn blocks(text: &str) -> Vec<Block<'_>> {
    let mut blocks = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(info) = line.strip_prefix("```") {
            blocks.push(Block { info, lines: lines.by_ref().take_while(|l| *l != "```").collect() });
        }
    }
    blocks
}

/// Commands with the output shown for them.
fn commands<'a>(block: &Block<'a>) -> Vec<(&'a str, Vec<&'a str>)> {
    let mut all: Vec<(&str, Vec<&str>)> = Vec::new();
    for &line in &block.lines {
        match (line.strip_prefix("$ "), all.last_mut()) {
            (Some(command), _) => all.push((command, Vec::new())),
            (None, Some((_, shown))) => shown.push(line),
            (None, None) => panic!("\"{line}\" stands before any command"),
        }
    }
    all
}

/// Whether the printed output is the output shown.
fn agrees(shown: &[&str], printed: &[&str]) -> bool {
    match (shown.split_first(), printed.split_first()) {
        (None, _) => printed.is_empty(),
        (Some((&"...", rest)), _) => (0..=printed.len()).any(|skipped| agrees(rest, &printed[skipped..])),
        (Some((s, shown)), Some((p, printed))) => line_agrees(s, p) && agrees(shown, printed),
        (Some(_), None) => false,
    }
}

fn line_agrees(shown: &str, printed: &str) -> bool {
    let mut rest = printed;
    let parts: Vec<&str> = shown.split("...").collect();
    for (i, part) in parts.iter().enumerate() {
        let Some(at) = rest.find(part).filter(|at| i > 0 || *at == 0) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.is_empty() || parts.last() == Some(&"") && parts.len() > 1
}

fn run_page(page: &Path) -> usize {
    let text = fs::read_to_string(page).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let bin = cargo_bin("tongue-fit");
    let path = format!("{}:{}", bin.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let mut ran = 0;
    for block in blocks(&text) {
        if let Some((_, name)) = block.info.split_once(' ') {
            fs::write(folder.path().join(name), block.lines.join("\n") + "\n").unwrap();
        }
        if !block.info.starts_with("console") {
            continue;
        }
        let commands = commands(&block);
        for (nth, (command, shown)) in commands.iter().enumerate() {
            if *command == "echo $?" || NOT_RUN.iter().any(|c| command.starts_with(c)) {
                continue;
            }
            assert!(command.starts_with("tongue-fit "), "{command} in {} is not run", page.display());
            let mut shell = Command::new("sh");
            shell.args(["-c", &format!("{command} 2>&1")]).current_dir(folder.path()).env("PATH", &path);
            let output = shell.output().unwrap();
            let printed = String::from_utf8(output.stdout).unwrap();
            let status = match commands.get(nth + 1) {
                Some((next, shown)) if *next == "echo $?" => shown[0].parse().unwrap(),
                _ => 0,
            };
            assert_eq!(output.status.code(), Some(status), "{command}\n{printed}");
            let told = format!("{command} is shown to print\n{}\nbut prints\n{printed}", shown.join("\n"));
            assert!(agrees(shown, &printed.lines().collect::<Vec<_>>()), "{told}");
            ran += 1;
        }
    }
    ran
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().path()).collect();
    pages.sort();
    pages.push(root().join("README.md"));
    pages.push(root().join("CONTRIBUTING.md"));
    pages
}

#[test]
fn every_command_shown_works_and_prints_what_is_shown() {
    let ran: Vec<usize> = pages().iter().map(|page| run_page(page)).collect();
    assert!(ran.iter().sum::<usize>() >= 15, "{ran:?}");
}

/// Commands within lines are not run, because some take minutes. Their options must exist: with `--help` behind them help is printed only
/// after the options were parsed.
#[test]
fn every_command_within_a_line_has_options_that_exist() {
    let folder = tempfile::tempdir().unwrap();
    let mut seen = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        // Between fences every second piece is code; fenced blocks are removed first.
        let prose: String = text.split("```").step_by(2).collect();
        for code in prose.split('`').skip(1).step_by(2).filter(|c| c.starts_with("tongue-fit ")) {
            let line = format!("{} --help", code.trim_start_matches("tongue-fit "));
            assert_eq!(run(folder.path(), &line).status, Some(0), "`{code}` in {}", page.display());
            seen += 1;
        }
    }
    assert!(seen >= 15, "{seen}");
}

/// The anchor of a heading.
fn place_of(heading: &str) -> String {
    let kept = heading.trim_start_matches(['#', ' ']).to_lowercase();
    kept.chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

#[test]
fn every_file_and_heading_that_the_pages_link_to_exists() {
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for target in text.split("](").skip(1).chain(text.split("src=\"").skip(1)) {
            let target = target.split([')', '"']).next().unwrap();
            let (path, place) = target.split_once('#').unwrap_or((target, ""));
            if path.starts_with("http") {
                continue;
            }
            let file = if path.is_empty() { page.clone() } else { page.parent().unwrap().join(path) };
            assert!(file.exists(), "{path} in {}", page.display());
            if !place.is_empty() {
                let text = fs::read_to_string(&file).unwrap();
                let mut places = text.lines().filter(|l| l.starts_with('#')).map(place_of);
                assert!(places.any(|p| p == place), "#{place} of {path} in {}", page.display());
            }
        }
    }
}

#[test]
fn every_path_that_contributors_are_sent_to_exists() {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let prose: String = text.split("```").step_by(2).collect();
    let mut seen = 0;
    for path in prose.split('`').skip(1).step_by(2).filter(|c| c.contains('/') && !c.contains(' ')) {
        assert!(root().join(path).exists(), "{path}");
        seen += 1;
    }
    assert!(seen >= 30, "{seen}");
    // The table of what 95 % intervals hold names the tests that count it.
    let model = fs::read_to_string(root().join("docs/model.md")).unwrap();
    let tests: Vec<&str> = model.split('`').filter(|c| c.starts_with("tests/")).collect();
    assert!(tests.len() >= 7 && tests.iter().all(|path| root().join(path).exists()), "{tests:?}");
}

/// Checks paragraphs and list items, not tables, headings and fenced blocks.
#[test]
fn paragraphs_are_short_enough_to_be_read() {
    let mut seen = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        let prose: String = text.split("```").step_by(2).collect();
        let is_item =
            |l: &str| l.starts_with("- ") || l.split_once(". ").is_some_and(|(n, _)| n.parse::<u8>().is_ok());
        let mut words = 0;
        for line in prose.lines() {
            words =
                if line.is_empty() || line.starts_with(['|', '#', '`']) || is_item(line) { 0 } else { words };
            words += if line.starts_with(['|', '#']) { 0 } else { line.split_whitespace().count() };
            assert!(words < 120, "{words} words in {}: {line}", page.display());
            seen += usize::from(words > 0);
        }
    }
    assert!(seen > 100, "{seen}");
}

const README: &str = include_str!("../../README.md");

#[test]
fn the_table_in_the_readme_is_what_the_main_command_prints() {
    let folder = tempfile::tempdir().unwrap();
    let printed = run(folder.path(), "--vowel a").out;
    let shown = README.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert_eq!(shown, printed);
}

/// The program of the front page is compiled and run with the documentation.
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

/// The Python module's tests run its own README.
#[test]
fn the_python_program_in_the_readme_is_one_of_the_modules_own_readme() {
    let shown = README.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert!(include_str!("../../python/README.md").contains(&format!("```python\n{shown}```")), "{shown}");
}

/// The citation file has the version of the package and names the same sources as the README.
#[test]
fn the_citation_is_of_this_version() {
    let citation = include_str!("../../CITATION.cff");
    assert!(citation.contains(concat!("\nversion: ", env!("CARGO_PKG_VERSION"), "\n")));
    for source in ["Takano", "Kato", "49", "2007", "2014"] {
        assert!(citation.contains(source) && README.contains(source), "{source}");
    }
}
