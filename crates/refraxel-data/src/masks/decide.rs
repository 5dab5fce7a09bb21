//! From the masks that the files of a dataset state to masks whose meaning is known.

use super::meaning::{Prior, conclude};
use super::odd::{Odd, oddities};
use super::places::Places;
use super::sides::Seen;
use crate::decoding::Header;
use crate::looks::{Look, MaskLook};
use crate::parsed::{Frame, ParsedDataset, StatedMask};
use crate::photo;
use crate::{
    DataError, Format, MaskMeaning, OpenOptions, Orientation, PhotoSource, Problem, View, load_mask_of,
};
use rayon::prelude::*;
use std::path::PathBuf;

/// A mask and what its white means.
#[derive(Clone, Debug)]
pub(crate) struct MaskFile {
    pub path: PathBuf,
    pub meaning: MaskMeaning,
}

/// The masks of a dataset, before anything is decided of them.
pub(crate) struct Stated {
    /// One per view.
    pub masks: Vec<Option<(PathBuf, StatedMask)>>,
    pub problems: Vec<Problem>,
}

impl Stated {
    /// The alpha channels of photographs that have no other mask.
    pub fn add_alpha(&mut self, frames: &[Frame], headers: &[Header]) {
        for ((mask, frame), header) in self.masks.iter_mut().zip(frames).zip(headers) {
            if mask.is_none() && header.alpha {
                *mask = frame.image.clone().map(|image| (image, StatedMask::Alpha));
            }
        }
    }
}

/// The masks of a dataset.
pub(crate) struct Decided {
    /// One per view.
    pub masks: Vec<Option<MaskFile>>,
    /// One per photograph that was looked at.
    pub looks: Vec<Option<MaskLook>>,
    pub problems: Vec<Problem>,
}

/// Finds the mask of each view: the one that a file names, or one at the places where tools put it.
///
/// Errors: a mask has another shape than its image, or its header cannot be read.
pub(crate) fn find(parsed: &ParsedDataset, views: &[View]) -> Result<Stated, DataError> {
    let places = Places::of(parsed);
    let of_frame = |(frame, view): (&Frame, &View)| {
        let Some(image) = &frame.image else { return Ok(None) };
        let Some((path, stated)) = frame.mask.clone().or_else(|| places.find(parsed, image)) else {
            return Ok(None);
        };
        let PhotoSource::Files { orientation, .. } = view.source else { return Ok(None) };
        let is_scaled =
            path != *image && photo::is_scaled(&path, image, orientation, photo::stored_size(view))?;
        Ok(Some((path, stated, is_scaled)))
    };
    let mut found = Vec::new();
    parsed.frames.par_iter().zip(views).map(of_frame).collect_into_vec(&mut found);
    let found = found.into_iter().collect::<Result<Vec<_>, DataError>>()?;
    let scaled = found.iter().flatten().filter(|(.., is_scaled)| *is_scaled).count();
    let masks: Vec<Option<(PathBuf, StatedMask)>> =
        found.into_iter().map(|m| m.map(|(path, stated, _)| (path, stated))).collect();
    let used: Vec<Option<PathBuf>> = masks.iter().map(|m| m.as_ref().map(|(path, _)| path.clone())).collect();
    let mut problems = places.unused(&parsed.frames, &used);
    problems.extend(open_turn(&masks, views)?);
    if scaled > 0 {
        let message = format!(
            "{scaled} masks have fewer or more pixels than their photographs; they are scaled to them"
        );
        problems.push(Problem::note(message));
    }
    Ok(Stated { masks, problems })
}

