//! The folder of a render: it knows which of its files a render wrote, so that two renders never mix.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::{create_folder, read_text};
use anyhow::{Context, anyhow};
use refraxel_train::checkpoint::write_atomic;
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

/// The record: a heading, then the files of the render in the order of writing, one a line, relative to the folder.
pub const RECORD: &str = "render_files.txt";
const HEADING: &str = "# Files that `refraxel render` wrote here; --overwrite removes them.\n";
/// Files that a message names; it counts the rest.
const NAMED: usize = 3;

/// What happens to the files of an earlier render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Earlier {
    /// They stay, and the new render is refused.
    Keep,
    /// They are removed before the first new file is written.
    Remove,
}

/// A folder that is ready for the files of one render.
///
/// Each file is recorded as soon as it is written, so that the record of a render that was stopped is complete too.
pub struct RenderFolder {
    root: PathBuf,
    record: File,
}

impl RenderFolder {
    /// Makes the folder ready for the files `planned`, given relative to `root`.
    ///
    /// Errors: [`Exit::BadInput`] when an earlier render is there and has to stay, when a planned file would replace one
    /// that no render wrote, or when the record is not one. Nothing is changed then.
    pub fn open(root: &Path, planned: &BTreeSet<String>, earlier: Earlier) -> Result<Self, Failure> {
        let recorded = read_record(root)?;
        let present: Vec<&String> = recorded.iter().filter(|file| exists(&root.join(file))).collect();
        if earlier == Earlier::Keep && !present.is_empty() {
            return Err(refusal(format!(
                "{} holds an earlier render ({}); give another --out, or --overwrite to remove that render first",
                root.display(),
                list(&present),
            )));
        }
        let foreign = |file: &&String| !recorded.contains(*file) && is_blocked(root, file);
        let in_the_way: Vec<&String> = planned.iter().filter(foreign).collect();
        if !in_the_way.is_empty() {
            return Err(refusal(format!(
                "{} holds files that no render wrote, in the place of new ones: {}; such files are never removed, so \
                 move them or give another --out",
                root.display(),
                list(&in_the_way),
            )));
        }
        create_folder(root)?;
        remove(root, &present)?;
        let path = root.join(RECORD);
        write_atomic(&path, |f| f.write_all(HEADING.as_bytes()))?;
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
    let text = match read_text(&path) {
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(BTreeSet::new());
        }
        Err(e) if e.kind() == io::ErrorKind::InvalidData => String::new(), // no text: refused below
        text => text.with_context(cannot("read", &path)).or_exit(Exit::Io)?,
    };
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

/// "a.png, b.png, c.png and 57 more".
fn list(files: &[&String]) -> String {
    let named: Vec<&str> = files.iter().take(NAMED).map(|file| file.as_str()).collect();
    match files.len().saturating_sub(NAMED) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

fn cannot(action: &str, path: &Path) -> impl FnOnce() -> String {
    let text = format!("cannot {action} {}", path.display());
    move || text
}

fn refusal(text: String) -> Failure {
    Failure::new(Exit::BadInput, anyhow!(text))
}

#[cfg(test)]
mod tests;
