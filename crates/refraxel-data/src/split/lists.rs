//! Lists of views, and which views their entries mean.

use crate::naming::{key, stem_key};
use crate::parsed::{Frame, Part};
use std::collections::HashMap;

/// Lists of one source.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    /// What they are, for people.
    pub source: String,
    /// Names, or numbers of views.
    pub parts: Vec<(Part, Vec<String>)>,
    /// Nothing else has such a name.
    pub are_surely_lists: bool,
}

/// The part of each frame, by one source.
#[derive(Clone, Debug, Default)]
pub(super) struct Assignment {
    /// What it is, for people.
    pub rule: String,
    pub parts: Vec<Option<Part>>,
    /// Entries that mean no frame.
    pub unknown: Vec<String>,
    /// Frames that are listed to train and not to.
    pub twice: usize,
    /// How numbers were taken to count, where lists hold some.
    pub doubt: Option<&'static str>,
}

/// An entry of a list.
struct Entry<'a> {
    part: Part,
    stated: &'a str,
    path: String,
}

impl Lists {
    /// Whether there is a list of what trains.
    pub fn have_training(&self) -> bool {
        self.parts.iter().any(|(part, _)| *part == Part::Train)
    }

    /// How many entries they have.
    pub fn count(&self) -> usize {
        self.parts.iter().map(|(_, names)| names.len()).sum()
    }

    /// The same with entries taken apart: at commas and semicolons, and at spaces as well.
    pub fn pieces(&self) -> [Self; 2] {
        let at = |is_between: fn(char) -> bool| {
            let around = |c: char| c.is_whitespace() || "\"'[]()".contains(c);
            let pieces = |entry: &String| -> Vec<String> {
                let pieces = entry.split(is_between).map(|piece| piece.trim_matches(around));
                pieces.filter(|piece| !piece.is_empty()).map(str::to_owned).collect()
            };
            let parts =
                self.parts.iter().map(|(part, names)| (*part, names.iter().flat_map(pieces).collect()));
            Self { parts: parts.collect(), ..self.clone() }
        };
        [at(|c| ",;".contains(c)), at(|c| ",;".contains(c) || c.is_whitespace())]
    }

    /// The parts of these frames. Frames that are listed nowhere have none.
    pub fn assignment(&self, frames: &[Frame], are_in_file_order: bool) -> Assignment {
        let entry = |part, stated| Entry { part, stated, path: path_key(stated) };
        let entries: Vec<Entry> = self
            .parts
            .iter()
            .flat_map(|(part, names)| names.iter().map(move |name| entry(*part, name)))
            .collect();
        let by_name = by_name(&entries, frames);
        let are_named = 2 * by_name.iter().flatten().count() >= entries.len();
        let counted = if are_named { None } else { by_number(&entries, frames, are_in_file_order) };
        let (listed, doubt) = counted.unwrap_or((by_name, None));
        let mut is_known = vec![false; entries.len()];
        listed.iter().flatten().flatten().for_each(|&entry| is_known[entry] = true);
        let unknown = entries.iter().zip(is_known).filter(|(_, is_known)| !is_known);
        let unknown = unknown.map(|(entry, _)| entry.stated.to_owned()).collect();
        let mut twice = 0;
        let part = |listed: Option<Vec<usize>>| {
            let of = |part| listed.iter().flatten().any(|&entry| entries[entry].part == part);
            twice += usize::from(of(Part::Train) && (of(Part::Val) || of(Part::Test)));
            [Part::Test, Part::Val, Part::Train].into_iter().find(|part| of(*part))
        };
        let parts = listed.into_iter().map(part).collect();
        Assignment { rule: self.source.clone(), parts, unknown, twice, doubt }
    }
}

/// The entries of each frame: those of the longest end of its path that is listed, or else the only one that ends like it.
fn by_name(entries: &[Entry], frames: &[Frame]) -> Vec<Option<Vec<usize>>> {
    let mut whole: HashMap<&str, Vec<usize>> = HashMap::new();
    let mut ends: HashMap<&str, Vec<&str>> = HashMap::new();
    for (i, entry) in entries.iter().enumerate() {
        whole.entry(&entry.path).or_default().push(i);
        for end in ends_of(&entry.path).skip(1) {
            ends.entry(end).or_default().push(&entry.path);
        }
    }
    ends.values_mut().for_each(|paths| {
        paths.sort_unstable();
        paths.dedup();
    });
    let longer = |end: &str| match ends.get(end)?.as_slice() {
        [path] => whole.get(path),
        _ => None,
    };
    let entries_of = |frame: &Frame| {
        let path = path_key(&frame.file);
        let mut path_ends = ends_of(&path);
        let found = path_ends.find_map(|end| whole.get(end)).or_else(|| ends_of(&path).find_map(longer));
        found.cloned()
    };
    frames.iter().map(entries_of).collect()
}

/// The entries of each frame, where all are numbers of frames from 0 on; and how they are taken to count.
fn by_number(
    entries: &[Entry],
    frames: &[Frame],
    are_in_file_order: bool,
) -> Option<(Vec<Option<Vec<usize>>>, Option<&'static str>)> {
    let in_file: Vec<usize> = (0..frames.len()).collect();
    let mut by_name = in_file.clone();
    by_name.sort_by(|&a, &b| frames[a].file.cmp(&frames[b].file));
    let doubt = match are_in_file_order {
        _ if by_name == in_file => "",
        true => ", in the order of the file",
        false => ", sorted by name",
    };
    let order = if are_in_file_order { in_file } else { by_name };
    let mut listed = vec![None; frames.len()];
    for (i, entry) in entries.iter().enumerate() {
        let frame = *order.get(entry.stated.parse::<usize>().ok()?)?;
        listed[frame].get_or_insert_with(Vec::new).push(i);
    }
    Some((listed, Some(doubt)))
}

/// What all spellings of a path have in common, without the extension of a picture.
fn path_key(path: &str) -> String {
    let slashed = path.replace('\\', "/");
    let mut parts: Vec<&str> = slashed.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
    let name = parts.pop().map(stem_key).unwrap_or_default();
    parts.into_iter().map(key).chain([name]).collect::<Vec<_>>().join("/")
}

/// A path, and what is left of it without its first folder, and so on.
fn ends_of(path: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(path), |path| path.split_once('/').map(|(_, end)| end))
}
