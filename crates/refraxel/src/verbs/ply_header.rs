//! Headers of PLY files.

use std::fmt::Display;
use std::io::{self, Write};

/// What a file has so many of, and the numbers that each has.
pub struct Element(String);

impl Element {
    /// Without properties yet.
    pub fn new(name: &str, count: usize) -> Self {
        Self(format!("element {name} {count}\n"))
    }

    /// The next properties, of one type.
    #[must_use]
    pub fn with(mut self, kind: &str, names: impl IntoIterator<Item = impl Display>) -> Self {
        names.into_iter().for_each(|name| self.0 += &format!("property {kind} {name}\n"));
        self
    }
}

/// The format of numbers in the byte order of nearly all machines.
pub const BINARY: &str = "binary_little_endian";

/// Writes a header: its format, comments, and elements in the order in which they follow.
pub fn write_header(
    format: &str,
    comments: &[String],
    elements: &[Element],
    out: &mut dyn Write,
) -> io::Result<()> {
    writeln!(out, "ply\nformat {format} 1.0")?;
    comments.iter().try_for_each(|comment| writeln!(out, "comment {comment}"))?;
    elements.iter().try_for_each(|element| out.write_all(element.0.as_bytes()))?;
    writeln!(out, "end_header")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_names_format_comments_and_elements_in_this_order() {
        let vertex = Element::new("vertex", 3).with("float", ["x", "y"]).with("uchar", ["red"]);
        let face = Element::new("face", 1).with("list uchar int", ["vertex_indices"]);
        let mut out = Vec::new();
        write_header(BINARY, &["glass".to_owned()], &[vertex, face], &mut out).unwrap();
        let expected = "ply\nformat binary_little_endian 1.0\ncomment glass\nelement vertex 3\n\
                        property float x\nproperty float y\nproperty uchar red\nelement face 1\n\
                        property list uchar int vertex_indices\nend_header\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }
}
