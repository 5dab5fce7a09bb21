//! Options in TOML and command lines.

use super::{Answer, Target};
use crate::fuzz::Format;
use clap::FromArgMatches;
use refraxel::cli::{Cli, TrainArgs, Verb};
use refraxel::progress::Show;
use refraxel::verbs::options;
use refraxel_train::Options;
use std::fs;
use std::path::Path;

/// One option of each section that people set.
const TOML: &str = "[run]\nsteps = 4000\nminutes = 2.5\nsave_every = 30\nbatch = 4096\nmemory = 4.0\nseed = 3\n\
                    [grid]\nresolution = 160\nstages = 3\n[field]\nsh_degree = 1\n[refraction]\nbend = \"on\"\n\
                    bounds = \"-1,-1,-1,1,1,1\"\n[shape]\nstart = \"ball\"\n";
const WORDS: &str = "train\ndata\n--out\nrun\n--minutes\n2.5\n--set\nrun.steps=40\n--set\nfield.sh_degree=1\n--threads\n2\n\
                     --seed\n7\n--refraction\non\n--refraction-box\n-1,-1,-1,1,1,1\n--holdout\n8\n--mask-meaning\nrefractive\n";

pub fn targets() -> Vec<Target> {
    let target = |name, prepare, ask| Target { name, format: Format::Text, prepare, ask };
    vec![
        target("options-toml", |at| written(at, "options.toml", TOML), options_file),
        target("command-line", |at| written(at, "words.txt", WORDS), command_line),
    ]
}

fn written(at: &Path, name: &str, content: &str) -> anyhow::Result<std::path::PathBuf> {
    fs::write(at.join(name), content)?;
    Ok(at.join(name))
}

/// The arguments of `refraxel train` from the words after it.
pub fn train_args(words: &[&str]) -> anyhow::Result<TrainArgs> {
    let all = ["refraxel", "train"].iter().chain(words);
    let matches = Cli::with_negative_numbers().try_get_matches_from(all)?;
    match Cli::from_arg_matches(&matches)?.verb {
        Verb::Train(args) => Ok(args),
        _ => anyhow::bail!("not a training"),
    }
}

fn options_file(_folder: &Path, file: &Path) -> Answer {
    let path = file.display().to_string();
    let args = match train_args(&["data", "--out", "run", "--config", &path]) {
        Ok(args) => args,
        Err(error) => return Answer::Broken(error.to_string()),
    };
    read(&args)
}

fn read(args: &TrainArgs) -> Answer {
    let options = match options::read(args, Options::default(), Show::Nothing) {
        Ok(options) => options,
        Err(failure) => return Answer::Refused(failure.report()),
    };
    // What was accepted is accepted again from a checkpoint.
    match options.checked() {
        Ok(_) => Answer::Used,
        Err(error) => Answer::Broken(format!("accepted, then: {error}")),
    }
}

fn command_line(_folder: &Path, file: &Path) -> Answer {
    let text = fs::read(file).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let words = std::iter::once("refraxel").chain(text.lines());
    let parsed =
        Cli::with_negative_numbers().try_get_matches_from(words).and_then(|m| Cli::from_arg_matches(&m));
    match parsed.map(|cli| cli.verb) {
        Ok(Verb::Train(args)) if args.config.is_none() => read(&args),
        Ok(_) => Answer::Used,
        Err(error) => Answer::Refused(error.to_string()),
    }
}
