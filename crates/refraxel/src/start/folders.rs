//! The folders of this machine, for a person who chooses one: names of folders and videos, and how many photographs there are.

use refraxel_data::photographs::{Photographs, is_video};
use refraxel_train::run::CHECKPOINT;
use serde::Serialize;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Entries that are listed of a folder.
const MOST: usize = 1000;
/// Folders of the home folder where people keep photographs.
const USUAL: [&str; 5] = ["Pictures", "Videos", "Movies", "Downloads", "Desktop"];
/// Folders in which disks and cards appear.
const DISKS: [&str; 3] = ["/media", "/Volumes", "/mnt"];

/// A folder or a video.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Place {
    pub name: String,
    pub path: String,
}

/// What is told of a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Folder {
    pub path: String,
    /// The folder above.
    pub parent: Option<String>,
    /// Sorted by their names; hidden ones are left out.
    pub folders: Vec<Place>,
    pub videos: Vec<Place>,
    /// Photographs in it, or in `images` below it.
    pub photographs: usize,
    /// Photographs in formats that are not read.
    pub unread: usize,
    /// It is the folder of a run.
    pub is_run: bool,
    /// Entries that are not listed: there are too many, or their names are no text.
    pub left_out: usize,
}

/// Lists a folder. An error says what is wrong with the path.
pub fn list(path: &str) -> Result<Folder, String> {
    let folder = checked(path)?;
    let entries = fs::read_dir(&folder).map_err(|error| format!("cannot read {path}: {error}"))?;
    let (mut folders, mut videos, mut left_out) = (Vec::new(), Vec::new(), 0);
    for entry in entries.flatten() {
        let path = entry.path();
        let is_folder = path.is_dir();
        if !(is_folder || is_video(&path) && path.is_file()) {
            continue;
        }
        let Some(place) = place(&path) else {
            left_out += 1;
            continue;
        };
        if !place.name.starts_with('.') {
            if is_folder { folders.push(place) } else { videos.push(place) }
        }
    }
    for list in [&mut folders, &mut videos] {
        list.sort_by_key(|place| place.name.to_lowercase());
        left_out += list.len().saturating_sub(MOST);
        list.truncate(MOST);
    }
    let found = Photographs::in_folder(&folder).unwrap_or_default();
    Ok(Folder {
        path: folder.display().to_string(),
        parent: folder.parent().map(|parent| parent.display().to_string()),
        folders,
        videos,
        photographs: found.names.len(),
        unread: found.unread.len(),
        is_run: folder.join(CHECKPOINT).is_file(),
        left_out,
    })
}

/// A path from the root, without ways back; it may be a folder or a file.
pub fn checked(path: &str) -> Result<PathBuf, String> {
    let found = PathBuf::from(path);
    if !found.is_absolute() || found.components().any(|part| part == Component::ParentDir) {
        return Err(format!(
            "{path}: expected a path from the root, such as /home/me/photos, without \"..\""
        ));
    }
    // Without a slash at its end, and without `.` in between.
    Ok(found.components().collect())
}

/// Where a person may begin to look.
pub fn places(here: &Path) -> Vec<Place> {
    let home = std::env::home_dir().filter(|home| home.is_dir());
    let below = |name: &&str| home.as_ref().map(|home| home.join(name)).filter(|path| path.is_dir());
    let disks = DISKS.iter().flat_map(|disks| fs::read_dir(disks).into_iter().flatten().flatten());
    let mut disks: Vec<PathBuf> = disks.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    disks.sort();
    let all =
        [here.to_owned()].into_iter().chain(home.clone()).chain(USUAL.iter().filter_map(below)).chain(disks);
    let mut places: Vec<Place> = all.filter_map(|path| place(&path)).collect();
    let mut known = Vec::new();
    places.retain(|place| {
        !known.contains(&place.path) && {
            known.push(place.path.clone());
            true
        }
    });
    places
}

/// The name and the path, where both are text.
fn place(path: &Path) -> Option<Place> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_str()?.to_owned();
    Some(Place { name, path: path.to_str()?.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_folders_and_videos_are_told_and_of_photographs_how_many() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["b", "A", ".hidden", "run"] {
            fs::create_dir(at(name)).unwrap();
        }
        for name in ["walk.mp4", "1.jpg", "2.jpg", "3.heic", "secret.txt", "run/checkpoint.safetensors"] {
            fs::write(at(name), "x").unwrap();
        }
        let found = list(folder.path().to_str().unwrap()).unwrap();
        let names = |places: &[Place]| places.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
        assert_eq!(
            (names(&found.folders), names(&found.videos)),
            (vec!["A".into(), "b".into(), "run".into()], vec!["walk.mp4".into()])
        );
        assert_eq!((found.photographs, found.unread, found.is_run, found.left_out), (2, 1, false, 0));
        assert_eq!(found.parent.as_deref(), folder.path().parent().and_then(Path::to_str));
        assert!(list(&format!("{}/run/", found.path)).unwrap().is_run);
        assert!(!serde_json::to_string(&found).unwrap().contains("secret"), "{found:?}");
    }

    #[test]
    fn paths_that_are_no_folders_are_refused_by_name() {
        for (path, word) in [
            ("", "from the root"),
            ("photos", "from the root"),
            ("../photos", "from the root"),
            ("/tmp/../etc", "without \"..\""),
            ("/there/is/no/such/folder", "cannot read /there"),
            ("/tmp/a\0b", "cannot read"),
            ("/etc/passwd", "cannot read /etc/passwd"),
        ] {
            let why = list(path).unwrap_err();
            assert!(why.contains(word), "{path}: {why}");
        }
    }

    #[test]
    fn places_to_begin_at_are_there_and_named_once() {
        let folder = tempfile::tempdir().unwrap();
        let places = places(folder.path());
        assert_eq!(places[0].path, folder.path().to_str().unwrap());
        assert!(places.iter().all(|place| Path::new(&place.path).is_dir()), "{places:?}");
        let mut paths: Vec<&String> = places.iter().map(|place| &place.path).collect();
        paths.sort();
        paths.dedup();
        assert_eq!(paths.len(), places.len());
    }
}
