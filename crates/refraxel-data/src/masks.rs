//! Masks of parsed datasets: where they are, and what their white means.

use crate::error::Size;
use crate::parsed::{Frame, ParsedDataset, StatedMask};
use crate::{DataError, Format, MaskMeaning, OpenOptions, Problem, View, photo};
use rayon::prelude::*;
use refraxel_core::Camera;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A mask and what its white means.
pub(crate) struct MaskFile {
    pub path: PathBuf,
    pub meaning: MaskMeaning,
}

/// The mask of each frame of a parsed dataset, if it has one; `cameras` has one entry per frame.
///
/// Errors: a mask is not of its image's size, or its header cannot be read.
pub(crate) fn find_all(
    parsed: &ParsedDataset,
    cameras: &[Camera],
    truth: Option<&Value>,
    options: &OpenOptions,
) -> Result<Vec<Option<MaskFile>>, DataError> {
    let refractive =
        truth.and_then(|t| t.get("refractive")).and_then(Value::as_array).is_some_and(|l| !l.is_empty());
    let find = |(frame, camera): (&Frame, &Camera)| {
        let Some(image) = &frame.image else { return Ok(None) };
        let Some((path, stated)) = frame.mask.clone().or_else(|| in_usual_place(parsed, image)) else {
            return Ok(None);
        };
        photo::check_mask_size(&path, image, Size { width: camera.width, height: camera.height })?;
        let split_folder = parsed.format == Format::Blender && stated == StatedMask::Open;
        let concluded = match stated {
            StatedMask::Known(meaning) => meaning,
            StatedMask::Open if refractive || split_folder => MaskMeaning::Refractive,
            StatedMask::Open => MaskMeaning::Keep,
        };
        Ok(Some(MaskFile { path, meaning: options.mask_meaning.unwrap_or(concluded) }))
    };
    parsed.frames.par_iter().zip(cameras).map(find).collect()
}

/// The mask at one of the places where tools put it.
fn in_usual_place(parsed: &ParsedDataset, image: &Path) -> Option<(PathBuf, StatedMask)> {
    let root = parsed.root.folder();
    let inside = image.strip_prefix(root).unwrap_or(Path::new(image.file_name()?));
    let below_first: PathBuf = inside.components().skip(1).collect();
    let (folder, stem) = (image.parent()?, image.file_stem()?.to_str()?);
    let name = image.file_name()?.to_str()?;
    let masks = root.join("masks");
    let in_masks = [inside, below_first.as_path()].map(|relative| masks.join(relative));
    let open = in_masks.into_iter().flat_map(|path| {
        let with_png = PathBuf::from(format!("{}.png", path.display()));
        [path.with_extension("png"), with_png, path]
    });
    let beside = [format!("{stem}.mask.png"), format!("{stem}_mask.png"), format!("{name}.mask.png")];
    let candidates = open.chain(beside.map(|n| folder.join(n))).map(|path| (path, StatedMask::Open));
    let dynamic = folder.join(format!("dynamic_mask_{stem}.png"));
    let ignore = std::iter::once((dynamic, StatedMask::Known(MaskMeaning::Ignore)));
    candidates.chain(ignore).find(|(path, _)| path != image && path.is_file() && parsed.root.contains(path))
}

/// A note about the masks of all views: how many there are and what their white means.
pub(crate) fn summary(views: &[View]) -> Option<Problem> {
    let mut counts = BTreeMap::new();
    for view in views.iter().filter(|v| v.has_mask()) {
        let meaning = match view.mask_meaning {
            MaskMeaning::Refractive => "white = refractive object",
            MaskMeaning::Keep => "white = use, black = ignore",
            MaskMeaning::Ignore => "white = ignore",
        };
        *counts.entry(meaning).or_insert(0) += 1;
    }
    let text: Vec<String> = counts.iter().map(|(meaning, n)| format!("{n} masks, {meaning}")).collect();
    let without = views.len() - counts.values().sum::<usize>();
    let gap = if without > 0 { format!("; {without} views have none") } else { String::new() };
    (!text.is_empty()).then(|| Problem::note(format!("{}{gap}", text.join("; "))))
}
