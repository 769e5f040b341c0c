//! What the reader takes, how it understands it, and the message for everything that it refuses.

use proptest::prelude::*;

use super::read::read;
use super::*;

const REFERENCE: &str = include_str!("../../../targets/takano2007_lengths.csv");
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

/// The message for a good header over `rows`.
fn rows_refusal(rows: &str) -> String {
    refusal(format!("{HEADER}\n{rows}\n"))
}

/// The message for one good row with the field of GGm (column 4) replaced.
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

// The built-in table.

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
fn what_is_not_there_is_told_with_what_is() {
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
    assert!(matches!(data.baseline("S4"), Err(Error::MissingBaseline { has, .. }) if has.len() == 4));
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

// What spreadsheets and programs write.

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

#[test]
fn a_german_export_from_excel_is_read() {
    let text = "\u{feff}Proband;Vokal;GGa (mm);GGm (mm);Bemerkung;\r\nMüller;ɯ;46,5;56;gut, sehr;\r\nMüller;a;38;57,25;;\r\n;;;;;\r\n";
    let data = dataset(text);
    let reading = data.reading();
    assert_eq!((reading.encoding, reading.line_ends), (Encoding::Utf8Bom, LineEnds::Crlf));
    assert_eq!((reading.separator, reading.decimal_mark), (Separator::Semicolon, DecimalMark::Comma));
    assert_eq!(set_aside(&data), ["Bemerkung"]);
    assert!(data.broken().is_empty() && reading.rows_without_lengths.is_empty());
    // Two decimals are shown.
    assert_eq!(
        numbers(&data),
        [(Some(46.5), 0.005), (Some(56.0), 0.005), (Some(38.0), 0.005), (Some(57.25), 0.005)]
    );
    // What macOS types is decomposed.
    assert!(data.baseline("Mu\u{308}ller").is_ok());

    // The same as "Unicode text", as tab-separated text, with old line ends, and with Excel's first line.
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf16_be: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let tabs = text.replace(';', "\t");
    for same in [utf16, utf16_be, tabs.into_bytes(), text.replace("\r\n", "\r").into_bytes()] {
        assert_eq!(dataset(same).rows(), data.rows());
    }
    let marked = dataset(text.trim_start_matches('\u{feff}').replacen("Proband", "sep=;\r\nProband", 1));
    assert_eq!(marked.rows()[1].line, 4);
    assert_eq!(numbers(&marked), numbers(&data));
}

#[test]
fn what_r_writes_is_read() {
    // write.csv
    let data = dataset(
        "\"\",\"speaker\",\"phoneme\",\"GGa..mm.\",\"HG_cm\",\"age\"\n\"1\",\"X\",\"ɔ\",46.5,3.6,31\n\"2\",\"X\",\"u\",NA,3.9,31\n",
    );
    assert_eq!(set_aside(&data), ["", "age"]);
    assert_eq!(data.muscles(), ["GGa", "HG"]);
    assert_eq!(numbers(&data), [(Some(46.5), 0.05), (Some(36.0), 0.5), (None, 0.05), (Some(39.0), 0.5)]);
    assert_eq!(data.baseline("X").unwrap().length_mm_of("HG"), Some(39.0));
    // write.table(sep = "\t") names no column of row names.
    let table = dataset("speaker\tphoneme\tGGa_mm\n1\tX\tɔ\t46.5\n2\tX\tu\t47\n");
    assert_eq!(table.rows()[0].lengths.subject, "X");
    assert_eq!(table.rows()[0].lengths.length_mm, [Some(46.5)]);
}

#[test]
fn comments_in_front_are_skipped() {
    let data = dataset(format!("# tongue-fit 0.1.0\n#\n\n{HEADER}\n{ROW}\n#2{}\n", &ROW[2..]));
    assert_eq!((data.rows()[0].line, data.rows()[1].lengths.subject.as_str()), (5, "#2"));
}

#[test]
fn any_label_is_a_vowel_however_it_is_composed() {
    let data = dataset(
        "subject,vowel,GGa_mm\nX,/ɔ/,40\nX,æ,41\nX,ə,42\nX,o\u{303},43\nX,ɛ̃,44\nX,e,45\nX,E,46\nX,U,47\n",
    );
    let labels: Vec<_> = data.vowels("X").unwrap().iter().map(ToString::to_string).collect();
    assert_eq!(labels, ["ɔ", "æ", "ə", "õ", "ɛ\u{303}", "e", "E", "U"]);
    let length = |label| data.row("X", &vowel(label)).unwrap().length_mm[0].unwrap();
    assert_eq!([length("õ"), length("o\u{303}"), length("e"), length("E")], [43.0, 43.0, 45.0, 46.0]);
    assert_eq!(data.baseline("X").unwrap().length_mm, [Some(47.0)]);
    assert!(data.row("X", &vowel("ɯ\u{303}")).unwrap_err().to_string().ends_with("/E/, /U/"));
    // With both in the table, neither stands for the other.
    let both = dataset("subject,vowel,GGa_mm\nX,e,40\nX,E,41\n");
    assert_eq!(both.row("X", &vowel("E")).unwrap().length_mm, [Some(41.0)]);
}

#[test]
fn any_number_of_muscles_will_do() {
    for count in [1, 3, 11] {
        let names: Vec<_> = (0..count).map(|n| format!("muscle {n} (mm)")).collect();
        let cells: Vec<_> = (0..count).map(|n| format!("{}", 30 + n)).collect();
        let data = dataset(format!("{},subject,vowel\n{},X,a\n", names.join(","), cells.join(",")));
        assert_eq!(data.muscles().len(), count);
        assert_eq!(data.rows()[0].lengths.length_mm_of("Muscle 0"), Some(30.0));
    }
}

#[test]
fn missing_cells_are_not_measured_and_rows_of_them_are_not_there() {
    let row = |cells: &str| format!("{HEADER}\nS1,a,47,49,49,51,28,42,38,30\nS1,i,{cells}\n");
    let data = dataset(row(",NA,nan,-, * ,N/A,–,30"));
    assert_eq!(data.rows()[1].lengths.measured().collect::<Vec<_>>(), [("HGp", 30.0)]);
    let data = dataset(row(",,,,,,,"));
    assert_eq!((data.rows().len(), &data.reading().rows_without_lengths[..]), (1, &[3][..]));
    assert!(matches!(data.row("S1", &vowel("i")), Err(Error::MissingRow { .. })));
    assert_eq!(
        rows_refusal("S1,i,,,,,,,,"),
        "my.csv:3:1: no row has a length; write lengths in millimetres, like 57.8, where they were measured"
    );
}

#[test]
fn half_widths_come_from_columns_digits_or_the_user() {
    let table =
        |header: &str, cells: &str| dataset(format!("subject,vowel,{header}\nX,a,{cells}\nX,i,40,40,,\n"));
    let first = |data: &Dataset| data.rows()[0].lengths.half_width_mm.clone();
    let second = |data: &Dataset| data.rows()[1].lengths.half_width_mm.clone();

    let data = table("GGa_mm,HG_mm,half_width_mm,HG_error_cm", "40,41,0.7,0.2");
    assert_eq!((first(&data), second(&data)), (vec![0.7, 2.0], vec![0.5, 0.5]));
    let HalfWidth::Column { name, else_mm } = &data.reading().columns[1].half_width else { panic!() };
    assert_eq!((name.as_str(), *else_mm), ("HG_error_cm", 0.5));
    assert!(data.reading().set_aside.is_empty());

    for (cell, mm) in [("40", 0.5), ("40.0", 0.05), ("40.25", 0.005), ("4.05e1", 0.05)] {
        let data = table("GGa_mm,HG_mm,x,y", &format!("{cell},41,,"));
        assert_eq!(data.reading().columns[0].half_width, HalfWidth::Digits { mm });
        assert_eq!(first(&data), [mm; 2]);
    }
    let computed = table("GGa_mm,HG_mm,x,y", "40.2518273,41,,");
    assert_eq!(computed.reading().columns[0].half_width, HalfWidth::Default { mm: 0.5 });

    let given = computed.with_half_width_mm(1.0).unwrap();
    assert_eq!((first(&given), second(&given)), (vec![1.0; 2], vec![1.0; 2]));
    assert_eq!(given.reading().columns[1].half_width, HalfWidth::Given { mm: 1.0 });
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(given.clone().with_half_width_mm(wrong), Err(Error::BadHalfWidth { .. })));
    }

    let nobody = table("GGa_mm,HG_mm,SG_half_width_mm,speaker", "40,41,1,Y");
    assert_eq!(set_aside(&nobody), ["SG_half_width_mm", "speaker"]);
    let negative = dataset("subject,vowel,GGa_mm,error_mm\nX,a,40,-1\nX,i,40,1\n");
    assert_eq!(
        negative.broken()[0].fault.to_string(),
        "my.csv:2:4: error_mm is -1, no half width of a length; write one from 0 to 100 mm, like 0.5"
    );
}

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
    assert!(matches!(data.row("S2", &vowel("i")), Err(Error::UnknownSubject { .. })));
}

