//! The folder of a dataset, and the files that its descriptions may name in it.

use crate::DataError;
use std::path::{Path, PathBuf};

/// Extensions that are tried, in this order, for image names without an extension.
const EXTENSIONS: [&str; 7] = ["png", "jpg", "jpeg", "PNG", "JPG", "JPEG", "exr"];

/// A dataset's folder. Paths stated in files are resolved against it and may not leave it.
#[derive(Clone, Debug)]
pub(crate) struct Root {
    folder: PathBuf,
    canonical: PathBuf,
    allow_outside: bool,
}

/// Where a path was stated, for messages.
#[derive(Clone, Copy)]
pub(crate) struct Statement<'a> {
    /// The file.
    pub path: &'a Path,
    /// Key or line.
    pub key: &'a str,
}

impl Root {
    /// The dataset folder `folder`; `allow_outside` lifts the containment.
    pub fn new(folder: &Path, allow_outside: bool) -> Result<Self, DataError> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let canonical =
            folder.canonicalize().map_err(|source| DataError::Read { path: folder.to_owned(), source })?;
        Ok(Self { folder: folder.to_owned(), canonical, allow_outside })
    }

    /// The folder as the user gave it.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The existing file that `stated` names, `None` when there is none; an image extension may be missing.
    /// Backslashes separate folders too, as datasets written on Windows have them.
    pub fn find(&self, stated: &str, by: Statement<'_>) -> Result<Option<PathBuf>, DataError> {
        self.find_below("", stated, by)
    }

    /// The same for a name that is stated relative to a folder of the dataset.
    pub fn find_below(
        &self,
        folder: &str,
        stated: &str,
        by: Statement<'_>,
    ) -> Result<Option<PathBuf>, DataError> {
        let relative = self.relative(stated, by)?;
        let base = if matches!(folder, "" | ".") { self.folder.clone() } else { self.folder.join(folder) };
        let exact = base.join(&relative);
        let candidates = std::iter::once(exact.clone()).chain(EXTENSIONS.iter().map(|extension| {
            let mut name = exact.clone().into_os_string();
            name.push(format!(".{extension}"));
            PathBuf::from(name)
        }));
        let found = candidates.into_iter().find(|path| path.is_file());
        match found {
            Some(path) if !self.contains(&path) => Err(outside(stated, by)),
            found => Ok(found),
        }
    }

    /// True for an existing file whose real place, symbolic links followed, is inside the folder.
    pub fn contains(&self, path: &Path) -> bool {
        self.allow_outside || path.canonicalize().is_ok_and(|real| real.starts_with(&self.canonical))
    }

    /// `stated` without `.` and `..`; an error where it is empty, absolute or climbs above the folder.
    fn relative(&self, stated: &str, by: Statement<'_>) -> Result<PathBuf, DataError> {
        let expected = "a file path relative to the dataset folder";
        if stated.is_empty() || stated.contains('\0') {
            let (path, key) = (by.path.to_owned(), by.key.to_owned());
            return Err(DataError::Value { path, key, found: format!("{stated:?}"), expected });
        }
        let slashed = stated.replace('\\', "/");
        let drive = slashed.as_bytes().get(1) == Some(&b':') && slashed.as_bytes()[0].is_ascii_alphabetic();
        if self.allow_outside {
            return Ok(PathBuf::from(slashed));
        }
        let mut parts: Vec<&str> = Vec::new();
        for part in slashed.split('/') {
            match part {
                "" | "." => {}
                ".." => drop(parts.pop().ok_or_else(|| outside(stated, by))?),
                part => parts.push(part),
            }
        }
        if slashed.starts_with('/') || drive {
            return Err(outside(stated, by));
        }
        Ok(parts.iter().collect())
    }
}

fn outside(stated: &str, by: Statement<'_>) -> DataError {
    DataError::OutsideRoot { path: by.path.to_owned(), key: by.key.to_owned(), found: stated.to_owned() }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn by() -> Statement<'static> {
        Statement { path: Path::new("transforms.json"), key: "frames[0].file_path" }
    }

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
