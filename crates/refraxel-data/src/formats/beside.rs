//! Photographs beside a description: where they lie, and views of them.

use crate::folder::{folder_in, names};
use crate::naming::key;
use crate::parsed::{Frame, Intrinsics, Origin};
use crate::root::Root;
use refraxel_core::Pose;
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
