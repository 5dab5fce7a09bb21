//! Opening a dataset: find the format, let its importer read it, check and complete the result.

use crate::extensions::is_video;
use crate::folder::file_in;
use crate::formats::{colmap, llff, nsvf, recognise, transforms};
use crate::parsed::ParsedDataset;
use crate::photographs::Photographs;
use crate::{DataError, Dataset, NamedCamera, OpenOptions, Problem, assemble, below};
use std::path::{Path, PathBuf};

impl Dataset {
    /// Opens a dataset folder or description file of any supported [`Format`](crate::Format).
    ///
    /// It reads descriptions and image headers, and the pixels of at most 12 photographs and their masks. These say
    /// what lies behind the scene, and what alpha and masks mean, where nothing else does. Views whose image is missing
    /// are left out with a warning in [`Dataset::problems`].
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Dataset, DataError> {
        let path = path.as_ref();
        let parsed = import(path, options)?;
        assemble::assemble(path, parsed, options)
    }
}

/// Reads the cameras of a dataset whose pictures may be missing, as for new views along a path.
///
/// Sizes are those of the pictures where they exist and those that the file states elsewhere.
pub fn open_cameras(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Vec<NamedCamera>, DataError> {
    let path = path.as_ref();
    assemble::named_cameras(path, import(path, options)?, options)
}

/// Reads a file or folder, or the only dataset in a folder below.
fn import(path: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    match import_here(path, options) {
        Err(error @ (DataError::UnknownFormat { .. } | DataError::NoPoses { .. })) => {
            let below = below::only_dataset(path, |folder| import_here(folder, options))?;
            below.ok_or_else(|| part(path, options).unwrap_or_else(|| recognise::explained(path, error)))
        }
        read => read,
    }
}

/// The error about a file of a dataset that lies in a folder above, or about a folder of its photographs, reduced ones included.
fn part(path: &Path, options: &OpenOptions) -> Option<DataError> {
    /// Folders above that are looked at: a model of COLMAP lies in two.
    const ABOVE: usize = 3;
    let real = path.canonicalize().ok()?;
    let is_reduced = real.file_name()?.to_string_lossy().starts_with("images_");
    let holds = |folder: &&Path| {
        let frames = import_here(folder, options).map_or(Vec::new(), |parsed| parsed.frames);
        let mut images = frames.iter().filter_map(|frame| frame.image.as_ref());
        match real.is_file() || is_reduced {
            true => images.next().is_some(),
            false => images.any(|image| image.starts_with(&real)),
        }
    };
    let dataset = real.ancestors().skip(1).take(ABOVE).find(holds)?.to_owned();
    Some(DataError::Part { path: path.to_owned(), dataset })
}

fn import_here(path: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    if let Some(scene) = transforms::scannetpp(path) {
        return transforms::read_scannetpp(&scene, options);
    }
    if path.is_file()
        && let Some(parsed) = recognise::read_file(path, options)?
    {
        return Ok(parsed);
    }
    if !path.exists() {
        return Err(DataError::NotFound { path: path.to_owned() });
    }
    let (training, single) = (file_in(path, "transforms_train.json"), file_in(path, "transforms.json"));
    let models = colmap::find_models(path);
    let (rows, matrices) = (llff::pose_file(path), nsvf::pose_folder(path));
    // Beside the files of a split, the file of all views says the same again.
    let whole = single.as_ref().filter(|_| training.is_none());
    let there = [training.as_ref(), whole, models.first(), rows.as_ref(), matrices.as_ref()];
    let there: Vec<&PathBuf> = there.into_iter().flatten().collect();
    let mut parsed = match (&training, &single, &rows, &matrices) {
        (Some(_), ..) => transforms::read_blender(path, options)?,
        (_, Some(single), ..) => transforms::read_with_held_out(single, options)?,
        _ if !models.is_empty() => colmap::read(path, &models, options)?,
        (.., Some(poses), _) => llff::read(path, poses.clone(), options)?,
        (.., Some(poses)) => nsvf::read(path, poses, options)?,
        _ => match recognise::read_folder(path, options)? {
            Some(parsed) => return Ok(parsed),
            None => return Err(without_poses(path)),
        },
    };
    parsed.problems.extend(unread(&there));
    Ok(parsed)
}

/// A note about other descriptions of cameras than the one that is read.
fn unread(there: &[&PathBuf]) -> Option<Problem> {
    let (read, others) = there.split_first()?;
    let others: Vec<String> = others.iter().map(|path| path.display().to_string()).collect();
    (!others.is_empty()).then(|| {
        Problem::note(format!(
            "there are several descriptions of cameras: {} is read, and not {}; move away those that are not meant",
            read.display(),
            others.join(", ")
        ))
    })
}

/// Why nothing that was found has poses.
fn without_poses(path: &Path) -> DataError {
    let path = path.to_owned();
    if path.is_file() && is_video(&path) {
        return DataError::Video { path };
    }
    if let Err(half) = colmap::refuse_half(&path) {
        return half;
    }
    let found = Photographs::in_folder(&path).unwrap_or_default();
    match found.names.len() + found.unread.len() {
        0 => DataError::UnknownFormat { path },
        count => DataError::NoPoses { path, count },
    }
}
