//! Linear colours, and the colours of displays.

use crate::photo::{srgb_decode, srgb_encode};

/// Linear red, green, blue; 1 = white of the display.
pub type Rgb = [f64; 3];

/// sRGB encoding of a linear channel, clamped to [0, 1] (IEC 61966-2-1).
pub(in crate::synth) fn srgb_from_linear(v: f64) -> f64 {
    srgb_encode(v.clamp(0.0, 1.0))
}

/// Linear colour of a display colour such as 0xff8800.
pub(in crate::synth) fn rgb(hex: u32) -> Rgb {
    [16, 8, 0].map(|shift| srgb_decode(f64::from(hex >> shift & 0xff) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_encoding_inverts_decoding() {
        for i in 0..=255 {
            let v = f64::from(i) / 255.0;
            assert!((srgb_from_linear(srgb_decode(v)) - v).abs() < 1e-7); // the standard's own rounding
        }
    }
}
