//! Which of all statements of a split is obeyed, and what happens where there is none.

use super::lists::{Assignment, Lists};
use super::{beside, by_name};
use crate::naming::first_few;
use crate::parsed::{Frame, ParsedDataset, Part};
use crate::{DataError, Format, OpenOptions, Problem, Split};
use std::collections::HashMap;
use std::path::Path;

/// One view in so many is held out where no split is stated (bmild, gsplat, NerfBaselines).
pub(crate) const DEFAULT_HOLDOUT: usize = 8;
/// The same for NSVF (svox2).
const NSVF_HOLDOUT: usize = 16;

/// Writes the stated split to the frames and its rule to the dataset: that of the description, then lists beside it, then the
/// names of images. Others that contradict it are named.
///
/// Errors: half of the views are in no list, and the lists name others.
pub(crate) fn assign(path: &Path, parsed: &mut ParsedDataset) -> Result<(), DataError> {
    let mut problems = Vec::new();
    let mut stated = described(parsed, &mut problems);
    for lists in beside::lists(&parsed.root, &mut problems) {
        stated.extend(meant(parsed, &lists, &mut problems));
    }
    let (named, note) = by_name::stated(parsed.format, &parsed.frames);
    if stated.is_empty() {
        problems.extend(note);
    }
    stated.extend(named);
    stated.iter_mut().for_each(let_validation_test);
    if let Some((first, others)) = stated.split_first() {
        problems.extend(others.iter().filter_map(|other| contradiction(&parsed.frames, first, other)));
        problems.extend(doubts(first));
        problems.extend(unlisted(path, &parsed.frames, first)?);
        parsed.frames.iter_mut().zip(&first.parts).for_each(|(frame, part)| frame.part = *part);
        parsed.split_rule = Some(first.rule.clone());
    }
    parsed.problems.extend(problems);
    Ok(())
}

/// Decides the split of the views that can be used: as it is stated, or else every n-th view of the list sorted by name,
/// starting with the first.
///
/// Errors: no view trains.
pub(crate) fn decide(
    path: &Path,
    parsed: &mut ParsedDataset,
    options: &OpenOptions,
) -> Result<Split, DataError> {
    let rule = match parsed.split_rule.clone() {
        Some(rule) if options.holdout.is_some() => {
            parsed.problems.push(Problem::warning(format!(
                "the hold-out option is ignored: the dataset states its split ({rule})"
            )));
            rule
        }
        Some(rule) => rule,
        None => {
            let usual = if parsed.format == Format::Nsvf { NSVF_HOLDOUT } else { DEFAULT_HOLDOUT };
            hold_out(&mut parsed.frames, options.holdout.unwrap_or(usual))
        }
    };
    let split = collect(&parsed.frames, rule);
    if split.train.is_empty() {
        let (count, rule) = (parsed.frames.len(), split.rule);
        return Err(DataError::NoTraining { path: path.to_owned(), count, rule });
    }
    parsed.problems.extend(shared(&parsed.frames));
    Ok(split)
}

/// What the description states: lists before parts of frames or files.
fn described(parsed: &mut ParsedDataset, problems: &mut Vec<Problem>) -> Vec<Assignment> {
    let mut stated = Vec::new();
    let parts = std::mem::take(&mut parsed.split_lists);
    if !parts.is_empty() {
        let source = "lists of file names in the dataset's file".to_owned();
        stated.extend(meant(parsed, &Lists { source, parts, are_surely_lists: true }, problems));
    }
    if let Some(rule) = parsed.split_rule.take() {
        let parts = parsed.frames.iter().map(|frame| frame.part).collect();
        stated.push(completed(Assignment { rule, parts, ..Assignment::default() }));
    }
    stated
}

/// What lists mean for the frames; a warning instead, where they mean nothing.
fn meant(parsed: &ParsedDataset, lists: &Lists, problems: &mut Vec<Problem>) -> Option<Assignment> {
    let are_in_file_order = matches!(parsed.format, Format::Transforms | Format::Blender);
    let assigned = |lists: &Lists| lists.assignment(&parsed.frames, are_in_file_order);
    let is_empty = |assignment: &Assignment| assignment.parts.iter().all(Option::is_none);
    let mut assignment = assigned(lists);
    if is_empty(&assignment) {
        // Prose that happens to hold the number of a view is no list.
        let are_views =
            |(lists, a): &(Lists, Assignment)| !is_empty(a) && 2 * a.unknown.len() <= lists.count();
        let pieces = lists.pieces().map(|lists| {
            let found = assigned(&lists);
            (lists, found)
        });
        assignment = pieces.into_iter().find(are_views).map_or(assignment, |(_, assignment)| assignment);
    }
    let is_empty = is_empty(&assignment);
    if is_empty && !(lists.are_surely_lists && lists.have_training()) {
        let names = first_few(assignment.unknown.iter().map(String::as_str));
        let message =
            format!("{}: none of its names is that of a view ({names}); it is not obeyed", lists.source);
        problems.extend((!assignment.unknown.is_empty()).then(|| Problem::warning(message)));
        return None;
    }
    // Where names of views to train are stated, and all are wrong, none trains.
    let trains = assignment.parts.contains(&Some(Part::Train));
    Some(if lists.have_training() && !trains { assignment } else { completed(assignment) })
}

