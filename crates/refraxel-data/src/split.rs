//! Which views train and which are held out.

use crate::parsed::{Frame, ParsedDataset, Part};
use crate::{DataError, OpenOptions, Problem, Split, limits};
use std::collections::HashMap;
use std::path::Path;

/// One view in so many is held out where no split is stated (bmild, gsplat, NerfBaselines).
const DEFAULT_HOLDOUT: usize = 8;

/// Decides the split: lists in the file, then `{train,val,test}_list.txt`, then the format's own, then every n-th view
/// of the list sorted by name, starting with the first. Writes the parts to the frames too.
///
/// Errors: no view trains, or a list cannot be read.
pub(crate) fn decide(
    path: &Path,
    parsed: &mut ParsedDataset,
    options: &OpenOptions,
) -> Result<Split, DataError> {
    let split = decided(parsed, options)?;
    if split.train.is_empty() {
        let (count, rule) = (parsed.frames.len(), split.rule);
        return Err(DataError::NoTraining { path: path.to_owned(), count, rule });
    }
    Ok(split)
}

fn decided(parsed: &mut ParsedDataset, options: &OpenOptions) -> Result<Split, DataError> {
    let mut lists = std::mem::take(&mut parsed.split_lists);
    let mut rule = "lists of file names in the dataset's file".to_owned();
    if lists.is_empty() {
        lists = text_lists(parsed.root.folder())?;
        rule = "train_list.txt, val_list.txt, test_list.txt".to_owned();
    }
    if !lists.is_empty() {
        apply_lists(parsed, &lists);
    } else if let Some(stated) = parsed.split_rule.clone() {
        rule = stated;
    } else {
        let every = options.holdout.unwrap_or(DEFAULT_HOLDOUT);
        rule = hold_out(&mut parsed.frames, every);
        return Ok(collect(&parsed.frames, rule));
    }
    if options.holdout.is_some() {
        parsed.problems.push(Problem::warning(format!(
            "the hold-out option is ignored: the dataset states its split ({rule})"
        )));
    }
    Ok(collect(&parsed.frames, rule))
}

fn collect(frames: &[Frame], rule: String) -> Split {
    let of = |part| (0..frames.len()).filter(|&i| frames[i].part == Some(part)).collect();
    Split { train: of(Part::Train), val: of(Part::Val), test: of(Part::Test), rule }
}

fn hold_out(frames: &mut [Frame], every: usize) -> String {
    let mut by_name: Vec<usize> = (0..frames.len()).collect();
    by_name.sort_by(|&a, &b| frames[a].file.cmp(&frames[b].file));
    for (rank, i) in by_name.into_iter().enumerate() {
        let held_out = every > 0 && rank % every == 0;
        frames[i].part = Some(if held_out { Part::Test } else { Part::Train });
    }
    match every {
        0 => "all views train".to_owned(),
        n => format!("one view in {n}, sorted by name from the first, is held out"),
    }
}

/// `{train,val,test}_list.txt`: one image name per line.
fn text_lists(folder: &Path) -> Result<Vec<(Part, Vec<String>)>, DataError> {
    let mut lists = Vec::new();
    for (part, name) in [(Part::Train, "train"), (Part::Val, "val"), (Part::Test, "test")] {
        let file = folder.join(format!("{name}_list.txt"));
        if file.is_file() {
            let text = limits::read_text(&file)?;
            let names = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
            lists.push((part, names.map(str::to_owned).collect()));
        }
    }
    Ok(lists)
}

/// Assigns parts by name. Without a train list, everything unlisted trains; with one, it is unused.
fn apply_lists(parsed: &mut ParsedDataset, lists: &[(Part, Vec<String>)]) {
    let stated: HashMap<String, Part> =
        lists.iter().flat_map(|(part, names)| names.iter().map(|name| (plain(name), *part))).collect();
    let unlisted = lists.iter().all(|(part, _)| *part != Part::Train).then_some(Part::Train);
    let mut unused = 0;
    for frame in &mut parsed.frames {
        let path = plain(&frame.file);
        let name = path.rsplit('/').next().unwrap_or_default();
        let listed = [path.as_str(), name, stem(&path), stem(name)].iter().find_map(|key| stated.get(*key));
        frame.part = listed.copied().or(unlisted);
        unused += usize::from(frame.part.is_none());
    }
    if unused > 0 {
        parsed
            .problems
            .push(Problem::note(format!("{unused} views are in no list of the split and are not used")));
    }
}

fn plain(name: &str) -> String {
    name.replace('\\', "/").trim_start_matches("./").to_owned()
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
