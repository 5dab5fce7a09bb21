//! Arrays for NumPy: an uncompressed `.npz` whose bytes depend on its contents only (no clock in the archive).
//!
//! Sources: NumPy's NPY format 1.0; PKWARE APPNOTE 6.3 (stored entries, dates fixed to 1980-01-01).

use refraxel_core::Aabb;

/// An array in C order: the last axis runs fastest.
pub(super) struct Array<'a> {
    pub name: &'a str,
    pub shape: &'a [usize],
    pub values: Values<'a>,
}

pub(super) enum Values<'a> {
    F32(&'a [f32]),
    F64(&'a [f64]),
}

fn npy(array: &Array) -> Vec<u8> {
    let kind = match array.values {
        Values::F32(_) => "<f4",
        Values::F64(_) => "<f8",
    };
    let shape: String = array.shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header =
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    // Magic, version and length take 10 bytes; data start at a multiple of 64.
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    match array.values {
        Values::F32(v) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
        Values::F64(v) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
    }
    bytes
}

/// The bytes of an `.npz` file. Each array must stay below 4 GiB.
pub(super) fn npz(arrays: &[Array]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for array in arrays {
        let (data, name) = (npy(array), format!("{}.npy", array.name));
        let start = out.len() as u32;
        let mut common = Vec::new();
        common.extend([20u16, 0, 0, 0, 0x21].iter().flat_map(|v| v.to_le_bytes()));
        common.extend(crc32fast::hash(&data).to_le_bytes());
        common.extend([data.len() as u32, data.len() as u32].iter().flat_map(|v| v.to_le_bytes()));
        common.extend((name.len() as u16).to_le_bytes());
        common.extend(0u16.to_le_bytes());
        out.extend(b"PK\x03\x04");
        out.extend(&common);
        out.extend(name.as_bytes());
        out.extend(&data);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend([0u8; 10]); // comment length, disk, attributes
        directory.extend(start.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, count) = (out.len() as u32, arrays.len() as u16);
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([count, count].iter().flat_map(|v| v.to_le_bytes()));
    out.extend([directory.len() as u32, start].iter().flat_map(|v| v.to_le_bytes()));
    out.extend(0u16.to_le_bytes());
    out
}

/// The bytes of an `index.npz`: `n[x, y, z]` in the cells of a box, and its corners.
pub(crate) fn npz_of_index(bounds: &Aabb<f64>, cells: [usize; 3], n: &[f32]) -> Vec<u8> {
    npz(&[
        Array { name: "n", shape: &cells, values: Values::F32(n) },
        Array { name: "min", shape: &[3], values: Values::F64(&bounds.min.to_array()) },
        Array { name: "max", shape: &[3], values: Values::F64(&bounds.max.to_array()) },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_independent_reader_finds_the_arrays() {
        let n: Vec<f32> = (0..24).map(|i| i as f32 * 0.5).collect();
        let bytes = npz(&[
            Array { name: "n", shape: &[2, 3, 4], values: Values::F32(&n) },
            Array { name: "min", shape: &[3], values: Values::F64(&[-1.0, -2.0, 0.25]) },
        ]);
        let mut archive = npyz::npz::NpzArchive::new(std::io::Cursor::new(bytes)).unwrap();
        let array = archive.by_name("n").unwrap().unwrap();
        assert_eq!(array.shape(), [2, 3, 4]);
        assert_eq!(array.into_vec::<f32>().unwrap(), n);
        let min = archive.by_name("min").unwrap().unwrap();
        assert_eq!(min.into_vec::<f64>().unwrap(), [-1.0, -2.0, 0.25]);
    }
}
