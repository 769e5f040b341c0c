//! Formats that the reader accepts, how it understands them, and the message for everything that it refuses.

use proptest::prelude::*;

use super::number::mark_of;
use super::*;

const REFERENCE: &str = include_str!("../../../../../targets/takano2007_lengths.csv");
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

/// Messages about rows that cannot be used, and about cells.
fn faults(data: &Dataset) -> [Vec<String>; 2] {
    let rows = data.broken().iter().map(|row| row.fault.to_string()).collect();
    [rows, data.bad_cells().iter().map(ToString::to_string).collect()]
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
fn the_built_in_table_is_that_of_the_thesis_and_missing_rows_are_told_with_those_that_exist() {
    let data = Dataset::reference().unwrap();
    assert_eq!(data.muscles(), ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
    assert_eq!(data.subjects(), ["S1", "S2", "S3", "S4"]);
    assert_eq!(faults(&data), [vec![""; 0], vec![]]);
    assert!(data.reading().set_aside.is_empty() && data.rows().len() == 19);
    assert!(data.rows().iter().all(|r| r.lengths.half_width_mm == [0.5; 8]));
    for (subject, label, mm) in [
        ("S1", "i", [47.0, 49.0, 49.0, 51.0, 28.0, 42.0, 38.0, 30.0]),
        ("S2", "a", [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0]),
        ("S4", "o", [35.0, 66.0, 59.0, 46.0, 28.0, 45.0, 23.0, 25.0]),
        ("S2", "u", [46.0, 60.0, 45.0, 59.0, 32.0, 42.0, 42.0, 31.0]),
        ("S2", "う", [46.0, 60.0, 45.0, 59.0, 32.0, 42.0, 42.0, 31.0]),
    ] {
        assert_eq!(data.row(subject, &vowel(label)).unwrap().length_mm, mm.map(Some));
    }
    let labels = data.vowels("S4").unwrap();
    assert_eq!(labels.iter().map(Vowel::label).collect::<Vec<_>>(), ["i", "e", "a", "o"]);
    let a = data.row("S2", &vowel("a")).unwrap();
    assert_eq!(["SGm", "sgm", "XY"].map(|name| a.length_mm_of(name)), [Some(23.0), Some(23.0), None]);
    assert!(data.baseline("S2").is_ok());
    assert!(data.baseline("S4").unwrap_err().to_string().contains("it has /i/, /e/, /a/, /o/: choose one"));
    assert_eq!(data.baseline_vowel("S4", &vowel("e")).unwrap().vowel, vowel("e"));
    assert_eq!(data.row("S4", &vowel("A")).unwrap().vowel, vowel("a"));

    let origin = "targets/takano2007_lengths.csv (built in)";
    let message = |data: &Dataset, subject: &str, label: &str| {
        data.row(subject, &vowel(label)).unwrap_err().to_string()
    };
    assert_eq!(
        message(&data, "S22", "a"),
        format!("unknown subject \"S22\" in {origin}; did you mean \"S2\"? (known: S1, S2, S3, S4)")
    );
    assert_eq!(
        message(&data, "S4", "u"),
        format!("S4 has no row for /ɯ/ in {origin}; it has /i/, /e/, /a/, /o/")
    );
    let rows: String = (0..10_000).map(|n| format!("P{n},a,47,49,49,51,28,42,38,30\n")).collect();
    let many = dataset(format!("{HEADER}\n{rows}"));
    assert_eq!(many.subjects()[9_999], "P9999");
    assert_eq!(
        message(&many, "p77x", "a"),
        "unknown subject \"p77x\" in my.csv; did you mean \"P77\"? (one of 10000 subjects)"
    );
}

// Formats of spreadsheets and statistics programs.

#[test]
fn exports_of_excel_are_read() {
    let text = "\u{feff}Proband;Vokal;GGa (mm);GGm (mm);Bemerkung;\r\nMüller;ɯ;46,5;56;gut, sehr;\r\nMüller;a;38;57,25;;\r\n;;;;;\r\n";
    let data = dataset(text);
    let reading = data.reading();
    assert_eq!((reading.encoding, reading.line_ends), (Encoding::Utf8Bom, LineEnds::Crlf));
    assert_eq!((reading.separator, reading.decimal_mark), (Separator::Semicolon, DecimalMark::Comma));
    assert_eq!(set_aside(&data), ["Bemerkung"]);
    assert!(data.broken().is_empty() && reading.rows_without_lengths.is_empty());
    // The lengths have two decimals.
    let lengths = [(Some(46.5), 0.005), (Some(56.0), 0.005), (Some(38.0), 0.005), (Some(57.25), 0.005)];
    assert_eq!(numbers(&data), lengths);
    // macOS types decomposed letters.
    assert!(data.baseline("Mu\u{308}ller").is_ok());

    // The same as "Unicode text", as tab-separated text, with old line ends, with Excel's first line, and under a title.
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf16_be: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let tabs = text.replace(';', "\t");
    for same in [utf16, utf16_be, tabs.into_bytes(), text.replace("\r\n", "\r").into_bytes()] {
        assert_eq!(dataset(same).rows(), data.rows());
    }
    for title in
        ["sep=;\r\n", "Zungenmuskeln, Längen in mm;;;;;\r\n", "\"Längen\r\nvon 2020\"\r\n\r\n# Kommentar\r\n"]
    {
        let under = dataset(text.replacen("Proband", &format!("{title}Proband"), 1));
        assert_eq!(numbers(&under), lengths, "{title}");
        let lines = title.matches('\n').count() as u64;
        assert_eq!((under.reading().header_line, under.rows()[1].line), (1 + lines, 3 + lines), "{title}");
    }
}

#[test]
fn japanese_tables_are_read() {
    let data = dataset(
        "舌筋の長さ\n話者,母音,ＧＧａ（ｃｍ）,HGa（㎜）\nＳ１,う,４．６５,36.1\nS1,ア,3.8,３３\nS1,ｴ,3.9,－\n",
    );
    assert_eq!(faults(&data), [vec![""; 0], vec![]]);
    let reading = data.reading();
    assert_eq!((reading.header_line, &*reading.subject, &*reading.vowel), (2, "話者", "母音"));
    assert_eq!(data.muscles(), ["GGa", "HGa"]);
    let labels: Vec<_> = data.vowels("S1").unwrap().iter().map(ToString::to_string).collect();
    assert_eq!(labels, ["ɯ", "a", "e"]);
    assert_eq!(data.baseline("Ｓ１").unwrap().length_mm, [Some(46.5), Some(36.1)]);
    assert_eq!(data.row("S1", &vowel("あ")).unwrap().length_mm, [Some(38.0), Some(33.0)]);
    assert_eq!(data.row("S1", &vowel("エ")).unwrap().length_mm, [Some(39.0), None]);
}

#[test]
fn tables_of_r_are_read() {
    // write.csv
    let data = dataset(
        "\"\",\"speaker\",\"phoneme\",\"GGa..mm.\",\"HG_cm\",\"age\"\n\"1\",\"X\",\"ɔ\",46.5,3.6,31\n\"2\",\"X\",\"u\",NA,3.9,31\n",
    );
    assert_eq!(set_aside(&data), ["", "age"]);
    assert_eq!(data.muscles(), ["GGa", "HG"]);
    assert_eq!(numbers(&data), [(Some(46.5), 0.05), (Some(36.0), 0.5), (None, 0.05), (Some(39.0), 0.5)]);
    assert_eq!(data.baseline("X").unwrap().length_mm_of("HG"), Some(39.0));
    // write.table(sep = "\t") writes row names without a column name.
    let table = dataset("speaker\tphoneme\tGGa_mm\n1\tX\tɔ\t46.5\n2\tX\tu\t47\n");
    assert_eq!(table.rows()[0].lengths.subject, "X");
    assert_eq!(table.rows()[0].lengths.length_mm, [Some(46.5)]);
}

#[test]
fn order_blank_lines_spaces_and_comments_do_not_count() {
    let reversed: Vec<_> = REFERENCE
        .lines()
        .map(|line| format!("\n {} \n", line.rsplit(',').collect::<Vec<_>>().join(" , ")))
        .collect();
    let (data, straight) = (dataset(reversed.concat()), dataset(REFERENCE));
    for (number, (row, same)) in data.rows().iter().zip(straight.rows()).enumerate() {
        assert!(same.lengths.measured().all(|(muscle, mm)| row.lengths.length_mm_of(muscle) == Some(mm)));
        assert_eq!((row.line, same.line), (2 * number as u64 + 4, number as u64 + 2));
    }
    let data = dataset(format!("# tongue-fit 0.1.0\n#\n\n{HEADER}\n# from here\n{ROW}\n#2{}\n", &ROW[2..]));
    assert_eq!((data.rows()[0].line, data.rows()[1].lengths.subject.as_str()), (6, "#2"));
    for count in [1, 3, 11] {
        let names: Vec<_> = (0..count).map(|n| format!("muscle {n} (mm)")).collect();
        let cells: Vec<_> = (0..count).map(|n| format!("{}", 30 + n)).collect();
        let data = dataset(format!("{},subject,vowel\n{},X,a\n", names.join(","), cells.join(",")));
        assert_eq!(data.muscles().len(), count);
        assert_eq!(data.rows()[0].lengths.length_mm_of("Muscle 0"), Some(30.0));
    }
}

#[test]
fn column_names_determine_their_meaning() {
    for (name, is) in [
        ("SUBJECT", "subject"),
        ("Speaker ID", "subject"),
        ("被験者", "subject"),
        ("Phoneme", "vowel"),
        ("GGa_mm", "GGa in mm"),
        ("GGa (mm)", "GGa in mm"),
        ("GGa..mm.", "GGa in mm"),
        ("GGa [CM]", "GGa in cm"),
        ("GGa（cm）", "GGa in cm"),
        ("GGa_m", "GGa in m"),
        ("GG_a_mm", "GG_a in mm"),
        ("m. genioglossus ant. [mm]", "m. genioglossus ant in mm"),
        ("舌骨舌筋_mm", "舌骨舌筋 in mm"),
        ("half_width_mm", "half width"),
        ("Error (mm)", "half width"),
        ("Z half-width (cm)", "half width"),
        ("Z_error_mm", "half width"),
        ("terror_mm", "terror in mm"),
        ("GGa", "other"),
        ("GGm", "other"),
        ("mm", "other"),
        ("_mm", "other"),
        ("", "other"),
        ("age", "other"),
        ("F1_Hz", "other"),
    ] {
        // The first two are the last of the names that are known.
        let data = dataset(format!("発話者,音素,Z_mm,{name}\nX,a,40,31\n"));
        let reading = data.reading();
        let first = &reading.columns[0].half_width;
        let told = match &reading.columns[..] {
            [_] if reading.subject == name => "subject".to_owned(),
            [_] if reading.vowel == name => "vowel".to_owned(),
            [_] if matches!(first, HalfWidth::Column { .. }) => "half width".to_owned(),
            [_] => "other".to_owned(),
            columns => {
                let other = columns.iter().find(|c| c.muscle != "Z").unwrap();
                format!("{} in {}", other.muscle, other.unit.symbol())
            }
        };
        assert_eq!(told, is, "{name}");
    }
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
    // If both are in the table, neither stands for the other.
    let both = dataset("subject,vowel,GGa_mm\nX,e,40\nX,E,41\nX,u,42\nX,う,43\n");
    assert_eq!(both.row("X", &vowel("E")).unwrap().length_mm, [Some(41.0)]);
    assert_eq!(both.row("X", &"u".parse().unwrap()).unwrap().length_mm, [Some(42.0)]);
    assert_eq!(both.baseline("X").unwrap().length_mm, [Some(43.0)]);
}

#[test]
fn missing_cells_are_unmeasured_and_rows_of_them_are_ignored() {
    let row = |cells: &str| dataset(format!("{HEADER}\nS1,a,47,49,49,51,28,42,38,30\nS1,i,{cells}\n"));
    let data = row(",NA,nan,-, * ,N/A,–,30");
    assert_eq!(data.rows()[1].lengths.measured().collect::<Vec<_>>(), [("HGp", 30.0)]);
    let data = row(",,,,,,,");
    assert_eq!((data.rows().len(), &data.reading().rows_without_lengths[..]), (1, &[3][..]));
    assert!(data.row("S1", &vowel("i")).unwrap_err().to_string().starts_with("S1 has no row for /i/"));
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
        assert!(given.clone().with_half_width_mm(wrong).is_err());
    }
    let nobody = table("GGa_mm,HG_mm,SG_half_width_mm,speaker", "40,41,1,Y");
    assert_eq!(set_aside(&nobody), ["SG_half_width_mm", "speaker"]);
    // Of a half width that cannot be read the digits take the place.
    let negative = dataset("subject,vowel,GGa_mm,HG_mm,error_mm\nX,a,40,41,-1\nX,i,40,41,1\n");
    let told = "my.csv:2:5: error_mm is -1, which is not a half width of a length; write one from 0 to 100 mm, like 0.5";
    assert_eq!(faults(&negative), [vec![], vec![told]]);
    assert_eq!((first(&negative), second(&negative)), (vec![0.5; 2], vec![1.0; 2]));
}

#[test]
fn lengths_in_other_units_have_the_bits_of_millimetres() {
    // The texts are built from digits, because division by ten rounds.
    let mm = |tenths: u32| format!("{}.{}", tenths / 10, tenths % 10);
    let row = |tenths: u32| {
        let (whole, tenth) = (tenths / 10, tenths % 10);
        format!("X,{tenths},{},{}.{}{tenth},0.{whole:03}{tenth}\n", mm(tenths), whole / 10, whole % 10)
    };
    let table: String = (100..2000).map(row).collect();
    let header = "subject,vowel,A_mm,B_cm,C_m\n";
    for table in [format!("{header}{table}"), format!("{header}{table}").replace(',', ";").replace('.', ",")]
    {
        let data = dataset(table);
        for (row, tenths) in data.rows().iter().zip(100..2000) {
            assert_eq!(row.lengths.length_mm, [Some(f64::from(tenths) / 10.0); 3]);
            assert_eq!(row.lengths.half_width_mm, [0.05; 3]);
        }
        assert_eq!(data.rows().len(), 1900);
    }
    for none in ["57", "", "a,b", "5,7,8", "1.234,5", "1,234.5"] {
        assert_eq!(mark_of(none), None, "{none}");
    }
    let mm =
        |cell: &str| dataset(format!("subject,vowel,A_cm\nX,a,{cell}\n")).rows()[0].lengths.half_width_mm[0];
    assert_eq!([mm("5.7"), mm("6"), mm("6.25")], [0.5, 5.0, 0.05]);
}

// What cannot be used.

#[test]
fn a_bad_cell_loses_one_cell_and_a_broken_row_one_row() {
    let data = dataset(format!(
        "{HEADER}\n{ROW}\nS1,a,34,57,51,abc,20,500,34,34\nS2,a,41\n,a,41,62,53,59,23,44,33,35\nS1,i,47,49,49,51,28,42,38,31\n\
         S3,a,x,x,x,x,x,x,x,x\n"
    ));
    let places: Vec<_> = data.broken().iter().map(|b| (b.fault.line, b.fault.column)).collect();
    assert_eq!(places, [(4, 4), (5, 1), (6, 1), (7, 3)]);
    let places: Vec<_> = data.bad_cells().iter().map(|fault| (fault.line, fault.column)).collect();
    assert_eq!(places, [(3, 6), (3, 8)]);
    let a = data.row("S1", &vowel("a")).unwrap();
    assert_eq!(
        a.measured().map(|(name, _)| name).collect::<Vec<_>>(),
        ["GGa", "GGm", "GGp", "SGm", "HGa", "HGp"]
    );
    assert_eq!(data.bad_cells_of(a).count(), 2);
    assert!(data.bad_cells()[0].to_string().starts_with("my.csv:3:6: SGp_mm is \"abc\", not a number"));
    let i = data.row("S1", &vowel("i")).unwrap();
    assert_eq!((i.length_mm_of("HGp"), data.bad_cells_of(i).count()), (Some(30.0), 0));
    for (subject, expected) in
        [("S2", "my.csv:4:4: the line has 3 fields"), ("S3", "my.csv:7:3: GGa_mm is \"x\", not a number")]
    {
        let message = data.row(subject, &vowel("a")).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
    assert!(data.row("S2", &vowel("i")).unwrap_err().to_string().starts_with("unknown subject \"S2\""));
}

#[test]
fn header_faults_quote_the_line_that_was_taken() {
    let taken = |header: &str| {
        let quoted: String = header.chars().take(40).collect();
        format!("line 1 was taken for the header: \"{quoted}...\"; {WANTED}")
    };
    let with = |from, to| refusal(format!("{}\n{ROW}\n", HEADER.replacen(from, to, 1)));
    assert_eq!(
        with("subject", "subjct"),
        format!(
            "my.csv:1:11: missing from the header: subject; is column \"subjct\" meant to be subject?; {}",
            taken("subjct,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm")
        )
    );
    let bare = HEADER.replace("_mm", "");
    assert_eq!(
        refusal(format!("{bare}\n{ROW}\n")),
        format!(
            "my.csv:1:11: missing from the header: a length, like GGa_mm; if column \"GGa\" has lengths, its name must end with \
             their unit; {}",
            taken(&bare)
        )
    );
    assert_eq!(
        refusal("Lengths\nname,vowel,GGa\nX,a,40\n"),
        format!(
            "my.csv:2:4: missing from the header: subject, a length, like GGa_mm; if column \"GGa\" has lengths, its name \
             must end with their unit; line 2 was taken for the header: \"name,vowel,GGa\"; {WANTED}"
        )
    );
    for (to, expected) in [
        ("GGa_cm", "column GGa_cm says the same as column 3 (GGa_mm)"),
        ("GGa_mm", "column GGa_mm appears twice, here and as column 3"),
        ("subject", "column subject appears twice, here and as column 1"),
    ] {
        assert_eq!(with("GGm_mm", to), format!("my.csv:1:4: {expected}; keep one of the two"));
    }
    assert!(refusal("x,".repeat(20_000)).contains("the header has 20001 columns"));
}

/// As ten new users wrote them.
#[test]
fn tables_of_other_forms_are_refused_with_what_to_write_instead() {
    for (table, told) in [
        ("subject vowel GGa_mm\nP1 a 41\n", "1:1: the table has fewer than two columns; line 1 was"),
        ("| subject | vowel | GGa_mm |\n|---|---|---|\n", "1:1: the table has fewer than two columns"),
        ("[{\"subject\": \"P1\", \"GGa_mm\": 41}]", "1:1: the file is JSON, XML or a page, not a table"),
        ("subject,vowel,muscle,length_mm\nP1,a,GGa,41\n", "1:3: column muscle names muscles, so that each"),
        ("muscle,u,a\nGGa,46,41\n", "1:1: column muscle names muscles, so that each has rows of its own"),
        ("subject,vowel,GGa\nP1,a,46 mm\n", "1:4: missing from the header: a length, like GGa_mm; if column"),
        ("subject,vowel,GGa\n,,mm\nP1,a,46\n", "1:4: missing from the header: a length, like GGa_mm; if"),
        ("subject,vowel,A_mm,B_mm,C_mm\nP1,u,100,100,100\n", "2:3: every length is 100; write the measured"),
    ] {
        let message = refusal(table);
        assert!(message.starts_with(&format!("my.csv:{told}")), "{message}");
    }
    let exchanged = dataset("subject,vowel,GGa_mm\na,P1,41\n");
    assert_eq!(
        exchanged.row("P1", &vowel("a")).unwrap_err().to_string(),
        "unknown subject \"P1\" in my.csv; it is in column vowel; are subject and vowel exchanged?"
    );
}

#[test]
fn what_is_no_table_is_refused() {
    let latin1 = [HEADER.as_bytes(), b"\nS1,\xFC,47"].concat();
    for (bytes, expected) in [
        (&latin1[..], "my.csv:2:2: the text is not UTF-8; save the file as UTF-8"),
        (b"\xFF\xFEs\0u", "my.csv:1:1: the text begins as UTF-16 does, but is damaged"),
        (b"s\0u\0b\0", "my.csv:1:1: the text holds a zero byte; "),
        (b"PK\x03\x04...", "my.csv:1:1: the file is a workbook of a spreadsheet program; "),
        (b"", "my.csv:1:1: the file is empty; begin with a line like subject"),
        (b" \n\n", "my.csv:1:1: the file is empty; begin with a line like subject"),
        ("\u{feff}".as_bytes(), "my.csv:1:1: the file is empty; begin with a line like subject"),
        (b"# only a comment\n", "my.csv:1:1: the file is empty; begin with a line like subject"),
        (
            format!("{HEADER}\n").as_bytes(),
            "my.csv:2:1: the table has a header but no rows; line 1 was taken",
        ),
        (
            REFERENCE.replace("_mm", "_cm").as_bytes(),
            "my.csv:2:3: GGa_cm is 47, which is 470 mm: not a length",
        ),
    ] {
        let message = refusal(bytes);
        assert!(message.starts_with(expected), "{message}");
    }
    assert!(refusal(format!("{HEADER}\n{}", "a\n".repeat(200_001))).contains("more than 200000 rows"));
    let message = Dataset::from_reader(std::io::repeat(b'x'), "endless").unwrap_err().to_string();
    assert_eq!(message, "cannot read endless: it is larger than 64 MiB; split it into smaller files");
    let message = Dataset::from_path("no/such.csv").unwrap_err().to_string();
    assert!(message.starts_with("cannot read no/such.csv: "), "{message}");
    #[cfg(unix)]
    assert_eq!(
        Dataset::from_path("/dev/zero").unwrap_err().to_string(),
        "cannot read /dev/zero: it is a pipe or a device, which may never end; give a file"
    );
    // A line end at the end of the file is allowed, and a file may take the place of the built-in table.
    assert_eq!(dataset(format!("{HEADER}\n{ROW}\r\n")).rows().len(), 1);
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), REFERENCE).unwrap();
    let data = Dataset::from_path(file.path()).unwrap();
    assert_eq!(data.rows(), Dataset::reference().unwrap().rows());
    assert_eq!(data.origin(), file.path().display().to_string());
}

