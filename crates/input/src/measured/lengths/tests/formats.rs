//! Tables of spreadsheets and statistics programs are read.

use super::*;

#[test]
fn a_german_export_from_excel_is_read() {
    let text = "\u{feff}Proband;Vokal;GGa (mm);GGm (mm);Bemerkung;\r\nMüller;ɯ;46,5;56;gut, sehr;\r\nMüller;a;38;57,25;;\r\n;;;;;\r\n";
    let data = dataset(text);
    let reading = data.reading();
    assert_eq!((reading.encoding, reading.line_ends), (Encoding::Utf8Bom, LineEnds::Crlf));
    assert_eq!((reading.separator, reading.decimal_mark), (Separator::Semicolon, DecimalMark::Comma));
    assert_eq!(set_aside(&data), ["Bemerkung"]);
    assert!(data.broken().is_empty() && reading.rows_without_lengths.is_empty());
    // The lengths have two decimals.
    assert_eq!(
        numbers(&data),
        [(Some(46.5), 0.005), (Some(56.0), 0.005), (Some(38.0), 0.005), (Some(57.25), 0.005)]
    );
    // macOS types decomposed letters.
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
    // If both are in the table, neither stands for the other.
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
fn missing_cells_are_unmeasured_and_rows_of_them_are_ignored() {
    let row = |cells: &str| format!("{HEADER}\nS1,a,47,49,49,51,28,42,38,30\nS1,i,{cells}\n");
    let data = dataset(row(",NA,nan,-, * ,N/A,–,30"));
    assert_eq!(data.rows()[1].lengths.measured().collect::<Vec<_>>(), [("HGp", 30.0)]);
    let data = dataset(row(",,,,,,,"));
    assert_eq!((data.rows().len(), &data.reading().rows_without_lengths[..]), (1, &[3][..]));
    assert!(matches!(data.row("S1", &vowel("i")), Err(LengthsError::MissingRow { .. })));
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
        assert!(matches!(given.clone().with_half_width_mm(wrong), Err(LengthsError::BadHalfWidth { .. })));
    }

    let nobody = table("GGa_mm,HG_mm,SG_half_width_mm,speaker", "40,41,1,Y");
    assert_eq!(set_aside(&nobody), ["SG_half_width_mm", "speaker"]);
    let negative = dataset("subject,vowel,GGa_mm,error_mm\nX,a,40,-1\nX,i,40,1\n");
    assert_eq!(
        negative.broken()[0].fault.to_string(),
        "my.csv:2:4: error_mm is -1, which is not a half width of a length; write one from 0 to 100 mm, like 0.5"
    );
}
