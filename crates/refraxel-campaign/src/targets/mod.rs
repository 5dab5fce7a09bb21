//! What is attacked: one target for each format that is read, with a valid file of it.

mod datasets;
mod index_files;
mod runs;
mod small;
mod words;

use crate::fuzz::Format;
use anyhow::Context;
use std::fs;
use std::path::{Path, PathBuf};

/// What became of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It was used, and all that follows from it could be done.
    Used,
    /// It was refused with this message.
    Refused(String),
    /// It was accepted, and then this failed.
    Broken(String),
}

/// A format that is read.
pub struct Target {
    /// Its name on the command line, in reports and below `regressions/`.
    pub name: &'static str,
    /// How its files are changed.
    pub format: Format,
    /// Writes all that a valid file needs around it into an empty folder; gives the path of the file itself.
    prepare: fn(&Path) -> anyhow::Result<PathBuf>,
    /// Uses what lies in the folder, as the program would.
    ask: fn(&Path, &Path) -> Answer,
}

/// All targets.
pub fn all() -> Vec<Target> {
    [datasets::targets(), index_files::targets(), runs::targets(), words::targets()]
        .into_iter()
        .flatten()
        .collect()
}

/// The target of a name.
pub fn named(name: &str) -> anyhow::Result<Target> {
    let names = || all().iter().map(|t| t.name).collect::<Vec<_>>().join(", ");
    all()
        .into_iter()
        .find(|t| t.name == name)
        .with_context(|| format!("no target {name}; there are {}", names()))
}

/// A folder with the valid file of a target.
pub struct Bench {
    folder: PathBuf,
    file: PathBuf,
    valid: Vec<u8>,
}

impl Bench {
    /// Writes the valid file and all around it. The program must accept it as it is.
    pub fn new(target: &Target, folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let file = (target.prepare)(folder).with_context(|| format!("the valid file of {}", target.name))?;
        let valid = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let bench = Self { folder: folder.to_owned(), file, valid };
        match bench.ask(target, &bench.valid) {
            Answer::Used => Ok(bench),
            other => anyhow::bail!("the valid file of {} is not used: {other:?}", target.name),
        }
    }

    /// The valid file's content.
    pub fn valid(&self) -> &[u8] {
        &self.valid
    }

    /// Where the changed file is written.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Gives the target a file with this content.
    pub fn ask(&self, target: &Target, content: &[u8]) -> Answer {
        match fs::write(&self.file, content) {
            Ok(()) => (target.ask)(&self.folder, &self.file),
            Err(error) => {
                Answer::Broken(format!("the campaign cannot write {}: {error}", self.file.display()))
            }
        }
    }
}
