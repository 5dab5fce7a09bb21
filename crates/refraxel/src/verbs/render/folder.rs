//! The folder of a render: it knows which of its files a render wrote, so that two renders never mix.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::files::{create_folder, read_if_there, write_text};
use anyhow::Context;
use refraxel_data::listed;
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Component, Path, PathBuf};

/// The record: a heading, then the files of the render in the order of writing, one a line, relative to the folder.
pub const RECORD: &str = "render_files.txt";
const HEADING: &str = "# Files that `refraxel render` wrote here; --overwrite removes them.\n";
/// Files that a message names; it counts the rest.
const NAMED: usize = 3;

/// A folder that is ready for the files of one render.
///
/// Each file is recorded as soon as it is written, so that the record of a render that was stopped is complete too.
pub struct RenderFolder {
    root: PathBuf,
    record: File,
}

impl RenderFolder {
    /// Makes the folder ready for the files `planned`, given relative to `root`: with `overwrite`, files of an earlier render are
    /// removed first.
    ///
    /// Errors: [`Exit::BadInput`] when an earlier render is there and has to stay, when a planned file would replace one
    /// that no render wrote, or when the record is not one. Nothing is changed then.
    pub fn open(root: &Path, planned: &BTreeSet<String>, overwrite: bool) -> Result<Self, Failure> {
        let recorded = read_record(root)?;
        let present: Vec<&String> = recorded.iter().filter(|file| exists(&root.join(file))).collect();
        if !overwrite && !present.is_empty() {
            return Err(refusal(format!(
                "{} holds an earlier render ({}); give another --out, or --overwrite to remove that render first",
                root.display(),
                listed(&present, NAMED),
            )));
        }
        let foreign = |file: &&String| !recorded.contains(*file) && is_blocked(root, file);
        let in_the_way: Vec<&String> = planned.iter().filter(foreign).collect();
        if !in_the_way.is_empty() {
            return Err(refusal(format!(
                "{} holds files that no render wrote, in the place of new ones: {}; such files are never removed, so \
                 move them or give another --out",
                root.display(),
                listed(&in_the_way, NAMED),
            )));
        }
        create_folder(root)?;
        remove(root, &present)?;
        let path = root.join(RECORD);
        write_text(&path, HEADING)?;
        let record = OpenOptions::new().append(true).open(&path);
        Ok(Self {
            root: root.to_owned(),
            record: record.with_context(cannot("write", &path)).or_exit(Exit::Io)?,
        })
    }

    /// Writes a file, given relative to the folder, by `save`, and records it. Creates the folder that it lies in.
    pub fn write(
        &mut self,
        file: &str,
        save: impl FnOnce(&Path) -> Result<(), Failure>,
    ) -> Result<PathBuf, Failure> {
        let path = self.root.join(file);
        create_folder(path.parent().unwrap_or(&self.root))?;
        save(&path)?;
        let line = format!("{file}\n");
        let recorded = self.record.write_all(line.as_bytes());
        recorded.with_context(cannot("write", &self.root.join(RECORD))).or_exit(Exit::Io)?;
        Ok(path)
    }
}

/// The recorded files; none where there is no record.
fn read_record(root: &Path) -> Result<BTreeSet<String>, Failure> {
    let path = root.join(RECORD);
    let Some(text) = read_if_there(&path)? else { return Ok(BTreeSet::new()) };
    let lines = text.strip_prefix(HEADING).ok_or_else(|| {
        refusal(format!("{} is no record of a render; move it or give another --out", path.display()))
    })?;
    // The last line may have been cut off.
    let whole = lines.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let files: BTreeSet<String> = whole.lines().map(str::to_owned).collect();
    match files.iter().find(|file| !is_within(file)) {
        None => Ok(files),
        Some(file) => Err(refusal(format!(
            "{}: `{file}` is no file of this folder, so the record is damaged; remove the old pictures and the record \
             yourself, or give another --out",
            path.display(),
        ))),
    }
}

/// A relative path that leads to a file below the folder, other than the record.
fn is_within(file: &str) -> bool {
    let mut parts = Path::new(file).components().peekable();
    parts.peek().is_some() && parts.all(|c| matches!(c, Component::Normal(_))) && file != RECORD
}

/// Whether something stands where the file or the folder that it lies in should be.
fn is_blocked(root: &Path, file: &str) -> bool {
    let path = root.join(file);
    let folder = path.parent().unwrap_or(root);
    exists(&path) || (exists(folder) && !folder.is_dir() && folder != root)
}

/// Also true for a link that leads nowhere.
fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Removes files, and the folders below `root` that are empty then.
fn remove(root: &Path, files: &[&String]) -> Result<(), Failure> {
    for path in files.iter().map(|file| root.join(file)) {
        fs::remove_file(&path).with_context(cannot("remove", &path)).or_exit(Exit::Io)?;
    }
    let folders: BTreeSet<PathBuf> =
        files.iter().filter_map(|file| Some(root.join(file).parent()?.to_owned())).collect();
    for folder in folders.iter().filter(|folder| *folder != root) {
        let _ = fs::remove_dir(folder); // fails where it holds other files, which stay
    }
    Ok(())
}

