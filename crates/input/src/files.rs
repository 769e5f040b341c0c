//! The only module that opens files, and only with the feature `files`.

use std::io::{self, Read};
use std::path::Path;

/// Largest size of a file, bytes: a device might never end.
const LARGEST: u64 = 256 << 20;
/// Largest size of text that a user writes, bytes: its parsers need many times its size.
const LARGEST_TEXT: u64 = 16 << 20;

/// Reads all bytes of a file of at most 256 MiB.
pub fn read(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    read_up_to(LARGEST, path.as_ref())
}

/// Reads a file of UTF-8 text of at most 16 MiB.
pub fn read_text(path: impl AsRef<Path>) -> io::Result<String> {
    String::from_utf8(read_up_to(LARGEST_TEXT, path.as_ref())?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

pub fn read_up_to(limit: u64, path: &Path) -> io::Result<Vec<u8>> {
    if !cfg!(feature = "files") {
        let problem = "this build reads no files (feature `files`)";
        return Err(io::Error::new(io::ErrorKind::Unsupported, problem));
    }
    // The kind is checked before opening, because opening a pipe waits for a writer.
    let kind = std::fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    if !kind.is_file() {
        let problem = "it is a pipe or a device, which may never end";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    take_up_to(limit, std::fs::File::open(path)?)
}

pub fn take_up_to(limit: u64, reader: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let problem = format!("it is larger than {} MiB", limit >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    Ok(bytes)
}

pub fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::IsADirectory => "name a file in it",
        io::ErrorKind::InvalidInput => "give a file",
        io::ErrorKind::FileTooLarge => "split it into smaller files",
        _ => "check that the path is right and that the file may be read",
    }
}