// What is refused.

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
    // A line end is nobody's fault.
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
    // The quotation mark swallows the rest of the file.
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
             57.8; a column that is no muscle is set aside where its name has no unit"
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
    // The column is that of the file.
    let reordered = "HGp_mm,vowel,HGa_mm,SGa_mm,SGm_mm,SGp_mm,GGp_mm,GGm_mm,GGa_mm,subject";
    let message = refusal(format!("{reordered}\n30,i,38,42,28,51,49,-1,47,S1\n"));
    assert!(message.starts_with("my.csv:2:8: GGm_mm is -1"), "{message}");
    let long = length_refusal(&"x".repeat(100_000));
    assert_eq!(long, format!("my.csv:2:4: GGm_mm is \"{}...\", not a number; {number}", "x".repeat(40)));
    assert!(length_refusal(&"9".repeat(300)).len() < 300);
    // A column in centimetres of numbers in millimetres.
    let message = refusal("subject,vowel,GGa_cm\nX,a,47\n");
    assert_eq!(
        message,
        "my.csv:2:3: GGa_cm is 47, which is 470 mm: no length of a tongue muscle (10 to 200 mm); check the number, and \
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
    // Quotation marks keep a decimal comma apart from the commas between fields.
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
    let (u, same) = (ROW.replacen('i', "u", 1), ROW.replacen('i', "ɯ", 1).replace("47", "48"));
    let data = dataset(format!("{HEADER}\n{u}\n\n{ROW}\n{same}"));
    assert_eq!(
        data.broken()[0].fault.to_string(),
        "my.csv:5:1: S1 /ɯ/ is given twice, here and on line 2; keep one of the two lines, or tell repetitions apart, \
         as in a1 and a2"
    );
    assert_eq!(data.baseline("S1").unwrap().length_mm_of("GGa"), Some(47.0));
}

