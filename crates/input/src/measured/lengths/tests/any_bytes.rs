//! Property tests: any bytes are read or refused without a panic, and a written table is read back.

use proptest::prelude::*;

use super::*;

fn csv_line(subject: &str, vowel: &str, length_mm: &[f64]) -> String {
    let fields = [subject.to_owned(), vowel.to_owned()].into_iter();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields.chain(length_mm.iter().map(f64::to_string))).unwrap();
    String::from_utf8(writer.into_inner().unwrap()).unwrap()
}

/// A valid table in the spellings of several spreadsheets.
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
            Err(LengthsError::Malformed(fault)) => prop_assert!(in_it(&fault), "{fault}"),
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

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
