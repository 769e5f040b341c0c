//! Formats that the reader accepts, how it understands them, and the message for everything that it refuses.

mod any_bytes;
mod faults;
mod formats;

use super::read::read;
use super::*;

const REFERENCE: &str = include_str!("../../../../../../targets/takano2007_lengths.csv");
const HEADER: &str = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
const ROW: &str = "S1,i,47,49,49,51,28,42,38,30";
const WANTED: &str = "it must name, in any order, subject, vowel, and for each muscle its length with the unit, like \
                      subject,vowel,GGa_mm,GGm_mm";

fn dataset(table: impl AsRef<[u8]>) -> Dataset {
    Dataset::from_reader(table.as_ref(), "my.csv").unwrap()
}

/// The message for a table that must be refused.
fn refusal(table: impl AsRef<[u8]>) -> String {
    Dataset::from_reader(table.as_ref(), "my.csv").unwrap_err().to_string()
}

/// The message for a valid header over `rows`.
fn rows_refusal(rows: &str) -> String {
    refusal(format!("{HEADER}\n{rows}\n"))
}

/// The message for one valid row with the field of GGm (column 4) replaced.
fn length_refusal(value: &str) -> String {
    rows_refusal(&ROW.replacen("49", value, 1))
}

fn vowel(label: &str) -> Vowel {
    Vowel::new(label).unwrap()
}

fn set_aside(data: &Dataset) -> Vec<&str> {
    data.reading().set_aside.iter().map(|s| s.name.as_str()).collect()
}

/// Every length and half width in mm, row after row.
fn numbers(data: &Dataset) -> Vec<(Option<f64>, f64)> {
    let rows = data.rows().iter().map(|r| &r.lengths);
    rows.flat_map(|l| l.length_mm.iter().copied().zip(l.half_width_mm.iter().copied())).collect()
}

#[test]
fn the_built_in_table_is_that_of_the_thesis() {
    let new = Dataset::reference().unwrap();
    assert_eq!(new.muscles(), ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
    assert_eq!(new.subjects(), ["S1", "S2", "S3", "S4"]);
    assert!(new.broken().is_empty() && new.reading().set_aside.is_empty());
    assert_eq!(new.rows().len(), 19);
    assert!(new.rows().iter().all(|r| r.lengths.half_width_mm == [0.5; 8]));
    let cells = |subject: &str, label: &str| {
        new.row(subject, &vowel(label)).unwrap().length_mm.iter().map(|mm| mm.unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(cells("S1", "i"), [47.0, 49.0, 49.0, 51.0, 28.0, 42.0, 38.0, 30.0]);
    assert_eq!(cells("S2", "a"), [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0]);
    assert_eq!(cells("S4", "o"), [35.0, 66.0, 59.0, 46.0, 28.0, 45.0, 23.0, 25.0]);
    assert_eq!(cells("S2", "u"), [46.0, 60.0, 45.0, 59.0, 32.0, 42.0, 42.0, 31.0]);
    let labels = new.vowels("S4").unwrap();
    assert_eq!(labels.iter().map(Vowel::label).collect::<Vec<_>>(), ["i", "e", "a", "o"]);
    assert!(new.baseline("S2").is_ok() && new.baseline("S4").is_err());
    let a = new.row("S2", &vowel("a")).unwrap();
    assert_eq!(
        (a.length_mm_of("SGm"), a.length_mm_of("sgm"), a.length_mm_of("XY")),
        (Some(23.0), Some(23.0), None)
    );
}

#[test]
fn missing_rows_are_reported_with_existing_ones() {
    let data = Dataset::reference().unwrap();
    assert_eq!(
        data.row("S22", &vowel("a")).unwrap_err().to_string(),
        "unknown subject \"S22\" in targets/takano2007_lengths.csv (built in); did you mean \"S2\"? (known: \
         S1, S2, S3, S4)"
    );
    assert_eq!(
        data.row("S4", &vowel("u")).unwrap_err().to_string(),
        "S4 has no row for /ɯ/ in targets/takano2007_lengths.csv (built in); it has /i/, /e/, /a/, /o/"
    );
    assert!(matches!(data.baseline("S4"), Err(LengthsError::MissingBaseline { has, .. }) if has.len() == 4));
    assert_eq!(data.baseline_vowel("S4", &vowel("e")).unwrap().vowel, vowel("e"));
    assert_eq!(data.row("S4", &vowel("A")).unwrap().vowel, vowel("a"));
}

#[test]
fn ten_thousand_subjects_are_counted_not_listed() {
    let rows: String = (0..10_000).map(|n| format!("P{n},a,47,49,49,51,28,42,38,30\n")).collect();
    let data = dataset(format!("{HEADER}\n{rows}"));
    assert_eq!(data.subjects()[9_999], "P9999");
    assert_eq!(
        data.row("p77x", &vowel("a")).unwrap_err().to_string(),
        "unknown subject \"p77x\" in my.csv; did you mean \"P77\"? (one of 10000 subjects)"
    );
}

// Formats of spreadsheets and statistics programs.

#[test]
fn columns_may_come_in_any_order_and_blank_lines_and_spaces_do_not_count() {
    let reversed: Vec<_> = REFERENCE
        .lines()
        .map(|line| format!("\n {} \n", line.rsplit(',').collect::<Vec<_>>().join(" , ")))
        .collect();
    let (data, straight) = (dataset(reversed.concat()), dataset(REFERENCE));
    for (number, (row, same)) in data.rows().iter().zip(straight.rows()).enumerate() {
        for (muscle, mm) in same.lengths.measured() {
            assert_eq!(row.lengths.length_mm_of(muscle), Some(mm));
        }
        assert_eq!((row.line, same.line), (2 * number as u64 + 4, number as u64 + 2));
    }
}
