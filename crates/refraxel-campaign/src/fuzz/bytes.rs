//! Changes of binary files.

use super::Change;

/// Integers at the borders of their types.
const INTEGERS: [u64; 9] = [0, 1, 2, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX >> 1, 1 << 63, u64::MAX];
/// Numbers that arithmetic does not like.
const FLOATS: [f64; 12] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    1e38,
    1e300,
    1e-38,
    1e-310,
    1e9,
    f64::MIN_POSITIVE,
];

/// Changes a file in one place.
pub fn change(file: &mut Vec<u8>, change: &Change) {
    let Some(at) = change.at.checked_rem(file.len() as u64).map(|at| at as usize) else { return };
    let value = change.value;
    match change.kind / 8 % 9 {
        0 => file[at] ^= 1 << (value % 8),
        1 => file[at] = [0, 255, 127, 128, value as u8][(value >> 8) as usize % 5],
        2 => file.truncate(at),
        3 => write(file, at, &INTEGERS[value as usize % INTEGERS.len()].to_le_bytes()[..width(value)]),
        4 => {
            let value_bytes = INTEGERS[value as usize % INTEGERS.len()].to_be_bytes();
            write(file, at, &value_bytes[8 - width(value)..]);
        }
        5 => write(file, at, &float(value).to_le_bytes()),
        6 => write(file, at, &(float(value) as f32).to_le_bytes()),
        7 => drop(file.drain(at..(at + 1 + value as usize % 64).min(file.len()))),
        _ => {
            let piece = file[at..(at + 1 + value as usize % 64).min(file.len())].to_vec();
            let to = (value >> 8) as usize % file.len();
            file.splice(to..to, piece);
        }
    }
}

fn float(value: u64) -> f64 {
    FLOATS[value as usize % FLOATS.len()]
}

fn width(value: u64) -> usize {
    [1, 2, 4, 8][(value >> 16) as usize % 4]
}

fn write(file: &mut [u8], at: usize, bytes: &[u8]) {
    let end = (at + bytes.len()).min(file.len());
    file[at..end].copy_from_slice(&bytes[..end - at]);
}
