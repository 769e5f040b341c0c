//! `tongue-fit lengths check` reports how a table is understood, and its exit status says whether all of it
//! is.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};

/// An export of a German Excel, with a broken row, a missing cell and columns that are not lengths.
const EXPORT: &str = "\u{feff}Proband;Vokal;GGa (mm);GGm (mm);HG_cm;Bemerkung\r\n\
                      M;u;46,5;56;3,6;gut, sehr\r\nM;a;38;;3,4;\r\nM;ɔ;38,5;57;x;\r\nN;a;40;40;4;\r\nN;e;-;-;;\r\n";

fn check(arguments: &[&str], stdin: &[u8]) -> Output {
    let mut child = Command::new(cargo_bin("tongue-fit"))
        .args(["lengths", "check"])
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The program may already have ended with a refusal of the command line.
    let _ = child.stdin.take().unwrap().write_all(stdin);
    child.wait_with_output().unwrap()
}

#[test]
fn an_export_is_understood_except_its_broken_row() {
    let output = check(&["-", "--json"], EXPORT.as_bytes());
    assert_eq!(output.status.code(), Some(1));
    let record: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(record["muscles"], json!(["GGa", "GGm", "HG"]));
    assert_eq!(record["reading"]["separator"], "semicolon");
    assert_eq!(record["reading"]["decimal_mark"], "comma");
    assert_eq!(record["reading"]["set_aside"][0]["name"], "Bemerkung");
    assert_eq!(record["reading"]["rows_without_lengths"], json!([6]));
    assert_eq!(record["broken"].as_array().unwrap().len(), 1);
    assert_eq!(record["broken"][0]["vowel"], "ɔ");
    assert_eq!(record["broken"][0]["fault"]["line"], 4);
    let [m, n] = &record["subjects"].as_array().unwrap()[..] else { panic!("{record}") };
    assert_eq!((&m["baseline"], &n["baseline"]), (&json!("ɯ"), &json!(null)));
    assert_eq!(m["rows"][1]["not_measured"], json!(["GGm"]));
    assert_eq!(m["rows"][1]["lengths_mm"], json!({ "GGa": 38.0, "HG": 34.0 }));
    assert_eq!(m["rows"][1]["half_widths_mm"], json!({ "GGa": 0.05, "HG": 0.5 }));
}

#[test]
fn the_table_for_a_reader_names_everything() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.csv");
    std::fs::write(&file, EXPORT).unwrap();
    let output = check(&[file.to_str().unwrap(), "--error-mm", "1"], b"");
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout).unwrap();
    for said in [
        "UTF-8 with byte order mark, CRLF line ends, semicolons between fields, decimal comma\n",
        "columns \"Proband\" and \"Vokal\"\n",
        "3 rows; ignored, because they have no lengths: line 6\n",
        "column 6 \"Bemerkung\" (no unit of length in its name)\n",
        "| HG     | HG_cm    |   3 of 3 |         34.0 |        40.0 | 1 mm, as given |\n",
        "| M       | ɯ a    | ɯ        | /a/ GGm      |\n",
        "no row for the baseline /ɯ/: N; choose another with --baseline\n",
        "mine.csv:4:5: HG_cm is \"x\", not a number; write centimetres with a decimal comma",
    ] {
        assert!(text.contains(said), "{said} is not in\n{text}");
    }
}

#[test]
fn the_built_in_table_is_all_understood() {
    let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("targets/takano2007_lengths.csv");
    let output = check(&[table.to_str().unwrap()], b"");
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8(output.stdout).unwrap().contains("19 rows\n"));
}

#[test]
fn files_that_are_not_tables_are_refused_with_one_message() {
    for (arguments, stdin, expected) in [
        (&["-"][..], "", "error: stdin:1:1: the file is empty; begin with a line like"),
        (&["-"], "name,what\nX,a\n", "error: stdin:1:3: missing from the header: subject, vowel, a length"),
        (&["."], "", "error: cannot read .: it is a folder; name a file in it"),
        (
            &["-", "--error-mm", "-1"],
            EXPORT,
            "error: the half width of rounding is -1 mm; give one from 0 to",
        ),
    ] {
        let output = check(arguments, stdin.as_bytes());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.starts_with(expected) && message.lines().count() == 1, "{message}");
        assert!(output.stdout.is_empty());
    }
}
