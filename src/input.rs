//! What users hand in, read whole: never without bound, and never waiting for a device.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// No table, scene or anatomy is larger than this, bytes.
pub const LARGEST_BYTES: u64 = 64 << 20;

/// Why an input could not be read. Each message ends in what to do.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The operating system refused.
    #[error("{0}; check that the path is right and that the file may be read")]
    Io(#[from] io::Error),
    /// A folder.
    #[error("it is a folder; name a file in it")]
    Folder,
    /// A pipe or a device, which need not end.
    #[error("it is a pipe or a device, which need not end; give a file, or `-` and the text on stdin")]
    NoFile,
    /// Larger than [`LARGEST_BYTES`].
    #[error("it is larger than {} MiB; give the table alone", LARGEST_BYTES >> 20)]
    TooLarge,
}

/// All bytes of the file at `path`.
///
/// # Errors
/// Whatever [`InputError`] names.
pub fn read_file(path: &Path) -> Result<Vec<u8>, InputError> {
    // Asked before it is opened, because opening a pipe waits for somebody to write to it.
    let kind = fs::metadata(path)?;
    match kind.is_file() {
        true => read_all(File::open(path)?),
        false if kind.is_dir() => Err(InputError::Folder),
        false => Err(InputError::NoFile),
    }
}

/// All bytes of `reader`.
///
/// # Errors
/// [`InputError::Io`] and [`InputError::TooLarge`].
pub fn read_all(reader: impl Read) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    reader.take(LARGEST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_BYTES { Err(InputError::TooLarge) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_devices_and_endless_streams_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(read_file(folder.path()), Err(InputError::Folder)));
        assert!(matches!(read_file(&folder.path().join("none")), Err(InputError::Io(_))));
        assert!(matches!(read_all(io::repeat(b'x')), Err(InputError::TooLarge)));
        #[cfg(unix)]
        {
            assert!(matches!(read_file(Path::new("/dev/zero")), Err(InputError::NoFile)));
            let pipe = folder.path().join("pipe");
            assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            assert!(matches!(read_file(&pipe), Err(InputError::NoFile)));
        }
    }
}