/// A warning where the shapes of photographs with an orientation tag do not tell whether their masks were turned with them.
fn open_turn(masks: &[Option<(PathBuf, StatedMask)>], views: &[View]) -> Result<Option<Problem>, DataError> {
    /// Masks that are looked at: one tool writes all of them, and each header takes a read.
    const FEW: usize = 8;
    let with = masks.iter().zip(views).filter_map(|(mask, view)| match &view.source {
        PhotoSource::Files { image, orientation, .. } => Some((&mask.as_ref()?.0, image, *orientation)),
        _ => None,
    });
    for (mask, image, orientation) in with.take(FEW) {
        if mask != image && photo::may_be_turned(mask, image)? {
            let taken = match orientation {
                Orientation::Stored => "as they are stored",
                Orientation::Upright => "as the tag turns them",
            };
            return Ok(Some(Problem::warning(format!(
                "{} has an orientation tag (EXIF), its mask {} has none, and the shape of both fits either way: masks are taken to cover the \
                 photographs {taken}; look at them by inspect --out, and write masks and photographs without a tag if they do not",
                image.display(),
                mask.display()
            ))));
        }
    }
    Ok(None)
}

/// What the masks mean: somebody says it, or their files do, or what the photographs that were looked at show.
pub(crate) fn decide(
    parsed: &ParsedDataset,
    stated: Stated,
    views: &[View],
    looks: &[Look],
    options: &OpenOptions,
    marks_glass: bool,
) -> Result<Decided, DataError> {
    let Stated { masks, mut problems } = stated;
    let mask_looks = look_at(&masks, views, looks)?;
    let seen = |wanted: &dyn Fn(StatedMask) -> bool| -> Vec<Seen> {
        let of = |(look, mask)| Some(Seen { look, mask: Option::as_ref(mask)? });
        let seen = looks.iter().zip(&mask_looks).filter_map(of);
        seen.filter(|s| masks[s.look.view].as_ref().is_some_and(|(_, stated)| wanted(*stated))).collect()
    };
    let is_open = |stated: StatedMask| match stated {
        StatedMask::Open => !marks_glass,
        StatedMask::Shown => true,
        StatedMask::Context(_) | StatedMask::Alpha => false,
    };
    let is_alpha = |stated: StatedMask| stated == StatedMask::Alpha;
    let rendered =
        parsed.format == Format::Blender && masks.iter().flatten().all(|(_, s)| *s != StatedMask::Shown);
    let prior = if rendered { Prior::Refractive } else { Prior::Coverage };
    let mut of = |wanted: &dyn Fn(StatedMask) -> bool, prior: Prior| {
        let is_asked =
            options.mask_meaning.is_none() && masks.iter().flatten().any(|(_, stated)| wanted(*stated));
        if !is_asked {
            return MaskMeaning::Keep;
        }
        let (meaning, problem) = conclude(prior, &seen(wanted));
        problems.extend(problem);
        meaning
    };
    let (shown, by_alpha) = (of(&is_open, prior), of(&is_alpha, Prior::Keep));
    let meaning = |stated: StatedMask| match stated {
        StatedMask::Context(meaning) => meaning,
        StatedMask::Alpha => by_alpha,
        stated if is_open(stated) => shown,
        _ => MaskMeaning::Refractive,
    };
    let meaning = |stated: StatedMask| options.mask_meaning.unwrap_or(meaning(stated));
    let pairs = looks.iter().zip(&mask_looks).filter_map(|(look, mask)| {
        let (path, stated) = masks[look.view].as_ref()?;
        let path = Some(path.as_path()).filter(|_| *stated != StatedMask::Alpha);
        Some(Odd { view: &views[look.view], path, mask: mask.as_ref()?, meaning: meaning(*stated) })
    });
    problems.extend(oddities(&pairs.collect::<Vec<_>>())?);
    let mask = |(path, stated)| MaskFile { path, meaning: meaning(stated) };
    let masks = masks.into_iter().map(|m| m.map(mask)).collect();
    Ok(Decided { masks, looks: mask_looks, problems })
}

/// The masks of the photographs that were looked at.
fn look_at(
    masks: &[Option<(PathBuf, StatedMask)>],
    views: &[View],
    looks: &[Look],
) -> Result<Vec<Option<MaskLook>>, DataError> {
    let of = |look: &Look| {
        let Some((path, _)) = &masks[look.view] else { return Ok(None) };
        let mut view = views[look.view].clone();
        if let PhotoSource::Files { mask, .. } = &mut view.source {
            *mask = Some(path.clone());
        }
        Ok(load_mask_of(&view)?.map(|mask| MaskLook::at(&mask)))
    };
    looks.par_iter().map(of).collect()
}
