//! What the documents say against what the program does.

use clap::Parser;
use refraxel::cli::Cli;
use std::path::{Path, PathBuf};

const THEORY: &str = include_str!("../../../../docs/theory.md");

/// The folder of the repository.
fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// README.md and the pages below docs: their names and texts.
fn pages() -> Vec<(String, String)> {
    let folder = std::fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = folder.filter(|path| path.extension().is_some_and(|e| e == "md"));
    pages
        .chain([repository().join("README.md")])
        .map(|path| (path.display().to_string(), std::fs::read_to_string(&path).unwrap()))
        .collect()
}

/// The arguments of each command in a page's shell blocks and in its tables of verbs. Those with … are left out.
fn commands(page: &str) -> Vec<String> {
    let mut in_shell = false;
    let mut found = Vec::new();
    for line in page.replace("\\\n", " ").lines() {
        if line.starts_with("```") {
            in_shell = line == "```sh";
        }
        let table = line.strip_prefix("| `refraxel ").and_then(|l| l.split_once("` |"));
        let command = if in_shell {
            line.trim_start().strip_prefix("refraxel ")
        } else {
            table.map(|(command, _)| command)
        };
        let bare = command.and_then(|c| c.split(" #").next()?.split(" & ").next());
        found.extend(bare.filter(|c| !c.contains('…')).map(|c| c.replace("...", "").replace('\'', "")));
    }
    found
}

/// The equations that a source file cites, such as `3.4` for "theory (3.4)".
fn cited(source: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (_, mut rest) in source.match_indices("theory (").map(|(at, _)| source[at..].split_at(7)) {
        while let Some((number, after)) = rest.strip_prefix('(').and_then(|r| r.split_once(')')) {
            found.push(number);
            rest = ["–", ", ", " and "].iter().find_map(|s| after.strip_prefix(s)).unwrap_or("");
        }
    }
    found
}

fn sources(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "rs") && !entry.ends_with("program/docs.rs") {
            found.push(std::fs::read_to_string(entry).unwrap());
        }
    }
}

#[test]
fn every_command_of_the_pages_is_accepted() {
    let mut count = 0;
    for (page, text) in pages() {
        for command in commands(&text) {
            let words = command.split_whitespace().map(|word| match word {
                "N" | "M" => "5",
                "SHELL" => "bash",
                other => other,
            });
            let parsed = Cli::try_parse_from(std::iter::once("refraxel").chain(words));
            assert!(parsed.is_ok(), "{page}: {command}: {}", parsed.unwrap_err());
            count += 1;
        }
    }
    assert!(count >= 60, "{count}");
}

#[test]
fn the_page_of_options_is_the_list_of_the_program() {
    let page = std::fs::read_to_string(repository().join("docs/options.md")).unwrap_or_default();
    let renew = "cargo run --release -- train --options --markdown > docs/options.md";
    assert!(page == refraxel_train::options::list_as_markdown(), "docs/options.md is out of date: {renew}");
}

#[test]
fn every_equation_that_the_code_cites_is_in_the_theory() {
    let mut files = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), &mut files);
    let cited: Vec<&str> = files.iter().flat_map(|source| cited(source)).collect();
    assert!(cited.len() >= 40, "{cited:?}");
    for number in cited {
        let defined = [format!("\\qquad ({number})\n"), format!("| ({number}) |")];
        assert!(defined.iter().any(|d| THEORY.contains(d)), "docs/theory.md has no equation ({number})");
    }
}

#[test]
fn every_promise_of_the_security_page_has_its_test() {
    const PAGE: &str = include_str!("../../../../docs/security.md");
    let (_, table) = PAGE.split_once("## Promises and their tests").unwrap();
    let tests = table.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").nth(1));
    let quoted = tests.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    let names: Vec<&str> = quoted.filter(|name| !name.contains(' ')).collect();
    assert!(names.len() > 15, "{names:?}");
    let mut all = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), &mut all);
    for name in names {
        let test = format!("fn {name}(");
        assert!(all.iter().any(|source| source.contains(&test)), "there is no test {name}");
    }
}
