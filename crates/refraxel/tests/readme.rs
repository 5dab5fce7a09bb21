//! What README.md tells people to type.

use clap::Parser;
use refraxel::cli::Cli;

const README: &str = include_str!("../../../README.md");

/// The arguments of each command in the README's shell blocks and in its table of verbs.
fn commands() -> Vec<String> {
    let mut in_shell = false;
    let mut found = Vec::new();
    for line in README.lines() {
        if line.starts_with("```") {
            in_shell = line == "```sh";
        }
        let shell = line.strip_prefix("refraxel ").or_else(|| line.strip_prefix("cargo run --release -- "));
        let table = line.strip_prefix("| `refraxel ").and_then(|l| l.split_once("` |"));
        let command = if in_shell { shell } else { table.map(|(command, _)| command) };
        found.extend(command.map(|c| c.split("  ").next().unwrap_or(c).replace("...", "")));
    }
    found
}

#[test]
fn every_command_of_the_readme_is_accepted() {
    let commands = commands();
    assert!(commands.len() >= 15, "{commands:?}");
    for command in commands {
        let words = command.split_whitespace().map(|word| match word {
            "N" => "5",
            "SHELL" => "bash",
            other => other,
        });
        let parsed = Cli::try_parse_from(std::iter::once("refraxel").chain(words));
        assert!(parsed.is_ok(), "{command}: {}", parsed.unwrap_err());
    }
}
