//! The dataset in a folder below the one that was given: one or two levels deeper.

use crate::parsed::ParsedDataset;
use crate::{DataError, Problem};
use std::path::{Path, PathBuf};

/// Folders that are looked at on a level; more are no place where a dataset was unpacked.
const FOLDERS: usize = 256;
/// Datasets that an error names.
const NAMED: usize = 8;

/// The only dataset below a folder, with a note that says where it is; `None` where there is none.
///
/// `import` reads what is directly in a folder. Several datasets on the level nearest to the folder are an error.
pub(crate) fn only_dataset(
    given: &Path,
    import: impl Fn(&Path) -> Result<ParsedDataset, DataError>,
) -> Result<Option<ParsedDataset>, DataError> {
    let children = folders_in(given);
    let grandchildren = || children.iter().flat_map(|child| folders_in(child)).take(FOLDERS);
    let mut found = datasets(&children, &import);
    if found.is_empty() {
        found = datasets(&grandchildren().collect::<Vec<_>>(), &import);
    }
    if found.len() > 1 {
        let found = found.into_iter().map(|(folder, _)| folder).collect();
        return Err(DataError::SeveralDatasets { path: given.to_owned(), found });
    }
    let Some((folder, parsed)) = found.pop() else { return Ok(None) };
    let mut parsed = parsed?;
    let (given, folder) = (given.display(), folder.display());
    parsed
        .problems
        .push(Problem::note(format!("{given} holds no dataset itself; the one in {folder} is used")));
    Ok(Some(parsed))
}

fn datasets(
    folders: &[PathBuf],
    import: &impl Fn(&Path) -> Result<ParsedDataset, DataError>,
) -> Vec<(PathBuf, Result<ParsedDataset, DataError>)> {
    let read = |folder: &PathBuf| match import(folder) {
        Err(DataError::UnknownFormat { .. } | DataError::NoPoses { .. }) => None,
        read => Some((folder.clone(), read)),
    };
    folders.iter().filter_map(read).take(NAMED).collect()
}

/// Folders in a folder, sorted, without hidden ones and links.
fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_shown = |name: std::ffi::OsString| !name.to_string_lossy().starts_with(['.', '_']);
    let folders = entries.filter(|e| e.file_type().is_ok_and(|t| t.is_dir()) && is_shown(e.file_name()));
    let mut folders: Vec<PathBuf> = folders.map(|entry| entry.path()).take(FOLDERS).collect();
    folders.sort();
    folders
}
