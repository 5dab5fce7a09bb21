//! JSON with comments and commas behind the last entry, and typed access whose errors name file and key.

use crate::{DataError, limits, whole};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::io;
use std::path::Path;

/// Reads a JSON file. Comments, commas behind the last entry, and the literals NaN and ±Infinity (Python writes them)
/// are allowed; the literals are read as `null`, so that an error names their key when its number is needed.
///
/// Errors: it cannot be read, is larger than the [`limits`] allow, or is no JSON.
pub(crate) fn read(path: &Path) -> Result<Value, DataError> {
    let Plain { text, values, objects } = plain(&limits::read_text(path)?);
    limits::json(path, values, objects)?;
    parsed(path, &text)
}

/// The value that the text of a JSON file states, or what the file holds instead.
pub(crate) fn parsed<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, DataError> {
    serde_json::from_str(text).map_err(|source| match whole::something_else(text.as_bytes()) {
        Some(other) => DataError::Read { path: path.to_owned(), source: io::Error::other(other) },
        None => DataError::Json { path: path.to_owned(), source },
    })
}

/// The text of a JSON file without extensions, whatever number of values it has.
pub(crate) fn plain_text(path: &Path, bytes: u64) -> Result<String, DataError> {
    limits::read_text_up_to(path, bytes).map(|text| plain(&text).text)
}

/// JSON without extensions.
struct Plain {
    text: String,
    /// Values, if it is well formed; a few more, if it is not.
    values: usize,
    objects: usize,
}

/// The text with `//` and `/* */` comments and commas behind the last entry blanked, and non-finite literals turned into
/// `null`; line numbers are kept.
fn plain(text: &str) -> Plain {
    let (mut out, mut copied, mut at) = (String::with_capacity(text.len()), 0, 0);
    let (mut values, mut objects) = (1, 0);
    while let Some(&byte) = text.as_bytes().get(at) {
        let rest = &text[at..];
        at += match byte {
            b'"' => string_length(rest),
            b'/' | b'N' | b'-' | b'I' | b',' => match extension(rest) {
                Some((length, replacement)) => {
                    out.push_str(&text[copied..at]);
                    out.push_str(replacement);
                    out.extend(rest[..length].matches('\n'));
                    copied = at + length;
                    length
                }
                None => {
                    values += usize::from(byte == b',');
                    1
                }
            },
            byte => {
                values += usize::from(matches!(byte, b'[' | b'{'));
                objects += usize::from(byte == b'{');
                // To the next character: none but those of one byte matter here.
                (1..rest.len()).find(|&k| rest.is_char_boundary(k)).unwrap_or(rest.len())
            }
        };
    }
    out.push_str(&text[copied..]);
    Plain { text: out, values, objects }
}

/// Byte length of the comment, comma or literal that `rest` starts with, and what to write instead of it.
fn extension(rest: &str) -> Option<(usize, &'static str)> {
    if let Some(behind) = rest.strip_prefix(',') {
        return without_comments(behind).starts_with([']', '}']).then_some((1, " "));
    }
    if let Some(length) = comment_length(rest) {
        return Some((length, " "));
    }
    let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|word| rest.starts_with(word))?;
    Some((word.len(), "null"))
}

/// Byte length of the comment that `rest` starts with.
fn comment_length(rest: &str) -> Option<usize> {
    if rest.starts_with("//") {
        return Some(rest.find('\n').unwrap_or(rest.len()));
    }
    let comment = rest.strip_prefix("/*")?;
    Some(comment.find("*/").map_or(rest.len(), |end| end + 4))
}

/// The text behind white space and comments.
fn without_comments(text: &str) -> &str {
    let mut rest = text.trim_start();
    while let Some(length) = comment_length(rest) {
        rest = rest[length..].trim_start();
    }
    rest
}

/// Byte length of the string literal that `rest` starts with, quotes included.
fn string_length(rest: &str) -> usize {
    let mut escaped = false;
    for (i, b) in rest.bytes().enumerate().skip(1) {
        match b {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return i + 1,
            _ => {}
        }
    }
    rest.len()
}

