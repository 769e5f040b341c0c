//! What a command cannot use is refused in one message with its reason; no result is printed and no file is left.

use std::fs;

use super::run::{refused_with, run};

/// Words in the commands that stand for files of the repository.
const PATHS: [(&str, &str); 2] = [
    ("GMSH", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh")),
    ("RECORDING", concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv")),
];

fn with_paths(line: &str) -> String {
    PATHS.iter().fold(line.to_owned(), |line, (word, path)| line.replace(word, path))
}

/// The two columns of a part of refusals.txt: commands and parts of their messages, or files and their texts.
fn cases(part: usize) -> impl Iterator<Item = (&'static str, &'static str)> {
    let part = include_str!("refusals.txt").split("\n\n").nth(part).unwrap();
    part.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let (command, words) = line.split_once('|').unwrap();
        (command.trim(), words.trim())
    })
}

#[test]
fn what_cannot_be_used_is_refused_in_one_message_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    cases(2).for_each(|(name, text)| fs::write(folder.path().join(name), text.replace("\\n", "\n")).unwrap());
    let centimetres: String = tongue_fit::body::REFERENCE
        .lines()
        .map(|line| if line.starts_with('#') { String::new() } else { tenfold_smaller(line) + "\n" })
        .collect();
    fs::write(folder.path().join("cm.toml"), centimetres).unwrap();
    for (line, told) in cases(0) {
        let message = refused_with(1, folder.path(), &with_paths(line));
        assert!(message.contains(told), "{line}: {message}");
        // A number of hundreds of digits is printed with an exponent.
        let is_long = ["1e308", "1e-30", "1e300"].iter().any(|n| line.contains(n));
        assert!(message.len() < 400 || !is_long, "{message}");
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = tempfile::tempdir().unwrap();
    for (line, told) in cases(1) {
        let message = refused_with(2, folder.path(), &with_paths(line));
        assert!(message.contains(told), "{line}: {message}");
    }
    // Without a command the help is printed, and options of every command may be anywhere.
    let done = run(folder.path(), "");
    assert!(done.status == Some(2) && done.out.is_empty(), "{}", done.err);
    assert_eq!(run(folder.path(), "--threads 1 mesh").status, Some(0));
}

/// The text with every number that has a decimal point divided by ten, as in a file in centimetres.
fn tenfold_smaller(line: &str) -> String {
    let ends = &['[', ']', ',', ' ', '='][..];
    let smaller = |word: &str| {
        let number = word.trim_end_matches(ends);
        match number.parse::<f64>() {
            Ok(value) if number.contains('.') => format!("{}{}", value / 10.0, &word[number.len()..]),
            _ => word.to_owned(),
        }
    };
    line.split_inclusive(ends).map(smaller).collect()
}
