//! Cursor through the bytes of a Gmsh file (text, or text with binary numbers), and errors with their byte.

use tongue_core::body::BodyError;

pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
    big_endian: bool,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, binary: false, big_endian: false }
    }

    /// The byte at which the next token begins.
    pub fn position(&mut self) -> usize {
        if !self.binary {
            self.skip_space();
        }
        self.at
    }

    pub fn is_binary(&self) -> bool {
        self.binary
    }

    /// Switches to binary numbers. The next four bytes are the integer 1, which shows the byte order.
    pub fn begin_binary(&mut self) -> Parsed<()> {
        self.binary = true;
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
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let at = self.at;
        let line = self.line("a section")?;
        match line.trim().strip_prefix('$') {
            Some(name) if !name.is_empty() && !name.starts_with("End") => Ok(Some((name, at))),
            _ => {
                let found = shortened(line);
                Err(wrong!(
                    at,
                    "\"{found}\" stands where a section (like $Nodes) was expected; save the file again"
                ))
            }
        }
    }

    pub fn end(&mut self, section: &'static str) -> Parsed<()> {
        self.skip_space();
        let at = self.at;
        let found = self.token(section)?;
        if found.strip_prefix("$End") == Some(section) {
            return Ok(());
        }
        let found = shortened(found);
        Err(wrong!(
            at,
            "\"{found}\" stands where $End{section} was expected: the section has more entries than it announces; save the file again"
        ))
    }

    pub fn skip(&mut self, section: &str) -> Parsed<()> {
        let end = format!("$End{section}");
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        match rest.windows(end.len()).position(|w| w == end.as_bytes()) {
            Some(offset) => {
                self.at += offset + end.len();
                Ok(())
            }
            None => Err(self.ended(&end)),
        }
    }

    pub fn line(&mut self, what: &str) -> Parsed<&'a str> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        if rest.is_empty() {
            return Err(self.ended(what));
        }
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        let text = self.text(self.at, self.at + length, what)?;
        self.at = (self.at + length + 1).min(self.bytes.len());
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
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.ended(what));
        }
        let text = self.text(self.at, self.at + length, what)?;
        self.at += length;
        Ok(text)
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
        if !self.binary {
            return self.number(what);
        }
        let mut bytes = self.array(what)?;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(of(bytes))
    }

    fn number<T: std::str::FromStr>(&mut self, what: &'static str) -> Parsed<T> {
        let text = self.token(what)?;
        text.parse().map_err(|_| not_a_number(self.at - text.len(), what, text))
    }

    fn array<const N: usize>(&mut self, what: &str) -> Parsed<[u8; N]> {
        let bytes = self.bytes.get(self.at..self.at.saturating_add(N));
        let Some(bytes) = bytes.and_then(|b| <[u8; N]>::try_from(b).ok()) else {
            return Err(self.ended(what));
        };
        self.at += N;
        Ok(bytes)
    }

    fn text(&self, from: usize, to: usize, what: &str) -> Parsed<&'a str> {
        let bytes = self.bytes.get(from..to).unwrap_or_default();
        std::str::from_utf8(bytes).map_err(|_| wrong!(from, "{what} is not UTF-8 text; save the file again"))
    }

    fn ended(&self, what: &str) -> Located {
        wrong!(self.at, "the file ends where {what} was expected: it was cut off; save it again")
    }

    fn skip_space(&mut self) {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        self.at += rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
    }
}

fn not_a_number(at: usize, what: &str, found: &str) -> Located {
    let found = shortened(found);
    wrong!(
        at,
        "\"{found}\" stands where {what} was expected; correct it, or save the file again (are there as many entries as the \
         section announces?)"
    )
}

fn shortened(text: &str) -> String {
    text.trim().chars().take(40).collect()
}

/// A problem, and the byte of the file at which it is, if it is at one.
#[derive(Debug)]
pub(super) struct Located {
    pub at: Option<usize>,
    pub problem: String,
}

impl Located {
    pub fn into_error(self, origin: &str, bytes: &[u8], binary: bool) -> BodyError {
        let place = match self.at {
            None => String::new(),
            Some(at) if binary => format!(" (byte {at})"),
            Some(at) => format!(":{}", 1 + bytes.iter().take(at).filter(|b| **b == b'\n').count()),
        };
        BodyError(format!("{origin}{place}: {}", self.problem))
    }
}

pub(super) type Parsed<T> = Result<T, Located>;

/// A [`Located`] from a byte, or `None`, and the arguments of `format!`.
macro_rules! wrong {
    ($at:expr, $($words:tt)*) => {
        $crate::bodies::gmsh::cursor::Located { at: Option::from($at), problem: format!($($words)*) }
    };
}
pub(super) use wrong;
