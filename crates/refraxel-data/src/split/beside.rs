//! Files beside a description that hold lists of views.

use super::lists::Lists;
use super::words::{is_of_lists, part_of_list, part_of_view};
use crate::folder::{folder_in, names};
use crate::naming::extension;
use crate::parsed::Part;
use crate::root::Root;
use crate::{Problem, json, limits};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The lists in a dataset's folder, in its folder `splits` and in those of its COLMAP models: `{train,val,test}_list.txt`,
/// `test.txt`, `split.json`, others named so, and tables with a column `split`. What cannot be read is a warning.
pub(super) fn lists(root: &Root, problems: &mut Vec<Problem>) -> Vec<Lists> {
    let sparse = |folder: &Path| folder_in(folder, "sparse");
    let colmap = folder_in(root.folder(), "colmap");
    let models = [sparse(root.folder()), colmap.as_deref().and_then(sparse)];
    let inner = models.iter().flatten().flat_map(|model| [model.join("0"), model.clone()]);
    let own = ["splits", "split"].into_iter().filter_map(|name| folder_in(root.folder(), name));
    let folders = std::iter::once(root.folder().to_owned()).chain(own).chain(inner).chain(colmap.clone());
    let mut found = Vec::new();
    for folder in folders {
        let mut files = names(&folder).unwrap_or_default();
        problems.extend(files.iter().filter(|name| is_unread_list(name)).map(|name| {
            ignored(&format!("{}: lists are read as .txt, .json, .tsv or .csv", folder.join(name).display()))
        }));
        files.retain(|name| ["txt", "json", "tsv", "csv"].contains(&extension(name).as_str()));
        let files = files.iter().map(|name| folder.join(name));
        let files: Vec<PathBuf> = files.filter(|file| file.is_file() && root.contains(file)).collect();
        found.extend(of_text(root, &files, problems));
        found.extend(files.iter().filter_map(|file| of_pairs(root, file)));
        found.extend(files.iter().filter_map(|file| of_json(root, file, problems)));
        found.extend(files.iter().filter_map(|file| of_table(root, file)));
    }
    // What is surely meant so comes first; the order of the folders is kept.
    found.sort_by_key(|lists| !lists.are_surely_lists);
    found
}

/// One image name per line, one file per part; files of one folder that differ by the part alone belong together.
fn of_text(root: &Root, files: &[PathBuf], problems: &mut Vec<Problem>) -> Vec<Lists> {
    let mut families: BTreeMap<String, Lists> = BTreeMap::new();
    for file in files {
        let Some(part) = stem_with(file, "txt").and_then(part_of_list) else { continue };
        let text = match limits::read_text(file) {
            Ok(text) => text,
            Err(error) => {
                problems.push(ignored(&error.to_string()));
                continue;
            }
        };
        let is_around = |c: char| c.is_whitespace() || ['"', '\'', ','].contains(&c);
        let lines = text.lines().map(|line| line.trim_matches(is_around));
        let names = lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned);
        let stem = stem_with(file, "txt").unwrap_or_default().to_lowercase();
        let family = families.entry(stem.replace(word_of(&stem, part), "")).or_default();
        let are_more = !family.source.is_empty();
        family.source += if are_more { ", " } else { "" };
        family.source += &shown(root, file);
        family.are_surely_lists = stem.contains("list");
        family.parts.push((part, names.collect()));
    }
    let (empty, found): (Vec<Lists>, Vec<Lists>) =
        families.into_values().partition(|lists| lists.parts.iter().all(|(_, names)| names.is_empty()));
    problems.extend(empty.iter().map(|lists| ignored(&format!("{} names no views", lists.source))));
    found
}

/// Lines of a name and its part, as in `train_test_split.txt`.
fn of_pairs(root: &Root, file: &Path) -> Option<Lists> {
    stem_with(file, "txt").filter(|stem| part_of_list(stem).is_none() && is_of_lists(stem))?;
    let text = limits::read_text(file).ok()?;
    let pair = |line: &str| {
        let (name, part) = line.trim().rsplit_once([' ', '\t', ',', ';', ':'])?;
        Some((Part::named(part)?, vec![name.trim_end_matches([' ', '\t', ',', ';', ':']).to_owned()]))
    };
    let parts: Vec<_> = text.lines().filter_map(pair).collect();
    (!parts.is_empty()).then(|| Lists { source: shown(root, file), parts, are_surely_lists: false })
}

/// Whether a file is named as a list of views and has a format that is not read.
fn is_unread_list(name: &str) -> bool {
    let Some((stem, extension)) = name.rsplit_once('.') else { return false };
    let is_unread = ["yaml", "yml", "toml", "npy", "npz", "pkl"].contains(&extension.to_lowercase().as_str());
    is_unread && (part_of_list(stem).is_some() || is_of_lists(stem))
}

