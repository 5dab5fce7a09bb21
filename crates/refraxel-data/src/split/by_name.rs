//! Splits that the names of photographs state.

use super::lists::Assignment;
use super::words::words;
use crate::parsed::{Frame, Part};
use crate::{Format, Problem};

/// The split that all names state, and a note where only some do.
pub(super) fn stated(format: Format, frames: &[Frame]) -> (Option<Assignment>, Option<Problem>) {
    if let Some(prefixed) = prefixes(format, frames) {
        return (Some(prefixed), None);
    }
    let named = [
        ("folders named by parts of the split", parts(frames, folder)),
        ("names of images that hold train and test, val or eval", parts(frames, word)),
        ("names of images that hold clutter (train) and extra (test)", cluttered(frames)),
    ];
    let mut note = None;
    for (rule, parts) in named {
        let of = |part: Option<Part>| parts.iter().filter(|p| **p == part).count();
        let (without, training) = (of(None), of(Some(Part::Train)));
        let held_out = frames.len() - without - training;
        if held_out > 0 && training > 0 && without == 0 {
            return (Some(Assignment { rule: rule.to_owned(), parts, ..Assignment::default() }), None);
        }
        if held_out > 0 && held_out < frames.len() {
            note = Some(Problem::note(format!(
                "there are {rule}, but not of all images ({} of {}): they are not obeyed; a file test_list.txt with names would be",
                training + held_out,
                frames.len()
            )));
        }
    }
    (None, note)
}

/// NSVF: prefixes 0_, 1_, 2_ mean train, val, test; without 2_ the validation views are the test. One prefix alone says nothing.
fn prefixes(format: Format, frames: &[Frame]) -> Option<Assignment> {
    let name = |frame: &Frame| file_name(frame).to_owned();
    let has = |prefix: &str| frames.iter().any(|frame| name(frame).starts_with(prefix));
    let has_test = has("2_");
    if format != Format::Nsvf || !has("0_") || !(has("1_") || has_test) {
        return None;
    }
    let part = |frame: &Frame| {
        Some(match name(frame).chars().next() {
            Some('2') => Part::Test,
            Some('1') if has_test => Part::Val,
            Some('1') => Part::Test,
            _ => Part::Train,
        })
    };
    let rule =
        if has_test { "name prefixes 0_ train, 1_ val, 2_ test" } else { "name prefixes 0_ train, 1_ test" };
    let parts = frames.iter().map(part).collect();
    Some(Assignment { rule: rule.to_owned(), parts, ..Assignment::default() })
}

fn parts(frames: &[Frame], part: impl Fn(&Frame) -> Option<Part>) -> Vec<Option<Part>> {
    frames.iter().map(part).collect()
}

/// The part that a folder of the path is named by, the innermost first.
fn folder(frame: &Frame) -> Option<Part> {
    frame.file.rsplit(['/', '\\']).skip(1).find_map(Part::named)
}

/// The part that a word of the file name means, if there is one such word.
fn word(frame: &Frame) -> Option<Part> {
    let words = words(file_name(frame));
    let mut parts = words.iter().filter_map(|word| Part::named(word));
    let part = parts.next()?;
    parts.next().is_none().then_some(part)
}

/// RobustNeRF and NeRF On-the-go: with things that move, to train, and without, to test. Without the first, an extra photograph is one
/// more.
fn cluttered(frames: &[Frame]) -> Vec<Option<Part>> {
    let part = |frame: &Frame| {
        words(file_name(frame)).iter().find_map(|word| match word.as_str() {
            "clutter" => Some(Part::Train),
            "extra" => Some(Part::Test),
            _ => None,
        })
    };
    let parts = parts(frames, part);
    if parts.contains(&Some(Part::Train)) { parts } else { vec![None; frames.len()] }
}

fn file_name(frame: &Frame) -> &str {
    frame.file.rsplit(['/', '\\']).next().unwrap_or_default()
}
