//! Plain photographs: a folder without poses, the masks that belong to it, and pixels that are stored upright.

use crate::image::Mask;
use crate::size::Size;
use crate::{DataError, MaskMeaning, formats, masks, photo};
use std::path::{Path, PathBuf};

/// Extensions of photographs that are read.
const READ: [&str; 3] = ["jpg", "jpeg", "png"];
/// Extensions of photographs that have to be converted first.
const UNREAD: [&str; 15] = [
    "heic", "heif", "avif", "webp", "tif", "tiff", "bmp", "dng", "cr2", "cr3", "nef", "arw", "raf", "orf",
    "rw2",
];
/// Extensions of videos.
const VIDEO: [&str; 12] =
    ["mp4", "mov", "m4v", "avi", "mkv", "webm", "mpg", "mpeg", "3gp", "mts", "m2ts", "wmv"];

/// The photographs of a folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Photographs {
    /// The folder that holds them.
    pub folder: PathBuf,
    /// File names, sorted.
    pub names: Vec<String>,
    /// Names of photographs in formats that are not read, such as HEIC.
    pub unread: Vec<String>,
}

impl Photographs {
    /// The photographs in a folder, else those in `images` or `input` below it.
    ///
    /// Hidden files and masks beside photographs (`NAME_mask.png`) are none.
    pub fn in_folder(folder: &Path) -> Result<Self, DataError> {
        let mut found = Self::directly_in(folder)?;
        for below in ["images", "input"].map(|name| folder.join(name)) {
            if found.names.is_empty() && found.unread.is_empty() && below.is_dir() {
                found = Self::directly_in(&below)?;
            }
        }
        Ok(found)
    }

    fn directly_in(folder: &Path) -> Result<Self, DataError> {
        let mut all = formats::names(folder)?;
        all.retain(|name| !name.starts_with('.') && folder.join(name).is_file());
        let masks: Vec<String> = all
            .iter()
            .filter_map(|name| Some(masks::names_beside(Path::new(name).file_stem()?.to_str()?)))
            .flatten()
            .collect();
        let unread = all.iter().filter(|name| has_extension(name, &UNREAD)).cloned().collect();
        all.retain(|name| has_extension(name, &READ) && !masks.contains(name));
        Ok(Self { folder: folder.to_owned(), names: all, unread })
    }

    /// The folder of their masks: `glass_masks` or `masks` inside their folder or beside it, if it has a mask of any of them.
    pub fn mask_folder(&self) -> Option<PathBuf> {
        let inside = ["glass_masks", "masks"].map(|name| self.folder.join(name));
        // `..` of a link would lead elsewhere.
        let real = self.folder.canonicalize().ok();
        let parent = self.folder.parent().filter(|p| !p.as_os_str().is_empty());
        let parent = parent.map(Path::to_owned).or_else(|| real?.parent().map(Path::to_owned));
        let beside = parent.into_iter().flat_map(|p| ["glass_masks", "masks"].map(|name| p.join(name)));
        inside
            .into_iter()
            .chain(beside)
            .find(|masks| self.names.iter().any(|name| mask_in(masks, name).is_some()))
    }

    /// The mask of a photograph: in the folder of masks, else beside it.
    pub fn mask(&self, folder: Option<&Path>, name: &str) -> Option<PathBuf> {
        let stem = Path::new(name).file_stem()?.to_str()?;
        let beside =
            || masks::names_beside(stem).map(|name| self.folder.join(name)).into_iter().find(|p| p.is_file());
        folder.and_then(|folder| mask_in(folder, name)).or_else(beside)
    }
}

/// `STEM.png`, `NAME.png` or `NAME` in a folder of masks.
fn mask_in(folder: &Path, name: &str) -> Option<PathBuf> {
    masks::names_in_folder(folder.join(name)).into_iter().find(|p| p.is_file())
}

fn has_extension(name: &str, extensions: &[&str]) -> bool {
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    extensions.contains(&extension.to_ascii_lowercase().as_str())
}

/// True for the name of a video.
pub fn is_video(path: &Path) -> bool {
    path.file_name().and_then(|n| n.to_str()).is_some_and(|name| has_extension(name, &VIDEO))
}

/// Width and height of a photograph after its orientation tag (EXIF) is obeyed [pixel].
pub fn upright_size(path: &Path) -> Result<[u32; 2], DataError> {
    let Size { width, height } = photo::header(path)?.upright;
    Ok([width, height])
}

/// The file of a photograph with its pixels turned upright and encoded anew; `None` where they are stored upright.
///
/// Programs differ in whether they obey the orientation tag (EXIF); a file without one is the same to all. Other tags, such
/// as the focal length, are kept.
pub fn turned_upright(path: &Path) -> Result<Option<Vec<u8>>, DataError> {
    photo::turned_upright(path)
}

/// The mask of a photograph, turned as the photograph has to be turned.
pub fn upright_mask(mask: &Path, photograph: &Path) -> Result<Mask, DataError> {
    photo::upright_mask(mask, photograph)
}

/// What the white of masks means by what they show, as [`Dataset::open`](crate::Dataset::open) concludes it.
pub fn meaning_shown(masks: &[&Path]) -> Result<MaskMeaning, DataError> {
    masks::meaning_shown(masks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root::tests::folder_with;

    #[test]
    fn photographs_are_sorted_and_masks_and_hidden_files_are_none() {
        let folder = folder_with(&["b.JPG", "a.png", "a_mask.png", ".a.jpg", "c.heic", "notes.txt", "d.exr"]);
        let found = Photographs::in_folder(folder.path()).unwrap();
        assert_eq!(
            (found.names, found.unread),
            (vec!["a.png".into(), "b.JPG".into()], vec!["c.heic".into()])
        );
    }

    #[test]
    fn a_folder_of_photographs_below_is_found() {
        let folder = folder_with(&["images/a.jpg", "readme.txt"]);
        assert_eq!(Photographs::in_folder(folder.path()).unwrap().folder, folder.path().join("images"));
    }

    #[test]
    fn masks_are_found_inside_and_beside() {
        let inside = folder_with(&["a.jpg", "masks/a.png"]);
        let found = Photographs::in_folder(inside.path()).unwrap();
        assert_eq!(found.mask_folder(), Some(inside.path().join("masks")));
        let beside = folder_with(&["images/a.jpg", "glass_masks/a.jpg.png", "masks/other.png"]);
        let found = Photographs::in_folder(beside.path()).unwrap();
        let folder = found.mask_folder().unwrap();
        assert_eq!(found.mask(Some(&folder), "a.jpg"), Some(beside.path().join("glass_masks/a.jpg.png")));
        let none = folder_with(&["a.jpg", "a_mask.png", "masks/other.png"]);
        let found = Photographs::in_folder(none.path()).unwrap();
        assert_eq!(found.mask_folder(), None);
        assert_eq!(found.mask(None, "a.jpg"), Some(none.path().join("a_mask.png")));
    }

    #[test]
    fn videos_are_known_by_their_extension() {
        assert!(is_video(Path::new("a/walk.MP4")) && is_video(Path::new("b.webm")));
        assert!(!is_video(Path::new("mp4")) && !is_video(Path::new("a.png")));
    }
}
