//! Cursor through the bytes of a Gmsh file (text, or text with binary numbers), and errors with their byte.

pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    pub is_binary: bool,
    big_endian: bool,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, is_binary: false, big_endian: false }
    }

    /// The byte at which the next token begins.
    pub fn position(&mut self) -> usize {
        if !self.is_binary {
            self.skip_space();
        }
        self.at
    }

    /// Switches to binary numbers. The next four bytes are the integer 1, which shows the byte order.
    pub fn begin_binary(&mut self) -> Parsed<()> {
        self.is_binary = true;
        let at = self.at;
        let one = self.array::<4>("the number that tells the order of the bytes")?;
        self.big_endian = one == [0, 0, 0, 1];
        if self.big_endian || one == [1, 0, 0, 0] {
            Ok(())
        } else {
            Err(wrong!(at, "the byte order is neither big-endian nor little-endian; save the file again"))
        }
    }

    /// Name of the next section without the `$`, and its byte; `None` at the end of the file.
    pub fn section(&mut self) -> Parsed<Option<(&'a str, usize)>> {
        self.skip_space();
        let at = self.at;
        if self.rest().is_empty() {
            return Ok(None);
        }
        let line = self.line("a section")?;
        match line.trim().strip_prefix('$') {
            Some(name) if !name.is_empty() && !name.starts_with("End") => Ok(Some((name, at))),
            _ => Err(unexpected(at, line, "a section (like $Nodes) was expected; save the file again")),
        }
    }

    pub fn end(&mut self, section: &'static str) -> Parsed<()> {
        self.skip_space();
        let at = self.at;
        let found = self.token(section)?;
        if found.strip_prefix("$End") == Some(section) {
            return Ok(());
        }
        let help = "the section has more entries than it announces; save the file again";
        Err(unexpected(at, found, &format!("$End{section} was expected: {help}")))
    }

    pub fn skip(&mut self, section: &str) -> Parsed<()> {
        let end = format!("$End{section}");
        let offset = self.rest().windows(end.len()).position(|w| w == end.as_bytes());
        self.at += offset.ok_or_else(|| self.ended(&end))? + end.len();
        Ok(())
    }

    pub fn line(&mut self, what: &str) -> Parsed<&'a str> {
        let text = self.text(|b| *b == b'\n', what)?;
        self.at = (self.at + 1).min(self.bytes.len());
        Ok(text)
    }

    /// A number on a line of its own, which is text in binary files, too.
    pub fn count_in_text(&mut self, what: &'static str) -> Parsed<u64> {
        self.skip_space();
        let at = self.at;
        let text = self.line(what)?.trim();
        text.parse().map_err(|_| not_a_number(at, what, text))
    }

    pub fn token(&mut self, what: &str) -> Parsed<&'a str> {
        self.skip_space();
        self.text(u8::is_ascii_whitespace, what)
    }

    pub fn int(&mut self, what: &'static str) -> Parsed<i64> {
        self.read(what, |little| i32::from_le_bytes(little).into())
    }

    pub fn size(&mut self, what: &'static str) -> Parsed<u64> {
        self.read(what, u64::from_le_bytes)
    }

    pub fn real(&mut self, what: &'static str) -> Parsed<f64> {
        self.read(what, f64::from_le_bytes)
    }

    pub fn reals(&mut self, what: &'static str) -> Parsed<[f64; 3]> {
        Ok([self.real(what)?, self.real(what)?, self.real(what)?])
    }

    /// A number as text, or as bytes that `of` converts from little-endian order.
    fn read<T: std::str::FromStr, const N: usize>(
        &mut self,
        what: &'static str,
        of: fn([u8; N]) -> T,
    ) -> Parsed<T> {
        if !self.is_binary {
            let text = self.token(what)?;
            return text.parse().map_err(|_| not_a_number(self.at - text.len(), what, text));
        }
        let mut bytes = self.array(what)?;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(of(bytes))
    }

    fn array<const N: usize>(&mut self, what: &str) -> Parsed<[u8; N]> {
        let bytes = self.rest().first_chunk().ok_or_else(|| self.ended(what))?;
        self.at += N;
        Ok(*bytes)
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The text up to the first byte that `is_end`.
    fn text(&mut self, is_end: impl Fn(&u8) -> bool, what: &str) -> Parsed<&'a str> {
        let rest = self.rest();
        if rest.is_empty() {
            return Err(self.ended(what));
        }
        let length = rest.iter().position(is_end).unwrap_or(rest.len());
        let text = std::str::from_utf8(&rest[..length])
            .map_err(|_| wrong!(self.at, "{what} is not UTF-8 text; save the file again"))?;
        self.at += length;
        Ok(text)
    }

    fn ended(&self, what: &str) -> Located {
        wrong!(self.at, "the file ends where {what} was expected: it was cut off; save it again")
    }

    fn skip_space(&mut self) {
        self.at += self.rest().len() - self.rest().trim_ascii_start().len();
    }
}

fn not_a_number(at: usize, what: &str, found: &str) -> Located {
    let help = "correct it, or save the file again (are there as many entries as the section announces?)";
    unexpected(at, found, &format!("{what} was expected; {help}"))
}

/// `wanted` says what was expected, and what to do.
fn unexpected(at: usize, found: &str, wanted: &str) -> Located {
    wrong!(at, "\"{:.40}\" stands where {wanted}", found.trim())
}

/// A problem, and the byte of the file at which it is, if it is at one.
#[derive(Debug)]
pub(super) struct Located {
    pub at: Option<usize>,
    pub problem: String,
}

pub(super) type Parsed<T> = Result<T, Located>;

/// A [`Located`] from a byte, or `None`, and the arguments of `format!`.
macro_rules! wrong {
    ($at:expr, $($words:tt)*) => {
        $crate::bodies::gmsh::cursor::Located { at: Option::from($at), problem: format!($($words)*) }
    };
}
pub(super) use wrong;
