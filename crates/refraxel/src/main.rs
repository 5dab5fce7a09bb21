//! The `refraxel` program.

use std::io::{self, Write};
use std::process::ExitCode;

use anyhow::anyhow;
use clap::{CommandFactory, Parser};
use refraxel::cli::{Cli, Verb};
use refraxel::console::Console;
use refraxel::exit::{Exit, Failure, OrExit};
use refraxel::verbs;

fn main() -> ExitCode {
    match run(Cli::parse().verb) {
        Ok(()) => Exit::Done.into(),
        Err(failure) => {
            let _ = writeln!(io::stderr(), "{}", failure.report()); // nowhere else to complain
            failure.exit.into()
        }
    }
}

fn run(verb: Verb) -> Result<(), Failure> {
    match verb {
        Verb::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "refraxel", &mut script);
            Console::Text.say(&String::from_utf8_lossy(&script)).or_exit(Exit::Io)
        }
        Verb::Train(args) => verbs::train::run(&args),
        Verb::Eval(args) => verbs::eval::run(&args),
        _ => Err(Failure::new(Exit::Usage, anyhow!("this build does not have the verb yet"))),
    }
}
