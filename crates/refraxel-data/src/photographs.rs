//! Plain photographs: a folder without poses, the masks that belong to it, and pixels that are stored upright.

use crate::extensions::is_photograph;
use crate::image::Mask;
use crate::root::OF_PHOTOGRAPHS;
use crate::size::Size;
use crate::{DataError, MaskMeaning, Orientation, decoding, folder, masks, photo, upright};
use ::image::DynamicImage;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

pub use crate::extensions::{conversion, is_video};

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
    /// The photographs in a folder, else those in `images`, `input` or another usual folder below it.
    ///
    /// Hidden files and masks beside photographs (`NAME_mask.png`) are none.
    pub fn in_folder(folder: &Path) -> Result<Self, DataError> {
        let mut found = Self::directly_in(folder)?;
        for name in OF_PHOTOGRAPHS {
            if found.names.is_empty()
                && found.unread.is_empty()
                && let Some(below) = folder::folder_in(folder, name)
            {
                found = Self::directly_in(&below)?;
            }
        }
        Ok(found)
    }

    fn directly_in(folder: &Path) -> Result<Self, DataError> {
        let mut all = folder::names(folder)?;
        all.retain(|name| folder.join(name).is_file());
        let masks: HashSet<String> = all
            .iter()
            .filter_map(|name| Some(masks::names_beside(Path::new(name).file_stem()?.to_str()?)))
            .flatten()
            .collect();
        let unread = all.iter().filter(|name| conversion(name).is_some()).cloned().collect();
        all.retain(|name| is_photograph(name) && !masks.contains(name));
        Ok(Self { folder: folder.to_owned(), names: all, unread })
    }

    /// The folder of their masks: `glass_masks`, `masks` or another usual name inside their folder or beside it, if it has a mask of any
    /// of them.
    pub fn mask_folder(&self) -> Option<PathBuf> {
        let inside = masks::mask_folders(&self.folder);
        // `..` of a link would lead elsewhere.
        let real = self.folder.canonicalize().ok();
        let parent = self.folder.parent().filter(|p| !p.as_os_str().is_empty());
        let parent = parent.map(Path::to_owned).or_else(|| real?.parent().map(Path::to_owned));
        let beside = parent.into_iter().flat_map(|p| masks::mask_folders(&p));
        inside
            .into_iter()
            .chain(beside)
            .find(|masks| self.names.iter().any(|name| mask_in(masks, name).is_some()))
    }

    /// The mask of a photograph: in the folder of masks, else beside it.
    pub fn mask(&self, folder: Option<&Path>, name: &str) -> Option<PathBuf> {
        let stem = Path::new(name).file_stem()?.to_str()?;
        let beside =
            || masks::names_beside(stem).into_iter().map(|name| self.folder.join(name)).find(|p| p.is_file());
        folder.and_then(|folder| mask_in(folder, name)).or_else(beside)
    }
}

/// `STEM.png`, `NAME.png`, `NAME` and the like in a folder of masks.
fn mask_in(folder: &Path, name: &str) -> Option<PathBuf> {
    masks::names_in_folder(&folder.join(name)).into_iter().find(|p| p.is_file())
}

/// Width and height of a photograph after its orientation tag (EXIF) is obeyed [pixel].
pub fn upright_size(path: &Path) -> Result<[u32; 2], DataError> {
    let Size { width, height } = decoding::header(path)?.upright();
    Ok([width, height])
}

/// The file of a photograph with its pixels turned upright and encoded anew; `None` where they are stored upright.
///
/// Programs differ in whether they obey the orientation tag (EXIF); a file without one is the same to all. Other tags, such
/// as the focal length, are kept.
pub fn turned_upright(path: &Path) -> Result<Option<Vec<u8>>, DataError> {
    upright::turned_upright(path)
}

/// The pixels of a picture as its file holds them.
pub fn stored_pixels(path: impl AsRef<Path>) -> Result<DynamicImage, DataError> {
    Ok(decoding::decode(path.as_ref())?.image)
}

/// The mask of a photograph, turned as the photograph has to be turned.
pub fn upright_mask(mask: &Path, photograph: &Path) -> Result<Mask, DataError> {
    let expected = decoding::header(photograph)?.upright();
    photo::load_mask(mask, photograph, Orientation::Upright, expected)
}

/// What the white of masks means by what they show, as [`Dataset::open`](crate::Dataset::open) concludes it.
pub fn meaning_shown(masks: &[&Path]) -> Result<MaskMeaning, DataError> {
    masks::meaning_shown(masks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::tests::folder_with;

    #[test]
    fn photographs_are_sorted_and_masks_and_hidden_files_are_none() {
        let folder =
            folder_with(&["b.JPG", "a.png", "a_mask.png", "._b.JPG", "c.heic", "notes.txt", "d.exr"]);
        let found = Photographs::in_folder(folder.path()).unwrap();
        assert_eq!(
            (found.names, found.unread),
            (vec!["a.png".into(), "b.JPG".into()], vec!["c.heic".into()])
        );
    }

    #[test]
    fn a_folder_of_photographs_below_is_found() {
        for below in ["images", "Images", "input"] {
            let folder = folder_with(&[&format!("{below}/a.jpg"), "__MACOSX/._a.jpg", "readme.txt"]);
            assert_eq!(Photographs::in_folder(folder.path()).unwrap().folder, folder.path().join(below));
        }
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
}
