//! Numbers on their way into a page, as `viewer/share/scene.ts` reads them.

use serde::Serialize;
use std::collections::BTreeMap;

/// Where numbers lie [byte].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Part {
    at: usize,
    length: usize,
}

/// Numbers of 16 bits, c, that stand for low + step c.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Packed {
    at: usize,
    length: usize,
    low: f32,
    step: f32,
}

/// All numbers of a page. Every part begins at a multiple of 4 bytes.
#[derive(Debug, Default)]
pub struct Pack {
    /// The numbers.
    pub bytes: Vec<u8>,
    /// Parts that devices read as they are.
    pub parts: BTreeMap<&'static str, Part>,
    /// Coefficients, in the order of the shader.
    pub splines: Vec<Packed>,
}

impl Pack {
    fn put(&mut self, bytes: &[u8]) -> (usize, usize) {
        let at = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        (at, bytes.len())
    }

    /// The bytes of a part; none where there is none of this name.
    pub fn part(&self, name: &str) -> &[u8] {
        self.parts.get(name).map_or(&[], |part| &self.bytes[part.at..part.at + part.length])
    }

    /// A part of this name.
    pub fn bytes(&mut self, name: &'static str, bytes: &[u8]) {
        let (at, length) = self.put(bytes);
        self.parts.insert(name, Part { at, length });
    }

    /// A part of 32-bit words.
    pub fn words(&mut self, name: &'static str, words: impl IntoIterator<Item = u32>) {
        let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        self.bytes(name, &bytes);
    }

    /// A part of reals.
    pub fn reals(&mut self, name: &'static str, reals: impl IntoIterator<Item = f32>) {
        self.words(name, reals.into_iter().map(f32::to_bits));
    }

    /// Numbers in 65 535 steps from the smallest to the largest.
    pub fn packed(&mut self, numbers: &[f32]) -> Packed {
        let low = numbers.iter().copied().fold(f32::INFINITY, f32::min);
        let high = numbers.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let (low, step) = if low < high { (low, (high - low) / 65_535.0) } else { (low, 0.0) };
        let code = |x: &f32| if step > 0.0 { ((x - low) / step).round() as u16 } else { 0 };
        let bytes: Vec<u8> = numbers.iter().map(code).flat_map(u16::to_le_bytes).collect();
        let (at, length) = self.put(&bytes);
        Packed { at, length, low, step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_numbers_are_back_within_half_a_step() {
        let numbers: Vec<f32> = (0..1001).map(|k| (k as f32 * 0.37).sin() * 12.0 - 3.0).collect();
        let mut pack = Pack::default();
        pack.bytes("odd", &[1, 2, 3]);
        let Packed { at, length, low, step } = pack.packed(&numbers);
        assert_eq!((at, length, pack.bytes.len() % 4), (4, 2002, 0));
        for (x, c) in numbers.iter().zip(pack.bytes[at..at + length].as_chunks().0) {
            let back = low + step * f32::from(u16::from_le_bytes(*c));
            assert!((back - x).abs() <= 0.51 * step, "{x} {back}");
        }
        let same = pack.packed(&[2.5; 4]);
        assert_eq!((same.low, same.step), (2.5, 0.0));
    }
}
