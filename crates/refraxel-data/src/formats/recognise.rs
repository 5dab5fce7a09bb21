//! Which tool's description a file or a folder is, by what is in it.

use super::{gaussians, metashape, opensfm, others, polycam, realitycapture, record3d, transforms};
use crate::extensions::{is_video, unpacking};
use crate::folder::{inside, names};
use crate::parsed::ParsedDataset;
use crate::{DataError, OpenOptions, Problem, limits};
use std::path::{Path, PathBuf};

/// Reads a file that somebody has named; `None` for a file of another kind.
pub(crate) fn read_file(file: &Path, options: &OpenOptions) -> Result<Option<ParsedDataset>, DataError> {
    let extension = extension(file);
    let folder = file.parent().unwrap_or(Path::new(""));
    match extension.as_str() {
        "json" | "" if is_like_record3d(file) => record3d::read(file, options).map(Some),
        "json" => match list_of(file) {
            List::Cameras => gaussians::read(file, options).map(Some),
            List::Reconstructions => opensfm::read(folder, file, options).map(Some),
            List::None => match others::cameras(file) {
                Some(other) => Err(other),
                None => transforms::read_single(file, options).map(Some),
            },
        },
        "xml" if metashape::is_cameras(file) => metashape::read(file, options).map(Some),
        "csv" if realitycapture::is_cameras(file) => realitycapture::read(file, options).map(Some),
        _ => archive(file).map_or(Ok(None), Err),
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

/// Why no poses were found, as far as it is known what lies there instead, or in one of the folders in it, or which folder in these cannot
/// be read.
pub(crate) fn explained(path: &Path, error: DataError) -> DataError {
    let folders_in = |folder: &Path| inside(folder).into_iter().filter(|path| path.is_dir());
    let folders: Vec<PathBuf> = std::iter::once(path.to_owned()).chain(folders_in(path)).collect();
    if let Some(closed) = folders.iter().flat_map(|folder| folders_in(folder)).find_map(|f| names(&f).err()) {
        return closed;
    }
    let cameras = folders.iter().find_map(|folder| others::cameras(folder));
    let packed = || {
        let files = folders.iter().flat_map(|folder| inside(folder));
        files.into_iter().find_map(|file| archive(&file).or_else(|| video(&file)))
    };
    let results = || folders.iter().find_map(|folder| others::results(folder));
    match error {
        DataError::UnknownFormat { .. } => cameras.or_else(packed).or_else(results).unwrap_or(error),
        error => cameras.unwrap_or(error),
    }
}

/// The error about a packed file.
fn archive(file: &Path) -> Option<DataError> {
    let command = file.file_name().and_then(|name| unpacking(name.to_str()?)).filter(|_| file.is_file())?;
    Some(DataError::Archive { path: file.to_owned(), command })
}

fn video(file: &Path) -> Option<DataError> {
    (file.is_file() && is_video(file)).then(|| DataError::Video { path: file.to_owned() })
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
    let text = others::head(file);
    let has = |key: &str| text.contains(key);
    match text.trim_start_matches('\u{feff}').trim_start().starts_with('[') {
        true if has("\"img_name\"") || (has("\"rotation\"") && has("\"position\"")) => List::Cameras,
        true if has("\"cameras\"") || has("\"shots\"") => List::Reconstructions,
        _ => List::None,
    }
}

fn is_like_record3d(file: &Path) -> bool {
    limits::read_text(file).is_ok_and(|text| record3d::is_metadata(&text))
}
