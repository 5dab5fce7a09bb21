//! A folder of photographs and its masks: what it holds, and the copies that COLMAP and the trainer read.

use super::calls::Shared;
use super::work::WorkFolder;
use crate::cli::ImportArgs;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Subtask};
use crate::verbs::dataset::data_failure;
use crate::verbs::files::create_folder;
use crate::verbs::interrupts::interrupted;
use anyhow::Context;
use image::{GrayImage, ImageFormat};
use rayon::prelude::*;
use refraxel_data::photographs::{
    Photographs, conversion, meaning_shown, turned_upright, upright_mask, upright_size,
};
use refraxel_data::{DataError, Mask, MaskMeaning};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Photographs of fewer places than this cannot be used.
pub const FEWEST: usize = 3;
/// Coverage from which a pixel of a mask counts as white.
const WHITE: u8 = 128;

/// One photograph.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    pub file: PathBuf,
    /// Its path below the folder of images: with a folder for its size where sizes differ.
    pub name: String,
    pub mask: Option<PathBuf>,
}

/// Photographs that are posed together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhotoSet {
    pub folder: PathBuf,
    pub photos: Vec<Photo>,
    /// What white means, where there are masks.
    pub meaning: Option<MaskMeaning>,
    pub shared: Shared,
    /// Files left out because their format is not read.
    pub unread: Vec<String>,
}

impl PhotoSet {
    /// The photographs that the command line names.
    pub fn of(args: &ImportArgs) -> Result<Self, Failure> {
        let found = Photographs::in_folder(&args.source).map_err(data_failure)?;
        if found.names.len() < FEWEST {
            return Err(Exit::BadInput.because(too_few(&args.source, &found)));
        }
        let masks = match &args.masks {
            Some(folder) if !folder.is_dir() => {
                return Err(data_failure(DataError::NotFound { path: folder.clone() }));
            }
            Some(folder) => Some(folder.clone()),
            None => found.mask_folder(),
        };
        let sizes: Vec<[u32; 2]> = found
            .names
            .par_iter()
            .map(|name| upright_size(&found.folder.join(name)))
            .collect::<Result<_, _>>()
            .map_err(data_failure)?;
        let shared = if sizes.iter().all(|s| *s == sizes[0]) { Shared::ByAll } else { Shared::InFolders };
        let photo = |(name, [width, height]): (&String, [u32; 2])| Photo {
            file: found.folder.join(name),
            name: match shared {
                Shared::ByAll => name.clone(),
                Shared::InFolders => format!("{width}x{height}/{name}"),
            },
            mask: found.mask(masks.as_deref(), name),
        };
        let photos: Vec<Photo> = found.names.iter().zip(sizes).map(photo).collect();
        let meaning = meaning(args, masks.as_deref(), &photos)?;
        Ok(Self { folder: found.folder, photos, meaning, shared, unread: found.unread })
    }

    /// Names of the photographs below the folder of images.
    pub fn names(&self) -> Vec<String> {
        self.photos.iter().map(|photo| photo.name.clone()).collect()
    }

    /// Copies the photographs to `images` and the masks to a folder whose name says what white means, and writes
    /// `feature_masks`, black where COLMAP must not look. What an earlier import has copied stays.
    ///
    /// Copies, because a dataset cannot use links that lead out of its folder, and a later change of the originals must
    /// not change what poses were computed for.
    pub fn copy(&self, work: &WorkFolder, progress: &mut Progress) -> Result<(), Failure> {
        let total = self.photos.len() as u64;
        let shown = Mutex::new((progress, 0));
        self.photos.par_iter().try_for_each(|photo| {
            if interrupted() {
                return Err(Exit::Interrupted.because("stopped while photographs were copied"));
            }
            self.copy_photo(photo, work)?;
            if let Ok(mut shown) = shown.lock() {
                let (progress, done) = &mut *shown;
                *done += 1;
                progress.subtask(&Subtask { name: "copies", done: *done, total: Some(total) }, "");
            }
            Ok(())
        })
    }

