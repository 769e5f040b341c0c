//! Tables of lengths are read in the formats of spreadsheets and statistics programs, and the reading is reported.

use proptest::prelude::*;
use tongue_fit::measured::{Dataset, Vowel};
use tongue_input::measured::lengths::{DecimalMark, Encoding, HalfWidth, LineEnds, Separator};

use crate::fixtures::{says, vowel};
use crate::lengths_are_refused::{HEADER, REFERENCE, ROW, dataset, faults};

fn set_aside(data: &Dataset) -> Vec<&str> {
    data.reading.set_aside.iter().map(|s| s.name.as_str()).collect()
}

/// Lengths and half widths, mm, row by row.
fn numbers(data: &Dataset) -> Vec<(Option<f64>, f64)> {
    let rows = data.rows.iter().map(|r| &r.lengths);
    rows.flat_map(|l| l.length_mm.iter().copied().zip(l.half_width_mm.iter().copied())).collect()
}

fn labels(data: &Dataset, subject: &str) -> Vec<String> {
    data.vowels(subject).unwrap().iter().map(ToString::to_string).collect()
}

#[test]
fn the_built_in_table_is_that_of_the_thesis_and_missing_rows_are_told_with_those_that_exist() {
    let data = Dataset::reference().unwrap();
    assert_eq!(data.muscles[..], ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
    assert_eq!(data.subjects(), ["S1", "S2", "S3", "S4"]);
    assert_eq!(faults(&data), [vec![""; 0], vec![]]);
    assert!(data.reading.set_aside.is_empty() && data.rows.len() == 19);
    assert!(data.rows.iter().all(|r| r.lengths.half_width_mm == [0.5; 8]));
    for (subject, label, mm) in [
        ("S1", "i", [47.0, 49.0, 49.0, 51.0, 28.0, 42.0, 38.0, 30.0]),
        ("S2", "a", [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0]),
        ("S4", "o", [35.0, 66.0, 59.0, 46.0, 28.0, 45.0, 23.0, 25.0]),
        ("S2", "う", [46.0, 60.0, 45.0, 59.0, 32.0, 42.0, 42.0, 31.0]),
    ] {
        assert_eq!(data.row(subject, &vowel(label)).unwrap().length_mm, mm.map(Some));
    }
    assert_eq!(labels(&data, "S4"), ["i", "e", "a", "o"]);
    let a = data.row("S2", &vowel("A")).unwrap();
    assert_eq!(["SGm", "sgm", "XY"].map(|name| a.length_mm_of(name)), [Some(23.0), Some(23.0), None]);
    assert_eq!(data.baseline("S2").unwrap().vowel, Vowel::unrounded_u());
    assert_eq!(data.baseline_vowel("S4", &vowel("e")).unwrap().vowel, vowel("e"));

    let rows: String = (0..10_000).map(|n| format!("P{n},a,47,49,49,51,28,42,38,30\n")).collect();
    let many = dataset(format!("{HEADER}\n{rows}"));
    assert_eq!(many.subjects()[9_999], "P9999");
    for (data, subject, label, expected) in [
        (
            &data,
            "S22",
            "a",
            "\"S22\" in targets/takano2007_lengths.csv (built in); did you mean \"S2\"? (known: S1, S2,",
        ),
        (
            &data,
            "S4",
            "u",
            "S4 has no row for /ɯ/ in targets/takano2007_lengths.csv (built in); it has /i/, /e/, /a/",
        ),
        (&many, "p77x", "a", "subject \"p77x\" in my.csv; did you mean \"P77\"? (one of 10000 subjects)"),
    ] {
        says(data.row(subject, &vowel(label)), expected);
    }
}

#[test]
fn exports_of_excel_are_read() {
    let text = "\u{feff}Proband;Vokal;GGa (mm);GGm (mm);Bemerkung;\r\nMüller;ɯ;46,5;56;gut, sehr;\r\nMüller;a;38;57,25;;\r\n;;;;;\r\n";
    let data = dataset(text);
    let reading = &data.reading;
    assert_eq!((reading.encoding, reading.line_ends), (Encoding::Utf8Bom, LineEnds::Crlf));
    assert_eq!((reading.separator, reading.decimal_mark), (Separator::Semicolon, DecimalMark::Comma));
    assert_eq!(set_aside(&data), ["Bemerkung"]);
    assert!(data.broken.is_empty() && reading.rows_without_lengths.is_empty());
    // The lengths have two decimals.
    let lengths = [(Some(46.5), 0.005), (Some(56.0), 0.005), (Some(38.0), 0.005), (Some(57.25), 0.005)];
    assert_eq!(numbers(&data), lengths);
    // macOS writes decomposed letters.
    assert!(data.baseline("Mu\u{308}ller").is_ok());

    // The same table as "Unicode text", separated by tabs, with line ends CR, with Excel's first line, and under a title.
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf16_be: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let tabs = text.replace(';', "\t");
    for same in [utf16, utf16_be, tabs.into_bytes(), text.replace("\r\n", "\r").into_bytes()] {
        assert_eq!(dataset(same).rows, data.rows);
    }
    for title in
        ["sep=;\r\n", "Zungenmuskeln, Längen in mm;;;;;\r\n", "\"Längen\r\nvon 2020\"\r\n\r\n# Kommentar\r\n"]
    {
        let under = dataset(text.replacen("Proband", &format!("{title}Proband"), 1));
        assert_eq!(numbers(&under), lengths, "{title}");
        let lines = title.matches('\n').count() as u64;
        assert_eq!((under.reading.header_line, under.rows[1].line), (1 + lines, 3 + lines), "{title}");
    }
}

#[test]
fn japanese_tables_and_those_of_r_are_read() {
    let data = dataset(
        "舌筋の長さ\n話者,母音,ＧＧａ（ｃｍ）,HGa（㎜）\nＳ１,う,４．６５,36.1\nS1,ア,3.8,３３\nS1,ｴ,3.9,－\n",
    );
    assert_eq!(faults(&data), [vec![""; 0], vec![]]);
    let reading = &data.reading;
    assert_eq!((reading.header_line, &*reading.subject, &*reading.vowel), (2, "話者", "母音"));
    assert_eq!(data.muscles[..], ["GGa", "HGa"]);
    assert_eq!(labels(&data, "S1"), ["ɯ", "a", "e"]);
    assert_eq!(data.baseline("Ｓ１").unwrap().length_mm, [Some(46.5), Some(36.1)]);
    assert_eq!(data.row("S1", &vowel("あ")).unwrap().length_mm, [Some(38.0), Some(33.0)]);
    assert_eq!(data.row("S1", &vowel("エ")).unwrap().length_mm, [Some(39.0), None]);
    // As R's write.csv writes it.
    let data = dataset(
        "\"\",\"speaker\",\"phoneme\",\"GGa..mm.\",\"HG_cm\",\"age\"\n\"1\",\"X\",\"ɔ\",46.5,3.6,31\n\"2\",\"X\",\"u\",NA,3.9,31\n",
    );
    assert_eq!(set_aside(&data), ["", "age"]);
    assert_eq!(data.muscles[..], ["GGa", "HG"]);
    assert_eq!(numbers(&data), [(Some(46.5), 0.05), (Some(36.0), 0.5), (None, 0.05), (Some(39.0), 0.5)]);
    assert_eq!(data.baseline("X").unwrap().length_mm_of("HG"), Some(39.0));
    // write.table(sep = "\t") writes row names without a header for them.
    let table = dataset("speaker\tphoneme\tGGa_mm\n1\tX\tɔ\t46.5\n2\tX\tu\t47\n");
    let first = &table.rows[0].lengths;
    assert_eq!((first.subject.as_str(), &first.length_mm[..]), ("X", &[Some(46.5)][..]));
}

#[test]
fn order_blank_lines_spaces_and_comments_do_not_count() {
    let reversed: Vec<_> = REFERENCE
        .lines()
        .map(|line| format!("\n {} \n", line.rsplit(',').collect::<Vec<_>>().join(" , ")))
        .collect();
    let (data, straight) = (dataset(reversed.concat()), dataset(REFERENCE));
    for (number, (row, same)) in data.rows.iter().zip(straight.rows).enumerate() {
        assert!(same.lengths.measured().all(|(muscle, mm)| row.lengths.length_mm_of(muscle) == Some(mm)));
        assert_eq!((row.line, same.line), (2 * number as u64 + 4, number as u64 + 2));
    }
    let data = dataset(format!("# tongue-fit 0.1.0\n#\n\n{HEADER}\n# from here\n{ROW}\n#2{}\n", &ROW[2..]));
    assert_eq!((data.rows[0].line, data.rows[1].lengths.subject.as_str()), (6, "#2"));
}

#[test]
fn column_names_determine_their_meaning() {
    for (is, name) in [
        ("subject", "SUBJECT; Speaker ID; 被験者"),
        ("vowel", "Phoneme"),
        ("GGa in Mm", "GGa_mm; GGa (mm); GGa..mm."),
        ("GGa in Cm", "GGa [CM]; GGa（cm）"),
        ("GGa in M", "GGa_m"),
        ("GG_a in Mm", "GG_a_mm"),
        ("m. genioglossus ant in Mm", "m. genioglossus ant. [mm]"),
        ("舌骨舌筋 in Mm", "舌骨舌筋_mm"),
        ("half width", "half_width_mm; Error (mm); Z half-width (cm); Z_error_mm"),
        ("terror in Mm", "terror_mm"),
        ("other", "GGa; GGm; mm; _mm; ; age; F1_Hz"),
    ]
    .into_iter()
    .flat_map(|(is, names)| names.split("; ").map(move |name| (is, name)))
    {
        // The first two names are the last ones in the lists of known names.
        let data = dataset(format!("発話者,音素,Z_mm,{name}\nX,a,40,31\n"));
        let reading = &data.reading;
        let message = match &reading.columns[..] {
            [_] if reading.subject == name => "subject".to_owned(),
            [_] if reading.vowel == name => "vowel".to_owned(),
            [z] if matches!(z.half_width, HalfWidth::Column { .. }) => "half width".to_owned(),
            [_] => "other".to_owned(),
            columns => {
                let other = columns.iter().find(|c| c.muscle != "Z").unwrap();
                format!("{} in {:?}", other.muscle, other.unit)
            }
        };
        assert_eq!(message, is, "{name}");
    }
}

#[test]
fn any_label_is_a_vowel_however_it_is_composed_and_u_is_unrounded() {
    let alike = ["a", "ə", "ɯ", "A", "iː", "schwa", "か", "あい"].map(|label| (label, label));
    let read =
        [(" /ɔ/ ", "ɔ"), ("[æ]", "æ"), ("u", "ɯ"), ("/u/", "ɯ"), ("あ", "a"), ("／ウ／", "ɯ"), ("う", "ɯ")];
    let composed = [("a\u{308}", "ä"), ("o\u{303}", "õ"), ("ɛ̃", "ɛ\u{303}"), ("ｵ", "o"), ("ｅ", "e")];
    for (written, label) in alike.into_iter().chain(read).chain(composed) {
        let vowel = Vowel::new(written).unwrap();
        assert_eq!(vowel.label(), label);
        assert!(written.parse::<Vowel>().unwrap().is_like(&vowel));
        assert_eq!(serde_json::from_value::<Vowel>(serde_json::to_value(&vowel).unwrap()).unwrap(), vowel);
    }
    for wrong in ["", " ", "//", "[ ]", "a\nb", &"a".repeat(41)] {
        assert!(wrong.parse::<Vowel>().is_err(), "{wrong}");
    }
    assert!(!vowel("E").is_like(&vowel("ɛ")));
    let data = dataset("subject,vowel,GGa_mm\nX,o\u{303},43\nX,e,45\nX,E,46\nX,U,47\n");
    assert_eq!(labels(&data, "X"), ["õ", "e", "E", "U"]);
    let length = |label| data.row("X", &vowel(label)).unwrap().length_mm[0].unwrap();
    assert_eq!([length("õ"), length("o\u{303}"), length("e"), length("E")], [43.0, 43.0, 45.0, 46.0]);
    assert_eq!(data.baseline("X").unwrap().length_mm, [Some(47.0)]);
    assert!(data.row("X", &vowel("ɯ\u{303}")).unwrap_err().to_string().ends_with("/E/, /U/"));
    // If a table has both, neither stands for the other.
    let both = dataset("subject,vowel,GGa_mm\nX,e,40\nX,E,41\nX,u,42\nX,う,43\n");
    assert_eq!(both.row("X", &vowel("E")).unwrap().length_mm, [Some(41.0)]);
    assert_eq!(both.row("X", &"u".parse().unwrap()).unwrap().length_mm, [Some(42.0)]);
    assert_eq!(both.baseline("X").unwrap().length_mm, [Some(43.0)]);
}

#[test]
fn missing_cells_are_unmeasured_and_rows_of_them_are_ignored() {
    let row = |cells: &str| dataset(format!("{HEADER}\nS1,a,47,49,49,51,28,42,38,30\nS1,i,{cells}\n"));
    let data = row(",NA,nan,-, * ,N/A,–,30");
    assert_eq!(data.rows[1].lengths.measured().collect::<Vec<_>>(), [("HGp", 30.0)]);
    let data = row(",,,,,,,");
    assert_eq!((data.rows.len(), &data.reading.rows_without_lengths[..]), (1, &[3][..]));
    assert!(data.row("S1", &vowel("i")).unwrap_err().to_string().starts_with("S1 has no row for /i/"));
}

#[test]
fn half_widths_come_from_columns_digits_or_the_user() {
    let table =
        |header: &str, cells: &str| dataset(format!("subject,vowel,{header}\nX,a,{cells}\nX,i,40,40,,\n"));
    let widths = |data: &Dataset| [0, 1].map(|n| data.rows[n].lengths.half_width_mm.clone());

    let data = table("GGa_mm,HG_mm,half_width_mm,HG_error_cm", "40,41,0.7,0.2");
    assert_eq!(widths(&data), [[0.7, 2.0], [0.5, 0.5]]);
    let column = HalfWidth::Column { name: "HG_error_cm".into(), else_mm: 0.5 };
    assert_eq!(data.reading.columns[1].half_width, column);
    assert!(data.reading.set_aside.is_empty());

    for (cell, mm) in [("40", 0.5), ("40.0", 0.05), ("40.25", 0.005), ("4.05e1", 0.05)] {
        let data = table("GGa_mm,HG_mm,x,y", &format!("{cell},41,,"));
        assert_eq!(data.reading.columns[0].half_width, HalfWidth::Digits { mm });
        assert_eq!(widths(&data)[0], [mm; 2]);
    }
    // One length with a decimal among forty does not make the others exact.
    let rows: String =
        (0..20).map(|n| format!("S{n},a,40,{}\n", if n == 7 { "41.0" } else { "41" })).collect();
    let data = dataset(format!("subject,vowel,GGa_mm,HG_mm\n{rows}"));
    assert_eq!(data.reading.columns[0].half_width, HalfWidth::Digits { mm: 0.5 });
    // Lengths in whole or half centimetres, in any unit.
    for (unit, one, two, mm) in [
        ("mm", [50.0, 60.0, 40.0, 70.0], [50.0, 50.0, 30.0, 60.0], 5.0),
        ("mm", [50.0, 65.0, 40.0, 70.0], [45.0, 50.0, 30.0, 60.0], 2.5),
        ("mm", [50.0, 65.0, 40.0, 70.0], [45.0, 50.0, 31.0, 60.0], 0.5),
        ("cm", [5.0, 6.5, 4.0, 7.0], [4.5, 5.0, 3.0, 6.0], 2.5),
    ] {
        let [one, two] = [one, two].map(|row| row.map(|length: f64| length.to_string()).join(","));
        let header = ["A", "B", "C", "D"].map(|name| format!("{name}_{unit}")).join(",");
        let data = dataset(format!("subject,vowel,{header}\nX,a,{one}\nX,i,{two}\n"));
        assert_eq!(data.reading.columns[0].half_width, HalfWidth::Digits { mm }, "{one}");
        assert_eq!(data.rows[1].lengths.half_width_mm, [mm; 4]);
    }
    let computed = table("GGa_mm,HG_mm,x,y", "40.2518273,41,,");
    assert_eq!(computed.reading.columns[0].half_width, HalfWidth::Default { mm: 0.5 });

    let given = computed.with_half_width_mm(1.0).unwrap();
    assert_eq!(widths(&given), [[1.0; 2]; 2]);
    assert_eq!(given.reading.columns[1].half_width, HalfWidth::Given { mm: 1.0 });
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(given.clone().with_half_width_mm(wrong).is_err());
    }
    let nobody = table("GGa_mm,HG_mm,SG_half_width_mm,speaker", "40,41,1,Y");
    assert_eq!(set_aside(&nobody), ["SG_half_width_mm", "speaker"]);
    // A half width that cannot be read is replaced by that of the digits.
    let negative = dataset("subject,vowel,GGa_mm,HG_mm,error_mm\nX,a,40,41,-1\nX,i,40,41,1\n");
    let message = "my.csv:2:5: error_mm is -1, which is not a half width of a length; write one from 0 to 100 mm, like 0.5; \
                   until then that of the lengths' digits is taken";
    assert_eq!(faults(&negative), [vec![], vec![message]]);
    assert_eq!(widths(&negative), [[0.5; 2], [1.0; 2]]);
}

