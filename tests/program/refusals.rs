//! What no command can use is refused in one message with its reason; nothing is printed as a result and no file is left.

use std::fs;

use super::run::{refused_with, run};

/// What stands for files of the repository in the commands.
const PATHS: [(&str, &str); 2] = [
    ("GMSH", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh")),
    ("RECORDING", concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv")),
];

fn with_paths(line: &str) -> String {
    PATHS.iter().fold(line.to_owned(), |line, (word, path)| line.replace(word, path))
}

/// Files that the commands below name.
const FILES: [(&str, &str); 20] = [
    ("bad.toml", "name = 3"),
    ("far.csv", "node,x_mm,y_mm,z_mm\n5000,1,2,3\n"),
    ("short.csv", "node,x_mm,y_mm\n5,1,2\n"),
    ("words.csv", "node,x_mm,y_mm,z_mm\n5,1,two,3\n"),
    ("late.csv", "node,x_mm,y_mm,z_mm,time_s\n5,1,2,3,1\n5,1,2,3,0\n"),
    ("timed.csv", "x_mm,z_mm,time_s\n1,2,0\n"),
    ("doubled.csv", "muscle,length_mm,stretch\nGGP,40,1\n"),
    ("flat.csv", "muscle,stretch\nGGP,0\n"),
    (
        "one.csv",
        "speaker,phoneme,GGa_mm,GGm_mm,SGm_mm,HGa_mm,HGp_mm\nA,ɯ,46,56,25,36,31\nA,ɔ,38,57,21,33,33\n",
    ),
    ("slip.toml", "title = \"t\"\nwant = \"shape\"\n[body.tongue]\n[effects]\nincompresibility = true\n"),
    ("mesh.json", "{}"),
    ("ema.csv", "time_s,point,x_mm,y_mm\n0,T1,1,2\n0,T2,20,12\n"),
    ("three.csv", "time_s,point,x_mm,y_mm\n0,T1,1,2\n0,T2,20,12\n0,T3,30,8\n"),
    ("large.csv", "time_s,point,x_mm,y_mm\n0,T1,10,20\n0,T2,200,120\n0,T3,300,80\n"),
    ("cm.csv", "point,x_mm,y_mm\nmental_spine,0,0\nhyoid,3.76,-0.31\n"),
    ("bones.csv", "point,x_mm,y_mm\nmental_spine,0,0\nhyoid,37.6,-3.1\n"),
    (
        "below.csv",
        "point,x_mm,y_mm\na,45,-10\nb,39,-13\nc,33,-10\nd,27,-13\ne,21,-10\nf,15,-13\ng,9,-10\nh,3,-13\ni,-3,-10\n",
    ),
    ("map.toml", "[points]\nT1 = { surface_mm = 5 }\nT2 = { surface_mm = 25 }\n"),
    ("tiny.toml", "noise_mm = 1e-300\n"),
    ("unit.toml", "title = \"t\"\nwant = \"lengths\"\n[body.mesh]\nfile = \"mesh.json\"\nunit = \"mm\"\n"),
];

/// Lines of commands and words of their messages, of one part of the table beside this file.
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
    FILES.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    let centimetres: String = tongue_fit::body::REFERENCE
        .lines()
        .map(|line| if line.starts_with('#') { String::new() } else { tenfold_smaller(line) + "\n" })
        .collect();
    fs::write(folder.path().join("cm.toml"), centimetres).unwrap();
    for (line, told) in cases(0) {
        let message = refused_with(1, folder.path(), &with_paths(line));
        assert!(message.contains(told), "{line}: {message}");
        // A number of hundreds of digits is told in few.
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
    // No command at all prints the help, and options of every command may stand anywhere.
    let done = run(folder.path(), "");
    assert!(done.status == Some(2) && done.out.is_empty(), "{}", done.err);
    assert_eq!(run(folder.path(), "--threads 1 mesh").status, Some(0));
}

/// The text with every number with a decimal point divided by ten, as in a file of centimetres.
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