#[test]
fn what_does_not_end_or_is_no_table_is_refused() {
    let message = Dataset::from_reader(std::io::repeat(b'x'), "endless").unwrap_err().to_string();
    assert_eq!(message, "cannot read endless: it is larger than 64 MiB; give less at a time");
    let message = Dataset::from_path("no/such.csv").unwrap_err().to_string();
    assert!(message.starts_with("cannot read no/such.csv: "), "{message}");
    #[cfg(unix)]
    assert_eq!(
        Dataset::from_path("/dev/zero").unwrap_err().to_string(),
        "cannot read /dev/zero: it is a pipe or a device, which need not end; give a file"
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

fn csv_line(subject: &str, vowel: &str, length_mm: &[f64]) -> String {
    let fields = [subject.to_owned(), vowel.to_owned()].into_iter();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields.chain(length_mm.iter().map(f64::to_string))).unwrap();
    String::from_utf8(writer.into_inner().unwrap()).unwrap()
}

/// A good table as spreadsheets of all kinds write it.
fn spellings() -> Vec<Vec<u8>> {
    let german = REFERENCE.replace(',', ";").replace("47;", "47,5;").replace('\n', "\r\n");
    let with_bom = format!("\u{feff}{german}");
    let utf16 = with_bom.replace(';', "\t").encode_utf16().flat_map(u16::to_le_bytes).collect();
    let half_widths = REFERENCE.replace("vowel,", "vowel,half_width_mm,").replace("a,", "a,0.5,");
    vec![REFERENCE.into(), with_bom.into_bytes(), utf16, half_widths.into_bytes()]
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read(&bytes, "noise").is_err(), "noise is no table");
    }

    #[test]
    fn a_damaged_table_is_read_or_refused_at_a_place_in_it(
        spelling in 0usize..4,
        at in 0usize..2000,
        gone in 0usize..20,
        put in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..6),
            "[\",;\n\r\t.0-9/ɯ -]{0,6}".prop_map(String::into_bytes),
        ],
    ) {
        let mut bytes = spellings().swap_remove(spelling);
        let at = at % bytes.len();
        let end = (at + gone).min(bytes.len());
        bytes.splice(at..end, put);
        let last_line = 1 + bytes.iter().filter(|b| b"\r\n".contains(b)).count() as u64;
        let in_it = |fault: &Malformed| (1..=last_line).contains(&fault.line) && fault.column >= 1;
        match Dataset::from_reader(&bytes[..], "damaged") {
            Ok(data) => {
                let lengths = || data.rows().iter().map(|r| &r.lengths);
                prop_assert!(data.rows().iter().all(|r| r.line <= last_line));
                prop_assert!(lengths().flat_map(Lengths::measured).all(|(_, l)| (10.0..=200.0).contains(&l)));
                prop_assert!(lengths().flat_map(|l| &l.half_width_mm).all(|w| (0.0..=100.0).contains(w)));
                prop_assert!(lengths().all(|l| l.length_mm.len() == data.muscles().len()));
                prop_assert!(data.broken().iter().all(|b| in_it(&b.fault)));
                for subject in data.subjects() {
                    for vowel in data.vowels(subject).unwrap() {
                        prop_assert_eq!(&data.row(subject, &vowel).unwrap().vowel, &vowel);
                    }
                }
            }
            Err(Error::Malformed(fault)) => prop_assert!(in_it(&fault), "{fault}"),
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit(
        rows in prop::collection::btree_map(
            ("[a-zA-Z0-9ɯé][^\\pC]{0,8}[a-z]", "[a-zɔæə]{1,3}"),
            prop::collection::vec(10.0f64..=200.0, 5),
            1..30,
        )
    ) {
        let lines: String = rows.iter().map(|((s, v), mm)| csv_line(s, v, mm)).collect();
        let data = dataset(format!("subject,vowel,A_mm,B_mm,C_mm,D_mm,E_mm\n{lines}"));
        for ((subject, label), mm) in &rows {
            let read = data.row(subject, &vowel(label)).unwrap();
            prop_assert_eq!(&read.length_mm, &mm.iter().copied().map(Some).collect::<Vec<_>>());
        }
    }
}
