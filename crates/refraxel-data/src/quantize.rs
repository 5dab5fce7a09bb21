//! From what a channel is to the byte that is stored and scored.

use refraxel_core::Real;

/// Nearest 8-bit value of an sRGB-encoded channel or of a share, theory (5.1): 0 → 0, 1 → 255; outside is clamped, NaN becomes 0.
///
/// Rounds to nearest; truncation would cost up to 1.5 dB at 49 dB.
#[inline]
pub fn quantize<T: Real>(channel: T) -> u8 {
    (channel * T::of(255.0)).round().f64() as u8 // `as` clamps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantize_rounds_to_nearest_and_clamps() {
        let cases =
            [(0.0, 0), (1.0, 255), (0.5, 128), (-0.1, 0), (1.5, 255), (0.49 / 255.0, 0), (0.51 / 255.0, 1)];
        for (channel, byte) in cases {
            assert_eq!(quantize(channel), byte, "{channel}");
        }
        assert_eq!(quantize(f32::NAN), 0);
    }

    #[test]
    fn quantize_inverts_division_by_255() {
        for byte in 0..=255u8 {
            assert_eq!(quantize(f32::from(byte) / 255.0), byte);
        }
    }
}
