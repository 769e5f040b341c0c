//! Tables of lengths that cannot be used are refused, wholly or in part, with the place, the reason and advice.

use tongue_fit::measured::Dataset;
use tongue_input::measured::lengths::{DecimalMark, plausibility};

use crate::fixtures::{says, vowel};

pub const REFERENCE: &str = include_str!("../../targets/takano2007_lengths.csv");
pub const HEADER: &str = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
pub const ROW: &str = "S1,i,47,49,49,51,28,42,38,30";
const WANTED: &str = "it must name, in any order, subject, vowel, and for each muscle its length with the unit, like \
                      subject,vowel,GGa_mm,GGm_mm";

pub fn dataset(table: impl AsRef<[u8]>) -> Dataset {
    Dataset::from_reader(table.as_ref(), "my.csv").unwrap()
}

/// The message for a table that must be refused.
fn refusal(table: impl AsRef<[u8]>) -> String {
    Dataset::from_reader(table.as_ref(), "my.csv").unwrap_err().to_string()
}

/// Messages about rows and about cells that cannot be used.
pub fn faults(data: &Dataset) -> [Vec<String>; 2] {
    let rows = data.broken.iter().map(|row| row.fault.to_string()).collect();
    [rows, data.bad_cells.iter().map(ToString::to_string).collect()]
}

#[test]
fn a_bad_cell_loses_one_cell_and_a_broken_row_one_row() {
    let data = dataset(format!(
        "{HEADER}\n{ROW}\nS1,a,34,57,51,abc,20,500,34,34\nS2,a,41\n,a,41,62,53,59,23,44,33,35\nS1,i,47,49,49,51,28,42,38,31\n\
         S3,a,x,x,x,x,x,x,x,x\n"
    ));
    let places: Vec<_> = data.broken.iter().map(|b| (b.fault.line, b.fault.column)).collect();
    assert_eq!(places, [(4, 4), (5, 1), (6, 1), (7, 3)]);
    let places: Vec<_> = data.bad_cells.iter().map(|fault| (fault.line, fault.column)).collect();
    assert_eq!(places, [(3, 6), (3, 8)]);
    let a = data.row("S1", &vowel("a")).unwrap();
    let measured: Vec<&str> = a.measured().map(|(name, _)| name).collect();
    assert_eq!((measured.join(" "), data.bad_cells_of(a).count()), ("GGa GGm GGp SGm HGa HGp".to_owned(), 2));
    let i = data.row("S1", &vowel("i")).unwrap();
    assert_eq!((i.length_mm_of("HGp"), data.bad_cells_of(i).count()), (Some(30.0), 0));
    for (subject, expected) in
        [("S2", "my.csv:4:4: the line has 3 fields"), ("S3", "my.csv:7:3: GGa_mm is \"x\", not a number")]
    {
        says(data.row(subject, &vowel("a")), expected);
    }
    assert!(data.row("S2", &vowel("i")).unwrap_err().to_string().starts_with("unknown subject \"S2\""));
}

#[test]
fn header_faults_quote_the_line_that_was_taken() {
    let with = |to: &str| HEADER.replacen("GGm_mm", to, 1);
    let subjct = HEADER.replacen("subject", "subjct", 1);
    for (header, expected) in [
        (subjct.clone(), "1:11: missing from the header: subject; is column \"subjct\" meant to be subject?"),
        (HEADER.replace("_mm", ""), "1:11: missing from the header: a length, like GGa_mm; if column"),
        (with("GGa_cm"), "1:4: column GGa_cm says the same as column 3 (GGa_mm); keep one of the two"),
        (with("GGa_mm"), "1:4: column GGa_mm appears twice, here and as column 3; keep one of the two"),
        (with("subject"), "1:4: column subject appears twice, here and as column 1; keep one of the two"),
    ] {
        let expected = format!("my.csv:{expected}");
        let message = refusal(format!("{header}\n{ROW}\n"));
        assert!(message.starts_with(&expected), "{message}");
        let quoted = format!("; line 1 was taken for the header: \"{}...\"; {WANTED}", &header[..40]);
        assert_eq!(message.ends_with(&quoted), expected.contains("missing"), "{message}");
    }
    let titled = refusal("Lengths\nname,vowel,GGa\nX,a,40\n");
    assert!(titled.contains("line 2 was taken for the header: \"name,vowel,GGa\""), "{titled}");
}