#[test]
fn rows_are_refused_with_the_reason() {
    for (row, expected) in [
        (
            ROW.replace(',', "\t"),
            "2:1: the fields are separated by tabs; separate them by commas, as in the header",
        ),
        (
            "S1,i,47".to_owned(),
            "2:4: the line has 3 fields where the header, line 1, has 10; give every column a value; check for a \
             quotation mark that is never closed",
        ),
        (
            "S1,i,47,5,49,49,51,28,42,38,30".to_owned(),
            "2:11: the line has 11 fields where the header, line 1, has 10; take out the surplus; between commas \
             decimals are written with a point, like 57.8",
        ),
        (
            ROW.replacen('i', "", 1),
            "2:2: the vowel is \"\"; write a label of 1 to 40 printable characters, like a, ɔ or ə",
        ),
        (
            ROW.replacen("S1", "", 1),
            "2:1: the subject is \"\"; give it a name of printable characters, like S2",
        ),
        (
            ROW.replacen("S1", "\"S\n1\"", 1),
            "2:1: the subject is \"S\\n1\"; give it a name of printable characters, like S2",
        ),
        (
            ROW.replacen("S1", "S\u{1b}[31m", 1),
            "2:1: the subject is \"S\\u{1b}[31m\"; give it a name of printable characters, like S2",
        ),
    ] {
        assert_eq!(rows_refusal(&row), format!("my.csv:{expected}"));
    }
    // The unclosed quotation mark includes the rest of the file.
    assert!(rows_refusal(&format!("\"{ROW}\n{ROW}")).starts_with("my.csv:2:2: the line has 1 fields"));
    let first = ROW.replacen('i', "ɯ", 1);
    let (u, same) = (ROW.replacen('i', "u", 1), first.replace("47", "48"));
    // /u/ is another vowel if a table has both.
    assert!(dataset(format!("{HEADER}\n{u}\n{first}")).broken().is_empty());
    let data = dataset(format!("{HEADER}\n{first}\n\n{ROW}\n{same}"));
    let told = "my.csv:5:1: S1 /ɯ/ is given twice, here and on line 2; keep one of the two lines, or tell repetitions \
                apart, as in a1 and a2";
    assert_eq!(faults(&data), [vec![told], vec![]]);
    assert_eq!(data.baseline("S1").unwrap().length_mm_of("GGa"), Some(47.0));
}

