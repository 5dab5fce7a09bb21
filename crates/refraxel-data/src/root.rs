//! The folder of a dataset, and the files that its descriptions may name in it.

use crate::folder::{Listing, names};
use crate::naming::{self, Difference, listed};
use crate::{DataError, extensions};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Folders of photographs, where a description states none or one of another machine.
pub(crate) const OF_PHOTOGRAPHS: [&str; 8] =
    ["images", "image", "imgs", "rgb", "input", "frames", "photos", "color"];

/// A dataset's folder. Paths stated in files are resolved against it and may not leave it.
#[derive(Debug)]
pub(crate) struct Root {
    folder: PathBuf,
    canonical: PathBuf,
    allow_outside: bool,
    /// What lies in its folders, each read once.
    listings: Mutex<HashMap<PathBuf, Arc<Listing>>>,
    renamed: Mutex<Vec<Renamed>>,
    /// The first photograph that lies outside and is not allowed to.
    outside: Mutex<Option<DataError>>,
}

/// A file that was found under another name than the stated one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Renamed {
    pub stated: String,
    pub found: PathBuf,
    pub difference: Difference,
}

/// Where a path was stated, for messages.
#[derive(Clone, Copy)]
pub(crate) struct Statement<'a> {
    /// The file.
    pub path: &'a Path,
    /// Key or line.
    pub key: &'a str,
}

/// A stated path, in parts.
struct Stated<'a> {
    /// Between slashes, without `.` and `..`.
    parts: Vec<&'a str>,
    /// It is absolute, or climbs above its folder.
    leaves: bool,
}