#[test]
fn what_is_no_table_and_tables_of_other_forms_are_refused_with_what_to_write_instead() {
    let latin1 = [HEADER.as_bytes(), b"\nS1,\xFC,47"].concat();
    let many = format!("{HEADER}\n{}", "a\n".repeat(200_001));
    for (bytes, expected) in [
        (&latin1[..], "2:2: the text is not UTF-8; save the file as UTF-8"),
        (b"\xFF\xFEs\0u", "1:1: the text begins as UTF-16 does, but is damaged"),
        (b"s\0u\0b\0", "1:1: the text contains a zero byte; "),
        (b"PK\x03\x04...", "1:1: the file is a workbook of a spreadsheet program; "),
        (b"", "1:1: the file is empty; begin with a line like subject"),
        ("\u{feff} \n\n".as_bytes(), "1:1: the file is empty; begin with a line like subject"),
        (b"# only a comment\n", "1:1: the file is empty; begin with a line like subject"),
        (format!("{HEADER}\n").as_bytes(), "2:1: the table has a header but no rows; line 1 was taken"),
        (REFERENCE.replace("_mm", "_cm").as_bytes(), "2:3: GGa_cm is 47, which is 470 mm: not a length"),
        ("x,".repeat(20_000).as_bytes(), "1:1: the header has 20001 columns"),
        (many.as_bytes(), "200002:1: the table has more than 200000 rows"),
        (format!("{HEADER}\nS1,i,,,,,,,,\n").as_bytes(), "3:1: no row has a length; write lengths in"),
        // Tables as ten new users wrote them.
        (b"subject vowel GGa_mm\nP1 a 41\n", "1:1: the table has fewer than two columns; line 1 was"),
        (b"| subject | vowel | GGa_mm |\n|---|---|---|\n", "1:1: the table has fewer than two columns"),
        (b"[{\"subject\": \"P1\", \"GGa_mm\": 41}]", "1:1: the file is JSON, XML or a page, not a table"),
        (b"subject,vowel,muscle,length_mm\nP1,a,GGa,41\n", "1:3: column muscle names muscles, so that each"),
        (b"muscle,u,a\nGGa,46,41\n", "1:1: column muscle names muscles, so that each has rows of its own"),
        (b"subject,vowel,GGa\n,,mm\nP1,a,46\n", "1:4: missing from the header: a length, like GGa_mm; if"),
        (b"subject,vowel,A_mm,B_mm,C_mm\nP1,u,100,100,100\n", "2:3: every length is 100; write the measured"),
    ] {
        let message = refusal(bytes);
        assert!(message.starts_with(&format!("my.csv:{expected}")), "{message}");
    }
    let exchanged = dataset("subject,vowel,GGa_mm\na,P1,41\n");
    assert_eq!(
        exchanged.row("P1", &vowel("a")).unwrap_err().to_string(),
        "unknown subject \"P1\" in my.csv; it is in column vowel; are subject and vowel exchanged?"
    );
    let message = Dataset::from_reader(std::io::repeat(b'x'), "endless").unwrap_err().to_string();
    assert_eq!(message, "cannot read endless: it is larger than 64 MiB; split it into smaller files");
    // A line end at the end of the file is allowed, and a copy of the built-in table in a file gives the same data.
    assert_eq!(dataset(format!("{HEADER}\n{ROW}\r\n")).rows.len(), 1);
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), REFERENCE).unwrap();
    let data = Dataset::from_path(file.path()).unwrap();
    assert_eq!(data.rows, Dataset::reference().unwrap().rows);
    assert_eq!(data.origin, file.path().display().to_string());
}

