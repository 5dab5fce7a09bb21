//! The vertices of a PLY file.

use super::header::{EXPECTED, Encoding, Header, Kind, open};
use crate::bytes::Bytes;
use crate::parsed::Sighting;
use crate::{DataError, limits};
use refraxel_core::Vec3;
use std::path::Path;

/// Positions of all finite vertices.
pub(crate) fn points(path: &Path, content: &[u8]) -> Result<Vec<Vec3<f64>>, DataError> {
    let (mut bytes, header, _) = open(path, content)?;
    let mut points = vertices(&mut bytes, &header)?;
    points.retain(|p| p.is_finite());
    Ok(points)
}

/// All finite vertices of a file, if they have colours of 8 bits; none otherwise.
pub(crate) fn coloured_points(path: &Path) -> Result<Vec<Sighting>, DataError> {
    let content = limits::read(path, limits::BINARY_BYTES)?;
    let (mut bytes, header, _) = open(path, &content)?;
    let columns = ["x", "y", "z", "red", "green", "blue"]
        .map(|name| header.properties.iter().position(|p| p.name == name));
    let [Some(x), Some(y), Some(z), Some(r), Some(g), Some(b)] = columns else { return Ok(Vec::new()) };
    if [r, g, b].iter().any(|&c| header.properties[c].size != 1) {
        return Ok(Vec::new());
    }
    let rows = rows(&mut bytes, &header, [x, y, z, r, g, b])?;
    let sighting = |[x, y, z, colour @ ..]: [f64; 6]| Sighting {
        position: Vec3::from([x, y, z]),
        colour: colour.map(|c| c as u8),
    };
    Ok(rows.into_iter().map(sighting).filter(|s| s.position.is_finite()).collect())
}

/// Positions of all vertices; of an ASCII file this takes all bytes that are left.
pub(super) fn vertices(bytes: &mut Bytes, header: &Header) -> Result<Vec<Vec3<f64>>, DataError> {
    let column = |axis: &str| header.properties.iter().position(|p| p.name == axis && p.kind == Kind::Float);
    let (Some(x), Some(y), Some(z)) = (column("x"), column("y"), column("z")) else {
        return Err(bytes.damaged("no x, y, z".into(), EXPECTED));
    };
    Ok(rows(bytes, header, [x, y, z])?.into_iter().map(Vec3::from).collect())
}

/// These columns of all vertices.
fn rows<const N: usize>(
    bytes: &mut Bytes,
    header: &Header,
    columns: [usize; N],
) -> Result<Vec<[f64; N]>, DataError> {
    match header.encoding {
        Encoding::Ascii => ascii(bytes, header, columns),
        _ => binary(bytes, header, columns),
    }
}

fn ascii<const N: usize>(
    bytes: &mut Bytes,
    header: &Header,
    columns: [usize; N],
) -> Result<Vec<[f64; N]>, DataError> {
    let width = header.properties.len();
    bytes.check_count(header.count, 2 * width, EXPECTED)?;
    let text = String::from_utf8_lossy(bytes.take(bytes.left(), EXPECTED)?).into_owned();
    let mut words = text.split_whitespace();
    let mut points = Vec::new();
    for i in 0..header.count {
        let row: Vec<f64> = words.by_ref().take(width).filter_map(|w| w.parse().ok()).collect();
        if row.len() < width {
            return Err(bytes.damaged(format!("{} numbers in vertex {i}", row.len()), EXPECTED));
        }
        points.push(columns.map(|c| row[c]));
    }
    Ok(points)
}

fn binary<const N: usize>(
    bytes: &mut Bytes,
    header: &Header,
    columns: [usize; N],
) -> Result<Vec<[f64; N]>, DataError> {
    let start = |c: usize| header.properties[..c].iter().map(|p| p.size).sum::<usize>();
    let places = columns.map(|c| start(c)..start(c) + header.properties[c].size);
    let stride = start(header.properties.len());
    bytes.check_count(header.count, stride, EXPECTED)?;
    let mut points = Vec::new();
    for _ in 0..header.count {
        let vertex = bytes.take(stride, EXPECTED)?;
        points.push(places.clone().map(|place| number(&vertex[place], header.encoding)));
    }
    Ok(points)
}

/// A float, or an integer of one byte.
fn number(raw: &[u8], encoding: Encoding) -> f64 {
    match (raw, encoding) {
        (&[byte], _) => f64::from(byte),
        (&[a, b, c, d], Encoding::Big) => f64::from(f32::from_be_bytes([a, b, c, d])),
        (&[a, b, c, d], _) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (&[a, b, c, d, e, f, g, h], Encoding::Big) => f64::from_be_bytes([a, b, c, d, e, f, g, h]),
        (&[a, b, c, d, e, f, g, h], _) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::NAN, // floats have 4 or 8 bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    const ASCII: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 2\nproperty float x\nproperty float y\n\
                         property float z\nproperty uchar red\nend_header\n1 2 3 255\n-4 5.5 6 0\n";

    fn binary_file(big: bool) -> Vec<u8> {
        let name = if big { "big" } else { "little" };
        let mut file = format!(
            "ply\nformat binary_{name}_endian 1.0\nelement vertex 2\nproperty uchar red\nproperty double x\n\
             property double y\nproperty double z\nend_header\n"
        )
        .into_bytes();
        for row in [[1.0, 2.0, 3.0], [-4.0, 5.5, 6.0]] {
            file.push(7);
            file.extend(row.iter().flat_map(|v: &f64| if big { v.to_be_bytes() } else { v.to_le_bytes() }));
        }
        file
    }

    #[test]
    fn all_three_encodings_give_the_same_points() {
        let expected = vec![vec3(1.0, 2.0, 3.0), vec3(-4.0, 5.5, 6.0)];
        for file in [ASCII.as_bytes().to_vec(), binary_file(false), binary_file(true)] {
            assert_eq!(points(Path::new("p.ply"), &file).unwrap(), expected);
        }
    }
}
