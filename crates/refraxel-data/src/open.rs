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
    let descriptions = descriptions_in(path);
    let Some((first, others)) = descriptions.split_first() else {
        return recognise::read_folder(path, options)?.ok_or_else(|| without_poses(path));
    };
    let mut parsed = match first {
        Description::Split(_) => transforms::read_blender(path, options)?,
        Description::Whole(file) => transforms::read_with_held_out(file, options)?,
        Description::Colmap(models) => colmap::read(path, models, options)?,
        Description::Llff(poses) => llff::read(path, poses.clone(), options)?,
        Description::Nsvf(poses) => nsvf::read(path, poses, options)?,
    };
    parsed.problems.extend(unread(first, others));
    Ok(parsed)
}

/// A description of cameras of a well-known name.
enum Description {
    /// The first of the files of a split.
    Split(PathBuf),
    /// The file of all views.
    Whole(PathBuf),
    /// At least one model.
    Colmap(Vec<PathBuf>),
    Llff(PathBuf),
    Nsvf(PathBuf),
}

/// The descriptions in a folder, in the order in which they are preferred.
fn descriptions_in(folder: &Path) -> Vec<Description> {
    let split = file_in(folder, "transforms_train.json").map(Description::Split);
    // Beside the files of a split, the file of all views says the same again.
    let transforms = split.or_else(|| file_in(folder, "transforms.json").map(Description::Whole));
    let models = Some(colmap::find_models(folder)).filter(|models| !models.is_empty());
    let poses =
        [llff::pose_file(folder).map(Description::Llff), nsvf::pose_folder(folder).map(Description::Nsvf)];
    [transforms, models.map(Description::Colmap)].into_iter().chain(poses).flatten().collect()
}

impl Description {
    /// Its file or folder, for messages.
    fn path(&self) -> String {
        match self {
            Self::Split(path) | Self::Whole(path) | Self::Llff(path) | Self::Nsvf(path) => path,
            Self::Colmap(models) => &models[0],
        }
        .display()
        .to_string()
    }
}

/// A note about other descriptions of cameras than the one that is read.
fn unread(read: &Description, others: &[Description]) -> Option<Problem> {
    let read = read.path();
    let others = others.iter().map(Description::path).collect::<Vec<_>>().join(", ");
    (!others.is_empty()).then(|| {
        Problem::note(format!(
            "there are several descriptions of cameras: {read} is read, and not {others}; move away those that are not meant"
        ))
    })
}

/// Why nothing that was found has poses.
fn without_poses(path: &Path) -> DataError {
    let path = path.to_owned();
    if path.is_file() && is_video(&path) {
        return DataError::Video { path };
    }
    if let Some(half) = colmap::half_model(&path) {
        return half;
    }
    let found = Photographs::in_folder(&path).unwrap_or_default();
    match found.names.len() + found.unread.len() {
        0 => DataError::UnknownFormat { path },
        count => DataError::NoPoses { path, count },
    }
}
