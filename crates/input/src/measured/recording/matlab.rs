//! Reader of numbers, text, structures and cells in MATLAB's level 5 files (`.mat`, the format of `save` but for version 7.3).
//!
//! A file is a header of 128 bytes and elements: a type, a size and that many bytes, padded to a multiple of eight. Variables are elements
//! of type `miMATRIX`, plain or compressed (MathWorks, *MAT-File Format*, level 5). Every size is checked against the available bytes and
//! decompression is limited, so that no file needs more memory than twice its own size and [`MOST_INFLATED`] together.

use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_zlib_with_limit};

use super::{Malformed, SourcePlace};

/// Limit of the decompressed size of all variables of a file, bytes.
const MOST_INFLATED: usize = 64 << 20;
const DEEPEST: usize = 6;
/// Limit of the number of elements in all arrays of structures and cells.
const MOST_ELEMENTS: usize = 200_000;
const HELP: &str = "save it in MATLAB with save(file, '-v7'), or copy it again";

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

pub(super) enum MatValue {
    /// In column-major order.
    Numbers {
        /// Rows and columns; further dimensions are multiplied into the columns.
        size: [usize; 2],
        kind: u32,
        big_endian: bool,
        bytes: Vec<u8>,
    },
    Text(String),
    /// The fields of each structure of an array.
    Structures(Vec<Vec<(String, MatValue)>>),
    Other,
}

impl MatValue {
    pub fn number(&self, n: usize) -> Option<f64> {
        let Self::Numbers { kind, big_endian, bytes, .. } = self else { return None };
        let width = width_of(*kind)?;
        let stored = bytes.get(n.checked_mul(width)?..)?.get(..width)?;
        let mut little = [0_u8; 8];
        little[..width].copy_from_slice(stored);
        if *big_endian {
            little[..width].reverse();
        }
        let (bits, unused) = (u64::from_le_bytes(little), 64 - 8 * width);
        Some(match kind {
            7 => f64::from(f32::from_bits(bits as u32)),
            9 => f64::from_bits(bits),
            // The arithmetic shift down extends the sign.
            1 | 3 | 5 | 12 => ((bits << unused) as i64 >> unused) as f64,
            _ => bits as f64,
        })
    }
}

/// Bytes of a number of MATLAB's type `kind`.
fn width_of(kind: u32) -> Option<usize> {
    Some(match kind {
        1 | 2 => 1,
        3 | 4 => 2,
        5..=7 => 4,
        9 | 12 | 13 => 8,
        _ => return None,
    })
}

#[derive(Clone, Copy)]
struct Piece<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl<'a> Piece<'a> {
    fn word(self, at: usize) -> Option<u32> {
        let b: [u8; 4] = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big_endian { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) })
    }

    /// Type and bytes of the next element.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let first = self.word(0)?;
        // A small element has up to four bytes in the tag itself.
        if first >> 16 != 0 {
            let data = self.bytes.get(4..8)?.get(..(first >> 16) as usize)?;
            self.bytes = self.bytes.get(8..)?;
            return Some((first & 0xffff, data));
        }
        let size = self.word(4)? as usize;
        let data = self.bytes.get(8..)?.get(..size)?;
        let padded = if first == COMPRESSED { size } else { size.checked_next_multiple_of(8)? };
        self.bytes = self.bytes.get(8..)?.get(padded..).unwrap_or_default();
        Some((first, data))
    }

    fn of(self, bytes: &'a [u8]) -> Self {
        Self { bytes, ..self }
    }
}

