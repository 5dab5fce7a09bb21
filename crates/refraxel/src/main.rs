//! The `refraxel` program.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::CommandFactory;
use refraxel::cli::{Cli, Verb};
use refraxel::console::Console;
use refraxel::exit::{Exit, Failure, OrExit, end_on_panic};
use refraxel::verbs;

fn main() -> ExitCode {
    end_on_panic();
    match run(Cli::read().verb) {
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
        Verb::Mask(args) => verbs::mask::run(&args),
        Verb::Eval(args) => verbs::eval::run(&args),
        Verb::Demo(args) => verbs::demo::run(&args),
        Verb::Import(args) => verbs::import::run(&args),
        Verb::Inspect(args) => verbs::inspect::run(&args),
        Verb::Render(args) => verbs::render::run(&args),
        Verb::View(args) => verbs::view::run(&args),
        Verb::Export(args) => verbs::export::run(&args),
        Verb::Compare(args) => verbs::compare::run(&args),
        Verb::Sweep(args) => verbs::sweep::run(&args),
        Verb::Synth(args) => verbs::synth::run(&args),
        Verb::Bench(args) => verbs::bench::run(&args),
    }
}