#[test]
fn lengths_are_refused_with_the_reason_and_an_example_in_their_unit() {
    let not_a_number = |unit: &str| {
        format!("not a number; write {unit} with a decimal point, or NA where nothing was measured")
    };
    let millimetres = not_a_number("millimetres like 57.8");
    let none = "write a measured length in millimetres, like 57.8, or NA where there is none";
    let check = "not a length of a tongue muscle (10 to 200 mm); check the number, and the unit that the column's name gives";
    let long = "x".repeat(100_000);
    for (unit, cell, expected) in [
        ("mm", "abc", format!("is \"abc\", {millimetres}")),
        ("mm", "49 mm", format!("is \"49 mm\", {millimetres}")),
        ("cm", "4.9 cm", format!("is \"4.9 cm\", {}", not_a_number("centimetres like 5.78"))),
        ("m", "x", format!("is \"x\", {}", not_a_number("metres like 0.0578"))),
        ("mm", &long, format!("is \"{}...\", {millimetres}", "x".repeat(40))),
        ("mm", "-49", format!("is -49, not positive; {none}")),
        ("mm", "0", format!("is 0, not positive; {none}")),
        ("mm", "-0", format!("is -0, not positive; {none}")),
        ("mm", "inf", "is inf, not finite; write a measured length in millimetres, like 57.8".to_owned()),
        (
            "mm",
            "490",
            "is 490, too long for a tongue muscle (above 200 mm); write a measured length in millimetres, like 57.8; a \
             column that is not of a muscle is ignored if its name has no unit"
                .to_owned(),
        ),
        (
            "mm",
            "4.9",
            "is 4.9, too short for millimetres (below 10): it looks like centimetres; multiply the lengths by 10, or \
             write cm in place of mm in the column's name"
                .to_owned(),
        ),
        (
            "mm",
            "0.049",
            "is 0.049, too short for millimetres (below 10): it looks like metres; multiply the lengths by 1000, or \
             write m in place of mm in the column's name"
                .to_owned(),
        ),
        ("cm", "47", format!("is 47, which is 470 mm: {check}")),
        ("cm", "1e308", "is 1e308, not finite; write a measured length in centimetres, like 5.78".to_owned()),
        ("cm", "1e306", format!("is 1e306, which is 1{}... mm: {check}", "0".repeat(39))),
    ] {
        let data = dataset(format!("subject,vowel,GGa_mm,GGm_{unit}\nX,a,40,{cell}\n"));
        assert_eq!(faults(&data), [vec![], vec![format!("my.csv:2:4: GGm_{unit} {expected}")]]);
        assert_eq!(data.rows()[0].lengths.length_mm, [Some(40.0), None]);
    }
    // What the message tells is read.
    for (unit, cell) in
        [("mm", "57.8"), ("cm", "5.78"), ("m", "0.0578"), ("mm", "57,8"), ("cm", "5,78"), ("m", "0,0578")]
    {
        let data = dataset(format!("subject;vowel;GGa_{unit}\nX;a;{cell}\nX;e;?\n"));
        assert_eq!(data.rows()[0].lengths.length_mm, [Some(57.8)]);
        let told = &data.broken()[0].fault.help;
        assert!(told.contains(&format!("like {cell} ")), "{told}");
    }
    // The column number is that of the file.
    let reordered = "HGp_mm,vowel,HGa_mm,SGa_mm,SGm_mm,SGp_mm,GGp_mm,GGm_mm,GGa_mm,subject";
    let data = dataset(format!("{reordered}\n30,i,38,42,28,51,49,-1,47,S1\n"));
    assert!(faults(&data)[1][0].starts_with("my.csv:2:8: GGm_mm is -1"));
}

