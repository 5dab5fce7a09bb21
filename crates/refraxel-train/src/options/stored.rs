//! Options as trees of tables: TOML files, and the headers of checkpoints.

use super::OptionError;
use super::gone::GONE;
use super::sections::Options;
use serde_json::{Map, Value};

/// A name and the text of its value.
struct Entry {
    key: String,
    text: String,
}

impl Options {
    /// Changes the options that a tree names: tables of sections (`{"surface": {"blur": 1.5}}`), or full names.
    pub fn set_tree(&mut self, tree: &Value) -> Result<(), OptionError> {
        self.set_entries(entries(tree)?)
    }

    fn set_entries(&mut self, entries: Vec<Entry>) -> Result<(), OptionError> {
        entries.into_iter().try_for_each(|Entry { key, text }| self.set(&key, &text))
    }
}

/// The options of a stored run. What it does not mention has its default; what is gone must have had the value that is a constant now.
impl TryFrom<Value> for Options {
    type Error = OptionError;

    fn try_from(tree: Value) -> Result<Self, OptionError> {
        let mut entries = entries(&tree)?;
        entries.retain(|entry| !is_idle(entry));
        let mut options = Self::default();
        options.set_entries(entries)?;
        Ok(options)
    }
}

/// An option that is gone, with a value that is a constant now, or that says nothing of a run that has begun.
fn is_idle(entry: &Entry) -> bool {
    // A stored f32 has more digits than the text that said it.
    let number = |text: &str| text.parse::<f32>().ok();
    let is_same =
        |was: &&str| *was == entry.text || number(was).is_some_and(|was| number(&entry.text) == Some(was));
    GONE.iter().any(|gone| gone.name == entry.key && (gone.was.is_empty() || gone.was.iter().any(is_same)))
}

fn entries(tree: &Value) -> Result<Vec<Entry>, OptionError> {
    let table = tree.as_object().ok_or_else(|| OptionError::NoTable { found: text(tree) })?;
    let mut found = Vec::new();
    collect(table, "", &mut found);
    Ok(found)
}

/// Appends the entries of a table whose keys begin with `prefix`.
fn collect(table: &Map<String, Value>, prefix: &str, found: &mut Vec<Entry>) {
    for (key, value) in table {
        let key = format!("{prefix}{key}");
        match value {
            Value::Object(table) => collect(table, &format!("{key}."), found),
            other => found.push(Entry { key, text: text(other) }),
        }
    }
}

/// As `--set` would say it: words without quotes, the numbers of a list separated by commas.
fn text(value: &Value) -> String {
    match value {
        Value::String(word) => word.clone(),
        Value::Array(values) => values.iter().map(text).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}
