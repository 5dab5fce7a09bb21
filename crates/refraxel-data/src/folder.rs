//! What lies in a folder: names, found in whatever way they are written.

use crate::DataError;
use crate::extensions::is_picture;
use crate::naming::{is_of_system, key, picture_stem, rank, stem_key};
use ::image::ImageFormat;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The names in a folder, sorted, without those that systems put there for themselves.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>, DataError> {
    let failed = |source| DataError::Read { path: folder.to_owned(), source };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut names: Vec<String> = entries.flatten().filter_map(|e| e.file_name().into_string().ok()).collect();
    names.retain(|name| !is_of_system(name));
    names.sort();
    Ok(names)
}

/// What has these [`names`]; nothing where the folder cannot be read.
pub(crate) fn inside(folder: &Path) -> Vec<PathBuf> {
    names(folder).unwrap_or_default().into_iter().map(|name| folder.join(name)).collect()
}

/// The file of this name in a folder, in upper or lower case, if there is one.
pub(crate) fn file_in(folder: &Path, name: &str) -> Option<PathBuf> {
    entry_in(folder, name, Path::is_file)
}

/// The folder of this name in a folder, in upper or lower case, if there is one.
pub(crate) fn folder_in(folder: &Path, name: &str) -> Option<PathBuf> {
    entry_in(folder, name, Path::is_dir)
}

fn entry_in(folder: &Path, name: &str, is_kind: fn(&Path) -> bool) -> Option<PathBuf> {
    let exact = folder.join(name);
    if is_kind(&exact) {
        return Some(exact);
    }
    let mut same = names(folder).ok()?.into_iter().filter(|other| key(other) == key(name));
    let (first, second) = (same.next()?, same.next());
    Some(folder.join(first)).filter(|path| second.is_none() && is_kind(path))
}

/// The folder itself, or the one above where that is called `name` and has the photographs.
pub(crate) fn above(folder: &Path, name: &str) -> PathBuf {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let is_named = real.file_name().is_some_and(|n| key(&n.to_string_lossy()) == name);
    let above = real.parent().filter(|above| is_named && folder_in(above, "images").is_some());
    match above {
        Some(above) if folder_in(folder, "images").is_none() => above.to_owned(),
        _ => folder.to_owned(),
    }
}

/// The one file of these; several are an error that names them.
pub(crate) fn only_one(folder: &Path, mut found: Vec<PathBuf>) -> Result<Option<PathBuf>, DataError> {
    match found.len() {
        0 | 1 => Ok(found.pop()),
        _ => Err(DataError::SeveralDatasets { path: folder.to_owned(), found }),
    }
}

/// The one file in a folder whose name ends so, in upper or lower case, and that `is_it`; several are an error that names them.
pub(crate) fn only_file(
    folder: &Path,
    ending: &str,
    is_it: fn(&Path) -> bool,
) -> Result<Option<PathBuf>, DataError> {
    let mut found = names(folder).unwrap_or_default();
    found.retain(|name| !name.starts_with('.') && name.to_ascii_lowercase().ends_with(ending));
    let mut files: Vec<PathBuf> = found.into_iter().map(|name| folder.join(name)).collect();
    files.retain(|file| is_it(file));
    only_one(folder, files)
}

/// The names in a folder, by what their spellings have in common.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    names: Vec<String>,
    by_key: HashMap<String, Vec<usize>>,
    /// Pictures, without their extensions.
    by_stem: HashMap<String, Vec<usize>>,
}

impl Listing {
    /// Lists a folder; nothing where it cannot be read.
    pub fn of(folder: &Path) -> Self {
        let mut listing = Self { names: names(folder).unwrap_or_default(), ..Self::default() };
        for (i, name) in listing.names.iter().enumerate() {
            listing.by_key.entry(key(name)).or_default().push(i);
            if is_picture(name) {
                listing.by_stem.entry(stem_key(name)).or_default().push(i);
            }
        }
        listing
    }

    /// All of them, sorted.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The pictures.
    pub fn images(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str).filter(|name| is_picture(name))
    }

    /// The pictures that are called so, in any spelling and with any extension.
    pub fn called(&self, name: &str) -> impl Iterator<Item = &str> {
        let places = self.by_stem.get(&stem_key(name)).map_or(&[][..], |places| places);
        places.iter().map(|i| self.names[*i].as_str())
    }

    /// The name itself, or else the only other spelling of it.
    pub fn entry(&self, name: &str) -> Option<&str> {
        if let Ok(i) = self.names.binary_search_by(|other| other.as_str().cmp(name)) {
            return Some(&self.names[i]);
        }
        match self.by_key.get(&key(name))?.as_slice() {
            [i] => Some(&self.names[*i]),
            _ => None,
        }
    }

    /// The file that is meant by a name: itself, itself with an extension added, another spelling, or the only picture that
    /// is called so and has another extension.
    pub fn file(&self, name: &str) -> Option<&str> {
        if let Some(found) = self.entry(name) {
            return Some(found);
        }
        let mut pictures: Vec<&str> = self.called(name).collect();
        let is_open = picture_stem(name) == name;
        if is_open {
            pictures.sort_by_key(|found| (picture_stem(found) != name, rank(found)));
        } else if pictures.len() > 1 {
            let is_jpeg = |name: &str| matches!(ImageFormat::from_path(name), Ok(ImageFormat::Jpeg));
            pictures.retain(|found| is_jpeg(found) && is_jpeg(name));
        }
        pictures.first().copied().filter(|_| is_open || pictures.len() == 1)
    }

    /// The folder that is meant by a name: itself, another spelling, or, of pictures, the largest reduced copies (`images_2`).
    pub fn folder(&self, name: &str) -> Option<&str> {
        let reduced = || {
            let prefix = format!("{name}_");
            let factor = |other: &String| other.strip_prefix(&prefix)?.parse::<u32>().ok();
            let copies = self.names.iter().filter_map(|other| Some((factor(other)?, other.as_str())));
            copies.min().map(|(_, other)| other).filter(|_| name == "images")
        };
        self.entry(name).or_else(reduced)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A folder that holds these files.
    pub(crate) fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, b"x").unwrap();
        }
        folder
    }

    #[test]
    fn a_name_that_may_mean_two_files_means_none() {
        let listing = |files: &[&str]| Listing::of(folder_with(files).path());
        assert_eq!(listing(&["V00.PNG"]).file("v00.png"), Some("V00.PNG"));
        assert_eq!(listing(&["V00.PNG", "v00.Png"]).file("v00.png"), None);
        assert_eq!(listing(&["V00.PNG", "v00.png"]).file("v00.png"), Some("v00.png"));
        assert_eq!(listing(&["a.png", "a.exr"]).file("a.jpg"), None);
        assert_eq!(listing(&["a.png", "a.JPG"]).file("a.jpeg"), Some("a.JPG"));
        assert_eq!(listing(&["a.png", "a.jfif"]).file("a.jpg"), Some("a.jfif"));
        assert_eq!(listing(&["a.exr", "a.png"]).file("a"), Some("a.png"), "the order of extensions");
        assert_eq!(listing(&["a.txt", "._a.png"]).file("a.jpg"), None);
    }

    #[test]
    fn reduced_copies_stand_for_a_folder_of_images_that_is_missing() {
        let folder = folder_with(&["images_8/a.png", "images_2/a.png", "images_old/a.png"]);
        let listing = Listing::of(folder.path());
        assert_eq!((listing.folder("images"), listing.folder("masks")), (Some("images_2"), None));
    }
}
