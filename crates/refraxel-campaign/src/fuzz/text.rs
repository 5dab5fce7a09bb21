//! Changes of texts: JSON, TOML, OBJ, ASCII PLY, COLMAP's text files and command lines.

use super::Change;
use std::ops::Range;

/// What takes the place of a number, a string or a word.
const WORDS: [&str; 32] = [
    "NaN",
    "inf",
    "1e400",
    "-1e400",
    "1e300",
    "1e38",
    "1e30",
    "1e9",
    "1e8",
    "1e-30",
    "1e-308",
    "-0.0",
    "0",
    "-1",
    "1",
    "2",
    "3",
    "7",
    "0.5",
    "4294967296",
    "2147483647",
    "99999999999999999999",
    "\"\"",
    "null",
    "true",
    "[]",
    "{}",
    "\"../../x\"",
    "\"\\u0000\"",
    "[[[[[[[[]]]]]]]]",
    "#",
    "",
];

/// Changes a text in one place.
pub fn change(text: &mut Vec<u8>, change: &Change) {
    let spans = if change.kind % 8 < 4 { tokens(text) } else { lines(text) };
    let Some(k) = change.at.checked_rem(spans.len() as u64) else { return };
    let span = spans[k as usize].clone();
    let value = change.value as usize;
    match change.kind % 8 {
        0..3 => drop(text.splice(span, WORDS[value % WORDS.len()].bytes())),
        3 => {
            // The value of another place: right in type, wrong in place.
            let other = text[spans[value % spans.len()].clone()].to_vec();
            text.splice(span, other);
        }
        4 => drop(text.drain(span)),
        _ => {
            let line = text[span.clone()].to_vec();
            let to = spans[value % spans.len()].start;
            text.splice(to..to, line);
        }
    }
}

/// Numbers, strings and words.
fn tokens(text: &[u8]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let start = at;
        let is_part = |b: u8| b.is_ascii_alphanumeric() || b"+-._".contains(&b);
        if text[at] == b'"' {
            at += 1;
            while at < text.len() && text[at] != b'"' && text[at] != b'\n' {
                at += 1 + usize::from(text[at] == b'\\');
            }
            at = (at + 1).min(text.len());
        } else {
            while at < text.len() && is_part(text[at]) {
                at += 1;
            }
        }
        if at == start {
            at += 1;
        } else {
            found.push(start..at);
        }
    }
    found
}

/// Lines with their ends.
fn lines(text: &[u8]) -> Vec<Range<usize>> {
    let mut start = 0;
    let spans = text.split_inclusive(|&b| b == b'\n').map(|line| {
        start += line.len();
        start - line.len()..start
    });
    spans.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_takes_the_place_of_one_value_and_the_rest_stays() {
        let mut text = br#"{"w": -1.5e3, "h": [true]}"#.to_vec();
        let words: Vec<_> = tokens(&text).iter().map(|t| String::from_utf8_lossy(&text[t.clone()])).collect();
        assert_eq!(words, ["\"w\"", "-1.5e3", "\"h\"", "true"]);
        change(&mut text, &Change { kind: 0, at: 1, value: 0 });
        assert_eq!(text, br#"{"w": NaN, "h": [true]}"#);
    }

    #[test]
    fn an_open_string_ends_with_its_line_or_the_text() {
        assert_eq!(tokens(b"\"ab"), vec![0..3]);
        assert_eq!(tokens(b"\"a\\"), vec![0..3]);
    }
}
