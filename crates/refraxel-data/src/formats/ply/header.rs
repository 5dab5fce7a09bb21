//! The header of a PLY file: how numbers are written, and what a vertex has.

use crate::DataError;
use crate::bytes::Bytes;
use std::path::Path;

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The vertex element, which must come first.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// A number of a vertex.
pub(super) struct Property {
    /// Size [byte].
    pub(super) size: usize,
    pub(super) kind: Kind,
    pub(super) name: String,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Integer,
    Float,
}

pub(super) const EXPECTED: &str =
    "a PLY file whose first element is vertex, with float x, y, z and no list properties";

/// The bytes behind the header, what it says about vertices, and all of its text.
pub(super) fn open<'a>(path: &'a Path, content: &'a [u8]) -> Result<(Bytes<'a>, Header, String), DataError> {
    const END: &[u8] = b"end_header\n";
    const HEADER_BYTES: usize = 64 << 10;
    let mut bytes = Bytes::new(path, content);
    let end = content.windows(END.len()).take(HEADER_BYTES).position(|w| w == END).map(|at| at + END.len());
    let end = end.ok_or_else(|| bytes.damaged("no end_header".into(), EXPECTED))?;
    let text = String::from_utf8_lossy(bytes.take(end, EXPECTED)?).into_owned();
    let header = header(&text).ok_or_else(|| bytes.damaged(text.chars().take(80).collect(), EXPECTED))?;
    Ok((bytes, header, text))
}

fn header(text: &str) -> Option<Header> {
    let mut lines =
        text.lines().map(str::trim).filter(|l| !l.starts_with("comment") && !l.starts_with("obj_info"));
    if lines.next()? != "ply" {
        return None;
    }
    let encoding = match lines.next()? {
        "format ascii 1.0" => Encoding::Ascii,
        "format binary_little_endian 1.0" => Encoding::Little,
        "format binary_big_endian 1.0" => Encoding::Big,
        _ => return None,
    };
    let count = lines.next()?.strip_prefix("element vertex ")?.trim().parse().ok()?;
    let properties =
        lines.take_while(|line| line.starts_with("property")).map(property).collect::<Option<_>>()?;
    Some(Header { encoding, count, properties })
}

/// The property of a line `property TYPE NAME`.
fn property(line: &str) -> Option<Property> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let &[_, kind, name] = words.as_slice() else { return None };
    let (size, kind) = match kind {
        "char" | "uchar" | "int8" | "uint8" => (1, Kind::Integer),
        "short" | "ushort" | "int16" | "uint16" => (2, Kind::Integer),
        "int" | "uint" | "int32" | "uint32" => (4, Kind::Integer),
        "float" | "float32" => (4, Kind::Float),
        "double" | "float64" => (8, Kind::Float),
        _ => return None,
    };
    Some(Property { size, kind, name: name.to_owned() })
}