#[test]
fn lengths_in_other_units_have_the_bits_of_millimetres() {
    // The texts are built from digits, because division by ten would round.
    let row = |tenths: u32| {
        let (whole, tenth) = (tenths / 10, tenths % 10);
        format!("X,{tenths},{whole}.{tenth},{}.{}{tenth},0.{whole:03}{tenth}\n", whole / 10, whole % 10)
    };
    let table = "subject,vowel,A_mm,B_cm,C_m\n".to_owned() + &(100..2000).map(row).collect::<String>();
    for table in [table.replace(',', ";").replace('.', ","), table] {
        let data = dataset(table);
        for (row, tenths) in data.rows.iter().zip(100..2000) {
            assert_eq!(row.lengths.length_mm, [Some(f64::from(tenths) / 10.0); 3]);
            assert_eq!(row.lengths.half_width_mm, [0.05; 3]);
        }
        assert_eq!(data.rows.len(), 1900);
    }
    for (cell, mm) in [("5.7", 0.5), ("6", 5.0), ("6.25", 0.05)] {
        let data = dataset(format!("subject,vowel,A_cm\nX,a,{cell}\n"));
        assert_eq!(data.rows[0].lengths.half_width_mm, [mm]);
    }
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
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(["subject", "vowel", "A_mm", "B_mm", "C_mm", "D_mm", "E_mm"]).unwrap();
        for ((subject, label), mm) in &rows {
            let names = [subject, label].into_iter().cloned();
            table.write_record(names.chain(mm.iter().map(f64::to_string))).unwrap();
        }
        let data = dataset(String::from_utf8(table.into_inner().unwrap()).unwrap());
        for ((subject, label), mm) in &rows {
            let read = data.row(subject, &vowel(label)).unwrap();
            prop_assert_eq!(&read.length_mm, &mm.iter().copied().map(Some).collect::<Vec<_>>());
        }
    }
}
