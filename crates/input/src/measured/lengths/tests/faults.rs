//! Faults of tables are reported with their place and advice.

use super::*;

#[test]
fn a_broken_row_stops_only_what_needs_it() {
    let data = dataset(format!(
        "{HEADER}\n{ROW}\nS1,a,34,57,51,abc,20,50,34,34\nS2,a,41\n,a,41,62,53,59,23,44,33,35\nS1,i,47,49,49,51,28,42,38,31\n"
    ));
    let faults: Vec<_> = data.broken().iter().map(|b| (b.fault.line, b.fault.column)).collect();
    assert_eq!(faults, [(3, 6), (4, 4), (5, 1), (6, 1)]);
    assert_eq!(data.row("S1", &vowel("i")).unwrap().length_mm_of("HGp"), Some(30.0));
    for (subject, expected) in
        [("S1", "my.csv:3:6: SGp_mm is \"abc\", not a number"), ("S2", "my.csv:4:4: the line has 3 fields")]
    {
        let message = data.row(subject, &vowel("a")).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
    assert!(matches!(data.row("S2", &vowel("i")), Err(LengthsError::UnknownSubject { .. })));
}

// Refused tables.

#[test]
fn header_faults() {
    let with = |from, to| refusal(format!("{}\n{ROW}\n", HEADER.replacen(from, to, 1)));
    assert_eq!(
        with("subject", "subjct"),
        format!(
            "my.csv:1:11: missing from the header: subject; is column \"subjct\" meant to be subject?; {WANTED}"
        )
    );
    assert_eq!(
        refusal(format!("{}\n{ROW}\n", HEADER.replace("_mm", ""))),
        format!("my.csv:1:11: missing from the header: a length, like GGa_mm; {WANTED}")
    );
    assert_eq!(
        with("GGm_mm", "GGa_cm"),
        "my.csv:1:4: column GGa_cm says the same as column 3 (GGa_mm); keep one of the two"
    );
    assert_eq!(
        with("GGm_mm", "GGa_mm"),
        "my.csv:1:4: column GGa_mm appears twice, here and as column 3; keep one of the two"
    );
    assert_eq!(
        with("GGm_mm", "subject"),
        "my.csv:1:4: column subject appears twice, here and as column 1; keep one of the two"
    );
}

#[test]
fn encoding_faults() {
    let latin1 = [HEADER.as_bytes(), b"\nS1,\xFC,47"].concat();
    assert!(refusal(latin1).starts_with("my.csv:2:2: the text is not UTF-8; save the file as UTF-8"));
    assert!(
        refusal(b"\xFF\xFEs\0u").starts_with("my.csv:1:1: the text begins as UTF-16 does, but is damaged")
    );
    assert!(refusal(b"s\0u\0b\0").starts_with("my.csv:1:1: the text holds a zero byte; "));
    assert!(
        refusal(b"PK\x03\x04...")
            .starts_with("my.csv:1:1: the file is a workbook of a spreadsheet program; ")
    );
    for empty in ["", " \n\n", "\u{feff}", "# only a comment\n"] {
        let message = refusal(empty);
        assert!(
            message.starts_with("my.csv:1:1: the file is empty; begin with a line like subject"),
            "{message}"
        );
    }
    assert!(refusal(format!("{HEADER}\n")).starts_with("my.csv:2:1: the table has a header but no rows; "));
    // A line end at the end of the file is allowed.
    assert_eq!(dataset(format!("{HEADER}\n{ROW}\r\n")).rows().len(), 1);
}

#[test]
fn separator_and_shape_faults() {
    assert_eq!(
        rows_refusal(&ROW.replace(',', "\t")),
        "my.csv:2:1: the fields are separated by tabs; separate them by commas, as in the header"
    );
    assert_eq!(
        rows_refusal("S1,i,47"),
        "my.csv:2:4: the line has 3 fields where the header has 10; give every column a value; check for a \
         quotation mark that is never closed"
    );
    assert_eq!(
        rows_refusal("S1,i,47,5,49,49,51,28,42,38,30"),
        "my.csv:2:11: the line has 11 fields where the header has 10; take out the surplus; between commas decimals \
         are written with a point, like 57.8"
    );
    // The unclosed quotation mark includes the rest of the file.
    assert!(rows_refusal(&format!("\"{ROW}\n{ROW}")).starts_with("my.csv:2:2: the line has 1 fields"));
}

#[test]
fn length_faults() {
    let number = "write millimetres with a decimal point, like 57.8, or NA where nothing was measured";
    let none = "write a measured length in millimetres, like 57.8, or NA where there is none";
    for (value, expected) in [
        ("abc", format!("GGm_mm is \"abc\", not a number; {number}")),
        ("49 mm", format!("GGm_mm is \"49 mm\", not a number; {number}")),
        ("-49", format!("GGm_mm is -49, not positive; {none}")),
        ("0", format!("GGm_mm is 0, not positive; {none}")),
        ("-0", format!("GGm_mm is -0, not positive; {none}")),
        ("inf", "GGm_mm is inf, not finite; write a measured length in millimetres, like 57.8".to_owned()),
        (
            "490",
            "GGm_mm is 490, too long for a tongue muscle (above 200 mm); write the length in millimetres, like \
             57.8; a column that is not of a muscle is ignored if its name has no unit"
                .to_owned(),
        ),
        (
            "4.9",
            "GGm_mm is 4.9, too short for millimetres (below 10): it looks like centimetres; multiply the lengths \
             by 10, or write cm in place of mm in the column's name"
                .to_owned(),
        ),
        (
            "0.049",
            "GGm_mm is 0.049, far too short for millimetres: it looks like metres; multiply the lengths by 1000, or \
             write m in place of mm in the column's name"
                .to_owned(),
        ),
    ] {
        assert_eq!(length_refusal(value), format!("my.csv:2:4: {expected}"));
    }
    // The column number is that of the file.
    let reordered = "HGp_mm,vowel,HGa_mm,SGa_mm,SGm_mm,SGp_mm,GGp_mm,GGm_mm,GGa_mm,subject";
    let message = refusal(format!("{reordered}\n30,i,38,42,28,51,49,-1,47,S1\n"));
    assert!(message.starts_with("my.csv:2:8: GGm_mm is -1"), "{message}");
    let long = length_refusal(&"x".repeat(100_000));
    assert_eq!(long, format!("my.csv:2:4: GGm_mm is \"{}...\", not a number; {number}", "x".repeat(40)));
    assert!(length_refusal(&"9".repeat(300)).len() < 300);
    // A column named in centimetres with numbers in millimetres.
    let message = refusal("subject,vowel,GGa_cm\nX,a,47\n");
    assert_eq!(
        message,
        "my.csv:2:3: GGa_cm is 47, which is 470 mm: not a length of a tongue muscle (10 to 200 mm); check the number, and \
         the unit that the column's name gives"
    );
}

#[test]
fn one_decimal_mark_a_table() {
    let decimals = |cells: [&str; 3]| {
        let rows: String = cells.iter().enumerate().map(|(n, c)| format!("X{n};a;{c}\n")).collect();
        dataset(format!("subject;vowel;GGa_mm\n{rows}"))
    };
    let data = decimals(["47,5", "47.5", "48,5"]);
    assert_eq!(
        data.broken()[0].fault.to_string(),
        "my.csv:3:3: GGa_mm is \"47.5\", with a decimal point; write it with a decimal comma: 47,5"
    );
    let data = decimals(["47.5", "48,5", "48"]);
    assert_eq!(
        data.broken()[0].fault.to_string(),
        "my.csv:3:3: GGa_mm is \"48,5\", with a decimal comma; write it with a decimal point: 48.5"
    );
    // A decimal comma in quotation marks is possible with commas between fields.
    let quoted = dataset("subject,vowel,GGa_mm\nX,a,\"47,5\"\n");
    assert_eq!(quoted.rows()[0].lengths.length_mm, [Some(47.5)]);
}

#[test]
fn subject_vowel_and_duplicate_faults() {
    assert_eq!(
        rows_refusal(&ROW.replacen('i', "", 1)),
        "my.csv:2:2: the vowel is \"\"; write a label of 1 to 40 printable characters, like a, ɔ or ə"
    );
    assert_eq!(
        rows_refusal(&ROW.replacen("S1", "", 1)),
        "my.csv:2:1: the subject is \"\"; give it a name of printable characters, like S2"
    );
    let message = rows_refusal(&ROW.replacen("S1", "\"S\n1\"", 1));
    assert!(message.starts_with("my.csv:2:1: the subject is \"S\\n1\"; "), "{message}");
    let first = ROW.replacen('i', "ɯ", 1);
    let (u, same) = (ROW.replacen('i', "u", 1), first.replace("47", "48"));
    // /u/ is another vowel if a table has both.
    assert!(dataset(format!("{HEADER}\n{u}\n{first}")).broken().is_empty());
    let data = dataset(format!("{HEADER}\n{first}\n\n{ROW}\n{same}"));
    assert_eq!(
        data.broken()[0].fault.to_string(),
        "my.csv:5:1: S1 /ɯ/ is given twice, here and on line 2; keep one of the two lines, or tell repetitions apart, \
         as in a1 and a2"
    );
    assert_eq!(data.baseline("S1").unwrap().length_mm_of("GGa"), Some(47.0));
}

#[test]
fn endless_input_and_other_files_are_refused() {
    let message = Dataset::from_reader(std::io::repeat(b'x'), "endless").unwrap_err().to_string();
    assert_eq!(message, "cannot read endless: it is larger than 64 MiB; split it into smaller files");
    let message = Dataset::from_path("no/such.csv").unwrap_err().to_string();
    assert!(message.starts_with("cannot read no/such.csv: "), "{message}");
    #[cfg(unix)]
    assert_eq!(
        Dataset::from_path("/dev/zero").unwrap_err().to_string(),
        "cannot read /dev/zero: it is a pipe or a device, which may never end; give a file"
    );
    assert!(refusal(format!("{HEADER}\n{}", "a\n".repeat(200_001))).contains("more than 200000 rows"));
    assert!(refusal("x,".repeat(20_000)).contains("the header has 20001 columns"));
}

#[test]
fn a_file_takes_the_place_of_the_built_in_table() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), REFERENCE).unwrap();
    let data = Dataset::from_path(file.path()).unwrap();
    assert_eq!(data.rows(), Dataset::reference().unwrap().rows());
    assert_eq!(data.origin(), file.path().display().to_string());
}
