//! From a plan to the list of its runs.

use super::job::Job;
use super::results;
use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::files::absolute;
use anyhow::Context;
use refraxel_train::Options;
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// A plan as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    /// Datasets by name.
    data: BTreeMap<String, String>,
    /// Options of every run.
    #[serde(default)]
    options: toml::Table,
    /// Values of which every combination is tried.
    #[serde(default)]
    vary: BTreeMap<String, Vec<toml::Value>>,
}

/// Files beside the folders of the datasets.
const RESERVED: [&str; 2] = [results::TABLE, results::PAGE];

/// Runs that one plan may ask for: more is a slip.
const MOST: usize = 100_000;

/// The runs of a plan, whose folders lie below `out`. Everything that can be wrong with them is found here.
pub fn jobs(path: &Path, out: &Path) -> Result<Vec<Job>, Failure> {
    let refused = || format!("the plan {} is refused", path.display());
    let text = std::fs::read_to_string(path).with_context(refused).or_exit(Exit::BadInput)?;
    let plan: Plan = toml::from_str(&text).with_context(refused).or_exit(Exit::BadInput)?;
    let base = path.parent().unwrap_or(Path::new(""));
    plan.jobs(base, out).map_err(|f| f.within(refused()))
}

/// A run by its number.
pub fn chosen(jobs: &[Job], number: usize) -> Result<&Job, Failure> {
    let last = jobs.len().saturating_sub(1);
    let job = jobs.get(number);
    job.ok_or_else(|| {
        Exit::Usage.because(format!("the plan has no run {number}; expected a number from 0 to {last}"))
    })
}

/// Every dataset can be opened and holds images out, by which runs are scored.
pub fn check_data(jobs: &[Job]) -> Result<(), Failure> {
    let all: BTreeMap<&PathBuf, &Job> = jobs.iter().map(|job| (&job.data, job)).collect();
    all.into_values().try_for_each(Job::check_data)
}

impl Plan {
    fn jobs(&self, base: &Path, out: &Path) -> Result<Vec<Job>, Failure> {
        if self.data.is_empty() {
            return Err(
                Exit::BadInput.because("[data] is empty; expected name = \"folder\" for each dataset")
            );
        }
        let common: Vec<(String, String)> = self
            .options
            .iter()
            .map(|(k, v)| Ok((k.clone(), written(k, v)?)))
            .collect::<Result<_, Failure>>()?;
        let mut jobs = Vec::new();
        for (name, data) in &self.data {
            check_name(name)?;
            if name.is_empty() || RESERVED.iter().any(|r| r.eq_ignore_ascii_case(name)) {
                return Err(Exit::BadInput.because(format!(
                    "{name:?} cannot be the name of a dataset: runs are stored in folders of its name, beside {}",
                    RESERVED.join(" and ")
                )));
            }
            for varied in self.combinations()? {
                let folder = folder_name(&varied);
                check_name(&folder)?;
                jobs.push(Job {
                    number: jobs.len(),
                    name: if folder.is_empty() { name.clone() } else { format!("{name}/{folder}") },
                    dataset: name.clone(),
                    data: absolute(&base.join(data)),
                    folder: out.join(name).join(if folder.is_empty() { "run".to_owned() } else { folder }),
                    options: common.clone(),
                    varied,
                });
            }
        }
        let mut folders = HashMap::new();
        for job in &jobs {
            // Some file systems do not tell upper from lower case.
            if let Some(first) = folders.insert(job.name.to_ascii_lowercase(), &job.name) {
                return Err(Exit::BadInput.because(format!(
                    "the runs {first} and {} would share a folder; name each dataset and value once",
                    job.name
                )));
            }
        }
        jobs.iter().try_for_each(check)?;
        Ok(jobs)
    }

    /// Every combination of the varied values, the last option fastest.
    fn combinations(&self) -> Result<Vec<Vec<(String, String)>>, Failure> {
        let mut all = vec![Vec::new()];
        for (option, values) in &self.vary {
            if values.is_empty() || all.len() * values.len() > MOST {
                return Err(Exit::BadInput.because(format!(
                    "[vary] {option} has {} values; expected at least one, and at most {MOST} runs in all",
                    values.len()
                )));
            }
            let values: Vec<String> =
                values.iter().map(|v| written(option, v)).collect::<Result<_, Failure>>()?;
            let with = |before: &Vec<(String, String)>, value: &String| {
                before.iter().cloned().chain([(option.clone(), value.clone())]).collect()
            };
            all = all.iter().flat_map(|before| values.iter().map(move |value| with(before, value))).collect();
        }
        Ok(all)
    }
}

