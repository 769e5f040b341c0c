//! `tongue-fit lengths check` reports how a table is read and which fits refuse it; its exit status says whether all of it can be used.

use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use serde_json::json;

use super::run::{Done, program, refused, run};

/// An export of a German Excel with a title, a bad cell, a missing cell, columns that are not lengths, and a subject without a baseline.
const EXPORT: &str = "\u{feff}Zungenmuskeln;;;;;\r\nProband;Vokal;GGa (mm);GGm (mm);HG_cm;Bemerkung\r\n\
                      M;u;46,5;56;3,6;gut, sehr\r\nM;a;38;;3,4;\r\nM;ɔ;38,5;57;x;\r\nN;a;40;40;4;\r\nN;e;-;-;;\r\n\
                      M;o;47;57;3,7;\r\n";

/// A run that reads a table from stdin.
fn fed(line: &str, table: &str) -> Done {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(folder.path(), line);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The program may already have ended because it refused the command line.
    let _ = child.stdin.take().unwrap().write_all(table.as_bytes());
    child.wait_with_output().unwrap().into()
}

#[test]
fn an_export_is_understood_except_its_bad_cell_and_the_fits_that_refuse_it() {
    let done = fed("lengths check - --json", EXPORT);
    assert_eq!(done.status, Some(1));
    let record = done.record();
    assert_eq!(record["muscles"], json!(["GGa", "GGm", "HG"]));
    assert_eq!(record["reading"]["rows_without_lengths"], json!([7]));
    assert_eq!(record["broken"], json!([]));
    assert_eq!((&record["bad_cells"][0]["line"], &record["bad_cells"][0]["column"]), (&json!(5), &json!(5)));
    let [m, n] = &record["subjects"].as_array().unwrap()[..] else { panic!("{record}") };
    assert_eq!((&m["baseline"], &n["baseline"]), (&json!("ɯ"), &json!(null)));
    assert_eq!(m["rows"][1]["not_measured"], json!(["GGm"]));
    assert_eq!(m["rows"][1]["lengths_mm"], json!({ "GGa": 38.0, "HG": 34.0 }));
    assert_eq!(m["rows"][1]["half_widths_mm"], json!({ "GGa": 0.05, "HG": 0.5 }));
    assert_eq!(m["rows"][2]["not_measured"], json!(["HG"]));

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.csv"), EXPORT).unwrap();
    let done = run(folder.path(), "lengths check mine.csv --error-mm 1");
    assert_eq!(done.status, Some(1));
    let printed = done.out;
    for said in [
        "UTF-8 with byte order mark, CRLF line ends, semicolons between fields, decimal comma\n",
        "header              line 2\n",
        "columns \"Proband\" and \"Vokal\"\n",
        "5 rows; ignored, because they have no lengths: line 7\n",
        "column 6 \"Bemerkung\" (no unit of length in its name)\n",
        "| HG     | HG_cm    |   4 of 5 |         34.0 |        40.0 | 1 mm, as given |\n",
        "| M       | ɯ a ɔ o | ɯ        | /a/ GGm      |\n",
        "1 cell left out:\n",
        "mine.csv:5:5: HG_cm is \"x\", not a number; write centimetres like 5,78 with a decimal comma",
    ] {
        assert!(printed.contains(said), "{said} is not in\n{printed}");
    }
    let both = fed("lengths check -", "subject,vowel,GGa_mm\nX,a,40\nX,u,42\nX,ɯ,43\n");
    assert!(both.err.contains("u and ɯ are two vowels, since the table has both"), "{}", both.err);
    // The reasons are, word for word, those that a fit of the row gives.
    for (subject, vowel, reason) in [
        ("N", "a", "no row for the baseline vowel /ɯ/"),
        ("M", "o", "no muscle of M is shorter in /o/ than in /ɯ/"),
    ] {
        let refused =
            refused(folder.path(), &format!("--vowel {vowel} --subject {subject} --lengths mine.csv"));
        let refused = refused.trim_start_matches("error: ");
        assert!(refused.contains(reason) && printed.contains(refused), "{refused} is not in\n{printed}");
    }
    let none = refused(folder.path(), "batch --subjects N --lengths mine.csv --out none");
    assert!(none.starts_with("error: none of the 1 rows can be fitted; line 6, N /a/: "), "{none}");
    // A batch fits the rest, which is row M /ɔ/ by stretches.
    let done = run(folder.path(), "batch --lengths mine.csv --error-mm 1 --out rest");
    assert!(done.status == Some(1) && done.err.contains("mine.csv:5:5: HG_cm"), "{}", done.err);
    assert!(done.err.contains("M /o/, stretch: no muscle of M is shorter in /o/"), "{}", done.err);
    let summary = &super::run::record(folder.path(), "rest/batch.json")["summary"];
    assert_eq!((&summary["fits"], &summary["not_fitted"]), (&json!(1), &json!(6)));
    // A fit of a row with a bad cell names the cell and leaves out its muscle.
    let line = "--vowel ɔ --subject M --lengths mine.csv --target stretch --json";
    let done = run(folder.path(), line);
    assert_eq!(done.status, Some(1), "as of a batch: {}", done.err);
    let told = done.err;
    assert!(told.contains("mine.csv:5:5: HG_cm is \"x\"") && told.contains("is left out)"), "{told}");
    assert_eq!(told.matches("HG_cm").count(), 1, "{told}");
    // A fit of a row that is given twice names it too.
    let twice = "subject,vowel,when,GGa_mm,SGm_mm\nP,a,pre,46,30\nP,a,post,45,29\nP,ɯ,pre,50,32\n";
    std::fs::write(folder.path().join("twice.csv"), twice).unwrap();
    let told = run(folder.path(), "--vowel a --subject P --lengths twice.csv").err;
    assert!(told.contains("twice.csv:3:1: P /a/ is given twice") && told.contains("left out)"), "{told}");
}

