//! Runs below a folder, the latest first.

use refraxel_train::run::CHECKPOINT;
use serde::Serialize;
use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Runs that are told.
const MOST: usize = 12;
/// Folders that are looked into, and how far below.
const LOOKED_AT: usize = 2000;
const DEEPEST: usize = 3;

/// A run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Recent {
    /// Its folder, as seen from the one that is searched.
    pub name: String,
    pub path: String,
    /// When it was saved last [s since 1970].
    pub saved: u64,
}

/// The runs in a folder and below, the latest first. Links are not followed.
pub fn recent(folder: &Path) -> Vec<Recent> {
    let mut waiting: VecDeque<(PathBuf, usize)> = [(folder.to_owned(), 0)].into();
    let (mut found, mut looked_at) = (Vec::new(), 0);
    while let Some((path, depth)) = waiting.pop_front() {
        looked_at += 1;
        if let Some(saved) = saved(&path) {
            found.extend(run(folder, &path, saved));
            continue;
        }
        if depth == DEEPEST || looked_at + waiting.len() >= LOOKED_AT {
            continue;
        }
        for entry in fs::read_dir(&path).into_iter().flatten().flatten() {
            let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
            if !is_hidden && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                waiting.push_back((entry.path(), depth + 1));
            }
        }
    }
    found.sort_by(|a: &Recent, b| b.saved.cmp(&a.saved).then_with(|| a.name.cmp(&b.name)));
    found.truncate(MOST);
    found
}

/// When the run of a folder was saved [s since 1970]; `None` where there is none.
pub fn saved(folder: &Path) -> Option<u64> {
    let metadata = fs::metadata(folder.join(CHECKPOINT)).ok().filter(fs::Metadata::is_file)?;
    let time = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
    Some(time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

fn run(root: &Path, path: &Path, saved: u64) -> Option<Recent> {
    let name = path.strip_prefix(root).ok().and_then(Path::to_str).filter(|name| !name.is_empty());
    let name = name.or_else(|| path.file_name()?.to_str())?.to_owned();
    Some(Recent { name, path: path.to_str()?.to_owned(), saved })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::time::Duration;

    #[test]
    fn the_latest_runs_below_a_folder_are_found() {
        let folder = tempfile::tempdir().unwrap();
        for (name, seconds) in
            [("old", 100), ("sweep/b", 300), ("sweep/a", 200), (".hidden/c", 400), ("1/2/3/4", 500)]
        {
            let run = folder.path().join(name);
            fs::create_dir_all(&run).unwrap();
            let file = File::create(run.join(CHECKPOINT)).unwrap();
            file.set_modified(UNIX_EPOCH + Duration::from_secs(seconds)).unwrap();
        }
        fs::create_dir(folder.path().join("old/below")).unwrap();
        File::create(folder.path().join("old/below").join(CHECKPOINT)).unwrap();
        let found = recent(folder.path());
        let names: Vec<(&str, u64)> = found.iter().map(|run| (&*run.name, run.saved)).collect();
        assert_eq!(names, [("sweep/b", 300), ("sweep/a", 200), ("old", 100)]);
        assert_eq!(recent(&folder.path().join("old"))[0].name, "old");
    }

    #[test]
    fn many_runs_are_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        for k in 0..MOST + 3 {
            let run = folder.path().join(k.to_string());
            fs::create_dir(&run).unwrap();
            File::create(run.join(CHECKPOINT)).unwrap();
        }
        assert_eq!(recent(folder.path()).len(), MOST);
        assert!(recent(&folder.path().join("nothing")).is_empty());
    }
}
