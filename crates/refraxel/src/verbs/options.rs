//! The options of `refraxel train`: where they come from, and the list of all of them.

use super::files::read_text;
use super::known_index;
use crate::cli::{Refraction, Setting, TrainArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use anyhow::Context;
use refraxel_train::Options;
use refraxel_train::options::{Switch, list, list_as_markdown, list_as_text};
use std::path::Path;

/// Options that a resumed run may change.
const FREE: [&str; 3] = ["run.minutes", "run.stop_after", "run.save_every"];

/// `refraxel train --options`.
pub fn print(args: &TrainArgs) -> Result<(), Failure> {
    let page = if args.markdown { list_as_markdown() } else { list_as_text() };
    Console::new(args.work.json).result(page.trim_end(), &list()).or_exit(Exit::Io)
}

/// The options of a run: those of `base`, then of the file, then of `--set`, then of the flags of their own.
pub fn read(args: &TrainArgs, base: Options) -> Result<Options, Failure> {
    let mut options = base;
    if let Some(file) = &args.index_from {
        if !args.resume {
            known_index::suit(&mut options, file);
        }
        known_index::held(&mut options);
    }
    let mut options = changed(options, args.config.as_deref(), &args.settings)?;
    set_flags(args, &mut options);
    let options = options.checked().or_exit(Exit::Usage)?;
    if args.index_from.is_some() {
        known_index::refuse_unused(&options)?;
    }
    Ok(options)
}

/// The options as a file and then `--set` change them.
pub fn changed(
    mut options: Options,
    config: Option<&Path>,
    settings: &[Setting],
) -> Result<Options, Failure> {
    if let Some(path) = config {
        let refused = || format!("the options of {} are refused", path.display());
        options.set_tree(&table(path)?).with_context(refused).or_exit(Exit::BadInput)?;
        options = options.checked().with_context(refused).or_exit(Exit::BadInput)?;
    }
    set_all(settings, &mut options)?;
    Ok(options)
}

/// Takes every `--set`.
pub fn set_all(settings: &[Setting], options: &mut Options) -> Result<(), Failure> {
    settings.iter().try_for_each(|s| options.set(&s.key, &s.value).or_exit(Exit::Usage))
}

/// A TOML file as a tree of values.
fn table(path: &Path) -> Result<serde_json::Value, Failure> {
    let text = read_text(path)
        .with_context(|| format!("cannot read the options in {}", path.display()))
        .or_exit(Exit::BadInput)?;
    let table: toml::Table = text
        .parse()
        .with_context(|| format!("{} is not a TOML file of `key = value` lines", path.display()))
        .or_exit(Exit::BadInput)?;
    serde_json::to_value(table).or_exit(Exit::BadInput)
}

/// Bends rays or not, where somebody says so.
pub fn bend(wish: Refraction, options: &mut Options) {
    match wish {
        Refraction::Off => options.refraction.bend = Switch::Off,
        Refraction::On => options.refraction.bend = Switch::On,
        Refraction::Auto => {}
    }
}

/// Flags of the command line that are short for options.
fn set_flags(args: &TrainArgs, options: &mut Options) {
    options.run.seed = args.seed.unwrap_or(options.run.seed);
    options.run.minutes = args.minutes.unwrap_or(options.run.minutes);
    bend(args.refraction, options);
    options.reflection.enabled = args.reflection.unwrap_or(options.reflection.enabled);
    options.clearcoat.enabled = args.clearcoat.unwrap_or(options.clearcoat.enabled);
    options.pose.enabled = args.poses.unwrap_or(options.pose.enabled);
    options.pose.lens = args.lens.unwrap_or(options.pose.lens);
    options.exposure.enabled = args.exposure.unwrap_or(options.exposure.enabled);
    if let Some(bounds) = &args.refraction_box {
        options.refraction.bounds.clone_from(bounds);
    }
}

/// The options with which a stored run goes on: its own, of which only `FREE` may change.
pub fn resumed(args: &TrainArgs, stored: Options) -> Result<Options, Failure> {
    let mut base = stored.clone();
    base.run.stop_after = 0;
    let options = read(args, base)?;
    let changed = options.differences(&stored).into_iter().find(|d| !FREE.contains(&d.name));
    let Some(changed) = changed else { return Ok(options) };
    let (out, free) = (args.out().display(), FREE.join("` and `"));
    Err(Exit::BadInput.because(format!(
        "option `{}` is {}, but {out} was trained with {}; --resume continues with the same options (only `{free}` may \
         change), so leave it out or start a new run",
        changed.name,
        changed.here,
        changed.there,
    )))
}
