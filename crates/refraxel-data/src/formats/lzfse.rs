//! Maps of numbers that are compressed by LZFSE, as Record3D exports depth.
//!
//! The file is one stream of LZFSE, of which `lzfse_rust` decodes every kind of block, and states no size.
//! Source: Apple's reference implementation, <https://github.com/lzfse/lzfse>.

use crate::DataError;
use crate::size::Size;
use lzfse_rust::LzfseRingDecoder;
use std::io::Read;
use std::path::Path;

/// A map of so many columns and rows, rows from the top: `f32`, little endian.
///
/// Decoding stops within 64 KiB of the map's end, and no more is kept than the map and one byte, which tells that there is more.
/// Errors: the stream is damaged, or holds fewer or more numbers.
pub(crate) fn floats(path: &Path, content: &[u8], [width, height]: [u32; 2]) -> Result<Vec<f64>, DataError> {
    let expected = 4 * u64::from(width) * u64::from(height);
    let (mut decoder, mut bytes) = (LzfseRingDecoder::default(), Vec::new());
    let decoded = decoder.reader_bytes(content).take(expected + 1).read_to_end(&mut bytes);
    decoded.map_err(|source| DataError::Damaged {
        path: path.to_owned(),
        at: format!("byte {} of its depth", bytes.len()),
        found: format!("what does not decode ({source})"),
        expected: "numbers compressed by LZFSE",
    })?;
    let count = bytes.len() as u64;
    if count != expected {
        let found = if count > expected { format!("more than {expected}") } else { count.to_string() };
        let (path, size) = (path.to_owned(), Size { width, height });
        return Err(DataError::Record3dDepth { path, found, expected, size });
    }
    Ok(bytes.as_chunks::<4>().0.iter().map(|&number| f64::from(f32::from_le_bytes(number))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compressed(values: &[f32]) -> Vec<u8> {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut file = Vec::new();
        lzfse_rust::encode_bytes(&bytes, &mut file).unwrap();
        file
    }

    /// As many depths, which repeat and are not smooth.
    fn depths([width, height]: [u32; 2]) -> Vec<f32> {
        (0..width * height).map(|i| 1.0 + (i * i % 1009) as f32 / 64.0).collect()
    }

    fn read(file: &[u8], size: [u32; 2]) -> Result<Vec<f64>, String> {
        floats(Path::new("0.depth"), file, size).map_err(|error| error.to_string())
    }

    #[test]
    fn maps_of_any_size_come_back() {
        for size in [[1, 1], [12, 8], [192, 256]] {
            let values = depths(size);
            let expected: Vec<f64> = values.iter().copied().map(f64::from).collect();
            assert!(read(&compressed(&values), size).unwrap() == expected, "{size:?}");
        }
    }

    #[test]
    fn what_lies_beyond_the_map_is_not_decoded() {
        let zeros = compressed(&[0.0; 1 << 16]);
        let unread = [&b"bvx-"[..], &24_u32.to_le_bytes(), &[0; 24], b"no block"].concat();
        for file in [zeros, unread] {
            let refused = read(&file, [2, 2]).unwrap_err();
            assert!(refused.contains("more than 16 bytes of depth; expected 16"), "{refused}");
        }
    }

    #[test]
    fn a_file_with_any_byte_changed_is_read_or_refused_by_name() {
        let size = [40, 32];
        let whole = compressed(&depths(size));
        assert_eq!(&whole[..4], b"bvx2");
        for (at, change) in (0..whole.len()).flat_map(|at| [1, 0xff].map(|change| (at, change))) {
            let mut file = whole.clone();
            file[at] ^= change;
            if let Err(refused) = read(&file, size) {
                assert!(refused.contains("0.depth"), "{at}: {refused}");
            }
        }
    }
}