impl Root {
    /// The dataset folder `folder`; `allow_outside` lifts the containment.
    pub fn new(folder: &Path, allow_outside: bool) -> Result<Self, DataError> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let canonical =
            folder.canonicalize().map_err(|source| DataError::Read { path: folder.to_owned(), source })?;
        let (listings, renamed, outside) = Default::default();
        Ok(Self { folder: folder.to_owned(), canonical, allow_outside, listings, renamed, outside })
    }

    /// The folder as the user gave it.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The existing file that `stated` names, `None` when there is none. Backslashes separate folders too, as datasets written
    /// on Windows have them.
    ///
    /// Where no file has the very name, the one is taken that is meant beyond doubt: spelled otherwise, with another extension
    /// of a picture, or below the dataset where the path is one of another machine. [`Root::renamed`] tells.
    pub fn find(&self, stated: &str, by: Statement<'_>) -> Result<Option<PathBuf>, DataError> {
        // A mask that is stated with its folder is none of another folder.
        let fewest = if extensions::is_picture(stated) { 2 } else { 1 };
        self.search(&self.folder, Vec::new, fewest, stated, by)
    }

    /// The same for a photograph, whose folder may be another than is stated. One that leads outside is none, and
    /// [`Root::refuse_outside`] decides.
    pub fn find_photograph(&self, stated: &str, by: Statement<'_>) -> Result<Option<PathBuf>, DataError> {
        let usual = || {
            let top = self.listing(&self.folder);
            let names = OF_PHOTOGRAPHS.into_iter().filter_map(|name| top.entry(name));
            names.map(|name| self.folder.join(name)).collect()
        };
        self.inside(self.search(&self.folder, usual, 1, stated, by))
    }

    /// The same for a photograph whose path is stated relative to a folder of the dataset, or else to the only folder in that which has
    /// such a one.
    pub fn find_below(
        &self,
        folder: &str,
        stated: &str,
        by: Statement<'_>,
    ) -> Result<Option<PathBuf>, DataError> {
        let base = self.below(folder);
        self.inside(self.search(&base, || self.parts_of(&base), 1, stated, by))
    }

    /// The folders of photographs in a folder that holds none itself, such as one for each camera.
    fn parts_of(&self, base: &Path) -> Vec<PathBuf> {
        let listing = self.listing(base);
        if *base == self.folder || listing.images().next().is_some() {
            return Vec::new();
        }
        let is_of_others =
            |name: &String| ["mask", "depth"].iter().any(|word| naming::key(name).contains(word));
        let names = listing.names().iter().filter(|name| !is_of_others(name));
        names.map(|name| base.join(name)).filter(|path| path.is_dir()).collect()
    }

    /// The error of the first photograph that leads outside, unless others with paths of another machine were found: then it
    /// is missing as any other may be.
    pub fn refuse_outside(&self) -> Result<(), DataError> {
        let leads_outside = |r: &Renamed| Stated::of(&r.stated.replace('\\', "/")).leaves;
        let are_moved = locked(&self.renamed).iter().any(leads_outside);
        locked(&self.outside).take().filter(|_| !are_moved).map_or(Ok(()), Err)
    }

    /// Nothing, and a note for later, where it is outside.
    fn inside(&self, found: Result<Option<PathBuf>, DataError>) -> Result<Option<PathBuf>, DataError> {
        match found {
            Err(error @ DataError::OutsideRoot { .. }) => {
                locked(&self.outside).get_or_insert(error);
                Ok(None)
            }
            found => found,
        }
    }

    /// Whether that finds a file, without a trace in [`Root::renamed`].
    pub fn has_below(&self, folder: &str, stated: &str) -> bool {
        let base = self.below(folder);
        let slashed = stated.replace('\\', "/");
        let parts = Stated::of(&slashed).parts;
        completed(&base.join(parts.join("/"))).is_some()
            || self.meant(&[vec![base.clone()], self.parts_of(&base)].concat(), 1, &parts).is_some()
    }

    /// What was found under other names than the stated ones, in the order in which it was asked for.
    pub fn renamed(&self) -> Vec<Renamed> {
        locked(&self.renamed).clone()
    }

    /// What lies where a photograph was stated, for messages.
    pub fn lies_there(&self, stated: &str) -> String {
        const SHOWN: usize = 3;
        let slashed = stated.replace('\\', "/");
        let path = Stated::of(&slashed);
        let mut at = self.folder.clone();
        for part in &path.parts[..path.parts.len().saturating_sub(1)] {
            at = match self.listing(&at).folder(part) {
                Some(folder) => at.join(folder),
                None => break,
            };
        }
        if slashed.contains("://") {
            return "names are addresses, from which nothing is downloaded".to_owned();
        }
        let usual = OF_PHOTOGRAPHS.into_iter().map(|name| self.below(name));
        let places: Vec<PathBuf> = std::iter::once(at).chain(usual).collect();
        let holds = |folder: &PathBuf, what: &str, is_it: &dyn Fn(&str) -> bool| {
            let listing = self.listing(folder);
            let names: Vec<&String> = listing.names().iter().filter(|name| is_it(name)).collect();
            (!names.is_empty()).then(|| format!("{} holds {what}{}", folder.display(), listed(&names, SHOWN)))
        };
        let closed = || {
            let mut folders = places.iter().filter(|folder| folder.is_dir());
            folders.find_map(|folder| names(folder).err()).map(|error| error.to_string())
        };
        let images = places.iter().find_map(|folder| holds(folder, "", &extensions::is_picture));
        let is_packed =
            |name: &str| extensions::is_video(Path::new(name)) || extensions::unpacking(name).is_some();
        let packed = || {
            let mut folders = places.iter().chain(Some(&self.folder));
            folders.find_map(|folder| holds(folder, "no images, but ", &is_packed))
        };
        images
            .or_else(closed)
            .or_else(packed)
            .unwrap_or_else(|| format!("there are no images in {}", self.folder.display()))
    }

    /// What lies in a folder.
    pub fn listing(&self, folder: &Path) -> Arc<Listing> {
        if let Some(known) = locked(&self.listings).get(folder) {
            return known.clone();
        }
        let listing = Arc::new(Listing::of(folder));
        locked(&self.listings).insert(folder.to_owned(), listing.clone());
        listing
    }

    /// True for an existing file whose real place, symbolic links followed, is inside the folder.
    pub fn contains(&self, path: &Path) -> bool {
        self.allow_outside || path.canonicalize().is_ok_and(|real| real.starts_with(&self.canonical))
    }

    fn below(&self, folder: &str) -> PathBuf {
        if matches!(folder, "" | ".") { self.folder.clone() } else { self.folder.join(folder) }
    }

    /// The file that is stated relative to a folder, or else the one that is meant by at least so many of the last parts of the
    /// path, there or in one of other folders.
    fn search(
        &self,
        base: &Path,
        others: impl Fn() -> Vec<PathBuf>,
        fewest: usize,
        stated: &str,
        by: Statement<'_>,
    ) -> Result<Option<PathBuf>, DataError> {
        if stated.is_empty() || stated.contains('\0') {
            let (path, key) = (by.path.to_owned(), by.key.to_owned());
            let expected = "a file path relative to the dataset folder";
            return Err(DataError::Value { path, key, found: format!("{stated:?}"), expected });
        }
        let slashed = stated.replace('\\', "/");
        let path = Stated::of(&slashed);
        let as_stated = match self.own(&slashed) {
            _ if self.allow_outside => completed(&base.join(&slashed)),
            Some(own) => completed(&self.folder.join(own)),
            None if path.leaves => None,
            None => completed(&base.join(path.parts.join("/"))),
        };
        let found = as_stated
            .or_else(|| self.meant(&[vec![base.to_owned()], others()].concat(), fewest, &path.parts));
        match found {
            Some(found) if !self.contains(&found) => Err(outside(stated, by)),
            None if path.leaves && !self.allow_outside && self.own(&slashed).is_none() => {
                Err(outside(stated, by))
            }
            Some(found) => {
                self.note(&path, base, &found, stated);
                Ok(Some(found))
            }
            None => Ok(None),
        }
    }

    /// What an absolute path into the dataset names in it.
    fn own<'a>(&self, slashed: &'a str) -> Option<&'a Path> {
        let path = Path::new(slashed);
        path.strip_prefix(&self.canonical).ok().filter(|inside| !inside.as_os_str().is_empty())
    }

    /// The file that is meant by a path of which none exists: the longest end of the path that leads to one in one base.
    fn meant(&self, bases: &[PathBuf], fewest: usize, parts: &[&str]) -> Option<PathBuf> {
        let last = (parts.len() + 1).saturating_sub(fewest.min(parts.len()));
        for skipped in 0..last {
            let paths = bases.iter().map(|base| self.spelled(base, &parts[skipped..])).enumerate();
            let mut found = paths.filter_map(|(base, path)| Some((base, path?)));
            match (found.next(), found.next()) {
                (Some((0, path)), _) | (Some((_, path)), None) => return Some(path),
                (Some(_), Some(_)) => return None,
                (None, _) => {}
            }
        }
        None
    }

    /// The file at this path below a folder, in whatever spelling.
    fn spelled(&self, base: &Path, parts: &[&str]) -> Option<PathBuf> {
        let (name, folders) = parts.split_last()?;
        let mut at = base.to_owned();
        for folder in folders {
            at = at.join(self.listing(&at).folder(folder)?);
        }
        let path = at.join(self.listing(&at).file(name)?);
        path.is_file().then_some(path)
    }

    /// Keeps in mind that a file has another name than the stated one.
    fn note(&self, path: &Stated<'_>, base: &Path, found: &Path, stated: &str) {
        if self.own(&stated.replace('\\', "/")).is_some() {
            return;
        }
        let inside = found.strip_prefix(base).or_else(|_| found.strip_prefix(&self.folder));
        let Some(inside) = inside.ok().and_then(Path::to_str).map(|p| p.replace('\\', "/")) else { return };
        let found_parts: Vec<&str> = inside.split('/').collect();
        if let Some(difference) = differ(&path.parts, &found_parts) {
            let renamed = Renamed { stated: stated.to_owned(), found: found.to_owned(), difference };
            locked(&self.renamed).push(renamed);
        }
    }
}

