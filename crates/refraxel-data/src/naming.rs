//! Names of files as different systems write them: which of them mean one file.

use crate::extensions::{self, conversion, is_picture};
use unicode_normalization::UnicodeNormalization;

/// What systems put into folders for themselves, beside names that begin with a dot (`._a.png`, `.DS_Store`).
const OF_SYSTEMS: [&str; 7] =
    ["thumbs.db", "ehthumbs.db", "desktop.ini", "__macosx", "@eadir", "#recycle", "lost+found"];

/// How the name of a file differs from the name that was stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Difference {
    Case,
    /// An accent is a character of its own, as macOS writes them, or part of a letter.
    Unicode,
    /// `%20` and the like.
    UrlEncoding,
    Extension,
    Folder,
}

impl Difference {
    /// In what the names differ, for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Case => "upper and lower case",
            Self::Unicode => "the Unicode form of accents",
            Self::UrlEncoding => "URL encoding",
            Self::Extension => "the extension",
            Self::Folder => "the folders before it",
        }
    }
}

/// True for what a system puts into folders for itself.
pub(crate) fn is_of_system(name: &str) -> bool {
    name.starts_with('.') || OF_SYSTEMS.contains(&name.to_ascii_lowercase().as_str())
}

/// The part of a name behind its last dot, in lower case; empty without one.
pub(crate) fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or("", |(_, extension)| extension).to_ascii_lowercase()
}

/// The place of an extension among those that are tried.
pub(crate) fn rank(name: &str) -> usize {
    extensions::READ.iter().position(|e| *e == extension(name)).unwrap_or(extensions::READ.len())
}

/// Names that a message lists.
const LISTED: usize = 3;

/// The first few of some names, for messages.
pub(crate) fn first_few<'a>(mut names: impl Iterator<Item = &'a str>) -> String {
    let first: Vec<&str> = names.by_ref().take(LISTED).collect();
    first.join(", ") + if names.next().is_some() { ", …" } else { "" }
}

/// "a.png, b.png and 57 more": at most `most` of some names.
pub fn listed(names: &[impl AsRef<str>], most: usize) -> String {
    let named = names.iter().take(most).map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(most) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// What all spellings of a name have in common.
pub(crate) fn key(name: &str) -> String {
    url_decoded(name.trim()).chars().flat_map(char::to_lowercase).nfc().collect()
}

/// The same without extensions of pictures, of which there may be several (`a.png.png`).
pub(crate) fn stem_key(name: &str) -> String {
    key(picture_stem(name))
}

/// A name without its extensions of a picture; other extensions stay.
pub(crate) fn picture_stem(name: &str) -> &str {
    let mut stem = name;
    while let Some((shorter, _)) = stem.rsplit_once('.')
        && (is_picture(stem) || conversion(stem).is_some())
        && !shorter.is_empty()
    {
        stem = shorter;
    }
    stem
}

/// How the name that was found differs from the name that was stated; `None` where it is the same, or one that was to be
/// completed by an extension.
pub(crate) fn difference(stated: &str, found: &str) -> Option<Difference> {
    let is_open = picture_stem(stated) == stated;
    let found = if is_open && is_picture(found) { picture_stem(found) } else { found };
    if stated == found {
        None
    } else if key(stated) != key(found) {
        Some(Difference::Extension)
    } else if stated.to_lowercase() == found.to_lowercase() {
        Some(Difference::Case)
    } else if stated.nfc().eq(found.nfc()) {
        Some(Difference::Unicode)
    } else {
        Some(Difference::UrlEncoding)
    }
}

/// `%20` as a space, and so on; as it is, where that is no text.
fn url_decoded(name: &str) -> String {
    let (mut bytes, mut rest) = (Vec::with_capacity(name.len()), name.as_bytes());
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        let coded = digits.filter(|d| *first == b'%' && d.bytes().all(|b| b.is_ascii_hexdigit()));
        let byte = coded.and_then(|d| u8::from_str_radix(d, 16).ok());
        bytes.push(byte.unwrap_or(*first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_counted() {
        let all: Vec<String> = (0..60).map(|k| format!("{k:04}.png")).collect();
        assert_eq!(listed(&all, 3), "0000.png, 0001.png, 0002.png and 57 more");
        assert_eq!(listed(&all[..2], 3), "0000.png, 0001.png");
    }

    #[test]
    fn spellings_of_one_name_have_one_key_and_other_names_another() {
        for (stated, found, difference_) in [
            ("v00.png", "V00.PNG", Difference::Case),
            ("caf\u{e9}.png", "cafe\u{301}.png", Difference::Unicode),
            ("a%20b.png", "a b.png", Difference::UrlEncoding),
            ("caf%C3%A9.png", "Cafe\u{301}.png", Difference::UrlEncoding),
        ] {
            assert_eq!(key(stated), key(found));
            assert_eq!(difference(stated, found), Some(difference_), "{stated} {found}");
        }
        for (a, b) in [("a1.png", "a01.png"), ("cafe.png", "caf\u{e9}.png"), ("100%.png", "100.png")] {
            assert_ne!(key(a), key(b));
        }
        assert_eq!(difference("v00.jpg", "v00.png"), Some(Difference::Extension));
        assert_eq!(difference("v00.png", "v00.png.png"), Some(Difference::Extension));
        assert_eq!(difference("v00", "v00.png"), None, "an extension was to be added");
        assert_eq!(difference("V00", "v00.png"), Some(Difference::Case));
    }

    #[test]
    fn only_extensions_of_pictures_are_taken_off() {
        for (name, stem) in
            [("a.png.png", "a"), ("x.5.JPG", "x.5"), ("x.5", "x.5"), ("b.heic", "b"), (".png", ".png")]
        {
            assert_eq!(picture_stem(name), stem);
        }
    }

    #[test]
    fn what_systems_leave_in_folders_is_known() {
        for name in ["._v00.png", ".DS_Store", "Thumbs.db", "__MACOSX", "@eaDir"] {
            assert!(is_of_system(name), "{name}");
        }
        assert!(!is_of_system("_v00.png") && !is_of_system("v00.png"));
    }

    proptest::proptest! {
        #[test]
        fn any_name_has_a_key(name in ".{0,40}", bytes in "[%0-9a-f]{0,12}") {
            key(&name);
            stem_key(&name);
            difference(&name, &bytes);
            url_decoded(&bytes);
        }
    }
}
