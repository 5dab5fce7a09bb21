//! Views of the files that cannot be used: they are left out, counted and named, and where they are many, the dataset is
//! refused.

use crate::camera::MIN_VIEWS;
use crate::decoding::{self, Header};
use crate::extensions::is_picture;
use crate::naming::{first_few, picture_stem};
use crate::parsed::{Frame, Loss, ParsedDataset, Part};
use crate::root::{Renamed, Root};
use crate::{DataError, Format, Problem, whole};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

/// A view that is left out.
struct Lost {
    name: String,
    loss: Loss,
    part: Option<Part>,
    /// What its file holds instead of a picture.
    detail: Option<String>,
}

/// Leaves out the views that cannot be used, and says so; the headers of the images of the others.
///
/// Errors: half of the views to learn from or more are lost, too few are left, or images are outside.
pub(crate) fn leave_out(path: &Path, parsed: &mut ParsedDataset) -> Result<Vec<Header>, DataError> {
    parsed.root.refuse_outside()?;
    parsed.problems.extend(unposed(parsed));
    parsed.problems.extend(twins(parsed));
    let looked_at: Vec<Result<Header, Lost>> =
        parsed.frames.par_iter().map(look_at).collect::<Result<_, DataError>>()?;
    let (mut headers, mut lost, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    let (count, mut swapped) = (looked_at.len(), Vec::new());
    for (mut frame, looked) in std::mem::take(&mut parsed.frames).into_iter().zip(looked_at) {
        match looked.and_then(|header| upright(&mut frame, header, &mut swapped)) {
            Ok(header) => {
                headers.push(header);
                frames.push(frame);
            }
            Err(view) => lost.push(view),
        }
    }
    parsed.frames = frames;
    parsed.problems.extend(renaming(&parsed.frames, &parsed.root.renamed()));
    refuse_many(path, &parsed.root, &parsed.frames, &lost)?;
    parsed.problems.extend(warnings(&parsed.root, &lost, count));
    parsed.problems.extend(swapped.first().map(|first| {
        Problem::warning(format!(
            "the width and height of {} cameras have changed places, by their principal point and their picture ({first} first): they are \
             read the right way round; correct w and h in the file",
            swapped.len()
        ))
    }));
    Ok(headers)
}

/// The header of a picture that lies as its camera states, once width and height of the camera are exchanged where they have changed
/// places. An orientation tag is looked at elsewhere.
fn upright(frame: &mut Frame, header: Header, swapped: &mut Vec<String>) -> Result<Header, Lost> {
    if header.turned() || !frame.intrinsics.lies_across(header.stored) {
        return Ok(header);
    }
    if frame.intrinsics.has_swapped_size() {
        frame.intrinsics.size = frame.intrinsics.size.map(|[w, h]| [h, w]);
        swapped.push(frame.file.clone());
        return Ok(header);
    }
    let stated = frame.intrinsics.size.map_or(String::new(), |[w, h]| format!("{w:.0}x{h:.0} stated, "));
    Err(Lost::of(frame, Loss::Turned, Some(format!("{stated}{} found", header.stored))))
}

/// Refuses cameras of which some are lost, as those of a path.
pub(crate) fn refuse_lost(path: &Path, frames: &[Frame]) -> Result<(), DataError> {
    let lost = frames.iter().filter_map(|frame| Some(Lost::of(frame, frame.lost?, None)));
    let lost: Vec<Lost> = lost.collect();
    if lost.is_empty() { Ok(()) } else { Err(refusal(path, frames.len(), &lost)) }
}

impl Lost {
    fn of(frame: &Frame, loss: Loss, detail: Option<String>) -> Self {
        Self { name: frame.file.clone(), loss, part: frame.part, detail }
    }
}

/// Characters of a name that are shown: a name may be a whole picture as text (`data:image/png;base64,…`).
const SHOWN: usize = 200;
/// Fewest columns and rows of a picture.
const LEAST_EDGE: u32 = 2;

/// The header of an image that is large enough to be a photograph.
pub(crate) fn header(path: &Path) -> Result<Header, DataError> {
    let header = decoding::header(path)?;
    let found = header.stored;
    let is_picture = found.width.min(found.height) >= LEAST_EDGE;
    is_picture.then_some(header).ok_or_else(|| DataError::ImageTooSmall { path: path.to_owned(), found })
}

/// The header of a frame's image, or why it cannot be used.
fn look_at(frame: &Frame) -> Result<Result<Header, Lost>, DataError> {
    let lost = |loss, detail| Ok(Err(Lost::of(frame, loss, detail)));
    if let Some(loss) = frame.lost {
        return lost(loss, frame.image.as_ref().map(|image| image.display().to_string()));
    }
    let Some(image) = &frame.image else { return lost(Loss::NoImage, None) };
    if let Some((loss, detail)) = whole::fault(image) {
        return lost(loss, detail);
    }
    match header(image) {
        Ok(header) => Ok(Ok(header)),
        Err(error @ DataError::TooLarge { .. }) => Err(error),
        Err(error) => lost(Loss::Undecodable, Some(error.to_string())),
    }
}

/// A note about files that have other names than the stated ones, by what differs.
fn renaming(frames: &[Frame], renamed: &[Renamed]) -> Option<Problem> {
    let used: HashSet<&Path> = frames
        .iter()
        .flat_map(|f| f.image.iter().chain(f.mask.iter().map(|(mask, _)| mask)))
        .map(PathBuf::as_path)
        .collect();
    let of_files = |r: &&Renamed| used.contains(r.found.as_path()) || !is_picture(&r.found.to_string_lossy());
    let mut kinds = BTreeMap::new();
    for renamed in renamed.iter().filter(of_files) {
        kinds.entry(renamed.difference).or_insert((0, renamed)).0 += 1;
    }
    let count: usize = kinds.values().map(|(count, _)| count).sum();
    let by_kind: Vec<String> = kinds
        .iter()
        .map(|(difference, (count, first))| {
            let Renamed { stated, found, .. } = first;
            format!("{count} by {} ({stated:?} is taken to be {})", difference.name(), found.display())
        })
        .collect();
    (count > 0).then(|| {
        Problem::note(format!(
            "{count} files differ from the names that are stated for them: {}",
            by_kind.join("; ")
        ))
    })
}

/// The files of all masks.
fn masks(frames: &[Frame]) -> HashSet<&Path> {
    frames.iter().filter_map(|f| Some(f.mask.as_ref()?.0.as_path())).collect()
}

/// A note about the photographs beside those of the frames that no frame names.
fn unposed(parsed: &ParsedDataset) -> Option<Problem> {
    if parsed.format == Format::Colmap {
        return None; // its importer says so, of all folders
    }
    let masks = masks(&parsed.frames);
    let (mut named, mut without): (BTreeMap<&Path, BTreeSet<&str>>, BTreeSet<&str>) = Default::default();
    for frame in &parsed.frames {
        let place = frame.image.as_deref().and_then(|i| Some((i.parent()?, i.file_name()?.to_str()?)));
        match place {
            Some((folder, name)) => drop(named.entry(folder).or_default().insert(picture_stem(name))),
            None => drop(without.insert(picture_stem(frame.file.rsplit(['/', '\\']).next()?))),
        }
    }
    let others = |(folder, stems): (&&Path, &BTreeSet<&str>)| -> Vec<PathBuf> {
        let has_frame = |stem| is_of_one(stem, stems) || is_of_one(stem, &without);
        let listing = parsed.root.listing(folder);
        let others = listing.images().filter(|name| !has_frame(picture_stem(name)));
        others.map(|name| folder.join(name)).filter(|path| !masks.contains(path.as_path())).collect()
    };
    let found: Vec<PathBuf> = named.iter().flat_map(others).collect();
    let more = if found.len() > 1 { format!(" and {} more", found.len() - 1) } else { String::new() };
    let first = found.first()?.display();
    Some(Problem::note(format!("{} photographs have no pose and are not used: {first}{more}", found.len())))
}

/// A warning about photographs that are stated without an extension and lie there with several.
fn twins(parsed: &ParsedDataset) -> Option<Problem> {
    let masks = masks(&parsed.frames);
    let twin = |frame: &Frame| -> Option<(PathBuf, PathBuf)> {
        let stated = frame.file.rsplit(['/', '\\']).next().filter(|name| picture_stem(name) == *name)?;
        let image = frame.image.clone()?;
        let folder = image.parent()?;
        let listing = parsed.root.listing(folder);
        let others = listing.called(stated).filter(|other| picture_stem(other) == stated);
        let mut others = others.map(|other| folder.join(other));
        let other = others.find(|path| *path != image && !masks.contains(path.as_path()))?;
        Some((image, other))
    };
    let found: Vec<(PathBuf, PathBuf)> = parsed.frames.iter().filter_map(twin).collect();
    let (taken, other) = found.first()?;
    Some(Problem::warning(format!(
        "{} photographs are stated without an extension and lie there with several: {} is used, not {}; move away those that are not meant",
        found.len(),
        taken.display(),
        other.display()
    )))
}

/// Whether a name is one of these, or one with something added (`r_0_depth`, `r_0.mask`), as what belongs to it is named.
fn is_of_one(stem: &str, stems: &BTreeSet<&str>) -> bool {
    let ends = stem.char_indices().filter(|(_, c)| "_.-".contains(*c)).map(|(i, _)| &stem[..i]);
    stems.contains(stem) || ends.into_iter().any(|start| stems.contains(start))
}

/// Refuses a dataset that lost half of the views to learn from, or has too few left.
fn refuse_many(path: &Path, root: &Root, frames: &[Frame], lost: &[Lost]) -> Result<(), DataError> {
    let count = frames.len() + lost.len();
    let Some(first) = lost.first() else { return Ok(()) };
    if frames.is_empty() && lost.iter().all(|view| view.loss == Loss::NoImage) {
        let (path, there) = (path.to_owned(), root.lies_there(&first.name));
        let first = first.name.chars().take(SHOWN).collect();
        return Err(DataError::AllImagesMissing { path, count, first, there });
    }
    let learns = |part: Option<Part>| matches!(part, None | Some(Part::Train));
    let left = frames.iter().filter(|frame| learns(frame.part)).count();
    let gone = lost.iter().filter(|view| learns(view.part)).count();
    let are_many = gone > 0 && gone >= left;
    if are_many || frames.len() < MIN_VIEWS { Err(refusal(path, count, lost)) } else { Ok(()) }
}

fn refusal(path: &Path, count: usize, lost: &[Lost]) -> DataError {
    let reasons: Vec<String> = by_loss(lost).iter().map(|(loss, views)| reason(*loss, views)).collect();
    DataError::ViewsLost { path: path.to_owned(), count, lost: lost.len(), reasons: reasons.join("; ") }
}

/// One warning for each kind of loss.
fn warnings(root: &Root, lost: &[Lost], count: usize) -> Vec<Problem> {
    let warning = |(loss, views): (Loss, Vec<&Lost>)| {
        let there = match views.first() {
            Some(first) if loss == Loss::NoImage => format!(" ({})", root.lies_there(&first.name)),
            _ => String::new(),
        };
        let because = reason(loss, &views);
        Problem::warning(format!("{} of {count} views are left out because {because}{there}", views.len()))
    };
    by_loss(lost).into_iter().map(warning).collect()
}

fn by_loss(lost: &[Lost]) -> BTreeMap<Loss, Vec<&Lost>> {
    let mut kinds: BTreeMap<Loss, Vec<&Lost>> = BTreeMap::new();
    lost.iter().for_each(|view| kinds.entry(view.loss).or_default().push(view));
    kinds
}

/// Why views are lost, and the first of them.
fn reason(loss: Loss, views: &[&Lost]) -> String {
    let because = match loss {
        Loss::NoName => "their frame names no image (file_path)",
        Loss::NoPose => "the file states no pose for them",
        Loss::NoImage => "their image does not exist",
        Loss::Taken => "only the image of another view has a name like theirs",
        Loss::Empty => "their image has 0 bytes",
        Loss::Cut => "their image is cut off",
        Loss::Undecodable => "their image cannot be decoded",
        Loss::Turned => {
            "their image lies on its side: its width is the height that its camera states (turn the image back, or correct w and h)"
        }
    };
    let name = |view: &&Lost| match &view.detail {
        Some(detail) => format!("{} ({detail})", view.name),
        None => view.name.clone(),
    };
    let names: Vec<String> = views.iter().map(name).collect();
    format!("{because}: {}", first_few(names.iter().map(String::as_str)))
}