#[test]
fn rows_are_refused_with_the_reason() {
    let with = |from: char, to: &str| ROW.replacen(from, to, 1);
    for (row, expected) in [
        (ROW.replace(',', "\t"), "2:1: the fields are separated by tabs; separate them by commas, as in"),
        ("S1,i,47,5,49,49,51,28,42,38,30".to_owned(), "2:11: the line has 11 fields where the header, line"),
        (with('i', ""), "2:2: the vowel is \"\"; write a label of 1 to 40 printable characters, like a, ɔ"),
        (with('S', "S\u{1b}[31m"), "2:1: the subject is \"S\\u{1b}[31m1\"; give it a name of printable"),
        // The quotation mark that is not closed includes the rest of the file.
        (format!("\"{ROW}\n{ROW}"), "2:2: the line has 1 fields where the header, line 1, has 10; give"),
    ] {
        let message = refusal(format!("{HEADER}\n{row}\n"));
        assert!(message.starts_with(&format!("my.csv:{expected}")), "{message}");
    }
    let first = ROW.replacen('i', "ɯ", 1);
    let (u, same) = (ROW.replacen('i', "u", 1), first.replace("47", "48"));
    // /u/ is another vowel than /ɯ/ if a table has both.
    assert!(dataset(format!("{HEADER}\n{u}\n{first}")).broken.is_empty());
    let data = dataset(format!("{HEADER}\n{first}\n\n{ROW}\n{same}"));
    let text = "my.csv:5:1: S1 /ɯ/ is given twice, here and on line 2; keep one of the two lines, or give repetitions \
                different labels, as in a1 and a2";
    assert_eq!(faults(&data), [vec![text], vec![]]);
    assert_eq!(data.baseline("S1").unwrap().length_mm_of("GGa"), Some(47.0));
}

#[test]
fn lengths_are_refused_with_the_reason_and_an_example_in_their_unit() {
    let long = "x".repeat(100_000);
    let long_told = format!("is \"{}...\", not a number; write", "x".repeat(40));
    for (unit, cell, expected) in [
        ("mm", "abc", "is \"abc\", not a number; write millimetres like 57.8 with a decimal point, or NA"),
        ("mm", "49 mm", "is \"49 mm\", not a number; write millimetres like 57.8"),
        ("cm", "4.9 cm", "is \"4.9 cm\", not a number; write centimetres like 5.78 with a decimal point"),
        ("m", "x", "is \"x\", not a number; write metres like 0.0578 with a decimal point"),
        ("mm", &long, &long_told),
        ("mm", "-49", "is -49, not positive; write a measured length in millimetres, like 57.8, or NA"),
        ("mm", "0", "is 0, not positive"),
        ("mm", "-0", "is -0, not positive"),
        ("mm", "inf", "is inf, not finite; write a measured length in millimetres, like 57.8"),
        ("mm", "490", "is 490, too long for a tongue muscle (above 200 mm); write a measured length in"),
        ("mm", "4.9", "is 4.9, too short for millimetres (below 10); correct it, or if all lengths are in"),
        ("mm", "0.049", "is 0.049, too short for millimetres (below 10); correct it, or if all lengths are"),
        ("cm", "47", "is 47, which is 470 mm: not a length of a tongue muscle (10 to 200 mm); check the"),
        ("cm", "1e308", "is 1e308, not finite; write a measured length in centimetres, like 5.78"),
        ("cm", "1e306", "is 1e306, which is 1000000000000000000000000000000000000000... mm: not a length"),
    ] {
        let data = dataset(format!("subject,vowel,GGa_mm,GGm_{unit}\nX,a,40,{cell}\n"));
        let [rows, cells] = faults(&data);
        assert!(
            rows.is_empty() && cells[0].starts_with(&format!("my.csv:2:4: GGm_{unit} {expected}")),
            "{cells:?}"
        );
        assert_eq!(data.rows[0].lengths.length_mm, [Some(40.0), None]);
    }
    // A cell as the message recommends is read.
    for (unit, cell) in
        [("mm", "57.8"), ("cm", "5.78"), ("m", "0.0578"), ("mm", "57,8"), ("cm", "5,78"), ("m", "0,0578")]
    {
        let data = dataset(format!("subject;vowel;GGa_{unit}\nX;a;{cell}\nX;e;?\n"));
        assert_eq!(data.rows[0].lengths.length_mm, [Some(57.8)]);
        let message = &data.broken[0].fault.help;
        assert!(message.contains(&format!("like {cell} ")), "{message}");
    }
    // The column in the message is that of the file.
    let reordered = "HGp_mm,vowel,HGa_mm,SGa_mm,SGm_mm,SGp_mm,GGp_mm,GGm_mm,GGa_mm,subject";
    let data = dataset(format!("{reordered}\n30,i,38,42,28,51,49,-1,47,S1\n"));
    assert!(faults(&data)[1][0].starts_with("my.csv:2:8: GGm_mm is -1"));
}

