//! ScanNet++: `dslr/nerfstudio/transforms*.json`, whose pictures lie in folders beside `nerfstudio`.

use super::frame::Layout;
use super::read::add_file;
use crate::parsed::ParsedDataset;
use crate::{DataError, Format, OpenOptions, Problem};
use std::path::{Path, PathBuf};

/// A description, the folders of pictures that may belong to it, and those of their masks.
const KINDS: [(&str, [&str; 2], &str); 2] = [
    (
        "transforms_undistorted.json",
        ["resized_undistorted_images", "undistorted_images"],
        "resized_undistorted_masks",
    ),
    ("transforms.json", ["resized_images", "original_images"], "resized_anon_masks"),
];

/// What was found.
pub(crate) struct Scene {
    /// `dslr`.
    folder: PathBuf,
    file: PathBuf,
    images: &'static str,
    masks: Option<&'static str>,
}

/// The description of a scene, of its folder `dslr` or of `nerfstudio` in that, whose pictures are there.
pub(crate) fn scannetpp(path: &Path) -> Option<Scene> {
    let named = path.is_file().then(|| path.file_name()).flatten();
    let inner = if named.is_some() { path.parent()? } else { path };
    let bases = if inner.file_name().is_some_and(|name| name == "nerfstudio") {
        vec![inner.parent()?.to_owned()]
    } else if named.is_none() {
        vec![path.join("dslr"), path.to_owned()]
    } else {
        return None;
    };
    bases.into_iter().find_map(|base| {
        KINDS.into_iter().filter(|(file, ..)| named.is_none_or(|named| named == *file)).find_map(
            |(file, images, masks)| {
                let images = images.into_iter().find(|images| base.join(images).is_dir())?;
                let masks = base.join(masks).is_dir().then_some(masks);
                let file = base.join("nerfstudio").join(file);
                file.is_file().then(|| Scene { folder: base.clone(), file, images, masks })
            },
        )
    })
}

/// Reads a scene; `test_frames` are held out.
pub(crate) fn read_scannetpp(scene: &Scene, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let Scene { folder, file, images, masks } = scene;
    let mut parsed = ParsedDataset::below(folder, Format::Transforms, options)?;
    let layout = Layout { images, masks: *masks };
    add_file(&mut parsed, file, &layout, None)?;
    let (file, folder) = (file.display(), folder.display());
    parsed
        .problems
        .push(Problem::note(format!("ScanNet++: {file} is used with the pictures in {folder}/{images}")));
    Ok(parsed)
}
