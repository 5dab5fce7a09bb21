//! Writes the manual pages of the program and of its verbs into a folder: `cargo run --example manual -- DIR`.

use clap::CommandFactory;
use refraxel::cli::Cli;
use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let folder = env::args_os().nth(1).map(PathBuf::from);
    let folder = folder
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "expected a folder for the pages"))?;
    fs::create_dir_all(&folder)?;
    clap_mangen::generate_to(Cli::command(), &folder)
}