/// The variables of a file, with their names.
pub(super) fn variables(bytes: &[u8], origin: &str) -> Result<Vec<(String, MatValue)>, Malformed> {
    let fail = |byte: usize, what: &str| SourcePlace { origin, line: 1, column: byte + 1 }.error(what, HELP);
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
        return Err(fail(0, "the file is of MATLAB's version 7.3 (HDF5)"));
    }
    let big_endian = match bytes.get(124..128) {
        Some([.., b'I', b'M']) => false,
        Some([.., b'M', b'I']) => true,
        _ => return Err(fail(0, "the file is not a MATLAB level 5 file")),
    };
    let mut rest = Piece { bytes: &bytes[128..], big_endian };
    let mut variables = Vec::new();
    let (mut most_bytes, mut most_elements) = (MOST_INFLATED, MOST_ELEMENTS);
    while !rest.bytes.is_empty() {
        let at = bytes.len() - rest.bytes.len();
        let inflated;
        let (mut kind, mut data) = rest.next().ok_or_else(|| fail(at, "a variable is cut off"))?;
        if kind == COMPRESSED {
            inflated = decompress_to_vec_zlib_with_limit(data, most_bytes).map_err(|e| match e.status {
                TINFLStatus::HasMoreOutput => {
                    let most = MOST_INFLATED >> 20;
                    fail(at, &format!("the decompressed variables are larger than {most} MB"))
                }
                _ => fail(at, "a compressed variable is damaged or cut off"),
            })?;
            most_bytes -= inflated.len();
            // A decompressed variable has the same tag as one that is not compressed.
            let whole = Piece { bytes: &inflated, big_endian }.next();
            (kind, data) = whole.ok_or_else(|| fail(at, "a compressed variable is cut off"))?;
        }
        if kind == MATRIX {
            let value = matrix(Piece { bytes: data, big_endian }, DEEPEST, &mut most_elements);
            let unreadable = || fail(0, &format!("variable {} cannot be read", variables.len() + 1));
            variables.push(value.ok_or_else(unreadable)?);
        }
    }
    Ok(variables)
}

fn matrix(mut piece: Piece<'_>, depth: usize, left: &mut usize) -> Option<(String, MatValue)> {
    *left = left.checked_sub(1)?;
    // An empty field has no bytes.
    if piece.bytes.is_empty() {
        return Some((String::new(), MatValue::Other));
    }
    let whole = piece;
    let (_, flags) = piece.next()?;
    let class = whole.of(flags).word(0)? & 0xff;
    let (_, sizes) = piece.next()?;
    let sizes = (0..sizes.len() / 4)
        .map(|n| whole.of(sizes).word(4 * n).map(|s| s as usize))
        .collect::<Option<Vec<usize>>>()?;
    let rows = *sizes.first()?;
    let columns = sizes.get(1..)?.iter().try_fold(1_usize, |a, b| a.checked_mul(*b))?;
    let count = rows.checked_mul(columns)?;
    let (_, name) = piece.next()?;
    let name = String::from_utf8_lossy(name).into_owned();
    let value = match class {
        2 if depth > 0 => {
            let (_, length) = piece.next()?;
            let length = whole.of(length).word(0)? as usize;
            let (_, names) = piece.next()?;
            if length == 0 || !names.len().is_multiple_of(length) {
                return Some((name, MatValue::Structures(Vec::new())));
            }
            let names =
                names.chunks_exact(length).map(|n| n.split(|b| *b == 0).next().unwrap_or_default().to_vec());
            let names: Vec<String> = names.map(|n| String::from_utf8_lossy(&n).into_owned()).collect();
            if count.saturating_mul(names.len().max(1)) > *left {
                return None;
            }
            let mut field = |name: &String| {
                let value = match piece.next()? {
                    (MATRIX, bytes) => matrix(whole.of(bytes), depth - 1, left)?.1,
                    _ => MatValue::Other,
                };
                Some((name.clone(), value))
            };
            let all = (0..count).map(|_| names.iter().map(&mut field).collect());
            MatValue::Structures(all.collect::<Option<_>>()?)
        }
        4 => {
            let (kind, bytes) = piece.next().unwrap_or((16, &[]));
            let of = if whole.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            MatValue::Text(match kind {
                4 | 17 => {
                    let units = bytes.as_chunks::<2>().0.iter().map(|pair| of(*pair));
                    char::decode_utf16(units).map(|c| c.unwrap_or('?')).collect()
                }
                _ => String::from_utf8_lossy(bytes).into_owned(),
            })
        }
        6..=15 => {
            let (kind, bytes) = piece.next()?;
            if count.checked_mul(width_of(kind)?)? > bytes.len() {
                return None;
            }
            let (size, bytes) = ([rows, columns], bytes.to_vec());
            MatValue::Numbers { size, kind, big_endian: whole.big_endian, bytes }
        }
        _ => MatValue::Other,
    };
    Some((name, value))
}
