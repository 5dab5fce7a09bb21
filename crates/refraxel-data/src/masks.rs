//! Masks of parsed datasets: where they are, and what their white means.

use crate::parsed::{Frame, ParsedDataset, StatedMask};
use crate::size::Size;
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

/// The mask of each frame of a parsed dataset, if it has one, and a note where their meaning was concluded from what they show;
/// `cameras` has one entry per frame.
///
/// Errors: a mask is not of its image's size, or its header cannot be read.
pub(crate) fn find_all(
    parsed: &ParsedDataset,
    cameras: &[Camera],
    truth: Option<&Value>,
    options: &OpenOptions,
) -> Result<(Vec<Option<MaskFile>>, Option<Problem>), DataError> {
    let refractive =
        truth.and_then(|t| t.get("refractive")).and_then(Value::as_array).is_some_and(|l| !l.is_empty());
    let mut found = Vec::with_capacity(parsed.frames.len());
    let find = |(frame, camera): (&Frame, &Camera)| {
        let Some(image) = &frame.image else { return Ok(None) };
        let Some((path, stated)) = frame.mask.clone().or_else(|| in_usual_place(parsed, image)) else {
            return Ok(None);
        };
        photo::check_mask_size(&path, image, Size { width: camera.width, height: camera.height })?;
        Ok(Some((path, stated)))
    };
    parsed.frames.par_iter().zip(cameras).map(find).collect_into_vec(&mut found);
    let found = found.into_iter().collect::<Result<Vec<_>, DataError>>()?;
    // Masks of unknown meaning are looked at, all together, unless somebody says what they mean.
    let is_open = |stated: StatedMask| match stated {
        StatedMask::Context(_) => false,
        StatedMask::Open => !refractive && parsed.format != Format::Blender,
        StatedMask::Shown => true,
    };
    let open =
        found.iter().flatten().filter(|(_, stated)| options.mask_meaning.is_none() && is_open(*stated));
    let open: Vec<&Path> = open.map(|(path, _)| path.as_path()).collect();
    let white = white_share(&open)?;
    let shown = meaning_of(white);
    let concluded = |stated: StatedMask| match stated {
        StatedMask::Context(meaning) => meaning,
        _ if is_open(stated) => shown,
        _ => MaskMeaning::Refractive,
    };
    let mask = |(path, stated)| MaskFile { path, meaning: options.mask_meaning.unwrap_or(concluded(stated)) };
    Ok((found.into_iter().map(|m| m.map(mask)).collect(), white.map(|w| conclusion(w, shown))))
}

/// White that covers less than this part of the picture marks a thing; masks that say what to use are mostly white.
const SMALL: f64 = 0.5;

/// Masks that are looked at to find out what their white means, at most.
const LOOKED_AT: usize = 12;

/// [`crate::photographs::meaning_shown`].
pub(crate) fn meaning_shown(masks: &[&Path]) -> Result<MaskMeaning, DataError> {
    white_share(masks).map(meaning_of)
}

fn meaning_of(white: Option<f64>) -> MaskMeaning {
    if white.is_some_and(|w| w < SMALL) { MaskMeaning::Refractive } else { MaskMeaning::Keep }
}

/// The median share of white in masks that are not black; `None` without any.
fn white_share(masks: &[&Path]) -> Result<Option<f64>, DataError> {
    let some: Vec<&Path> = masks.iter().copied().step_by(masks.len().div_ceil(LOOKED_AT).max(1)).collect();
    let mut shares = some.into_par_iter().map(photo::white_share).collect::<Result<Vec<f64>, DataError>>()?;
    shares.retain(|s| *s > 0.0);
    shares.sort_by(f64::total_cmp);
    Ok(shares.get(shares.len() / 2).copied())
}

/// What was concluded, in a sentence.
fn conclusion(white: f64, meaning: MaskMeaning) -> Problem {
    let (taken, other) = match meaning {
        MaskMeaning::Refractive => ("mark something refractive", "keep"),
        _ => ("say which pixels to use", "refractive"),
    };
    Problem::note(format!(
        "nothing says what the white of the masks means; it covers {:.0} % of a picture, so they are taken to {taken} \
         (--mask-meaning {other} says otherwise)",
        100.0 * white
    ))
}

/// Where a folder of masks may have that of the photograph with this path in it.
pub(crate) fn names_in_folder(photograph: PathBuf) -> [PathBuf; 3] {
    let with_png = PathBuf::from(format!("{}.png", photograph.display()));
    [photograph.with_extension("png"), with_png, photograph]
}

/// Names of masks beside a photograph.
pub(crate) fn names_beside(stem: &str) -> [String; 2] {
    [format!("{stem}.mask.png"), format!("{stem}_mask.png")]
}

/// The mask at one of the places where tools put it.
fn in_usual_place(parsed: &ParsedDataset, image: &Path) -> Option<(PathBuf, StatedMask)> {
    let root = parsed.root.folder();
    let inside = image.strip_prefix(root).unwrap_or(Path::new(image.file_name()?));
    let below_first: PathBuf = inside.components().skip(1).collect();
    let (folder, stem) = (image.parent()?, image.file_stem()?.to_str()?);
    let name = image.file_name()?.to_str()?;
    let in_folder = |folder: &str, stated: StatedMask| {
        let in_masks = [inside, below_first.as_path()].map(|relative| root.join(folder).join(relative));
        in_masks.into_iter().flat_map(move |path| names_in_folder(path).map(|path| (path, stated)))
    };
    let [first, second] = names_beside(stem);
    let beside = [first, second, format!("{name}.mask.png")];
    let glass = in_folder("glass_masks", StatedMask::Context(MaskMeaning::Refractive));
    let open = beside.map(|n| (folder.join(n), StatedMask::Open));
    let candidates = glass.chain(in_folder("masks", StatedMask::Open)).chain(open);
    let dynamic = folder.join(format!("dynamic_mask_{stem}.png"));
    let ignore = std::iter::once((dynamic, StatedMask::Context(MaskMeaning::Ignore)));
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
