//! Frames that are no views of their own: the same view twice, a name that was taken for another's, what a system wrote.

use crate::extensions::is_video;
use crate::parsed::{Frame, Loss, Origin, ParsedDataset};
use crate::root::Renamed;
use crate::{DataError, Problem};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Marks frames as lost whose image was not stated so and belongs to another name as well. Drops frames that state an image
/// again, with the same camera, and those of files that macOS puts beside images (`._a.png`).
///
/// Errors: they state another camera for it, or it is a video.
pub(crate) fn resolve(parsed: &mut ParsedDataset) -> Result<(), DataError> {
    drop_of_macos(parsed);
    mark_taken(&mut parsed.frames, &parsed.root.renamed());
    let is_repeated = repeated(&parsed.frames)?;
    let mut names = parsed.frames.iter().zip(&is_repeated).filter(|(_, is)| **is).map(|(f, _)| &f.file);
    if let Some(first) = names.next() {
        let count = 1 + names.count();
        let message =
            format!("{count} frames state a view again, with the same camera, and are used once: {first}");
        parsed.problems.push(Problem::warning(message));
    }
    let mut is_repeated = is_repeated.into_iter();
    parsed.frames.retain(|_| !is_repeated.next().unwrap_or_default());
    Ok(())
}

fn drop_of_macos(parsed: &mut ParsedDataset) {
    let is_of_macos =
        |f: &Frame| f.file.rsplit(['/', '\\']).next().is_some_and(|name| name.starts_with("._"));
    let dropped: Vec<Frame> = parsed.frames.extract_if(.., |frame| is_of_macos(frame)).collect();
    parsed.problems.extend(dropped.first().map(|first| {
        let message = format!("{} frames name what macOS puts beside images: {}", dropped.len(), first.file);
        Problem::warning(format!("{message}; they are not used"))
    }));
}

fn mark_taken(frames: &mut [Frame], renamed: &[Renamed]) {
    let guessed: HashSet<(&str, &Path)> =
        renamed.iter().map(|r| (r.stated.as_str(), r.found.as_path())).collect();
    let mut stated: HashMap<&Path, HashSet<&str>> = HashMap::new();
    for frame in &*frames {
        if let Some(image) = &frame.image {
            stated.entry(image).or_default().insert(&frame.file);
        }
    }
    let is_taken = |frame: &Frame| {
        let image = frame.image.as_deref()?;
        Some(guessed.contains(&(frame.file.as_str(), image)) && stated.get(image)?.len() > 1)
    };
    let taken: Vec<bool> = frames.iter().map(|frame| is_taken(frame).unwrap_or_default()).collect();
    for (frame, _) in frames.iter_mut().zip(taken).filter(|(_, is_taken)| *is_taken) {
        frame.lost = frame.lost.or(Some(Loss::Taken));
    }
}

/// Which frames have the image of an earlier one of their part.
fn repeated<'a>(frames: &'a [Frame]) -> Result<Vec<bool>, DataError> {
    let mut known: HashMap<_, &Frame> = HashMap::new();
    let is_repeated = |frame: &'a Frame| {
        let Some(image) = frame.image.as_ref().filter(|_| frame.lost.is_none()) else { return Ok(false) };
        let first = *known.entry((image, frame.part)).or_insert(frame);
        if std::ptr::eq(first, frame) {
            return Ok(false);
        }
        if (first.pose, first.intrinsics) == (frame.pose, frame.intrinsics) {
            return Ok(true);
        }
        if is_video(image) {
            return Err(DataError::Video { path: image.clone() });
        }
        let Origin { path, key } = &frame.origin;
        Err(DataError::DuplicateFrame { path: path.to_path_buf(), key: key.clone(), image: image.clone() })
    };
    frames.iter().map(is_repeated).collect()
}
