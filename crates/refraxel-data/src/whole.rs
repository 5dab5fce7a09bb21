//! Whether a file holds a whole picture: downloads break off, and leave something else than a picture.

use crate::parsed::Loss;
use crate::{jpeg, limits};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
const JPEG: [u8; 2] = [0xff, 0xd8];
const JPEG_END: [u8; 2] = [0xff, 0xd9];

/// Why a file holds no whole picture, as far as that is seen without decoding it, and what it holds instead.
///
/// A file that cannot be read, or is of another kind, passes: whoever decodes it says what is wrong with it.
pub(crate) fn fault(path: &Path) -> Option<(Loss, Option<String>)> {
    let mut file = limits::open_regular(path).ok()?;
    let length = file.metadata().ok()?.len();
    if length == 0 {
        return Some((Loss::Empty, None));
    }
    let mut start = Vec::new();
    file.by_ref().take(64).read_to_end(&mut start).ok()?;
    if start.starts_with(&PNG) {
        let is_cut = !ends_with_its_last_chunk(&mut file, length).ok()?;
        return is_cut.then_some((Loss::Cut, None));
    }
    if start.starts_with(&JPEG) {
        let detail = jpeg_fault(path, &mut file).ok()??;
        return Some((Loss::Cut, Some(detail)));
    }
    let other = something_else(&start)?;
    Some((Loss::Undecodable, Some(other.to_owned())))
}

/// Whether a PNG ends with its last chunk, or its chunks lead to that within the file.
fn ends_with_its_last_chunk(file: &mut File, length: u64) -> io::Result<bool> {
    let mut end = [0; 12];
    file.seek(SeekFrom::Start(length.saturating_sub(12)))?;
    if file.read_exact(&mut end).is_ok() && end[..8] == *b"\0\0\0\0IEND" {
        return Ok(true);
    }
    let mut at = PNG.len() as u64;
    let mut head = [0; 8];
    while at + 12 <= length {
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head)?;
        let [a, b, c, d, kind @ ..] = head;
        if kind == *b"IEND" {
            return Ok(true);
        }
        at += 12 + u64::from(u32::from_be_bytes([a, b, c, d]));
    }
    Ok(false)
}

/// What a JPEG lacks that does not end as one; some cameras append something to theirs.
fn jpeg_fault(path: &Path, file: &mut File) -> io::Result<Option<String>> {
    let mut end = [0; 2];
    file.seek(SeekFrom::End(-2))?;
    file.read_exact(&mut end)?;
    if end == JPEG_END {
        return Ok(None);
    }
    let content = limits::read(path, limits::BINARY_BYTES).map_err(io::Error::other)?;
    Ok(jpeg::check(&content).err().map(|fault| fault.to_string()))
}

/// What is often found in place of a file.
pub(crate) fn something_else(start: &[u8]) -> Option<&'static str> {
    let start = start.trim_ascii_start();
    if limits::is_pointer(start) {
        return Some(limits::POINTER);
    }
    start.starts_with(b"<").then_some("it is a page of the web: download it again")
}