impl<'a> Stated<'a> {
    /// A path with slashes between its parts.
    fn of(slashed: &'a str) -> Self {
        let drive = slashed.as_bytes().get(1) == Some(&b':') && slashed.as_bytes()[0].is_ascii_alphabetic();
        let mut leaves = slashed.starts_with('/') || drive;
        let mut parts: Vec<&str> = Vec::new();
        for part in slashed[if drive { 2 } else { 0 }..].split('/') {
            match part {
                "" | "." => {}
                ".." => leaves |= parts.pop().is_none(),
                part => parts.push(part),
            }
        }
        Self { parts, leaves }
    }
}

/// In what two paths differ; the name counts before the folders.
fn differ(stated: &[&str], found: &[&str]) -> Option<Difference> {
    let ((stated_name, stated_folders), (name, folders)) = (stated.split_last()?, found.split_last()?);
    let in_name = naming::difference(stated_name, name);
    let is_same_path = stated_folders.len() == folders.len();
    let pairs = || stated_folders.iter().zip(folders);
    in_name.or_else(|| match pairs().find_map(|(a, b)| naming::difference(a, b)) {
        _ if !is_same_path => Some(Difference::Folder),
        Some(Difference::Extension) => Some(Difference::Folder),
        other => other,
    })
}

/// The file itself, or the first that has an extension more.
fn completed(exact: &Path) -> Option<PathBuf> {
    let extensions = extensions::READ.iter().flat_map(|e| [(*e).to_owned(), e.to_ascii_uppercase()]);
    let with = extensions.map(|extension| {
        let mut name = exact.to_owned().into_os_string();
        name.push(format!(".{extension}"));
        PathBuf::from(name)
    });
    std::iter::once(exact.to_owned()).chain(with).find(|path| path.is_file())
}