/// One JSON object with the name of its place, for error messages. Keys may be looked up in an outer object too:
/// a frame overrides its file.
#[derive(Clone, Copy)]
pub(crate) struct Object<'a> {
    path: &'a Path,
    place: &'a str,
    map: &'a Map<String, Value>,
    outer: Option<&'a Object<'a>>,
}

impl<'a> Object<'a> {
    /// The object `value` of file `path` at `place` (empty for the top level).
    pub fn new(path: &'a Path, place: &'a str, value: &'a Value) -> Result<Self, DataError> {
        let map = value.as_object().ok_or_else(|| wrong(path, place.to_owned(), value, "an object {…}"))?;
        Ok(Self { path, place, map, outer: None })
    }

    /// The same object, falling back to `outer` for keys it lacks.
    pub fn within(self, outer: &'a Object<'a>) -> Self {
        Self { outer: Some(outer), ..self }
    }

    /// The same object without its outer one.
    pub fn alone(self) -> Self {
        Self { outer: None, ..self }
    }

    /// The file.
    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Keys and values, without those of an outer object.
    pub fn map(&self) -> &'a Map<String, Value> {
        self.map
    }

    /// Full name of a key for messages: `frames[3].fl_x`.
    pub fn key(&self, key: &str) -> String {
        if self.place.is_empty() { key.to_owned() } else { format!("{}.{key}", self.place) }
    }

    /// The value of `key` and the object that states it.
    fn find(&self, key: &str) -> Option<(&'a Value, &Object<'a>)> {
        match self.map.get(key) {
            Some(value) => Some((value, self)),
            None => self.outer?.find(key),
        }
    }

    /// The value, unless it is absent or `null`.
    pub fn get(&self, key: &str) -> Option<&'a Value> {
        self.find(key).map(|(value, _)| value).filter(|value| !value.is_null())
    }

    /// The error that `key` is not `expected`.
    pub fn wrong(&self, key: &str, expected: &'static str) -> DataError {
        let (value, place) = self.find(key).unwrap_or((&Value::Null, self));
        let found = self.find(key).is_some().then(|| shorten(value));
        let (path, key) = (self.path.to_owned(), place.key(key));
        DataError::Value { path, key, found: found.unwrap_or_else(|| "missing".into()), expected }
    }

    /// A finite number, where the key is present.
    pub fn number(&self, key: &str) -> Result<Option<f64>, DataError> {
        const EXPECTED: &str = "a finite number";
        let Some((value, _)) = self.find(key) else { return Ok(None) };
        value.as_f64().filter(|v| v.is_finite()).map(Some).ok_or_else(|| self.wrong(key, EXPECTED))
    }

    /// A text, where the key is present.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>, DataError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        value.as_str().map(Some).ok_or_else(|| self.wrong(key, "a text \"…\""))
    }

    /// A flag, where the key is present; numbers count as flags when not zero.
    pub fn flag(&self, key: &str) -> Result<bool, DataError> {
        let Some(value) = self.get(key) else { return Ok(false) };
        let flag = value.as_bool().or_else(|| value.as_f64().map(|v| v != 0.0));
        flag.ok_or_else(|| self.wrong(key, "true or false"))
    }

    /// A list of texts, where the key is present.
    pub fn texts(&self, key: &str) -> Result<Option<Vec<&'a str>>, DataError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let texts = value.as_array().and_then(|list| list.iter().map(Value::as_str).collect());
        texts.map(Some).ok_or_else(|| self.wrong(key, "a list of texts [\"…\"]"))
    }

    /// `N` finite numbers, where the key is present.
    pub fn numbers<const N: usize>(
        &self,
        key: &str,
        expected: &'static str,
    ) -> Result<Option<[f64; N]>, DataError> {
        let Some((value, _)) = self.find(key) else { return Ok(None) };
        row(value).map(Some).ok_or_else(|| self.wrong(key, expected))
    }

    /// The first `R` rows of a matrix with `C` columns, where the key is present.
    pub fn matrix<const R: usize, const C: usize>(
        &self,
        key: &str,
        expected: &'static str,
    ) -> Result<Option<[[f64; C]; R]>, DataError> {
        let Some((value, _)) = self.find(key) else { return Ok(None) };
        let rows = value.as_array().and_then(|rows| rows.get(..R));
        let rows: Option<Vec<[f64; C]>> = rows.and_then(|rows| rows.iter().map(row).collect());
        let matrix = rows.and_then(|rows| rows.try_into().ok());
        matrix.map(Some).ok_or_else(|| self.wrong(key, expected))
    }
}

