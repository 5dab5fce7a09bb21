//! NumPy `.npy` arrays of floating-point numbers, as LLFF and index volumes need them.
//!
//! A reader of its own because shapes come from files: the product of a hostile shape must not overflow.

use crate::bytes::Bytes;
use crate::{DataError, limits};
use std::path::Path;

/// A matrix, rows from the top, columns fastest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    pub values: Vec<f64>,
}

/// An array in C order: the last axis runs fastest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
}

const EXPECTED: &str = "a NumPy array of version 1 to 3";

/// Reads an array of one or two dimensions; a vector is a single row.
pub(crate) fn read(path: &Path) -> Result<Matrix, DataError> {
    parse(path, &limits::read(path, limits::JSON_BYTES)?)
}

pub(crate) fn parse(path: &Path, content: &[u8]) -> Result<Matrix, DataError> {
    let Array { shape, values } = array(path, content)?;
    let (rows, columns) = match shape[..] {
        [n] => (1, n),
        [n, m] => (n, m),
        _ => {
            return Err(DataError::Value {
                path: path.to_owned(),
                key: "the 'shape'".into(),
                found: format!("{shape:?}"),
                expected: "one or two dimensions",
            });
        }
    };
    Ok(Matrix { rows, columns, values })
}

/// An array of any number of dimensions.
pub(crate) fn array(path: &Path, content: &[u8]) -> Result<Array, DataError> {
    let mut bytes = Bytes::new(path, content);
    let magic = bytes.take(8, EXPECTED)?;
    if &magic[..6] != b"\x93NUMPY" {
        return Err(bytes.damaged("another file type".into(), EXPECTED));
    }
    let length = match magic[6] {
        1 => bytes.take(2, EXPECTED)?.iter().rev().fold(0, |n, b| n << 8 | usize::from(*b)),
        _ => bytes.u32(EXPECTED)? as usize,
    };
    let header = String::from_utf8_lossy(bytes.take(length, EXPECTED)?).into_owned();
    let fault = |expected| DataError::Value {
        path: path.to_owned(),
        key: "the NumPy header".into(),
        found: header.chars().take(100).collect(),
        expected,
    };
    let size = match quoted(&header, "descr") {
        Some("<f8") => 8,
        Some("<f4") => 4,
        _ => return Err(fault("'descr': '<f8' or '<f4'")),
    };
    let order = after(&header, "fortran_order").unwrap_or_default();
    let is_first_fastest = order.starts_with("True");
    if !is_first_fastest && !order.starts_with("False") {
        return Err(fault("'fortran_order': False or True"));
    }
    let shape = shape(&header).ok_or_else(|| fault("a 'shape'"))?;
    let count = shape.iter().try_fold(1_usize, |n, &m| n.checked_mul(m));
    let count = count.ok_or_else(|| fault("a 'shape' that fits the file"))?;
    bytes.check_count(count as u64, size, "as many numbers as the shape says")?;
    let data = bytes.take(count * size, EXPECTED)?;
    let number = |chunk: &[u8]| match *chunk {
        [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
        [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::NAN, // chunks have 4 or 8 bytes
    };
    let values: Vec<f64> = data.chunks_exact(size).map(number).collect();
    let values = if is_first_fastest { with_last_fastest(&shape, &values) } else { values };
    Ok(Array { shape, values })
}

/// The values of an array whose first axis runs fastest, as those of transposed arrays do, in C order.
fn with_last_fastest(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let at = |k: usize| {
        // From the last axis on: the index along it, and how far apart its elements lie.
        let (mut rest, mut stride, mut at) = (k, values.len(), 0);
        for n in shape.iter().rev() {
            stride /= n;
            at += rest % n * stride;
            rest /= n;
        }
        values[at]
    };
    (0..values.len()).map(at).collect()
}

/// The text behind `'key':`.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}'"))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

fn quoted<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    after(header, key)?.strip_prefix('\'')?.split('\'').next()
}

/// The sizes in `(n,)` or `(n, m)`.
fn shape(header: &str) -> Option<Vec<usize>> {
    let inner = after(header, "shape")?.strip_prefix('(')?.split(')').next()?;
    let sizes = inner.split(',').map(str::trim).filter(|s| !s.is_empty());
    sizes.map(|s| s.parse().ok()).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A `.npy` file as NumPy writes it.
    pub(crate) fn npy(shape: &str, values: &[f64]) -> Vec<u8> {
        let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.bytes());
        file.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        file
    }

    #[test]
    fn a_matrix_is_read_row_by_row() {
        let file = npy("(2, 3)", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let matrix = parse(Path::new("a.npy"), &file).unwrap();
        assert_eq!((matrix.rows, matrix.columns, matrix.values[3]), (2, 3, 4.0));
    }

    #[test]
    fn an_array_whose_first_axis_runs_fastest_is_the_same() {
        let mut file = npy("(2, 3)", &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
        let at = file.windows(5).position(|w| w == b"False").unwrap();
        file[at..at + 5].copy_from_slice(b"True ");
        assert_eq!(parse(Path::new("a.npy"), &file).unwrap().values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(with_last_fastest(&[2, 1, 2], &[0.0, 10.0, 1.0, 11.0]), [0.0, 1.0, 10.0, 11.0]);
        assert_eq!(with_last_fastest(&[], &[7.0]), [7.0], "a single number");
        assert!(with_last_fastest(&[3, 0, 2], &[]).is_empty());
    }

    #[test]
    fn impossible_shapes_are_refused() {
        for shape in
            ["(18446744073709551615, 17)", "(4294967296, 4294967296)", "(9, 9)", "(1, 2, 3)", "(-1,)"]
        {
            assert!(parse(Path::new("a.npy"), &npy(shape, &[0.0; 4])).is_err(), "{shape}");
        }
    }
}
