//! Where the library reads files: here alone, and not without the feature `files`.

use std::io;
use std::path::Path;

/// Larger files are refused, bytes: none that this program reads comes near it, and a device may have no end.
const LARGEST: u64 = 256 << 20;
/// The same for text that is written by hand, whose parsers need many times its size.
#[cfg(feature = "cli")]
const LARGEST_TEXT: u64 = 16 << 20;

/// All bytes of a file.
///
/// # Errors
/// As the operating system; a file of more than 256 MiB; every file, without the feature `files`.
pub fn read(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    read_up_to(LARGEST, path.as_ref())
}

/// A file of UTF-8 text, of at most 16 MiB.
///
/// # Errors
/// As [`read`], and where it is not UTF-8.
#[cfg(feature = "cli")]
pub fn read_text(path: impl AsRef<Path>) -> io::Result<String> {
    String::from_utf8(read_up_to(LARGEST_TEXT, path.as_ref())?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

#[cfg(feature = "files")]
fn read_up_to(limit: u64, path: &Path) -> io::Result<Vec<u8>> {
    use io::Read;
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let problem = format!("it is larger than {} MiB", limit >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    Ok(bytes)
}

#[cfg(not(feature = "files"))]
fn read_up_to(_: u64, _: &Path) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "this build reads no files (feature `files`)"))
}

#[cfg(all(test, unix, feature = "cli"))]
mod tests {
    #[test]
    fn what_has_no_end_is_refused() {
        let refused = super::read_text("/dev/zero").unwrap_err().to_string();
        assert_eq!(refused, "it is larger than 16 MiB");
    }
}
