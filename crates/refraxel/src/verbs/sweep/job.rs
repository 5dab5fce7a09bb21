//! One run of a sweep.

use crate::cli::{Cli, SplitName, TrainArgs, Verb};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::eval::evaluate;
use crate::verbs::evaluation::Evaluation;
use crate::verbs::{create_folder, train};
use anyhow::{Context, anyhow};
use clap::Parser;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::run::CHECKPOINT;
use serde::{Deserialize, Serialize};
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
        Evaluation::read(&self.folder, SplitName::Test)
    }

    /// Trains and scores the run, or goes on with what an earlier attempt has saved.
    pub fn run(&self, show: Show) -> Result<Evaluation, Failure> {
        if let Some(done) = self.done()? {
            return Ok(done);
        }
        create_folder(&self.folder)?;
        let text = serde_json::to_string_pretty(self).or_exit(Exit::Io)?;
        write_atomic(&self.folder.join(JOB), |f| f.write_all(text.as_bytes()))?;
        let in_run = |f: Failure| Failure::new(f.exit, f.error.context(format!("run {}", self.name)));
        train::train(&self.arguments()?, show).map_err(in_run)?;
        evaluate(&self.folder, SplitName::Test, show).map_err(in_run)
    }

    /// The command line of its training.
    fn arguments(&self) -> Result<TrainArgs, Failure> {
        let mut words = vec!["refraxel".into(), "train".into(), self.data.clone().into_os_string()];
        words.extend(["--out".into(), self.folder.clone().into_os_string()]);
        for (option, value) in self.settings() {
            words.extend(["--set".into(), format!("{option}={value}").into()]);
        }
        if self.folder.join(CHECKPOINT).exists() {
            words.push("--resume".into());
        }
        match Cli::try_parse_from(words).or_exit(Exit::BadInput)?.verb {
            Verb::Train(args) => Ok(args),
            _ => Err(Failure::new(Exit::BadInput, anyhow!("not a training"))),
        }
    }

    fn check_folder(&self) -> Result<(), Failure> {
        let path = self.folder.join(JOB);
        let Ok(text) = std::fs::read_to_string(&path) else { return Ok(()) };
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
        Err(Failure::new(
            Exit::BadInput,
            anyhow!(
                "{} holds a run with other options or data than the plan says now; choose another --out, or remove the folder",
                self.folder.display()
            ),
        ))
    }
}
