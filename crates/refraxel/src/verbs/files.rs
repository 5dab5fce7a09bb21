//! Paths, folders and small text files.

use crate::exit::{Exit, Failure, OrExit};
use anyhow::Context;
use refraxel_data::atomic::write_atomic;
use refraxel_data::limits::{JSON_BYTES, open_regular};
use serde::Serialize;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A path from the root, so that it holds in any folder.
pub fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Reads a small text file: a [regular](open_regular) one, whose size is bounded as that of JSON of a dataset is. Bytes that are not
/// UTF-8 become U+FFFD and then fail where they are parsed.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(JSON_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > JSON_BYTES {
        let what = format!("it is larger than {} MiB", JSON_BYTES >> 20);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads a small text file as [`read_text`] does; `None` where there is none.
pub fn read_if_there(path: &Path) -> Result<Option<String>, Failure> {
    match read_text(path) {
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(None),
        text => text.map(Some).with_context(|| format!("cannot read {}", path.display())).or_exit(Exit::Io),
    }
}

/// Writes a text file, whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    Ok(write_atomic(path, |f| f.write_all(text.as_bytes()))?)
}

/// Writes a document as a file of JSON, whole or not at all.
pub fn write_json(path: &Path, document: &impl Serialize) -> Result<(), Failure> {
    write_text(path, &serde_json::to_string_pretty(document).or_exit(Exit::Io)?)
}

/// Creates a folder and its parents.
pub fn create_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path)
        .with_context(|| format!("cannot create the folder {}", path.display()))
        .or_exit(Exit::Io)
}
