//! Options in TOML and command lines.

use crate::damage::{Kind, damage, for_each_case};
use clap::FromArgMatches;
use refraxel::cli::{Cli, TrainArgs, Verb};
use refraxel::verbs::options;
use refraxel_train::Options;
use std::path::Path;

/// One option of each section that people set.
const TOML: &str = "[run]\nsteps = 4000\nminutes = 2.5\nsave_every = 30\nbatch = 4096\nmemory = 4.0\nseed = 3\n\
                    [grid]\nresolution = 160\nstages = 3\n[field]\nsh_degree = 1\n[refraction]\nbend = \"on\"\n\
                    bounds = \"-1,-1,-1,1,1,1\"\n[shape]\nstart = \"ball\"\n";
const LINE: &str = "train\ndata\n--out\nrun\n--minutes\n2.5\n--set\nrun.steps=40\n--set\nfield.sh_degree=1\n--threads\n2\n\
                    --seed\n7\n--refraction\non\n--refraction-box\n-1,-1,-1,1,1,1\n--holdout\n8\n--mask-meaning\nrefractive\n";

fn parsed<'a>(words: impl Iterator<Item = &'a str>) -> Result<Verb, clap::Error> {
    let matches = Cli::with_negative_numbers().try_get_matches_from(["refraxel"].into_iter().chain(words))?;
    Ok(Cli::from_arg_matches(&matches)?.verb)
}

/// Reads options. What is accepted must be accepted again from a checkpoint; what is refused must name `what`.
fn read(args: &TrainArgs, what: &str) -> bool {
    match options::read(args, Options::default()) {
        Ok(options) => options.checked().is_ok() || panic!("accepted, and then refused"),
        Err(failure) => {
            assert!(failure.report().contains(what), "{}", failure.report());
            false
        }
    }
}

#[test]
fn damaged_option_files_are_read_or_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("options.toml");
    let read_file = |content: &[u8], file: &Path| {
        std::fs::write(file, content).unwrap();
        let words = ["train", "data", "--out", "run", "--config", file.to_str().unwrap()];
        let Ok(Verb::Train(args)) = parsed(words.into_iter()) else { panic!("this line is right") };
        read(&args, "options.toml")
    };
    assert!(read_file(TOML.as_bytes(), &file));
    for_each_case("options", 256, damage(Kind::Text), |damage| {
        read_file(&damage.of(TOML.as_bytes()), &file);
    });
}

#[test]
fn damaged_command_lines_are_read_or_refused() {
    let read_line = |line: &str| match parsed(line.lines()) {
        Ok(Verb::Train(args)) if args.config.is_none() => read(&args, ""),
        _ => false,
    };
    assert!(read_line(LINE));
    for_each_case("command line", 256, damage(Kind::Text), |damage| {
        read_line(&String::from_utf8_lossy(&damage.of(LINE.as_bytes())));
    });
}
