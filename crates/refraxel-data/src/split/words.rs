//! Words that mean a part of the split, in names of files and keys.

use crate::parsed::Part;
use serde_json::{Map, Value};

/// Words that stand beside them in the names of lists.
const OF_LISTS: [&str; 25] = [
    "i",
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
pub(crate) fn is_of_lists(name: &str) -> bool {
    let words = words(name);
    let is_known = |word: &String| {
        Part::named(word).is_some()
            || OF_LISTS.contains(&word.as_str())
            || ["data", "dataset"].contains(&word.as_str())
    };
    let parts = words.iter().filter(|word| Part::named(word).is_some()).count();
    words.iter().all(is_known) && (parts > 1 || words.iter().any(|word| word.starts_with("split")))
}

/// Keys whose value is the name of a part.
const OF_PARTS: [&str; 6] = ["split", "subset", "partition", "set", "phase", "fold"];

/// The part that the keys of a view state, and by which: `"split": "test"`, `"subset": "val"`, `"is_test": true`.
pub(crate) fn part_of_view(view: &Map<String, Value>) -> Option<(Part, &str)> {
    let by_name = |(key, value): (&String, &Value)| {
        let is_of_parts = OF_PARTS.contains(&key.to_lowercase().as_str());
        Part::named(value.as_str()?).filter(|_| is_of_parts)
    };
    let by_flag = |(key, value): (&String, &Value)| {
        let of = words(key)
            .iter()
            .filter(|word| *word != "is")
            .map(|word| Part::named(word))
            .collect::<Option<Vec<_>>>()?;
        let [part] = of[..] else { return None };
        let is = value.as_bool()?;
        let otherwise = if part == Part::Train { Part::Test } else { Part::Train };
        Some(if is { part } else { otherwise })
    };
    let named = |find: &dyn Fn((&String, &Value)) -> Option<Part>| {
        view.iter().find_map(|(key, value)| Some((find((key, value))?, key.as_str())))
    };
    named(&by_name).or_else(|| named(&by_flag))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn views_state_their_part_by_names_and_flags() {
        for (view, expected) in [
            (json!({"split": "test", "set": 3}), Some(Part::Test)),
            (json!({"subset": "Validation"}), Some(Part::Val)),
            (json!({"is_test": true}), Some(Part::Test)),
            (json!({"is_test": false}), Some(Part::Train)),
            (json!({"isTrain": true, "train": false}), Some(Part::Test)),
            (json!({"split": "left", "file_path": "test"}), None),
            (json!({"test": "yes", "set": 1, "is_bad": true}), None),
        ] {
            let part = part_of_view(view.as_object().unwrap()).map(|(part, _)| part);
            assert_eq!(part, expected, "{view}");
        }
    }

    #[test]
    fn names_of_lists_hold_a_part_and_words_of_lists() {
        for (name, part) in
            [("i_test", Some(Part::Test)), ("train_ids", Some(Part::Train)), ("i_like_test", None)]
        {
            assert_eq!(part_of_list(name), part, "{name}");
        }
    }
}
