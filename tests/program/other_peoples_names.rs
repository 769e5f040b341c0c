//! Names in tables and recordings are written by others and must not control terminals or spreadsheets. Reaching a limit of the system ends
//! a run with a message.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use super::run::shell;

/// Writes a recording of three coils with this name.
fn record(folder: &Path, name: &str) {
    let coils = format!(
        "recording,time_s,point,x_mm,y_mm\n{name},0,T1,-5.6,37.5\n{name},0,T2,9.4,46.0\n{name},0,T3,28.2,50.6\n"
    );
    let map = "back = \"x\"\nup = \"y\"\nnoise_mm = 0.5\n[points]\n\
               T1 = { surface_mm = 9.0 }\nT2 = { surface_mm = 26.0 }\nT3 = { surface_mm = 47.0 }\n";
    fs::write(folder.join("coils.csv"), coils).unwrap();
    fs::write(folder.join("coils.toml"), map).unwrap();
}

const TRACK: &str = "$TONGUE_FIT track coils.csv --map coils.toml --as-is --frames 0 --out track";

#[test]
fn escapes_in_names_are_shown_and_not_obeyed() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), "o\u{1b}]0;title\u{7}ne");
    let printed = shell(folder.path(), TRACK).out;
    assert!(printed.contains("o\\u001b]0;title\\u0007ne: the hyoid was never seen"), "{printed}");
    for file in fs::read_dir(folder.path().join("track")).unwrap() {
        let file = file.unwrap().path();
        assert!(!fs::read(&file).unwrap().contains(&0x1b), "{}", file.display());
    }
    let csv = fs::read_to_string(folder.path().join("track/track.csv")).unwrap();
    assert!(csv.contains("o\\u001b]0;title\\u0007ne"), "{csv}");
    // JSON contains the name itself.
    let done = shell(folder.path(), &format!("{TRACK} --json 2>/dev/null | cat"));
    assert!(!done.out.contains(['\u{1b}', '\u{7}']), "{}", done.out);
    let record = done.record();
    assert!(record.to_string().contains("o\\u001b]0;title\\u0007ne"));
    // The name of a file is in a message.
    let done = shell(folder.path(), "$TONGUE_FIT --vowel a --lengths \"$(printf 'a\\033[31mb')\"");
    assert!(!done.out.contains('\u{1b}') && done.out.contains("a\\u001b[31mb"), "{}", done.out);
}

#[test]
fn names_that_look_like_formulas_are_text() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), "=cmd|x");
    let done = shell(folder.path(), TRACK);
    assert_eq!(done.status, Some(0), "{}", done.out);
    let mut lengths = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\n".to_owned();
    for subject in ["@SUM(1)", "=1+1", "+cmd|x", "-2+3+cmd|x"] {
        lengths += &format!("{subject},u,46,25,36\n{subject},a,38,21,33\n{subject},@,40,23,35\n");
    }
    fs::write(folder.path().join("my.csv"), lengths).unwrap();
    shell(folder.path(), "$TONGUE_FIT batch --lengths my.csv --out batch");
    let (mut seen, mut vowels) = (0, 0);
    for file in ["track/track.csv", "batch/fits.csv", "batch/muscles.csv"] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        for line in text.lines().skip(1) {
            // Numbers and the vowel `@` of SAMPA are as they were.
            assert!(line.starts_with('\'') && !line.contains(",'"), "{file}: {line}");
            seen += 1;
            vowels += usize::from(line.contains(",@,"));
        }
    }
    assert!(seen > 10 && vowels > 10, "{seen} {vowels}");
}

#[test]
fn a_file_that_reaches_the_limit_of_file_sizes_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let done = shell(folder.path(), "ulimit -f 4; $TONGUE_FIT --vowel a --out fit");
    assert!(done.status == Some(1) && done.out.contains("raise the limit of file sizes"), "{}", done.out);
    assert!(!folder.path().join("fit").exists(), "nothing half-written");
    let batch = "$TONGUE_FIT batch --subjects S2 --out batch";
    let done = shell(folder.path(), &format!("ulimit -f 64; {batch}"));
    assert!(done.status == Some(1) && done.out.contains("the same command resumes"), "{}", done.out);
    let done = shell(folder.path(), batch);
    assert!(matches!(done.status, Some(0 | 3)) && done.out.contains("resuming after"), "{}", done.out);
}