    fn copy_photo(&self, photo: &Photo, work: &WorkFolder) -> Result<(), Failure> {
        let image = work.join("images").join(&photo.name);
        write_once(&image, |to| {
            match turned_upright(&photo.file).map_err(data_failure)? {
                Some(bytes) => fs::write(to, bytes),
                None => fs::copy(&photo.file, to).map(|_| ()),
            }
            .with_context(|| format!("cannot copy {} to {}", photo.file.display(), to.display()))
            .or_exit(Exit::Io)
        })?;
        let Some(meaning) = self.meaning else { return Ok(()) };
        let as_png = format!("{}.png", photo.name);
        let mask = match &photo.mask {
            Some(mask) => Some(upright_mask(mask, &photo.file).map_err(data_failure)?),
            None => None,
        };
        if let Some(mask) = &mask {
            let flip = meaning == MaskMeaning::Ignore;
            save(
                &work.join(mask_folder(meaning)).join(&as_png),
                mask,
                |c| if flip { u8::MAX - c } else { c },
            )?;
        }
        // COLMAP wants a mask for every photograph; without one, all of it is used.
        let [width, height] = upright_size(&photo.file).map_err(data_failure)?;
        let blank = || Mask { width, height, coverage: vec![u8::MAX; width as usize * height as usize] };
        let (uses_white, mask) = match mask {
            Some(mask) => (meaning == MaskMeaning::Keep, mask),
            None => (true, blank()),
        };
        let used = |c: u8| if (c >= WHITE) == uses_white { u8::MAX } else { 0 };
        save(&work.join("feature_masks").join(&as_png), &mask, used)
    }
}

/// The folder of masks in the dataset. Masks that say what to ignore are stored as those that say what to use.
pub fn mask_folder(meaning: MaskMeaning) -> &'static str {
    match meaning {
        MaskMeaning::Refractive => "glass_masks",
        MaskMeaning::Keep | MaskMeaning::Ignore => "masks",
    }
}

fn too_few(source: &Path, found: &Photographs) -> String {
    let (source, count) = (source.display(), found.names.len());
    let Some((first, command)) = found.unread.iter().find_map(|name| Some((name, conversion(name)?))) else {
        return format!(
            "{source}: {count} photographs (such as JPEG or PNG); expected at least {FEWEST}, and some tens for a good result"
        );
    };
    format!(
        "{source}: {count} photographs in formats that are read (such as JPEG or PNG), and {} in others, such as {first}; convert \
         them, this one for example by: {command}",
        found.unread.len(),
    )
}

fn meaning(
    args: &ImportArgs,
    folder: Option<&Path>,
    photos: &[Photo],
) -> Result<Option<MaskMeaning>, Failure> {
    let masks: Vec<&Path> = photos.iter().filter_map(|photo| photo.mask.as_deref()).collect();
    match (masks.is_empty(), &args.masks) {
        (true, None) => return Ok(None),
        (true, Some(folder)) => {
            let first = &photos[0].name;
            let text = format!(
                "{}: no mask of any photograph; expected names such as {}",
                folder.display(),
                Path::new(first).with_extension("png").display(),
            );
            return Err(Exit::BadInput.because(text));
        }
        _ => {}
    }
    let is_glass = folder.is_some_and(|f| f.file_name().is_some_and(|name| name == "glass_masks"));
    match args.mask_meaning {
        Some(white) => Ok(Some(white)),
        None if is_glass => Ok(Some(MaskMeaning::Refractive)),
        None => meaning_shown(&masks).map(Some).map_err(data_failure),
    }
}

fn save(path: &Path, mask: &Mask, value: impl Fn(u8) -> u8) -> Result<(), Failure> {
    write_once(path, |to| {
        let pixels = mask.coverage.iter().map(|c| value(*c)).collect();
        let image = GrayImage::from_raw(mask.width, mask.height, pixels).context("the mask has no pixels");
        let saved = image.and_then(|image| Ok(image.save_with_format(to, ImageFormat::Png)?));
        saved.with_context(|| format!("cannot write {}", to.display())).or_exit(Exit::Io)
    })
}

/// Writes a file under another name first, so that one that is there is complete and is left.
fn write_once(path: &Path, write: impl FnOnce(&Path) -> Result<(), Failure>) -> Result<(), Failure> {
    if path.exists() {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        create_folder(folder)?;
    }
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    write(&part)?;
    fs::rename(&part, path).with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)
}
