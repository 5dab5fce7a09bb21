//! Words that mean a part of the split, in names of files and keys.

use crate::parsed::Part;

/// Words that stand beside them in the names of lists.
const OF_LISTS: [&str; 24] = [
    "list",
    "lists",
    "image",
    "images",
    "img",
    "imgs",
    "name",
    "names",
    "filename",
    "filenames",
    "file",
    "files",
    "id",
    "ids",
    "idx",
    "index",
    "indices",
    "view",
    "views",
    "frame",
    "frames",
    "cameras",
    "split",
    "splits",
];

/// The words of a name: its runs of letters, in lower case.
pub(super) fn words(name: &str) -> Vec<String> {
    let runs = name.split(|c: char| !c.is_alphabetic()).filter(|word| !word.is_empty());
    runs.map(str::to_lowercase).collect()
}

/// The part that a list of this name is of: `test`, `test_list`, `val_filenames`, `train_ids`.
pub(super) fn part_of_list(name: &str) -> Option<Part> {
    let words = words(name);
    let mut parts = words.iter().filter_map(|word| Part::named(word));
    let (part, other) = (parts.next()?, parts.next());
    let are_known = words.iter().all(|word| Part::named(word).is_some() || OF_LISTS.contains(&word.as_str()));
    Some(part).filter(|_| other.is_none() && are_known)
}

/// Whether a file of this name holds lists of several parts: `split`, `train_test_lists`, `data_splits`.
pub(super) fn is_of_lists(name: &str) -> bool {
    let words = words(name);
    let is_known = |word: &String| {
        Part::named(word).is_some()
            || OF_LISTS.contains(&word.as_str())
            || ["data", "dataset"].contains(&word.as_str())
    };
    let parts = words.iter().filter(|word| Part::named(word).is_some()).count();
    words.iter().all(is_known) && (parts > 1 || words.iter().any(|word| word.starts_with("split")))
}
