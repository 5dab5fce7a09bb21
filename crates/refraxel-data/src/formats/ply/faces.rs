//! The faces of a PLY file.

use super::header::{Encoding, open};
use super::vertices::vertices;
use crate::DataError;
use crate::bytes::Bytes;
use refraxel_core::Vec3;
use std::path::Path;

/// One property of a face.
enum FaceProperty {
    /// A number of this size [byte].
    Scalar(usize),
    /// The number of the face's region, of this size [byte].
    Region(usize),
    /// A count and as many numbers.
    List {
        /// Size of the count [byte].
        count: usize,
        /// Size of each number [byte].
        number: usize,
        /// True where the numbers are the vertices of the face.
        is_corners: bool,
    },
}

/// The comment by which a file that this program wrote says that the faces of region 0 are not refractive.
pub const OPAQUE_REGION: &str = "region 0: opaque";

const EXPECTED: &str =
    "a PLY mesh: element vertex, then element face with a list vertex_indices of 3 or more corners each";
/// Corners of one face; more are a damaged count.
const MOST_CORNERS: u64 = 1000;

/// Vertices and triangles of a mesh; polygons become fans. Of a file that says so in a comment, region 0 is opaque and left out.
pub(crate) fn mesh(path: &Path, content: &[u8]) -> Result<(Vec<Vec3<f64>>, Vec<[u32; 3]>), DataError> {
    let (mut bytes, header, text) = open(path, content)?;
    let start = bytes;
    let points = vertices(&mut bytes, &header)?;
    let (count, properties) =
        faces_of(&text).ok_or_else(|| start.damaged("no list of faces".into(), EXPECTED))?;
    let mut numbers = match header.encoding {
        Encoding::Ascii => {
            let mut all = start;
            let all = all.take(start.left(), EXPECTED)?;
            let skipped = header.count as usize * header.properties.len();
            let words = String::from_utf8_lossy(all)
                .split_whitespace()
                .skip(skipped)
                .map(str::to_owned)
                .collect::<Vec<_>>();
            Numbers::Words(start, words.into_iter())
        }
        encoding => Numbers::Binary(bytes, encoding),
    };
    let mut triangles = Vec::new();
    let tells_opaque = text.lines().any(|l| l.trim().strip_prefix("comment ") == Some(OPAQUE_REGION));
    for _ in 0..count {
        let (before, mut is_opaque) = (triangles.len(), false);
        for property in &properties {
            let (length, size, is_corners) = match *property {
                FaceProperty::Region(size) => {
                    is_opaque = numbers.next(size)? == 0 && tells_opaque;
                    continue;
                }
                FaceProperty::Scalar(size) => (1, size, false),
                FaceProperty::List { count, number, is_corners } => {
                    (numbers.next(count)?, number, is_corners)
                }
            };
            if length > MOST_CORNERS || (is_corners && length < 3) {
                return Err(start.damaged(format!("a face of {length} corners"), EXPECTED));
            }
            let list: Vec<u32> =
                (0..length).map(|_| Ok(numbers.next(size)? as u32)).collect::<Result<_, DataError>>()?;
            if is_corners {
                triangles.extend(list[1..].windows(2).map(|w| [list[0], w[0], w[1]]));
            }
        }
        if is_opaque {
            triangles.truncate(before);
        }
    }
    Ok((points, triangles))
}

/// Count and properties of the element `face`, which must be the second.
fn faces_of(header: &str) -> Option<(u64, Vec<FaceProperty>)> {
    let mut lines = header.lines().map(str::trim).skip_while(|l| !l.starts_with("element vertex")).skip(1);
    let count =
        lines.find(|l| l.starts_with("element"))?.strip_prefix("element face ")?.trim().parse().ok()?;
    let properties = lines.filter(|l| !l.starts_with("comment")).take_while(|l| l.starts_with("property"));
    let properties: Vec<FaceProperty> = properties.map(property).collect::<Option<_>>()?;
    let is_corners = |p: &&FaceProperty| matches!(p, FaceProperty::List { is_corners: true, .. });
    (properties.iter().filter(is_corners).count() == 1).then_some((count, properties))
}

fn property(line: &str) -> Option<FaceProperty> {
    let size = |kind: &str| {
        Some(match kind {
            "char" | "uchar" | "int8" | "uint8" => 1,
            "short" | "ushort" | "int16" | "uint16" => 2,
            "int" | "uint" | "int32" | "uint32" | "float" | "float32" => 4,
            "double" | "float64" => 8,
            _ => return None,
        })
    };
    match *line.split_whitespace().collect::<Vec<_>>().as_slice() {
        [_, "list", count, kind, name] => Some(FaceProperty::List {
            count: size(count)?,
            number: size(kind)?,
            is_corners: ["vertex_indices", "vertex_index"].contains(&name),
        }),
        [_, kind @ ("int" | "uint" | "int32" | "uint32"), "region"] => {
            Some(FaceProperty::Region(size(kind)?))
        }
        [_, kind, _] => Some(FaceProperty::Scalar(size(kind)?)),
        _ => None,
    }
}

/// Whole numbers, one after the other. Floating-point ones are passed over; their value does not matter.
enum Numbers<'a> {
    Words(Bytes<'a>, std::vec::IntoIter<String>),
    Binary(Bytes<'a>, Encoding),
}

impl Numbers<'_> {
    fn next(&mut self, size: usize) -> Result<u64, DataError> {
        match self {
            Numbers::Words(start, words) => {
                let word =
                    words.next().ok_or_else(|| start.damaged("the end of the file".into(), EXPECTED))?;
                // As u64: −1 saturates to 0 corners or a vertex; a fraction is no index.
                let value = word.parse::<f64>().ok().filter(|v| *v >= 0.0 || size > 4);
                value.map(|v| v as u64).ok_or_else(|| start.damaged(format!("{word:?}"), EXPECTED))
            }
            Numbers::Binary(bytes, encoding) => {
                let raw = bytes.take(size, EXPECTED)?;
                let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
                Ok(if *encoding == Encoding::Big {
                    raw.iter().fold(0, fold)
                } else {
                    raw.iter().rev().fold(0, fold)
                })
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A tetrahedron with a colour per vertex and a flag per face.
    pub(crate) fn tetrahedron(encoding: &str) -> Vec<u8> {
        let points = [[0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0_u32, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mut file = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nelement face 4\nproperty uchar flags\nproperty list uchar uint vertex_indices\nend_header\n"
        )
        .into_bytes();
        let big = encoding.contains("big");
        for p in points {
            if encoding == "ascii" {
                file.extend(format!("{} {} {} 255\n", p[0], p[1], p[2]).bytes());
            } else {
                file.extend(p.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }));
                file.push(255);
            }
        }
        for f in faces {
            if encoding == "ascii" {
                file.extend(format!("7 3 {} {} {}\n", f[0], f[1], f[2]).bytes());
            } else {
                file.extend([7, 3]);
                file.extend(f.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }));
            }
        }
        file
    }

    const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

    #[test]
    fn all_three_encodings_give_the_same_mesh() {
        for encoding in ENCODINGS {
            let (points, triangles) = mesh(Path::new("m.ply"), &tetrahedron(encoding)).unwrap();
            assert_eq!((points.len(), points[3].z), (4, 1.0), "{encoding}");
            assert_eq!(triangles, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], "{encoding}");
        }
    }
}