/// Without any view that is said to train, all that are not held out do; and the other way round, where all names are known.
fn completed(mut assignment: Assignment) -> Assignment {
    let Assignment { parts, rule, unknown, .. } = &mut assignment;
    let (trains, others) = (parts.contains(&Some(Part::Train)), parts.contains(&None));
    let are_held_out = parts.iter().flatten().any(|part| *part != Part::Train);
    if !trains {
        parts.iter_mut().for_each(|part| *part = part.or(Some(Part::Train)));
    } else if others && !are_held_out && unknown.is_empty() {
        parts.iter_mut().for_each(|part| *part = part.or(Some(Part::Test)));
        *rule += "; the others are held out";
    }
    assignment
}

/// Where no view is said to test, those that are to validate do.
fn let_validation_test(assignment: &mut Assignment) {
    let has = |part| assignment.parts.contains(&Some(part));
    if has(Part::Val) && !has(Part::Test) {
        let validating = assignment.parts.iter_mut().filter(|part| **part == Some(Part::Val));
        validating.for_each(|part| *part = Some(Part::Test));
        assignment.rule += "; no view is stated to test, so those to validate do";
    }
}

/// A warning where another source says otherwise of what trains.
fn contradiction(frames: &[Frame], obeyed: &Assignment, other: &Assignment) -> Option<Problem> {
    let trains = |part: &Option<Part>| part.map(|part| part == Part::Train);
    let pairs = obeyed.parts.iter().zip(&other.parts).zip(frames);
    let differ = pairs.filter(|((a, b), _)| b.is_some() && trains(a) != trains(b));
    let names: Vec<&str> = differ.map(|(_, frame)| frame.file.as_str()).collect();
    (!names.is_empty()).then(|| {
        let (count, first) = (names.len(), first_few(names.into_iter()));
        let message =
            format!("two splits are stated: {} is used; {} says otherwise", obeyed.rule, other.rule);
        Problem::warning(format!("{message} of {count} views ({first}) and is ignored"))
    })
}

/// What is strange about the lists that are obeyed.
fn doubts(obeyed: &Assignment) -> Vec<Problem> {
    let Assignment { rule, unknown, twice, doubt, .. } = obeyed;
    let names = first_few(unknown.iter().map(String::as_str));
    let messages = [
        (!unknown.is_empty()).then(|| format!("{} names in it are those of no view: {names}", unknown.len())),
        (*twice > 0)
            .then(|| format!("{twice} views are listed to train and to be held out; they are held out")),
        doubt.map(|order| {
            format!(
                "it lists numbers; they are taken to count the views from 0 on{order}; list names to be sure"
            )
        }),
    ];
    messages.into_iter().flatten().map(|message| Problem::warning(format!("{rule}: {message}"))).collect()
}

/// A warning about views that are in no list.
fn unlisted(path: &Path, frames: &[Frame], obeyed: &Assignment) -> Result<Option<Problem>, DataError> {
    let parts = frames.iter().zip(&obeyed.parts);
    let names: Vec<&str> =
        parts.filter(|(_, part)| part.is_none()).map(|(frame, _)| frame.file.as_str()).collect();
    let lost = names.len();
    let (first, count) = (first_few(names.into_iter()), frames.len());
    if lost > 0 && 2 * lost >= count && !obeyed.unknown.is_empty() && lost < count {
        let reasons = format!(
            "they are in no list of the split ({}): {first}; {} names of the lists are those of no view: {}",
            obeyed.rule,
            obeyed.unknown.len(),
            first_few(obeyed.unknown.iter().map(String::as_str))
        );
        return Err(DataError::ViewsLost { path: path.to_owned(), count, lost, reasons });
    }
    let message = format!("{lost} views are in no list of the split and are not used: {first}");
    Ok((lost > 0).then(|| Problem::warning(message)))
}

/// A warning about images that are learned from and held out.
fn shared(frames: &[Frame]) -> Option<Problem> {
    let trains = |frame: &Frame| frame.part == Some(Part::Train);
    let learned: HashMap<&Path, &Frame> =
        frames.iter().filter(|f| trains(f)).filter_map(|f| Some((f.image.as_deref()?, f))).collect();
    let held_out = frames.iter().filter(|frame| !trains(frame) && frame.part.is_some());
    let both: Vec<&str> =
        held_out.filter_map(|f| Some(learned.get(f.image.as_deref()?)?.file.as_str())).collect();
    let count = both.len();
    (count > 0).then(|| {
        let names = first_few(both.into_iter());
        Problem::warning(format!(
            "{count} held-out images are among those to learn from as well ({names}): their scores are not those of unseen views"
        ))
    })
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