#[test]
fn one_decimal_mark_a_table() {
    for (cells, expected) in [
        (["47,5", "47.5", "48,5"], "\"47.5\", with a decimal point; write it with a decimal comma"),
        (["47.5", "48,5", "48"], "\"48,5\", with a decimal comma; write it with a decimal point"),
    ] {
        let rows: String = cells.iter().enumerate().map(|(n, c)| format!("X{n};a;{c}\n")).collect();
        let data = dataset(format!("subject;vowel;GGa_mm\n{rows}"));
        let fault = data.broken[0].fault.to_string();
        assert!(fault.starts_with(&format!("my.csv:3:3: GGa_mm is {expected}")), "{fault}");
    }
    for cell in ["57", "", "a,b", "5,7,8", "1.234,5", "1,234.5"] {
        for (other, mark) in [("40", DecimalMark::Point), ("47,5", DecimalMark::Comma)] {
            let data = dataset(format!("subject;vowel;GGa_mm\nX;a;{cell}\nY;a;{other}\n"));
            assert_eq!(data.reading.decimal_mark, mark, "{cell} says nothing of the mark");
        }
    }
    // Between commas a decimal comma can be in quotation marks.
    let quoted = dataset("subject,vowel,GGa_mm\nX,a,\"47,5\"\n");
    assert_eq!(quoted.rows[0].lengths.length_mm, [Some(47.5)]);
}

/// The published rows, each with its lengths in mm.
fn published() -> Vec<(String, Vec<f64>)> {
    let rows = REFERENCE.lines().skip(1).map(|line| {
        let (name, lengths) = line.split_at(line.match_indices(',').nth(1).unwrap().0 + 1);
        (name.to_owned(), lengths.split(',').map(|mm| mm.parse().unwrap()).collect())
    });
    rows.collect()
}

/// The doubts about a table of these rows under `header`.
fn doubts_under(header: &str, rows: &[(String, Vec<f64>)]) -> Vec<String> {
    let lines = rows.iter().map(|(name, mm)| {
        let lengths: Vec<String> = mm.iter().map(f64::to_string).collect();
        format!("{name}{}\n", lengths.join(","))
    });
    plausibility::doubts(&dataset(format!("{header}\n{}", lines.collect::<String>())))
}

#[track_caller]
fn doubted(change: impl Fn(&mut Vec<(String, Vec<f64>)>), message: &str) {
    let mut rows = published();
    change(&mut rows);
    let doubts = doubts_under(HEADER, &rows);
    assert!(doubts.len() == 1 && doubts[0].contains(message), "{message}: {doubts:?}");
}

