//! Limits on what a file may ask for, so that a damaged or hostile dataset costs an error and not the machine's memory.

use crate::DataError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest JSON or text file [byte].
pub const JSON_BYTES: u64 = 64 << 20;
/// Largest reconstruction of OpenSfM, most of which are points [byte].
pub const RECONSTRUCTION_BYTES: u64 = 1 << 30;
/// Largest binary file (COLMAP models, PLY points) [byte].
pub const BINARY_BYTES: u64 = 4 << 30;
/// Most frames of a dataset.
pub const FRAMES: usize = 100_000;
/// Most values in a JSON file: the matrices of [`FRAMES`] frames, and as much again.
pub const JSON_VALUES: usize = 5_000_000;
/// Most objects in a JSON file.
pub const JSON_OBJECTS: usize = 3 * FRAMES;
/// Most bodies of a scene: a set of them is one machine word.
pub const BODIES: usize = 64;
/// Most faces, parts or waves of one body.
pub const PIECES: usize = 128;
/// Largest image [pixel].
pub const IMAGE_PIXELS: u64 = 256 << 20;
/// Largest image in memory, in the precision of its file [byte].
pub const IMAGE_BYTES: u64 = 3 << 29;

/// What a file is that [`is_pointer`].
pub(crate) const POINTER: &str = "it is a pointer of Git LFS: run git lfs pull";

/// Whether a file that begins so stands for one that was not downloaded.
pub(crate) fn is_pointer(start: &[u8]) -> bool {
    start.starts_with(b"version https://git-lfs")
}

/// Opens a file to read, if it is a regular one: a pipe would be waited for, and a device has no end.
pub fn open_regular(path: &Path) -> io::Result<File> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    File::open(path)
}

/// The whole file, if it is a [regular](open_regular) one, is there, and is not larger than `limit` bytes.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>, DataError> {
    let failed = |source| DataError::Read { path: path.to_owned(), source };
    let file = open_regular(path).map_err(failed)?;
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large from one that just fits, also while it grows.
    file.take(limit + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > limit {
        let found = std::fs::metadata(path).map_or(limit + 1, |m| m.len());
        return Err(DataError::TooLarge {
            path: path.to_owned(),
            what: "the file size [bytes]",
            found,
            limit,
        });
    }
    if is_pointer(&bytes) {
        return Err(failed(io::Error::other(POINTER)));
    }
    Ok(bytes)
}

/// The whole text file, in UTF-8 or in UTF-16 that says so, as Windows writes it; bytes that are neither become U+FFFD and then fail where
/// they are parsed.
pub(crate) fn read_text(path: &Path) -> Result<String, DataError> {
    read_text_up_to(path, JSON_BYTES)
}

/// The same with another limit [byte].
pub(crate) fn read_text_up_to(path: &Path, limit: u64) -> Result<String, DataError> {
    let bytes = read(path, limit)?;
    let text = match bytes.as_slice() {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes).into(),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes).into(),
        bytes => String::from_utf8_lossy(bytes),
    };
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units: Vec<u16> = bytes.as_chunks().0.iter().map(|pair| unit(*pair)).collect();
    String::from_utf16_lossy(&units)
}

/// Checks a frame count against [`FRAMES`].
pub(crate) fn frames(path: &Path, found: usize) -> Result<(), DataError> {
    at_most(path, "the number of frames", found, FRAMES)
}

/// Checks a number of bodies against [`BODIES`].
pub(crate) fn bodies(path: &Path, found: usize) -> Result<(), DataError> {
    at_most(path, "the number of bodies", found, BODIES)
}

/// Checks the pieces of a body against [`PIECES`].
pub(crate) fn pieces(path: &Path, found: usize) -> Result<(), DataError> {
    at_most(path, "the number of faces, parts or waves of a body", found, PIECES)
}

/// Checks the content of a JSON file before it takes memory.
pub(crate) fn json(path: &Path, values: usize, objects: usize) -> Result<(), DataError> {
    at_most(path, "the number of values", values, JSON_VALUES)?;
    at_most(path, "the number of objects {…}", objects, JSON_OBJECTS)
}

fn at_most(path: &Path, what: &'static str, found: usize, limit: usize) -> Result<(), DataError> {
    let fits = found <= limit;
    fits.then_some(()).ok_or_else(|| DataError::TooLarge {
        path: path.to_owned(),
        what,
        found: found as u64,
        limit: limit as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_windows_are_read_in_both_orders_of_their_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.txt");
        for order in [u16::to_le_bytes, u16::to_be_bytes] {
            let units = "\u{feff}é.png\r\n".encode_utf16();
            std::fs::write(&path, units.flat_map(order).collect::<Vec<u8>>()).unwrap();
            assert_eq!(read_text(&path).unwrap(), "é.png\r\n");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_file_without_an_end_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r_1.txt");
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        let refused = read(&path, u64::MAX - 1).unwrap_err().to_string();
        assert!(refused.contains("r_1.txt") && refused.contains("not a regular file"), "{refused}");
    }
}