#[test]
fn one_decimal_mark_a_table() {
    for (cells, told) in [
        (
            ["47,5", "47.5", "48,5"],
            "GGa_mm is \"47.5\", with a decimal point; write it with a decimal comma, as the others: 47,5",
        ),
        (
            ["47.5", "48,5", "48"],
            "GGa_mm is \"48,5\", with a decimal comma; write it with a decimal point, as the others: 48.5",
        ),
    ] {
        let rows: String = cells.iter().enumerate().map(|(n, c)| format!("X{n};a;{c}\n")).collect();
        let data = dataset(format!("subject;vowel;GGa_mm\n{rows}"));
        assert_eq!(data.broken()[0].fault.to_string(), format!("my.csv:3:3: {told}"));
    }
    // A decimal comma in quotation marks is possible with commas between fields.
    let quoted = dataset("subject,vowel,GGa_mm\nX,a,\"47,5\"\n");
    assert_eq!(quoted.rows()[0].lengths.length_mm, [Some(47.5)]);
}

fn csv_line(subject: &str, vowel: &str, length_mm: &[f64]) -> String {
    let fields = [subject.to_owned(), vowel.to_owned()].into_iter();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields.chain(length_mm.iter().map(f64::to_string))).unwrap();
    String::from_utf8(writer.into_inner().unwrap()).unwrap()
}

proptest! {
    #[test]
    fn written_tables_are_read_back_to_the_bit(
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
