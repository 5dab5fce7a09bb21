//! Where masks are: in the folders and under the names that tools give them.

use super::coverage;
use crate::extensions::{READ, conversion};
use crate::parsed::{Frame, ParsedDataset, StatedMask};
use crate::{MaskMeaning, Problem, decoding, folder};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Arrays, which masks may come as and which are not read.
const ARRAYS: [&str; 2] = ["npy", "npz"];
/// Folders below a folder of masks that are looked into.
const DEEPEST: usize = 4;

/// What the name of a photograph's mask has behind its own.
const TAILS: [&str; 7] = ["_mask", ".mask", "-mask", "_masks", "_matte", "_alpha", "_seg"];

/// Names of the mask of a photograph, in a folder of masks.
fn names(stem: &str, name: &str) -> impl Iterator<Item = String> {
    let of_stem = std::iter::once("").chain(TAILS).map(|tail| format!("{stem}{tail}"));
    let stems = of_stem.chain([name.to_owned(), format!("{name}.mask"), format!("mask_{stem}")]);
    let all: Vec<String> = stems.flat_map(|s| READ.map(|extension| format!("{s}.{extension}"))).collect();
    all.into_iter().chain([name.to_owned()])
}

/// Where a folder of masks may have that of the photograph with this path in it.
pub(crate) fn names_in_folder(photograph: &Path) -> Vec<PathBuf> {
    let [Some(stem), Some(name)] = [photograph.file_stem(), photograph.file_name()].map(|n| n?.to_str())
    else {
        return vec![photograph.to_owned()];
    };
    names(stem, name).map(|name| photograph.with_file_name(name)).collect()
}

/// Names of masks beside a photograph.
pub(crate) fn names_beside(stem: &str) -> Vec<String> {
    let stems = TAILS.iter().map(|tail| format!("{stem}{tail}")).chain([format!("mask_{stem}")]);
    stems.flat_map(|stem| READ.map(|extension| format!("{stem}.{extension}"))).collect()
}

/// Words of the names of folders that hold masks.
const OF_MASKS: [&str; 14] = [
    "mask",
    "masks",
    "segmentation",
    "segmentations",
    "seg",
    "segs",
    "silhouette",
    "silhouettes",
    "matte",
    "mattes",
    "alpha",
    "alphas",
    "label",
    "labels",
];
/// Words beside them that say that white marks something refractive, and that white is to be ignored.
const OF_GLASS: [&str; 4] = ["glass", "refractive", "transparent", "refraction"];
const IGNORED: [&str; 10] = [
    "dynamic",
    "ignore",
    "ignored",
    "invalid",
    "transient",
    "transients",
    "moving",
    "motion",
    "distractor",
    "distractors",
];
/// Words beside them that say nothing.
const PLAIN: [&str; 22] = [
    "object",
    "objects",
    "foreground",
    "fg",
    "image",
    "images",
    "img",
    "imgs",
    "rgb",
    "sam",
    "train",
    "test",
    "val",
    "input",
    "binary",
    "undistorted",
    "resized",
    "final",
    "output",
    "pred",
    "gt",
    "png",
];

