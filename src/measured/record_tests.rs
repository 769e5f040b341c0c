//! What the reader takes, and the message for everything that it refuses.

use proptest::prelude::*;

use super::*;

const REFERENCE: &str = include_str!("../../targets/takano2007_lengths.csv");
const HEADER: &str = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
const ROW: &str = "S1,i,47,49,49,51,28,42,38,30";

/// The message for a table that must be refused.
fn refusal(table: impl AsRef<[u8]>) -> String {
    read(table.as_ref(), "my.csv").unwrap_err().to_string()
}

/// The message for a good header over `rows`.
fn rows_refusal(rows: &str) -> String {
    refusal(format!("{HEADER}\n{rows}\n"))
}

/// The message for one good row with the field of GGm (column 4) replaced.
fn length_refusal(value: &str) -> String {
    rows_refusal(&ROW.replacen("49", value, 1))
}

#[test]
fn columns_may_come_in_any_order_and_blank_lines_and_spaces_do_not_count() {
    let reversed: Vec<_> = REFERENCE
        .lines()
        .map(|line| format!("\n {} \n", line.rsplit(',').collect::<Vec<_>>().join(" , ")))
        .collect();
    let rows = read(reversed.concat().as_bytes(), "reversed").unwrap();
    let straight = read(REFERENCE.as_bytes(), "reference").unwrap();
    assert_eq!(rows.len(), 19);
    for (number, (row, same)) in rows.iter().zip(&straight).enumerate() {
        assert_eq!(row.lengths, same.lengths);
        assert_eq!((row.line, same.line), (2 * number as u64 + 4, number as u64 + 2));
    }
}

#[test]
fn header_faults() {
    let with = |from, to| refusal(format!("{}\n{ROW}\n", HEADER.replacen(from, to, 1)));
    assert_eq!(
        with(",HGp_mm", ""),
        format!("my.csv:1:10: missing from the header: HGp_mm; it must name, in any order, {HEADER}")
    );
    assert_eq!(
        with("GGm_mm", "GGm_cm"),
        "my.csv:1:4: column \"GGm_cm\" is not in millimetres; lengths are wanted in mm, in a column named GGm_mm"
    );
    assert_eq!(
        with("GGm_mm", "ggm_m"),
        "my.csv:1:4: column \"ggm_m\" is not in millimetres; lengths are wanted in mm, in a column named GGm_mm"
    );
    assert_eq!(
        with("GGm_mm", "GGm"),
        "my.csv:1:4: column \"GGm\" does not say its unit; lengths are wanted in mm, in a column named GGm_mm"
    );
    assert_eq!(
        with("GGm_mm", "gGM_mm"),
        "my.csv:1:4: unknown column \"gGM_mm\"; lengths are wanted in mm, in a column named GGm_mm"
    );
    assert_eq!(
        with("subject", "subjct"),
        format!(
            "my.csv:1:1: unknown column \"subjct\"; did you mean \"subject\"? (known: {}); rename it or take it out",
            COLUMNS.join(", ")
        )
    );
    assert!(with("HGp_mm", "HGp_mm,age").starts_with("my.csv:1:11: unknown column \"age\"; "));
    assert_eq!(
        with("GGm_mm", "GGa_mm"),
        "my.csv:1:4: column GGa_mm appears twice, here and as column 3; keep one of the two"
    );
}