fn cannot(action: &str, path: &Path) -> impl FnOnce() -> String {
    let text = format!("cannot {action} {}", path.display());
    move || text
}

fn refusal(text: String) -> Failure {
    Exit::BadInput.because(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::TempDir;

    fn files(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|&name| name.to_owned()).collect()
    }

    /// A folder that holds a render of these files.
    fn rendered(names: &[&str]) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        render(folder.path(), names, false).unwrap();
        folder
    }

    fn render(root: &Path, names: &[&str], overwrite: bool) -> Result<(), Failure> {
        let mut folder = RenderFolder::open(root, &files(names), overwrite)?;
        for name in names {
            folder.write(name, |path| fs::write(path, "new").or_exit(Exit::Io))?;
        }
        Ok(())
    }

    fn refused(root: &Path, names: &[&str], overwrite: bool) -> String {
        let failure = render(root, names, overwrite).unwrap_err();
        assert_eq!(failure.exit, Exit::BadInput);
        failure.report()
    }

    #[test]
    fn an_earlier_render_is_refused_and_stays() {
        let folder = rendered(&["0000.png", "depth/0000.png"]);
        let message = refused(folder.path(), &["other.png"], false);
        assert!(message.contains("0000.png, depth/0000.png") && message.contains("--overwrite"), "{message}");
        assert!(folder.path().join("depth/0000.png").is_file() && !folder.path().join("other.png").exists());
    }

    #[test]
    fn overwriting_removes_what_a_render_wrote_and_nothing_else() {
        let folder = rendered(&["0000.png", "0001.png", "depth/0001.png", "index/0001.png"]);
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        fs::write(folder.path().join("index/mine.png"), "mine").unwrap();
        render(folder.path(), &["0000.png"], true).unwrap();
        let exists = |name: &str| folder.path().join(name).exists();
        assert!(exists("0000.png") && exists("notes.txt") && exists("index/mine.png"));
        assert!(!exists("0001.png") && !exists("depth") && !exists("index/0001.png"));
        // The record tells of the new render alone.
        assert_eq!(read_record(folder.path()).unwrap(), files(&["0000.png"]));
    }

    #[test]
    fn files_of_the_user_are_named_and_stay_even_when_overwriting() {
        let folder = rendered(&["0000.png"]);
        let mine = folder.path().join("0001.png");
        fs::write(&mine, "mine").unwrap();
        let message = refused(folder.path(), &["0000.png", "0001.png"], true);
        assert!(message.contains("new ones: 0001.png;"), "{message}");
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
        assert!(folder.path().join("0000.png").is_file(), "nothing is removed before all is well");
    }

    #[test]
    fn a_file_in_the_place_of_a_folder_is_in_the_way() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("depth"), "mine").unwrap();
        assert!(refused(folder.path(), &["depth/0000.png"], true).contains("depth/0000.png"));
    }

    #[test]
    fn a_render_that_was_stopped_is_recorded_as_far_as_it_came() {
        let folder = tempfile::tempdir().unwrap();
        let planned = files(&["0000.png", "0001.png", "0002.png"]);
        let mut first = RenderFolder::open(folder.path(), &planned, false).unwrap();
        first.write("0000.png", |path| fs::write(path, "new").or_exit(Exit::Io)).unwrap();
        first.write("0001.png", |_| Err(refusal("disk full".to_owned()))).unwrap_err();
        let record = folder.path().join(RECORD);
        let text = fs::read_to_string(&record).unwrap();
        fs::write(&record, text + "0002.p").unwrap(); // cut off
        assert_eq!(read_record(folder.path()).unwrap(), files(&["0000.png"]));
    }

    #[test]
    fn a_folder_whose_pictures_were_moved_away_is_free_again() {
        let folder = rendered(&["0000.png"]);
        fs::remove_file(folder.path().join("0000.png")).unwrap();
        render(folder.path(), &["0000.png"], false).unwrap();
    }

    #[test]
    fn a_record_that_leads_elsewhere_removes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        fs::write(&victim, "mine").unwrap();
        let root = folder.path().join("out");
        fs::create_dir(&root).unwrap();
        for line in ["../victim", victim.to_str().unwrap(), RECORD] {
            fs::write(root.join(RECORD), format!("{HEADING}{line}\n")).unwrap();
            assert!(refused(&root, &["0000.png"], true).contains("damaged"), "{line}");
        }
        fs::write(root.join(RECORD), "my own list\n").unwrap();
        assert!(refused(&root, &["0000.png"], true).contains("no record of a render"));
        assert!(victim.exists());
    }
}