/// What a folder of this name holds: the order in which such folders are asked, what white means, and the number of reduced
/// photographs, as in `masks_2` beside `images_2`.
fn known(name: &str) -> Option<(usize, StatedMask, Option<String>)> {
    let name = name.to_ascii_lowercase();
    let reduced =
        name.rsplit_once('_').filter(|(_, n)| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let (stem, number) = reduced.map_or((name.as_str(), None), |(stem, n)| (stem, Some(n.to_owned())));
    let words: Vec<&str> = stem.split(|c: char| !c.is_alphabetic()).filter(|word| !word.is_empty()).collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let others = words.iter().filter(|word| !OF_MASKS.contains(word));
    let is_known = |word: &&&str| OF_GLASS.contains(word) || IGNORED.contains(word) || PLAIN.contains(word);
    if !has(&OF_MASKS) || !others.clone().all(|word| is_known(&word)) {
        return None;
    }
    let (order, stated) = match (has(&OF_GLASS), has(&IGNORED)) {
        (true, false) => (0, StatedMask::Context(MaskMeaning::Refractive)),
        (false, true) => (3, StatedMask::Context(MaskMeaning::Ignore)),
        (true, true) => return None,
        _ if matches!(stem, "masks" | "mask") => (1, StatedMask::Open),
        _ => (2, StatedMask::Open),
    };
    Some((order, stated, number))
}

/// A folder of masks.
struct Folder {
    path: PathBuf,
    order: usize,
    stated: StatedMask,
    number: Option<String>,
    /// Its images by their path in it, in lower case with slashes.
    files: HashMap<String, PathBuf>,
    /// Files in formats that are not read.
    unread: usize,
}

/// All places where a dataset may have masks.
pub(super) struct Places {
    /// By the folder in which they lie, and there in the order in which they are asked.
    folders: BTreeMap<PathBuf, Vec<Folder>>,
    /// Files beside photographs, by folder.
    beside: HashMap<PathBuf, HashMap<String, PathBuf>>,
}

impl Places {
    /// Lists the folders of a dataset that may hold masks.
    pub fn of(parsed: &ParsedDataset) -> Self {
        let root = parsed.root.folder();
        let parents: BTreeSet<&Path> = images(&parsed.frames).filter_map(Path::parent).collect();
        let around = parents.iter().flat_map(|p| [Some(*p), p.parent()]).flatten();
        let bases: BTreeSet<&Path> = around.filter(|p| p.starts_with(root)).chain([root]).collect();
        let folders = bases.into_iter().map(|base| (base.to_owned(), folders_in(base, &parents)));
        let listed = parents.iter().map(|folder| {
            let mut files = HashMap::new();
            list(folder, "", 0, &mut files, &mut 0);
            ((*folder).to_owned(), files)
        });
        Self { folders: folders.collect(), beside: listed.collect() }
    }

    /// The mask of an image at one of the places where tools put it.
    pub fn find(&self, parsed: &ParsedDataset, image: &Path) -> Option<(PathBuf, StatedMask)> {
        let is_allowed = |path: &PathBuf| path != image && parsed.root.contains(path);
        let in_folders = self.folders.iter().filter_map(|(base, folders)| {
            let relative = image.strip_prefix(base).ok()?;
            let number =
                first_name(relative).and_then(|name| name.rsplit_once('_')).map(|(_, n)| n.to_owned());
            let fitting = |folder: &&Folder| (folder.order, folder.number != number, folder.number.is_some());
            let mut folders: Vec<&Folder> = folders.iter().collect();
            folders.sort_by_key(fitting);
            folders.into_iter().find_map(|f| Some((f.order, f.file_of(relative)?, f.stated)))
        });
        let in_folders = in_folders.filter(|(_, path, _)| is_allowed(path));
        let found =
            in_folders.min_by_key(|(order, ..)| *order).map(|(order, path, stated)| (order, (path, stated)));
        // A folder says more than a name, except where it is one of things that move.
        match found {
            Some((0..=2, found)) => Some(found),
            other => {
                self.beside(image).filter(|(path, _)| is_allowed(path)).or(other.map(|(_, found)| found))
            }
        }
    }

    fn beside(&self, image: &Path) -> Option<(PathBuf, StatedMask)> {
        let [stem, name] =
            [image.file_stem()?, image.file_name()?].map(|n| n.to_str().map(str::to_ascii_lowercase));
        let (stem, name, files) = (stem?, name?, self.beside.get(image.parent()?)?);
        let whole = READ.map(|extension| format!("{name}.mask.{extension}"));
        let open = names_beside(&stem).into_iter().chain(whole).map(|n| (n, StatedMask::Open));
        let ignore = StatedMask::Context(MaskMeaning::Ignore);
        let dynamic = READ.map(|extension| (format!("dynamic_mask_{stem}.{extension}"), ignore));
        open.chain(dynamic).find_map(|(name, stated)| Some((files.get(&name)?.clone(), stated)))
    }

    /// Warnings about folders of masks out of which no photograph has one: because it has none, or one from elsewhere.
    pub fn unused(&self, frames: &[Frame], used: &[Option<PathBuf>]) -> Vec<Problem> {
        let is_unused = |f: &&Folder| !used.iter().flatten().any(|path| path.starts_with(&f.path));
        let folders = self.folders.values().flatten().filter(is_unused);
        if let Some(taken) = used.iter().flatten().next().filter(|_| used.iter().all(Option::is_some)) {
            let is_second = |f: &&Folder| f.number.is_none() && !f.files.is_empty();
            return folders.filter(is_second).map(|f| f.second(taken)).collect();
        }
        let mut problems: Vec<Problem> = folders.filter_map(|f| f.warning(images(frames).next()?)).collect();
        if used.iter().all(Option::is_none) {
            problems.extend(self.folders.keys().flat_map(|base| unnamed(base, frames)));
        }
        problems
    }
}

/// Warnings about pictures of black and white that may be masks and have no name of such: in folders of other names, under the names of
/// photographs, and one for all of them.
fn unnamed(base: &Path, frames: &[Frame]) -> Vec<Problem> {
    let photographs: BTreeSet<&Path> = images(frames).filter_map(Path::parent).collect();
    let Some(image) = images(frames).find(|image| image.starts_with(base)) else { return Vec::new() };
    let relative = image.strip_prefix(base).unwrap_or(image);
    let names = folder::names(base).unwrap_or_default();
    let in_folder = |name: &String| {
        let path = base.join(name);
        if known(name).is_some() || !path.is_dir() || photographs.iter().any(|p| p.starts_with(&path)) {
            return None;
        }
        let folder = Folder::of(path, 0, StatedMask::Open, None);
        folder.file_of(relative).filter(|file| is_black_and_white(file)).map(|file| {
            Problem::warning(format!(
                "{} holds pictures of black and white under the names of photographs ({}), and they are not used; if they are masks, \
                 call the folder masks (or glass_masks, where white marks glass)",
                folder.path.display(),
                file.display()
            ))
        })
    };
    let is_single = |name: &&String| READ.iter().any(|e| name.eq_ignore_ascii_case(&format!("mask.{e}")));
    let single = names.iter().find(is_single).map(|name| {
        Problem::warning(format!(
            "{} seems to be a mask for all photographs, and it is not used: write a copy of it for each into a folder masks",
            base.join(name).display()
        ))
    });
    names.iter().filter_map(in_folder).chain(single).collect()
}

/// Whether a picture shows black and white, and hardly anything between.
fn is_black_and_white(path: &Path) -> bool {
    const BETWEEN: f64 = 0.01;
    let Ok(decoded) = decoding::decode(path) else { return false };
    let mask = coverage::of_mask(decoded.image, path).mask;
    mask.grey_share() < BETWEEN && (BETWEEN..1.0 - BETWEEN).contains(&mask.white_share())
}

/// Folders of masks in a folder, those that mark glass first.
pub(crate) fn mask_folders(folder: &Path) -> Vec<PathBuf> {
    let mut found = folders_in(folder, &BTreeSet::new());
    found.retain(|f| !matches!(f.stated, StatedMask::Context(MaskMeaning::Ignore)));
    found.sort_by_key(|f| f.order);
    found.into_iter().map(|f| f.path).collect()
}

fn images(frames: &[Frame]) -> impl Iterator<Item = &Path> {
    frames.iter().filter_map(|frame| frame.image.as_deref())
}

fn first_name(path: &Path) -> Option<&str> {
    path.parent()?.components().next()?.as_os_str().to_str()
}

/// The folders of masks in `base`, without those that hold photographs.
fn folders_in(base: &Path, photographs: &BTreeSet<&Path>) -> Vec<Folder> {
    let entries = std::fs::read_dir(base).into_iter().flatten().flatten();
    let folder = |entry: std::fs::DirEntry| {
        let (path, name) = (entry.path(), entry.file_name());
        let (order, stated, number) = known(name.to_str()?)?;
        if !path.is_dir() || photographs.iter().any(|p| p.starts_with(&path)) {
            return None;
        }
        Some(Folder::of(path, order, stated, number))
    };
    let mut folders: Vec<Folder> = entries.filter_map(folder).collect();
    folders.sort_by(|a, b| a.path.cmp(&b.path));
    folders
}

/// Lists the images in a folder and, down to a depth, in those below it. Hidden files are none.
fn list(folder: &Path, prefix: &str, depth: usize, files: &mut HashMap<String, PathBuf>, unread: &mut usize) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(name) = entry.file_name().into_string() else { continue };
        let (path, key) = (entry.path(), format!("{prefix}{}", name.to_ascii_lowercase()));
        let extension = key.rsplit_once('.').map_or("", |(_, extension)| extension);
        if name.starts_with('.') {
            continue;
        }
        if READ.contains(&extension) {
            files.insert(key, path);
        } else if ARRAYS.contains(&extension) || conversion(&key).is_some() {
            *unread += 1;
        } else if depth > 0 && path.is_dir() {
            list(&path, &format!("{key}/"), depth - 1, files, unread);
        }
    }
}