/// How an option's value is written on the command line.
fn written(option: &str, value: &toml::Value) -> Result<String, Failure> {
    match value {
        toml::Value::String(text) => Ok(text.clone()),
        toml::Value::Boolean(switch) => Ok(if *switch { "on" } else { "off" }.to_owned()),
        toml::Value::Integer(_) | toml::Value::Float(_) => Ok(value.to_string()),
        _ => Err(Exit::BadInput.because(format!(
            "the value of {option} is {value}; expected a number, a text or a switch (options are written \"section.name\" = value)"
        ))),
    }
}

/// "refraction.bend=off,run.seed=1".
fn folder_name(varied: &[(String, String)]) -> String {
    varied.iter().map(|(option, value)| format!("{option}={value}")).collect::<Vec<_>>().join(",")
}

/// Names become folders.
fn check_name(name: &str) -> Result<(), Failure> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._=,+-".contains(c);
    if name.chars().all(is_plain) && !name.starts_with('.') && name.len() <= 200 {
        return Ok(());
    }
    Err(Exit::BadInput.because(format!(
        "{name:?} cannot be the name of a folder; expected letters, digits and . _ = , + - in at most 200 characters"
    )))
}

/// Whether the options of a run exist and may have their values.
fn check(job: &Job) -> Result<(), Failure> {
    let mut options = Options::default();
    for (option, value) in job.settings() {
        let refused = || format!("run {}", job.name);
        options.set(option, value).with_context(refused).or_exit(Exit::BadInput)?;
    }
    options.checked().with_context(|| format!("run {}", job.name)).or_exit(Exit::BadInput).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Vec<Job>, Failure> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plan.toml");
        std::fs::write(&path, text).unwrap();
        jobs(&path, Path::new("out"))
    }

    #[test]
    fn every_combination_of_data_and_values_is_a_run() {
        let text = "[data]\na = \"x\"\nb = \"y\"\n[options]\n\"run.steps\" = 10\n\
                    [vary]\n\"run.seed\" = [0, 1, 2]\n\"refraction.bend\" = [false, \"on\"]\n";
        let jobs = of(text).unwrap();
        assert_eq!(jobs.len(), 12);
        assert_eq!(jobs[1].name, "a/refraction.bend=off,run.seed=1");
        assert_eq!(jobs[1].folder, Path::new("out/a/refraction.bend=off,run.seed=1"));
        assert!(jobs[11].data.ends_with("y") && jobs[11].number == 11);
        let settings: Vec<_> = jobs[1].settings().collect();
        assert_eq!(settings, [("run.steps", "10"), ("refraction.bend", "off"), ("run.seed", "1")]);
    }

    #[test]
    fn a_plan_without_varied_values_has_one_run_per_dataset() {
        let jobs = of("[data]\na = \"x\"\n").unwrap();
        assert_eq!((jobs.len(), jobs[0].name.as_str()), (1, "a"));
    }

    #[test]
    fn what_is_wrong_with_a_plan_is_said_before_any_work() {
        for (text, word) in [
            ("", "data"),
            ("[data]\n", "[data] is empty"),
            ("[data]\na = \"x\"\n[vary]\n\"run.seed\" = []\n", "at least one"),
            ("[data]\na = \"x\"\n[options]\n\"run.stepz\" = 1\n", "run.stepz"),
            ("[data]\na = \"x\"\n[options]\n\"run.steps\" = [1]\n", "expected a number"),
            ("[data]\n\"a/b\" = \"x\"\n", "name of a folder"),
            ("[data]\na = \"x\"\n[option]\n", "option"),
            ("[data]\n\"\" = \"x\"\n", "name of a dataset"),
            ("[data]\n\"Results.csv\" = \"x\"\n", "results.csv"),
            ("[data]\na = \"x\"\nA = \"y\"\n", "share a folder"),
            ("[data]\na = \"x\"\n[vary]\n\"run.seed\" = [0, \"0\"]\n", "share a folder"),
        ] {
            let report = of(text).unwrap_err().report();
            assert!(report.contains(word) && report.contains("plan.toml"), "{text}: {report}");
        }
    }
}