#[test]
fn the_built_in_table_is_all_understood() {
    let table = concat!("lengths check '", env!("CARGO_MANIFEST_DIR"), "/targets/takano2007_lengths.csv'");
    let done = run(Path::new("."), table);
    let told = "S4 has no /ɯ/: batch compares with /e/, a fit of one vowel needs --baseline e";
    assert!(done.status == Some(0) && done.out.contains("19 rows\n") && done.out.contains(told));
}

#[test]
fn a_table_from_stdin_is_refused_with_one_message() {
    let done = fed("lengths check -", "name,what\nX,a\n");
    assert!(done.status == Some(1) && done.out.is_empty(), "{}", done.err);
    let told = "error: stdin:1:3: missing from the header: subject, vowel, a length";
    assert!(done.err.starts_with(told) && done.err.lines().count() == 1, "{}", done.err);
}

#[test]
fn a_muscle_that_no_fit_knows_is_told_with_the_name_that_is_meant() {
    let table =
        |muscle: &str| format!("subject,vowel,GGa_mm,GGm_mm,{muscle}_mm\nS1,u,47,49,28\nS1,i,46,48,29\n");
    let done = fed("lengths check -", &table("SMg"));
    assert_eq!(done.status, Some(1));
    assert!(done.out.contains("no muscle SMg; did you mean \"SGm\"?"), "{}", done.out);
    // A fit leaves out a muscle that the body lacks and that is longer, and says so once.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("smg.csv"), table("SMg")).unwrap();
    let done = run(folder.path(), "--vowel i --subject S1 --lengths smg.csv");
    assert_eq!(
        done.err.matches("lacks the muscles SMg, whose lengths are left out").count(),
        1,
        "{}",
        done.err
    );
    let done = fed("lengths check -", &table("SGm"));
    assert!(done.status == Some(0) && !done.out.contains("no muscle"), "{}", done.out);
}
