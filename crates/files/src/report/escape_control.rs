//! Escapes control characters in text on the terminal and in files, since names in tables and recordings are written by others.

use std::io::{self, Write};

/// Writes UTF-8 with control characters, except line ends and tabs, escaped as in JSON, such as `\u001b`. JSON keeps its meaning.
#[derive(Debug)]
pub struct EscapeControl<W: Write> {
    out: W,
    /// The first bytes of an incomplete character.
    begun: Vec<u8>,
}

impl<W: Write> EscapeControl<W> {
    pub fn new(out: W) -> Self {
        Self { out, begun: Vec::new() }
    }
}

impl<W: Write> Write for EscapeControl<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.begun.is_empty() && bytes.iter().all(|b| matches!(b, b' '..=b'~' | b'\n' | b'\t')) {
            self.out.write_all(bytes)?;
            return Ok(bytes.len());
        }
        let mut all = std::mem::take(&mut self.begun);
        all.extend_from_slice(bytes);
        let mut passed = Vec::with_capacity(all.len());
        for part in all.utf8_chunks() {
            for character in part.valid().chars() {
                if is_command(character) {
                    passed.extend(format!("\\u{:04x}", u32::from(character)).into_bytes());
                } else {
                    passed.extend(character.encode_utf8(&mut [0; 4]).as_bytes());
                }
            }
            self.begun = part.invalid().to_vec();
            // Bytes that no further ones can complete are written unchanged.
            if !std::str::from_utf8(&self.begun).is_err_and(|e| e.error_len().is_none()) {
                passed.append(&mut self.begun);
            }
        }
        self.out.write_all(&passed)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Whether a terminal acts on the character: control characters (ESC, and those of C1, which some terminals take for ESC and a letter), and
/// those that reverse the direction of text.
fn is_command(character: char) -> bool {
    (character.is_control() && !matches!(character, '\n' | '\t'))
        || matches!(character, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn escaped(text: &str, cut: usize) -> String {
        let mut out = Vec::new();
        let mut writer = EscapeControl::new(&mut out);
        text.as_bytes().chunks(cut).for_each(|part| writer.write_all(part).unwrap());
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn commands_to_the_terminal_are_shown_and_not_obeyed() {
        let name = "\u{1b}]0;title\u{7}\u{9b}2J\r\u{202e}x\u{7f}";
        for cut in 1..=4 {
            assert_eq!(escaped(name, cut), r"\u001b]0;title\u0007\u009b2J\u000d\u202ex\u007f");
        }
    }

    #[test]
    fn everything_else_is_as_it_was_and_json_says_the_same() {
        let text = "| ɯ†  –\t|\n\u{1f445}";
        for cut in 1..=4 {
            assert_eq!(escaped(text, cut), text);
        }
        let json = serde_json::to_string("\u{1b}[2J \u{9b} \u{7f}").unwrap();
        let printed: String = serde_json::from_str(&escaped(&json, 3)).unwrap();
        assert_eq!(printed, "\u{1b}[2J \u{9b} \u{7f}");
    }
}