/// Exactly `N` finite numbers.
pub(crate) fn row<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers = value.as_array()?.iter().map(|v| v.as_f64().filter(|v| v.is_finite()));
    numbers.collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// The error that the value of a key is not `expected`.
pub(crate) fn wrong(path: &Path, key: String, found: &Value, expected: &'static str) -> DataError {
    let key = if key.is_empty() { "the top level".to_owned() } else { key };
    DataError::Value { path: path.to_owned(), key, found: shorten(found), expected }
}

/// A value as text, at most 80 characters of it.
fn shorten(value: &Value) -> String {
    match value {
        Value::Null => "null (or NaN)".into(),
        Value::Object(_) => "an object".into(),
        _ => {
            let text = value.to_string();
            let short: String = text.chars().take(80).collect();
            if short.len() < text.len() { format!("{short}…") } else { short }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_blanked_but_not_inside_strings() {
        let text =
            "{ // a \"quote\"\n \"a//b\": \"/* kept \\\" */\", /* gone\n\n */ \"x\": NaN, \"y\": -Infinity }";
        let value: Value = serde_json::from_str(&plain(text).text).unwrap();
        assert_eq!(value["a//b"], "/* kept \" */");
        assert!(value["x"].is_null() && value["y"].is_null());
        assert_eq!(plain(text).text.matches('\n').count(), text.matches('\n').count(), "line numbers stay");
    }

    #[test]
    fn commas_behind_the_last_entry_are_blanked() {
        let text = "{\"a\": [1, 2,\n ],\t\"b, ]\": {\"c\": 3, // last ]\n /* } */},\n}";
        let Plain { text, values, .. } = plain(text);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value, serde_json::json!({"a": [1, 2], "b, ]": {"c": 3}}));
        assert_eq!((values, text.matches('\n').count()), (6, 3));
        assert!(serde_json::from_str::<Value>(&plain("[1,,]").text).is_err());
    }

    #[test]
    fn a_frame_overrides_its_file_and_errors_name_the_place() {
        let path = Path::new("t.json");
        let file = serde_json::json!({"fl_x": 1.0, "w": "wide"});
        let frame = serde_json::json!({"fl_x": 2.0});
        let outer = Object::new(path, "", &file).unwrap();
        let inner = Object::new(path, "frames[3]", &frame).unwrap().within(&outer);
        assert_eq!(inner.number("fl_x").unwrap(), Some(2.0));
        assert_eq!(inner.number("fl_y").unwrap(), None);
        let message = inner.number("w").unwrap_err().to_string();
        assert_eq!(message, "t.json: w is \"wide\"; expected a finite number");
    }

    #[test]
    fn a_file_of_too_many_values_is_refused_before_they_take_memory() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let refusal = |text: String| {
            std::fs::write(file.path(), text).unwrap();
            read(file.path()).unwrap_err().to_string()
        };
        let objects = refusal(format!("[{}{{}}]", "{},".repeat(300_000)));
        assert!(objects.contains("the number of objects {…} is 300001, the limit is 300000"), "{objects}");
        let numbers = refusal(format!("[{}1]", "1,".repeat(5_000_000)));
        assert!(numbers.contains("the number of values is 5000002, the limit is 5000000"), "{numbers}");
        let texts = plain(r#"["[,{", "\"{,", {"a": [1, 2]}]"#);
        assert_eq!((texts.values, texts.objects), (7, 1), "texts hold no values");
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_stripped_without_panic(text in ".{0,80}", bytes in proptest::collection::vec(0u8..255, 0..80)) {
            plain(&text);
            plain(&String::from_utf8_lossy(&bytes));
            plain(&format!("/*{text}"));
            plain(&format!("\"{text}\\"));
        }
    }
}
