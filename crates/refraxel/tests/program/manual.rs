//! The manual pages.

use clap::CommandFactory;
use refraxel::cli::Cli;
use std::fs;

#[test]
fn every_verb_has_a_manual_page_with_its_options() {
    let folder = tempfile::tempdir().unwrap();
    clap_mangen::generate_to(Cli::command(), folder.path()).unwrap();
    for verb in Cli::command().get_subcommands() {
        let path = folder.path().join(format!("refraxel-{}.1", verb.get_name()));
        let page = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(page.contains(".SH SYNOPSIS") && page.contains(".SH OPTIONS"), "{}", verb.get_name());
    }
    assert!(fs::read_to_string(folder.path().join("refraxel.1")).unwrap().contains("train"));
}