#[test]
fn encoding_faults() {
    assert_eq!(
        refusal(format!("\u{feff}{REFERENCE}")),
        "my.csv:1:1: the file starts with a byte order mark (BOM); save it as \"UTF-8\" without BOM, not as \"CSV \
         UTF-8\""
    );
    assert_eq!(
        refusal(REFERENCE.replace('\n', "\r\n")),
        "my.csv:1:10: the line ends with a carriage return (CRLF, as Windows writes it); save the file with LF \
         (Unix) line ends, for instance by `tr -d '\\r'`"
    );
    assert!(
        refusal(format!("{HEADER}\n{ROW}\r\n")).starts_with("my.csv:2:10: the line ends with a carriage")
    );
    assert!(refusal(b"\xFF\xFEs\0u\0").starts_with("my.csv:1:1: the file is UTF-16; "));
    let latin1 = [HEADER.as_bytes(), b"\nS1,\xFC,47"].concat();
    assert!(refusal(latin1).starts_with("my.csv:2:2: the text is not UTF-8; save the file as UTF-8"));
    assert!(
        refusal("").starts_with(&format!("my.csv:1:1: the file is empty; the first line must be {HEADER}"))
    );
    assert!(refusal(" \n\n").starts_with("my.csv:1:1: the file is empty; "));
    assert!(refusal(format!("{HEADER}\n")).starts_with("my.csv:2:1: the table has a header but no rows; "));
}

#[test]
fn separator_and_shape_faults() {
    let help = "separate them by commas, and write decimals with a point, like 57.8";
    assert_eq!(
        refusal(REFERENCE.replace(',', ";")),
        format!("my.csv:1:1: the fields are separated by semicolons; {help}")
    );
    assert_eq!(
        rows_refusal(&ROW.replace(',', "\t")),
        format!("my.csv:2:1: the fields are separated by tabs; {help}")
    );
    assert_eq!(
        rows_refusal("S1,i,47"),
        "my.csv:2:4: the line has 3 fields where the header has 10; give every column a value; check for a \
         quotation mark that is never closed"
    );
    assert_eq!(
        rows_refusal("S1,i,47,5,49,49,51,28,42,38,30"),
        "my.csv:2:11: the line has 11 fields where the header has 10; take out the surplus; decimals are written \
         with a point, like 57.8, not a comma"
    );
    // The quotation mark swallows the rest of the file.
    assert!(rows_refusal(&format!("\"{ROW}\n{ROW}")).starts_with("my.csv:2:2: the line has 1 fields"));
}

#[test]
fn length_faults() {
    let number = "write millimetres with a decimal point, like 57.8";
    let measured = "write a measured length in millimetres, like 57.8";
    for (value, expected) in [
        ("abc", format!("GGm_mm is \"abc\", not a number; {number}")),
        ("49 mm", format!("GGm_mm is \"49 mm\", not a number; {number}")),
        ("", "GGm_mm is empty; write the length in millimetres, like 57.8".to_owned()),
        ("\"49,5\"", "GGm_mm is \"49,5\", with a decimal comma; write it with a decimal point: 49.5".to_owned()),
        ("-49", format!("GGm_mm is -49, not positive; {measured}")),
        ("0", format!("GGm_mm is 0, not positive; {measured}")),
        ("-0", format!("GGm_mm is -0, not positive; {measured}")),
        ("nan", format!("GGm_mm is NaN, not finite; {measured}")),
        ("inf", format!("GGm_mm is inf, not finite; {measured}")),
        ("1e999", format!("GGm_mm is inf, not finite; {measured}")),
        (
            "490",
            "GGm_mm is 490, too long for a tongue muscle (above 200 mm); write the length in millimetres, like \
             57.8"
                .to_owned(),
        ),
        (
            "4.9",
            "GGm_mm is 4.9, too short for millimetres (below 10): it looks like centimetres; multiply the lengths \
             by 10"
                .to_owned(),
        ),
        (
            "0.049",
            "GGm_mm is 0.049, far too short for millimetres: it looks like metres; multiply the lengths by 1000"
                .to_owned(),
        ),
    ] {
        assert_eq!(length_refusal(value), format!("my.csv:2:4: {expected}"));
    }
    // The column is that of the file, not of our own order.
    let reordered = "HGp_mm,vowel,HGa_mm,SGa_mm,SGm_mm,SGp_mm,GGp_mm,GGm_mm,GGa_mm,subject";
    assert!(
        refusal(format!("{reordered}\n30,i,38,42,28,51,49,abc,47,S1\n"))
            .starts_with("my.csv:2:8: GGm_mm is \"abc\"")
    );
    assert!(
        refusal(format!("{reordered}\n30,i,38,42,28,51,49,-1,47,S1\n"))
            .starts_with("my.csv:2:8: GGm_mm is -1")
    );
    let long = length_refusal(&"x".repeat(100_000));
    assert_eq!(long, format!("my.csv:2:4: GGm_mm is \"{}...\", not a number; {number}", "x".repeat(40)));
}

