//! One run of a sweep.

use crate::cli::{Cli, TrainArgs};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::dataset::data_failure;
use crate::verbs::eval::evaluate;
use crate::verbs::evaluation::Evaluation;
use crate::verbs::files::{create_folder, write_json};
use crate::verbs::train::{self, Lock};
use anyhow::Context;
use refraxel_data::{Dataset, OpenOptions, Part};
use refraxel_train::device::DeviceChoice;
use refraxel_train::run::CHECKPOINT;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::PathBuf;

/// What was asked for, in the folder of the run: another plan must not take its scores for its own.
const JOB: &str = "job.json";

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// Its number, from 0.
    pub number: usize,
    /// Name of the dataset and values of what varies.
    pub name: String,
    /// Name of the dataset.
    pub dataset: String,
    /// The dataset, from the root.
    pub data: PathBuf,
    /// Where the run is stored.
    pub folder: PathBuf,
    /// Options that all runs have.
    pub options: Vec<(String, String)>,
    /// Options that vary.
    pub varied: Vec<(String, String)>,
}

impl Job {
    /// All options; where one is named twice, the varied value counts.
    pub fn settings(&self) -> impl Iterator<Item = (&str, &str)> {
        self.options.iter().chain(&self.varied).map(|(option, value)| (option.as_str(), value.as_str()))
    }

    /// Its scores, once it is done. An error where the folder holds the run of another plan.
    pub fn done(&self) -> Result<Option<Evaluation>, Failure> {
        self.check_folder()?;
        Evaluation::read(&self.folder, Part::Test)
    }

    /// Trains and scores the run, or goes on with what an earlier attempt has saved. `None`: another process trains it.
    pub fn run(&self, show: Show) -> Result<Option<Evaluation>, Failure> {
        if let Some(done) = self.done()? {
            return Ok(Some(done));
        }
        self.check_data()?;
        create_folder(&self.folder)?;
        let lock = match Lock::attempt(&self.folder, show)? {
            Ok(lock) => lock,
            Err(holder) => {
                let holder = holder.map_or_else(|| "another process".to_owned(), |h| h.to_string());
                show.say(&format!("note: {holder} trains run {}, which is left to it", self.name));
                return Ok(None);
            }
        };
        // Whoever had the lock before may have finished meanwhile.
        if let Some(done) = self.done()? {
            return Ok(Some(done));
        }
        write_json(&self.folder.join(JOB), self)?;
        let in_run = |f: Failure| f.within(format!("run {}", self.name));
        let (_lock, _) = train::train_locked(&self.arguments()?, None, Some(lock), show).map_err(in_run)?;
        evaluate(&self.folder, Part::Test, DeviceChoice::Auto, show).map(Some).map_err(in_run)
    }

    /// Its dataset can be opened and holds images out, by which the run is scored.
    pub fn check_data(&self) -> Result<(), Failure> {
        let name = &self.dataset;
        let data = Dataset::open(&self.data, &OpenOptions::default()).map_err(data_failure);
        let data = data.map_err(|f| f.within(format!("dataset {name} of the plan")))?;
        if !data.split.test.is_empty() {
            return Ok(());
        }
        let path = self.data.display();
        Err(Exit::BadInput.because(format!(
            "dataset {name} of the plan, {path}, holds no images out: its runs could not be scored"
        )))
    }

    /// The command line of its training.
    fn arguments(&self) -> Result<TrainArgs, Failure> {
        let mut words = vec![self.data.clone().into_os_string()];
        words.extend(["--out".into(), self.folder.clone().into_os_string()]);
        for (option, value) in self.settings() {
            words.extend(["--set".into(), format!("{option}={value}").into()]);
        }
        if self.folder.join(CHECKPOINT).exists() {
            words.push("--resume".into());
        }
        Cli::training(words).or_exit(Exit::BadInput)
    }

    fn check_folder(&self) -> Result<(), Failure> {
        let path = self.folder.join(JOB);
        let text = match std::fs::read_to_string(&path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound && !self.holds_anything() => return Ok(()),
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Err(self.foreign()),
            text => text.with_context(|| format!("cannot read {}", path.display())).or_exit(Exit::Io)?,
        };
        let read = || format!("{} is not a document of this version", path.display());
        let found: Self = serde_json::from_str(&text).with_context(read).or_exit(Exit::BadInput)?;
        let sorted = |job: &Self| {
            let mut all: Vec<(String, String)> = job.options.iter().chain(&job.varied).cloned().collect();
            all.sort();
            all
        };
        if found.data == self.data && sorted(&found) == sorted(self) {
            return Ok(());
        }
        Err(self.foreign())
    }

    /// Whether there is a run or its scores.
    fn holds_anything(&self) -> bool {
        [CHECKPOINT, "eval"].into_iter().any(|name| self.folder.join(name).exists())
    }

    fn foreign(&self) -> Failure {
        let folder = self.folder.display();
        Exit::BadInput.because(format!(
            "{folder} holds a run with other options or data than the plan says now; choose another --out, or remove the folder"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_does_not_say_what_was_asked_for_is_not_taken_for_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let job = Job {
            number: 0,
            name: "a".into(),
            dataset: "a".into(),
            data: "/data".into(),
            folder: folder.path().into(),
            options: Vec::new(),
            varied: Vec::new(),
        };
        std::fs::write(folder.path().join("sweep.log"), "").unwrap();
        assert!(job.done().unwrap().is_none());
        for name in ["eval", CHECKPOINT, JOB] {
            let path = folder.path().join(name);
            std::fs::create_dir(&path).unwrap();
            assert!(job.done().is_err(), "{name}");
            std::fs::remove_dir(&path).unwrap();
        }
    }
}
