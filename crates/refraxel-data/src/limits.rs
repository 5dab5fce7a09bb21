//! Limits on what a file may ask for, so that a damaged or hostile dataset costs an error and not the machine's memory.

use crate::DataError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest JSON or text file [byte].
pub const JSON_BYTES: u64 = 64 << 20;
/// Largest binary file (COLMAP models, PLY points) [byte].
pub const BINARY_BYTES: u64 = 4 << 30;
/// Most frames of a dataset.
pub const FRAMES: usize = 100_000;
/// Largest image [pixel].
pub const IMAGE_PIXELS: u64 = 64 << 20;

/// The whole file, if it is not larger than `limit` bytes.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>, DataError> {
    let failed = |source| DataError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large from one that just fits, also for pipes.
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
    Ok(bytes)
}

/// The whole text file; bytes that are not UTF-8 become U+FFFD and then fail where they are parsed.
pub(crate) fn read_text(path: &Path) -> Result<String, DataError> {
    let bytes = read(path, JSON_BYTES)?;
    Ok(String::from_utf8_lossy(&bytes).trim_start_matches('\u{feff}').to_owned())
}

/// Checks a frame count against [`FRAMES`].
pub(crate) fn frames(path: &Path, found: usize) -> Result<(), DataError> {
    let fits = found <= FRAMES;
    fits.then_some(()).ok_or_else(|| DataError::TooLarge {
        path: path.to_owned(),
        what: "the number of frames",
        found: found as u64,
        limit: FRAMES as u64,
    })
}
