//! Cells of a CSV file that spreadsheets must not run as formulas.

use std::io::{self, Write};

/// A CSV writer into `out` that puts an apostrophe in front of text that a spreadsheet would take for a
/// formula.
pub fn writer<W: Write>(out: W) -> ::csv::Writer<AsText<W>> {
    ::csv::Writer::from_writer(AsText::new(out))
}

/// Writes CSV with an apostrophe in front of every cell that a spreadsheet would take for a formula. Names in
/// tables and recordings are other people's, and `=cmd|...` starts a program. Numbers are unchanged.
#[derive(Debug)]
pub struct AsText<W> {
    out: W,
    cell: Cell,
    is_quoted: bool,
}

#[derive(Debug)]
enum Cell {
    Begun,
    Opened,
    /// Text or a positive number, which is written unchanged.
    Harmless,
    /// Begins like a formula; kept back until its end.
    Held(Vec<u8>),
}

impl<W: Write> AsText<W> {
    pub fn new(out: W) -> Self {
        Self { out, cell: Cell::Begun, is_quoted: false }
    }

    #[cfg(test)]
    pub fn into_inner(self) -> W {
        self.out
    }
}

impl<W: Write> Write for AsText<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut passed = Vec::with_capacity(bytes.len() + 8);
        for &byte in bytes {
            if byte == b'"' {
                self.is_quoted = !self.is_quoted;
            }
            let is_end = !self.is_quoted && matches!(byte, b',' | b'\n');
            match &mut self.cell {
                _ if is_end => {
                    if let Cell::Held(cell) = std::mem::replace(&mut self.cell, Cell::Begun) {
                        passed.extend(is_formula(&cell).then_some(b'\''));
                        passed.extend(cell);
                    }
                    passed.push(byte);
                }
                Cell::Begun if byte == b'"' => {
                    self.cell = Cell::Opened;
                    passed.push(byte);
                }
                Cell::Begun | Cell::Opened if matches!(byte, b'=' | b'+' | b'-' | b'@' | b'\t' | b'\r') => {
                    self.cell = Cell::Held(vec![byte]);
                }
                Cell::Begun | Cell::Opened => {
                    self.cell = Cell::Harmless;
                    passed.push(byte);
                }
                Cell::Harmless => passed.push(byte),
                Cell::Held(cell) => cell.push(byte),
            }
        }
        self.out.write_all(&passed)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Whether a spreadsheet would run the cell: it begins like a formula and is not a number. A vowel may be
/// called `@`, as in SAMPA.
fn is_formula(cell: &[u8]) -> bool {
    let text = String::from_utf8_lossy(cell);
    let text = text.trim_end_matches('"');
    match text.as_bytes() {
        [] | [_] => false,
        [b'@', ..] => text.contains('('),
        _ => text.parse::<f64>().is_err(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(cells: &[&str]) -> String {
        let mut writer = writer(Vec::new());
        writer.write_record(cells).unwrap();
        String::from_utf8(writer.into_inner().unwrap().into_inner()).unwrap()
    }

    #[test]
    fn formulas_are_written_as_text() {
        for formula in [
            "=1+1",
            "=cmd|' /C calc'!A0",
            "+cmd|x",
            "-2+3+cmd|x",
            "@SUM(1)",
            "\t=1",
            "=HYPERLINK(\"http://x\",\"a,b\")",
        ] {
            let line = written(&["S1", formula, "0.5"]);
            let mut reader = ::csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            let record = reader.records().next().unwrap().unwrap();
            assert_eq!(record.iter().collect::<Vec<_>>(), ["S1", &format!("'{formula}"), "0.5"], "{line}");
        }
    }

    #[test]
    fn numbers_labels_and_everything_else_are_as_they_were() {
        let cells = [
            "-3.5",
            "+1e-3",
            "-",
            "",
            "@",
            "@`",
            "-inf",
            "a=b",
            "a,\"b\"",
            "tongue-fit --vowel a",
            "ɯ",
            "\"=1\"",
        ];
        let mut plain = ::csv::Writer::from_writer(Vec::new());
        plain.write_record(cells).unwrap();
        assert_eq!(written(&cells), String::from_utf8(plain.into_inner().unwrap()).unwrap());
    }

    #[test]
    fn the_result_does_not_depend_on_how_bytes_are_split() {
        let text = "a,\"=x,1\",-5,=y\n\"-a\"\"b\",\"\",=z\n";
        let whole = {
            let mut out = AsText::new(Vec::new());
            out.write_all(text.as_bytes()).unwrap();
            out.into_inner()
        };
        assert_eq!(String::from_utf8(whole.clone()).unwrap(), "a,\"'=x,1\",-5,'=y\n\"'-a\"\"b\",\"\",'=z\n");
        let mut out = AsText::new(Vec::new());
        text.bytes().for_each(|byte| out.write_all(&[byte]).unwrap());
        assert_eq!(out.into_inner(), whole);
    }
}