/// What a lock guards. It is whole, whatever stopped another thread: each change is a single call.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn outside(stated: &str, by: Statement<'_>) -> DataError {
    DataError::OutsideRoot { path: by.path.to_owned(), key: by.key.to_owned(), found: stated.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::tests::folder_with;

    fn by() -> Statement<'static> {
        Statement { path: Path::new("transforms.json"), key: "frames[0].file_path" }
    }

    #[test]
    fn names_may_lack_the_extension_use_backslashes_and_contain_spaces() {
        let folder = folder_with(&["train/r_0.png", "my photos/a b.JPG", "x.5.jpg"]);
        let root = Root::new(folder.path(), false).unwrap();
        for stated in
            ["./train/r_0", "train/r_0.png", "train\\r_0", "my photos/a b", "train/../x.5", "x.5.jpg"]
        {
            assert!(root.find(stated, by()).unwrap().is_some(), "{stated}");
        }
        assert_eq!(root.find("train/r_1", by()).unwrap(), None);
        assert_eq!(root.find(&"long".repeat(2000), by()).unwrap(), None);
    }

    #[test]
    fn paths_that_leave_the_folder_are_refused_unless_allowed() {
        let folder = folder_with(&["inside/a.png", "secret.png"]);
        let root = Root::new(&folder.path().join("inside"), false).unwrap();
        let absolute = folder.path().join("secret.png").display().to_string();
        for stated in
            ["../secret.png", "a/../../secret", "..\\secret.png", &absolute, "C:\\secret.png", "\\\\host\\x"]
        {
            assert!(matches!(root.find(stated, by()), Err(DataError::OutsideRoot { .. })), "{stated}");
        }
        for stated in ["", "a\0b"] {
            assert!(matches!(root.find(stated, by()), Err(DataError::Value { .. })), "{stated:?}");
        }
        let trusting = Root::new(&folder.path().join("inside"), true).unwrap();
        assert!(trusting.find("../secret", by()).unwrap().is_some());
        assert!(trusting.find(&absolute, by()).unwrap().is_some());
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_out_of_the_folder_is_refused() {
        let folder = folder_with(&["inside/a.png", "secret.png"]);
        std::os::unix::fs::symlink(folder.path().join("secret.png"), folder.path().join("inside/link.png"))
            .unwrap();
        let root = Root::new(&folder.path().join("inside"), false).unwrap();
        assert!(matches!(root.find("link.png", by()), Err(DataError::OutsideRoot { .. })));
    }

    proptest::proptest! {
        #[test]
        fn whatever_is_stated_nothing_outside_is_found(stated in "[./\\\\a-c:\u{0}~]{0,24}") {
            let folder = folder_with(&["inside/a/b.png", "b.png", "a/b.png"]);
            let root = Root::new(&folder.path().join("inside"), false).unwrap();
            if let Ok(Some(found)) = root.find(&stated, by()) {
                let inside = folder.path().join("inside").canonicalize().unwrap();
                assert!(found.canonicalize().unwrap().starts_with(inside));
            }
        }
    }
}
