//! NumPy `.npz` archives: ZIP files whose entries are stored as they are, as `numpy.savez` writes them.
//!
//! Source: PKWARE APPNOTE 6.3. Sizes come from the central directory; the local headers may lack them.

use crate::DataError;
use crate::bytes::Bytes;
use std::path::Path;

const EXPECTED: &str = "an uncompressed .npz archive (numpy.savez, not savez_compressed)";
/// Bytes of the record that ends an archive, without its comment.
const END_BYTES: usize = 22;

/// Whether the content starts like a ZIP file.
pub(crate) fn is_archive(content: &[u8]) -> bool {
    content.starts_with(b"PK\x03\x04")
}

/// Name and content of each entry.
pub(crate) fn entries<'a>(path: &Path, content: &'a [u8]) -> Result<Vec<(String, &'a [u8])>, DataError> {
    let all = Bytes::new(path, content);
    let last = content.len().saturating_sub(END_BYTES);
    // A comment of up to 64 KiB may follow the record.
    let end =
        (last.saturating_sub(1 << 16)..=last).rev().find(|&at| content[at..].starts_with(b"PK\x05\x06"));
    let end = end.ok_or_else(|| all.damaged("no end of the archive".into(), EXPECTED))?;
    let count = u16_at(content, end + 10).unwrap_or(0);
    let mut at = u32_at(content, end + 16).unwrap_or(u32::MAX) as usize;
    let mut found = Vec::new();
    for i in 0..count {
        let fault = |what: &str| all.damaged(format!("entry {i}: {what}"), EXPECTED);
        let entry = content.get(at..).filter(|e| e.starts_with(b"PK\x01\x02"));
        let entry = entry.ok_or_else(|| fault("no header in the directory"))?;
        let short = |at| u16_at(entry, at).map(usize::from).ok_or_else(|| fault("a header cut short"));
        let long = |at| u32_at(entry, at).map(|v| v as usize).ok_or_else(|| fault("a header cut short"));
        let (method, size, start) = (short(10)?, long(20)?, long(42)?);
        let (name, extra, comment) = (short(28)?, short(30)?, short(32)?);
        if method != 0 {
            return Err(fault("compressed"));
        }
        let text = entry.get(46..46 + name).ok_or_else(|| fault("a name cut short"))?;
        let local = content.get(start..).filter(|l| l.starts_with(b"PK\x03\x04"));
        let local = local.ok_or_else(|| fault("no header before the data"))?;
        let skip = |at| u16_at(local, at).map(usize::from).ok_or_else(|| fault("a header cut short"));
        let first = 30 + skip(26)? + skip(28)?;
        let data = first.checked_add(size).and_then(|end| local.get(first..end));
        found
            .push((String::from_utf8_lossy(text).into_owned(), data.ok_or_else(|| fault("data cut short"))?));
        at += 46 + name + extra + comment;
    }
    Ok(found)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..at + 2)?.try_into().ok().map(u16::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}
