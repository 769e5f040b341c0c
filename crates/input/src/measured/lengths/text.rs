//! Decoding of bytes to text whose lines end in line feeds.

use std::borrow::Cow;

use serde::Serialize;
use unicode_normalization::UnicodeNormalization;

use crate::measured::error::{Malformed, SourcePlace};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    Utf8,
    /// UTF-8 with a byte order mark, as Excel writes it.
    Utf8Bom,
    /// UTF-16 with a byte order mark, as in Excel's "Unicode text".
    Utf16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LineEnds {
    Lf,
    Crlf,
    Cr,
}

pub(in crate::measured) struct Text<'a> {
    pub text: Cow<'a, str>,
    pub encoding: Encoding,
    pub line_ends: LineEnds,
}

/// Decodes UTF-8, or UTF-16 with a byte order mark.
pub(in crate::measured) fn decode<'a>(bytes: &'a [u8], origin: &str) -> Result<Text<'a>, Malformed> {
    let start = SourcePlace::start(origin);
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"\xD0\xCF\x11\xE0") {
        let help = "save the sheet as CSV (in Excel: \"CSV UTF-8\")";
        return Err(start.error("the file is a workbook of a spreadsheet program", help));
    }
    let (text, encoding) = match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => (Cow::Borrowed(utf8(rest, origin)?), Encoding::Utf8Bom),
        [0xFF, 0xFE, rest @ ..] => (Cow::Owned(utf16(rest, u16::from_le_bytes, start)?), Encoding::Utf16),
        [0xFE, 0xFF, rest @ ..] => (Cow::Owned(utf16(rest, u16::from_be_bytes, start)?), Encoding::Utf16),
        _ => (Cow::Borrowed(utf8(bytes, origin)?), Encoding::Utf8),
    };
    if let Some(at) = text.find('\0') {
        let help = "give a table as plain text, in UTF-8 or in UTF-16 with a byte order mark";
        return Err(place_of_byte(origin, text.as_bytes(), at).error("the text contains a zero byte", help));
    }
    let line_ends = match text.find(['\r', '\n']) {
        Some(at) if text[at..].starts_with("\r\n") => LineEnds::Crlf,
        Some(at) if text[at..].starts_with('\r') => LineEnds::Cr,
        _ => LineEnds::Lf,
    };
    let text = if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n").into() } else { text };
    Ok(Text { text, encoding, line_ends })
}

fn utf8<'a>(bytes: &'a [u8], origin: &str) -> Result<&'a str, Malformed> {
    str::from_utf8(bytes).map_err(|e| {
        let help = "save the file as UTF-8, in Excel as \"CSV UTF-8\" (the vowel ɯ may be written u)";
        place_of_byte(origin, bytes, e.valid_up_to()).error("the text is not UTF-8", help)
    })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16, start: SourcePlace<'_>) -> Result<String, Malformed> {
    let (pairs, odd) = bytes.as_chunks::<2>();
    let text: Result<String, _> = char::decode_utf16(pairs.iter().map(|pair| unit(*pair))).collect();
    match text {
        Ok(text) if odd.is_empty() => Ok(text),
        _ => Err(start.error("the text begins as UTF-16 does, but is damaged", "save the file as UTF-8")),
    }
}

/// The place of the byte `offset`, for errors that are found before the text is a table.
fn place_of_byte<'a>(origin: &'a str, bytes: &[u8], offset: usize) -> SourcePlace<'a> {
    let before = bytes.get(..offset).unwrap_or(bytes);
    let line_start = before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
    let line = 1 + before.iter().filter(|b| **b == b'\n').count() as u64;
    let column = 1 + before.iter().skip(line_start).filter(|b| b",;\t".contains(b)).count();
    SourcePlace { origin, line, column }
}

/// Largest number of characters of a label, and of a quotation in a message.
pub(super) const LONGEST: usize = 40;

/// The text without surrounding spaces, in Unicode's form NFC (in which letters that look the same are equal), with full-width forms (`１`,
/// `ａ`, `（`, `㎝`) replaced by ASCII.
pub(in crate::measured) fn fold(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for character in text.trim().chars() {
        match character {
            '\u{3000}' => plain.push(' '),
            '\u{ff01}'..='\u{ff5e}' => plain.extend(char::from_u32(u32::from(character) - 0xfee0)),
            '㎜' => plain.push_str("mm"),
            '㎝' => plain.push_str("cm"),
            other => plain.push(other),
        }
    }
    plain.trim().nfc().collect()
}

/// The first [`LONGEST`] characters of a field, for a message.
pub(in crate::measured) fn clip(field: &str) -> String {
    match field.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", field.get(..end).unwrap_or_default()),
        None => field.to_owned(),
    }
}