impl Folder {
    /// Lists what it holds.
    fn of(path: PathBuf, order: usize, stated: StatedMask, number: Option<String>) -> Self {
        let (mut files, mut unread) = (HashMap::new(), 0);
        list(&path, "", DEEPEST, &mut files, &mut unread);
        Self { path, order, stated, number, files, unread }
    }

    /// The mask of the photograph that has this path beside the folder.
    fn file_of(&self, relative: &Path) -> Option<PathBuf> {
        let below_first: PathBuf = relative.components().skip(1).collect();
        [relative, &below_first].into_iter().find_map(|path| {
            let [stem, name] =
                [path.file_stem()?, path.file_name()?].map(|n| n.to_str().map(str::to_ascii_lowercase));
            let parent = path.parent().map(|p| p.to_string_lossy().replace('\\', "/").to_ascii_lowercase());
            let prefix = parent.filter(|p| !p.is_empty()).map_or(String::new(), |p| format!("{p}/"));
            names(&stem?, &name?).find_map(|name| self.files.get(&format!("{prefix}{name}")).cloned())
        })
    }

    /// A warning that the masks of photographs are taken from elsewhere.
    fn second(&self, taken: &Path) -> Problem {
        Problem::warning(format!(
            "{} holds masks as well, and they are not used: each photograph has one mask, such as {}; join them into one picture each, or \
             move away the folder that is not meant",
            self.path.display(),
            taken.display()
        ))
    }

    fn warning(&self, image: &Path) -> Option<Problem> {
        let (folder, stem) = (self.path.display(), image.file_stem()?.to_string_lossy());
        let expected = self.path.join(format!("{stem}.png"));
        let found = match self.files.values().min() {
            Some(first) => {
                format!(
                    "none of its {} images is named after a photograph (the first is {})",
                    self.files.len(),
                    first.display()
                )
            }
            None if self.unread > 0 => format!("none of its {} files is a PNG, JPEG or EXR", self.unread),
            None => return None,
        };
        Some(Problem::warning(format!(
            "{folder} seems to hold masks, and they are not used: {found}; expected names such as {}",
            expected.display()
        )))
    }
}