/// The word of a name that means this part.
fn word_of(stem: &str, part: Part) -> &str {
    let mut words = stem.split(|c: char| !c.is_alphabetic());
    words.find(|word| Part::named(word) == Some(part)).unwrap_or_default()
}

/// `{"train": ["a.png"], "test": ["b.png"]}`, `{"a.png": "train"}`, `[{"file": "a.png", "split": "train"}]`, or the list of one part.
fn of_json(root: &Root, file: &Path, problems: &mut Vec<Problem>) -> Option<Lists> {
    let stem = stem_with(file, "json")?;
    let part = part_of_list(stem);
    if part.is_none() && !is_of_lists(stem) {
        return None;
    }
    let value = match json::read(file) {
        Ok(value) => value,
        Err(error) => {
            problems.push(ignored(&error.to_string()));
            return None;
        }
    };
    let parts = match (&value, part) {
        (Value::Array(list), Some(part)) => {
            entries(list).map(|names| vec![(part, names)]).unwrap_or_default()
        }
        (Value::Array(views), None) => views.iter().filter_map(part_of_record).collect(),
        (Value::Object(map), _) => parts_of(map),
        _ => Vec::new(),
    };
    if parts.is_empty() {
        problems.push(ignored(&format!("{}: it holds no lists of views", file.display())));
        return None;
    }
    Some(Lists { source: shown(root, file), parts, are_surely_lists: false })
}

/// Keys and columns that hold the name of an image.
const OF_NAMES: [&str; 6] = ["filename", "file", "image", "name", "file_path", "file_name"];

/// The part and the name of one view: `{"file": "a.png", "split": "train"}`.
fn part_of_record(view: &Value) -> Option<(Part, Vec<String>)> {
    let map = view.as_object()?;
    let name = map.iter().find(|(key, _)| OF_NAMES.contains(&key.to_lowercase().as_str()))?.1;
    Some((part_of_view(map)?.0, vec![name.as_str()?.to_owned()]))
}

/// Lists by part, or parts by name, as far as an object holds some.
pub(crate) fn parts_of(map: &Map<String, Value>) -> Vec<(Part, Vec<String>)> {
    let lists = lists_of(map);
    let named =
        map.iter().filter_map(|(name, part)| Some((Part::named(part.as_str()?)?, vec![name.clone()])));
    let within = || map.values().filter_map(Value::as_object).filter(|_| map.len() == 1).flat_map(parts_of);
    match lists.is_empty() {
        false => lists,
        true => named.chain(within()).collect(),
    }
}

/// The lists of names or numbers among the values of an object whose keys name a part of the split.
pub(crate) fn lists_of<'a>(
    map: impl IntoIterator<Item = (&'a String, &'a Value)>,
) -> Vec<(Part, Vec<String>)> {
    let list = |(key, value): (&String, &Value)| {
        let entries = entries(value.as_array()?).filter(|entries| !entries.is_empty())?;
        Some((part_of_list(key)?, entries))
    };
    map.into_iter().filter_map(list).collect()
}

/// A table with columns for names and parts, as Photo Tourism has one: `filename`, `id`, `split`, `dataset`.
fn of_table(root: &Root, file: &Path) -> Option<Lists> {
    let separator = stem_with(file, "tsv").map(|_| '\t').or_else(|| stem_with(file, "csv").map(|_| ','))?;
    let text = limits::read_text(file).ok()?;
    let mut rows = text.lines().map(|line| line.split(separator).map(str::trim).collect::<Vec<_>>());
    let head: Vec<String> = rows.next()?.iter().map(|name| name.to_lowercase()).collect();
    let column = |names: &[&str]| head.iter().position(|name| names.contains(&name.as_str()));
    let (name, part) = (column(&OF_NAMES)?, column(&["split"])?);
    let entry = |row: Vec<&str>| {
        let name = row.get(name).filter(|name| !name.is_empty())?.to_string();
        Some((Part::named(row.get(part)?)?, vec![name]))
    };
    let parts: Vec<_> = rows.filter_map(entry).collect();
    (!parts.is_empty()).then(|| Lists { source: shown(root, file), parts, are_surely_lists: false })
}

/// Names, or numbers as text.
fn entries(list: &[Value]) -> Option<Vec<String>> {
    let entry = |value: &Value| match value {
        Value::String(name) => Some(name.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    list.iter().map(entry).collect()
}

/// The name of a file with this extension, without it.
fn stem_with<'a>(file: &'a Path, wanted: &str) -> Option<&'a str> {
    let is_one = file.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    file.file_stem().filter(|_| is_one)?.to_str()
}

fn shown(root: &Root, file: &Path) -> String {
    file.strip_prefix(root.folder()).unwrap_or(file).display().to_string()
}

fn ignored(what: &str) -> Problem {
    Problem::warning(format!("a list of the split is not used: {what}"))
}
