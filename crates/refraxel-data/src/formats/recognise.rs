//! Which tool's description a file or a folder is, by what is in it.

use super::{gaussians, metashape, opensfm, polycam, realitycapture, record3d, transforms};
use crate::folder::names;
use crate::parsed::ParsedDataset;
use crate::{DataError, OpenOptions, Problem, limits};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Bytes of a file that tell of which kind it is.
const HEAD: u64 = 1 << 16;
/// Extensions of packed files.
const ARCHIVES: [&str; 9] = ["zip", "r3d", "tar", "tgz", "gz", "bz2", "xz", "7z", "rar"];

/// Reads a file that somebody has named; `None` for a file of another kind.
pub(crate) fn read_file(file: &Path, options: &OpenOptions) -> Result<Option<ParsedDataset>, DataError> {
    let extension = extension(file);
    let folder = file.parent().unwrap_or(Path::new(""));
    match extension.as_str() {
        "json" | "" if is_like_record3d(file) => record3d::read(file, options).map(Some),
        "json" => match list_of(file) {
            List::Cameras => gaussians::read(file, options).map(Some),
            List::Reconstructions => opensfm::read(folder, file, options).map(Some),
            List::None => transforms::read_single(file, options).map(Some),
        },
        "xml" if metashape::is_cameras(file) => metashape::read(file, options).map(Some),
        "csv" if realitycapture::is_cameras(file) => realitycapture::read(file, options).map(Some),
        _ if ARCHIVES.contains(&extension.as_str()) => Err(DataError::Archive { path: file.to_owned() }),
        _ => Ok(None),
    }
}

/// Reads the description that lies in a folder; `None` where there is none.
pub(crate) fn read_folder(folder: &Path, options: &OpenOptions) -> Result<Option<ParsedDataset>, DataError> {
    if let Some(file) = opensfm::find(folder) {
        return opensfm::read(folder, &file, options).map(Some);
    }
    if let Some(keyframes) = polycam::find(folder) {
        return polycam::read(&keyframes, options).map(Some);
    }
    if let Some(file) = record3d::find(folder) {
        return record3d::read(&file, options).map(Some);
    }
    if let Some(file) = metashape::find(folder)? {
        return metashape::read(&file, options).map(Some);
    }
    if let Some(file) = realitycapture::find(folder)? {
        return realitycapture::read(&file, options).map(Some);
    }
    if let Some(file) = gaussians::find(folder) {
        return gaussians::read(&file, options).map(Some);
    }
    let Some(file) = transforms::find_other(folder)? else { return Ok(None) };
    let mut parsed = transforms::read_single(&file, options)?;
    let (folder, file) = (folder.display(), file.display());
    parsed.problems.push(Problem::note(format!("{folder} has no transforms.json; {file} is used")));
    Ok(Some(parsed))
}

/// Why nothing was found in a folder: it holds a packed dataset, if it holds one and no photographs.
pub(crate) fn packed(folder: &Path, error: DataError) -> DataError {
    let names = names(folder).unwrap_or_default().into_iter().map(|name| folder.join(name));
    let is_archive = |file: &PathBuf| ARCHIVES.contains(&extension(file).as_str()) && file.is_file();
    match error {
        DataError::UnknownFormat { path } => match names.into_iter().find(is_archive) {
            Some(path) => DataError::Archive { path },
            None => DataError::UnknownFormat { path },
        },
        error => error,
    }
}

/// The extension of a file in small letters; empty where it has none.
fn extension(file: &Path) -> String {
    file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// What a JSON list holds.
enum List {
    Cameras,
    Reconstructions,
    /// It is no list.
    None,
}

fn list_of(file: &Path) -> List {
    let mut head = Vec::new();
    let read = limits::open_regular(file).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    let text = String::from_utf8_lossy(&head);
    let has = |key: &str| text.contains(key);
    match text.trim_start_matches('\u{feff}').trim_start().starts_with('[') && read.is_ok() {
        true if has("\"img_name\"") || (has("\"rotation\"") && has("\"position\"")) => List::Cameras,
        true if has("\"cameras\"") || has("\"shots\"") => List::Reconstructions,
        _ => List::None,
    }
}

fn is_like_record3d(file: &Path) -> bool {
    limits::read_text(file).is_ok_and(|text| record3d::is_metadata(&text))
}
