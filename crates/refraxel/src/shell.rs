//! Commands as a shell reads them, for people to copy.

use std::path::Path;

/// A word that a POSIX shell takes as it is: quoted where it has to be.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-+=./:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A path as such a word.
pub fn quoted_path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// That these programs are missing, and how to install them.
pub fn not_installed(names: &[&str]) -> String {
    let (is, it) = if names.len() == 1 { ("is", "it") } else { ("are", "them") };
    let packages = names.join(" ").to_ascii_lowercase();
    format!(
        "{} {is} not installed: not found on the PATH; install {it} and run the same command again\n  \
         apt-get install {packages}    (Debian, Ubuntu)\n  \
         brew install {packages}       (macOS)",
        names.join(" and ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_words_that_need_quotes_get_them() {
        assert_eq!(quoted("my_photos/0001.png"), "my_photos/0001.png");
        assert_eq!(quoted("my photos"), "'my photos'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
