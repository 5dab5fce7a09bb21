//! Finding masks and deciding what their white means.

use crate::error::Size;
use crate::parsed::{ParsedDataset, StatedMask};
use crate::{DataError, Format, MaskMeaning, OpenOptions, Problem, View, photo};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Gives each view its mask and says in a note what was concluded.
pub(crate) fn attach(
    parsed: &mut ParsedDataset,
    views: &mut [View],
    truth: Option<&Value>,
    options: &OpenOptions,
) -> Result<(), DataError> {
    let refractive =
        truth.and_then(|t| t.get("refractive")).and_then(Value::as_array).is_some_and(|l| !l.is_empty());
    for (frame, view) in parsed.frames.iter().zip(&mut *views) {
        let found = frame.mask.clone().or_else(|| find(parsed, &view.image));
        let Some((path, stated)) = found else { continue };
        let split_folder = parsed.format == Format::Blender && stated == StatedMask::Open;
        let concluded = match stated {
            StatedMask::Known(meaning) => meaning,
            StatedMask::Open if refractive || split_folder => MaskMeaning::Refractive,
            StatedMask::Open => MaskMeaning::Keep,
        };
        view.mask_meaning = options.mask_meaning.unwrap_or(concluded);
        view.mask = Some(path);
    }
    let check = |view: &View| match &view.mask {
        Some(mask) => {
            let size = Size { width: view.camera.width, height: view.camera.height };
            photo::check_mask_size(mask, &view.image, size)
        }
        None => Ok(()),
    };
    views.par_iter().map(check).collect::<Result<Vec<()>, _>>()?;
    parsed.problems.extend(summary(views));
    Ok(())
}

/// The mask that lies where the conventions put it.
fn find(parsed: &ParsedDataset, image: &Path) -> Option<(PathBuf, StatedMask)> {
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

fn summary(views: &[View]) -> Option<Problem> {
    let mut counts = BTreeMap::new();
    for view in views.iter().filter(|v| v.mask.is_some()) {
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
