//! Photographs beside a description: where they lie, and views of them.

use crate::DepthFile;
use crate::extensions::is_picture;
use crate::folder::{folder_in, names};
use crate::masks::names_beside;
use crate::naming::{key, picture_stem};
use crate::parsed::{Frame, Intrinsics, Origin};
use crate::root::Root;
use refraxel_core::Pose;
use std::collections::HashSet;
use std::path::PathBuf;

/// A view of a photograph whose description says nothing of masks, depth and parts; `image` is `None` where the file does not exist.
pub(super) fn frame(
    origin: Origin,
    file: impl Into<String>,
    image: Option<PathBuf>,
    intrinsics: Intrinsics,
    pose: Pose,
) -> Frame {
    let (file, mask, depth, part, lost) = (file.into(), None, None, None, None);
    Frame { origin, file, image, mask, depth, part, intrinsics, pose, lost }
}

/// The images among these names that are no masks beside others.
pub(super) fn photographs(mut names: Vec<String>) -> Vec<String> {
    names.retain(|name| is_picture(name));
    let masks: HashSet<String> = names.iter().flat_map(|name| names_beside(picture_stem(name))).collect();
    names.retain(|name| !masks.contains(name));
    names
}

/// Maps of depth in a folder of the dataset, under the names of its photographs.
pub(super) struct Maps<'a> {
    pub folder: &'a str,
    pub extension: &'a str,
    /// Scene units a step.
    pub unit: f64,
    /// Columns and rows where the files do not state them, as in [`DepthFile::size`].
    pub size: Option<[u32; 2]>,
}

/// Gives photographs these maps, where they have none.
pub(super) fn add_depth(root: &Root, frames: &mut [Frame], maps: &Maps) {
    let &Maps { folder, extension, unit, size } = maps;
    let folder = root.folder().join(folder);
    for frame in frames.iter_mut().filter(|frame| frame.depth.is_none()) {
        let stem = frame.image.as_ref().and_then(|image| image.file_stem());
        let path = stem.map(|stem| folder.join(stem).with_added_extension(extension));
        let path = path.filter(|path| path.is_file() && root.contains(path));
        frame.depth = path.map(|path| DepthFile { path, unit, size });
    }
}

/// Folders that are looked into.
const FOLDERS: usize = 64;

/// The folder below the dataset's that holds most of the pictures that are named: `images`, then others that are called so, then the
/// dataset's own, then any. Names may begin with the folder: then the dataset's own comes first.
pub(super) fn image_folder<'a>(
    root: &Root,
    pictures: impl ExactSizeIterator<Item = &'a str> + Clone,
) -> String {
    let is_named =
        |name: &String| ["image", "input", "photo", "rgb"].iter().any(|word| key(name).contains(word));
    let usual = folder_in(root.folder(), "images").and_then(|p| p.file_name()?.to_str().map(str::to_owned));
    let usual = usual.unwrap_or_else(|| "images".to_owned());
    let mut all = names(root.folder()).unwrap_or_default();
    all.retain(|name| *name != usual && root.folder().join(name).is_dir());
    let (named, others): (Vec<_>, Vec<_>) = all.into_iter().partition(is_named);
    let mut folders = [vec![usual.clone()], named].concat();
    let at = if pictures.clone().all(|name| name.contains(['/', '\\'])) { 0 } else { folders.len() };
    folders.insert(at, ".".to_owned());
    let mut best = (0, usual);
    for folder in folders.into_iter().chain(others).take(FOLDERS) {
        let count = pictures.clone().filter(|name| root.has_below(&folder, name)).count();
        if count > best.0 {
            best = (count, folder);
        }
        if best.0 == pictures.len() {
            break;
        }
    }
    best.1
}