#[test]
fn published_lengths_are_not_doubted() {
    let all = published();
    assert_eq!(doubts_under(HEADER, &all), Vec::<String>::new());
    let mut in_cm = all.clone();
    in_cm.iter_mut().flat_map(|row| &mut row.1).for_each(|mm| *mm = 10.0 * (*mm / 10.0).round());
    assert_eq!(doubts_under(HEADER, &in_cm), Vec::<String>::new());
    // Without each of the muscles, and with the first five alone.
    for left_out in (0..8).map(|m| vec![m]).chain([vec![5, 6, 7]]) {
        let kept = |n: &usize| !left_out.contains(n);
        let names: Vec<&str> = HEADER.split(',').collect();
        let names = Vec::from_iter(
            names.iter().enumerate().filter(|(n, _)| *n < 2 || kept(&(n - 2))).map(|(_, n)| *n),
        );
        let mut fewer = all.clone();
        for row in &mut fewer {
            row.1 = (0..8).filter(kept).map(|n| row.1[n]).collect();
        }
        assert_eq!(doubts_under(&names.join(","), &fewer), Vec::<String>::new(), "{names:?}");
        for row in &fewer {
            assert_eq!(
                doubts_under(&names.join(","), std::slice::from_ref(row)),
                Vec::<String>::new(),
                "{row:?}"
            );
        }
    }
    for row in &all {
        assert_eq!(doubts_under(HEADER, std::slice::from_ref(row)), Vec::<String>::new(), "{row:?}");
    }
    for subject in ["S1", "S2", "S3", "S4"] {
        let own = Vec::from_iter(all.iter().filter(|row| row.0.starts_with(subject)).cloned());
        for first in 0..own.len() {
            // Each row in turn is the first one, which is the baseline if there is no row of /ɯ/.
            let mut own = own.clone();
            own.swap(0, first);
            assert_eq!(doubts_under(HEADER, &own), Vec::<String>::new(), "{own:?}");
        }
    }
}

#[test]
fn names_that_do_not_belong_to_their_columns_are_told() {
    let names: Vec<&str> = HEADER.split(',').collect();
    let message = |change: &dyn Fn(&mut [&str])| {
        let mut names = names.clone();
        change(&mut names[2..]);
        doubts_under(&names.join(","), &published()).join("; ")
    };
    for by in 1..8 {
        let text = message(&|names| names.rotate_left(by));
        assert!(text.contains("seems to have the lengths of"), "{by}: {text}");
    }
    let text = message(&|names| names.rotate_left(1));
    assert!(text.contains("shifted by one column: GGm seems to have the lengths of GGa"), "{text}");
    for (muscle, place) in [("GGm", 1), ("GGp", 2), ("SGp", 3)] {
        let text = message(&|names| names.swap(place, 4));
        assert!(text.contains(&format!("of its muscles SGm and {muscle} are exchanged")), "{text}");
    }
}

#[test]
fn what_is_no_length_or_of_another_size_is_told() {
    let scaled = |row: &mut (String, Vec<f64>), factor: f64| row.1.iter_mut().for_each(|mm| *mm *= factor);
    let parts = |rows: &mut Vec<_>| {
        *rows = vec![("S,a,".to_owned(), vec![95.0, 98.0, 91.0, 100.0, 97.0, 93.0, 99.0, 92.0])]
    };
    doubted(parts, "not percentages");
    let of_longest = |rows: &mut Vec<(String, Vec<f64>)>| {
        for row in rows {
            let longest = row.1.iter().copied().fold(0.0, f64::max);
            row.1.iter_mut().for_each(|mm| *mm = 100.0 * *mm / longest);
        }
    };
    doubted(of_longest, "percentages");
    // One muscle in tenths of an inch; a table in pixels.
    doubted(|rows| rows.iter_mut().for_each(|row| row.1[2] *= 0.3937), "GGp is 2.5 times as short");
    for factor in [0.5, 1.9] {
        doubted(|rows| rows.iter_mut().for_each(|row| scaled(row, factor)), "not pixels");
    }
    // S2 /a/ in another scale than S2 /ɯ/, then S2 /ɯ/ in another scale than all other rows of S2.
    doubted(|rows| scaled(&mut rows[0], 1.12), "in S1 /i/ all muscles together are 15 % longer than in /ɯ/");
    for factor in [0.88, 0.85, 0.8, 1.25] {
        doubted(|rows| scaled(&mut rows[7], factor), "in S2 /a/ all muscles together are ");
    }
    doubted(|rows| scaled(&mut rows[9], 1.25), "shorter than in /ɯ/ (and so in 3 more rows)");
    doubted(
        |rows| rows[7].1 = rows[5].1.clone(),
        "S2 /i/ on line 7 and S2 /a/ on line 9 have the same length in every muscle",
    );
    doubted(|rows| rows[12].1 = rows[2].1.clone(), "one seems to be a copy");
}