#[test]
fn a_table_all_in_centimetres_or_metres_is_refused() {
    for factor in [0.1, 0.001] {
        let scaled: Vec<_> = read(REFERENCE.as_bytes(), "mm")
            .unwrap()
            .iter()
            .map(|row| {
                csv_line(&row.lengths.subject, row.lengths.vowel, row.lengths.length_mm.map(|l| l * factor))
            })
            .collect();
        assert!(rows_refusal(scaled.concat().trim()).starts_with("my.csv:2:3: GGa_mm is "));
    }
}

#[test]
fn subject_vowel_and_duplicate_faults() {
    assert_eq!(
        rows_refusal(&ROW.replacen('i', "ee", 1)),
        "my.csv:2:2: unknown vowel \"ee\"; did you mean \"e\"? (known: i, e, a, o, ɯ, u); write one of these"
    );
    assert_eq!(
        rows_refusal(&ROW.replacen("S1", "", 1)),
        "my.csv:2:1: the subject is \"\"; give it a name of printable characters, like S2"
    );
    assert!(
        rows_refusal(&ROW.replacen("S1", "\"S\n1\"", 1))
            .starts_with("my.csv:2:1: the subject is \"S\\n1\"; ")
    );
    let u = ROW.replacen('i', "u", 1);
    let same = ROW.replacen('i', "ɯ", 1);
    assert_eq!(
        rows_refusal(&format!("{u}\n\n{ROW}\n{same}")),
        "my.csv:5:1: S1 /ɯ/ is given twice, here and on line 2; keep one of the two lines"
    );
}

fn csv_line(subject: &str, vowel: Vowel, length_mm: PerMuscle<f64>) -> String {
    let fields = [subject.to_owned(), vowel.to_string()].into_iter().chain(length_mm.map(|l| l.to_string()));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields).unwrap();
    String::from_utf8(writer.into_inner().unwrap()).unwrap()
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read(&bytes, "noise").is_err(), "noise is not a table");
    }

    #[test]
    fn a_damaged_table_is_read_or_refused_at_a_place_in_it(
        at in 0..REFERENCE.len(),
        gone in 0usize..20,
        put in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..6),
            "[\",;\n\t.0-9/ɯ -]{0,6}".prop_map(String::into_bytes),
        ],
    ) {
        let mut bytes = REFERENCE.as_bytes().to_vec();
        let end = (at + gone).min(bytes.len());
        bytes.splice(at..end, put);
        let last_line = 1 + bytes.iter().filter(|b| **b == b'\n').count() as u64;
        match read(&bytes, "damaged") {
            Ok(rows) => {
                prop_assert!(rows.iter().all(|r| r.line <= last_line));
                prop_assert!(rows.iter().flat_map(|r| r.lengths.length_mm).all(|l| (10.0..=200.0).contains(&l)));
            }
            Err(Error::Malformed { line, column, .. }) => {
                prop_assert!((1..=last_line).contains(&line) && column >= 1);
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit(
        rows in prop::collection::btree_map(
            ("[^\\pC\\pZ]([^\\pC]{0,8}[^\\pC\\pZ])?", prop::sample::select(Vowel::ALL.to_vec())),
            prop::array::uniform8(10.0f64..=200.0),
            1..30,
        )
    ) {
        let lines: String = rows.iter().map(|((s, v), mm)| csv_line(s, *v, *mm)).collect();
        let read = read(format!("{HEADER}\n{lines}").as_bytes(), "written").unwrap();
        let written: Vec<_> = rows
            .into_iter()
            .enumerate()
            .map(|(number, ((subject, vowel), length_mm))| Row {
                line: number as u64 + 2,
                lengths: Lengths { subject, vowel, length_mm },
            })
            .collect();
        prop_assert_eq!(read, written);
    }
}
