//! Gaussians as SPZ, a layout of about a ninth of the size of PLY: bytes and fixed-point numbers, one kind after the other, in gzip.
//!
//! Its axes point right, up and back, where those of the PLY layout point right, down and to the front: y and z change their signs, as
//! they do where the reference makes SPZ of PLY.
//!
//! Source: Niantic's reference implementation, `nianticlabs/spz`, version 2 of the layout.

use super::splats::Gaussian;
use flate2::Compression;
use flate2::write::GzEncoder;
use refraxel_core::{ShDegree, sh, vec3};
use std::io::{self, Write};

const MAGIC: &[u8; 4] = b"NGSP";
const VERSION: u32 = 2;
/// Bits behind the point of a coordinate, where the scene is small enough.
const MOST_BITS: u32 = 20;
/// Largest 24-bit number.
const LARGEST: f64 = 8_388_607.0;
/// Steps per unit of the first coefficient of a colour, and of the logarithm of a standard deviation, which begins at e⁻¹⁰.
const COLOUR_STEPS: f32 = 0.15 * 255.0;
const SCALE_STEPS: f32 = 16.0;
const SMALLEST_SCALE: f32 = -10.0;
/// Steps from one number that a coefficient of degree 1, or of a higher degree, may have to the next.
const BUCKETS: [i32; 2] = [8, 16];

/// What the layout cannot hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lost {
    /// Distance of neighbouring coordinates [scene unit].
    pub step: f64,
    /// Gaussians that are smaller or larger than any of the layout.
    pub of_other_size: usize,
}

/// Writes Gaussians whose colours have this degree.
pub(super) fn write(all: &[Gaussian], degree: ShDegree, out: &mut dyn Write) -> io::Result<Lost> {
    let count = u32::try_from(all.len()).map_err(io::Error::other)?;
    let bits = fraction_bits(all);
    let mut out = GzEncoder::new(out, Compression::default());
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&count.to_le_bytes())?;
    out.write_all(&[degree.get(), bits as u8, 0, 0])?;
    let unit = f64::from(1u32 << bits);
    for Gaussian { place: [x, y, z], .. } in all {
        for at in [*x, -y, -z] {
            let fixed = (f64::from(at) * unit).round().clamp(-LARGEST, LARGEST) as i32;
            out.write_all(&fixed.to_le_bytes()[..3])?;
        }
    }
    for g in all {
        out.write_all(&[byte(255.0 / (1.0 + (-g.logit).exp()))])?;
    }
    let coefficient = |g: &Gaussian, c: usize, k: usize| g.colour[c * degree.basis() + k];
    for g in all {
        out.write_all(&[0, 1, 2].map(|c| byte(coefficient(g, c, 0) * COLOUR_STEPS + 127.5)))?;
    }
    let size = |s: f32| (s - SMALLEST_SCALE) * SCALE_STEPS;
    for g in all {
        out.write_all(&g.scales.map(|s| byte(size(s))))?;
    }
    for Gaussian { rotation: [w, x, y, z], .. } in all {
        let sign = if *w < 0.0 { -1.0 } else { 1.0 };
        out.write_all(&[*x, -y, -z].map(|q| byte(127.5 * sign * q + 127.5)))?;
    }
    let signs = signs(degree);
    for g in all {
        for k in 1..degree.basis() {
            let bucket = BUCKETS[usize::from(k > 3)];
            out.write_all(&[0, 1, 2].map(|c| coarse(signs[k] * coefficient(g, c, k), bucket)))?;
        }
    }
    out.finish()?;
    let is_held = |g: &&Gaussian| g.scales.iter().all(|s| (-0.5..=255.5).contains(&size(*s)));
    Ok(Lost { step: unit.recip(), of_other_size: all.len() - all.iter().filter(is_held).count() })
}

/// As many as the largest coordinate leaves room for.
fn fraction_bits(all: &[Gaussian]) -> u32 {
    let largest = all.iter().flat_map(|g| g.place).fold(0.0, |most: f64, x| most.max(f64::from(x.abs())));
    (0..=MOST_BITS).rev().find(|&bits| largest * f64::from(1u32 << bits) <= LARGEST).unwrap_or(0)
}

/// Signs that coefficients take as y and z change theirs: each basis function keeps its value or reverses it.
fn signs(degree: ShDegree) -> Vec<f32> {
    let [x, y, z] = [0.3_f32, -0.5, 0.8];
    let [as_is, reversed] = [vec3(x, y, z), vec3(x, -y, -z)].map(|d| sh::basis(degree, d));
    as_is.iter().zip(reversed).map(|(a, b)| if a * b < 0.0 { -1.0 } else { 1.0 }).collect()
}

fn byte(x: f32) -> u8 {
    x.round().clamp(0.0, 255.0) as u8
}

/// A coefficient from −1 to 1, rounded to a multiple of the bucket: it compresses well.
fn coarse(x: f32, bucket: i32) -> u8 {
    let fine = ((128.0 * x).round() + 128.0).clamp(0.0, 255.0) as i32;
    ((fine + bucket / 2) / bucket * bucket).min(255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::GzDecoder;
    use std::io::Read;

    fn gaussian(x: f32) -> Gaussian {
        let colour: Vec<f32> = (0..12).map(|k| 0.05 * k as f32 - 0.2).collect();
        let (s, c) = 0.3_f32.sin_cos();
        Gaussian {
            place: [x, -2.0, 0.5],
            logit: 0.7,
            scales: [-3.0, -4.5, -2.25],
            rotation: [-c, 0.0, s * 0.6, s * 0.8],
            colour,
        }
    }

    /// Bytes of a file behind the header of 16, and the header's last four.
    fn read(file: &[u8]) -> ([u8; 4], Vec<u8>) {
        let mut bytes = Vec::new();
        GzDecoder::new(file).read_to_end(&mut bytes).unwrap();
        assert_eq!((&bytes[..4], &bytes[4..12]), (&MAGIC[..], &[2, 0, 0, 0, 2, 0, 0, 0][..]));
        (bytes[12..16].try_into().unwrap(), bytes[16..].to_vec())
    }

    #[test]
    fn numbers_are_those_of_the_reference_with_y_and_z_reversed() {
        let mut file = Vec::new();
        let lost = write(&[gaussian(1.25), gaussian(-3.5)], ShDegree::new(1).unwrap(), &mut file).unwrap();
        let ([degree, bits, _, _], bytes) = read(&file);
        let unit = 1.0 / f64::from(1u32 << bits);
        assert_eq!((degree, lost), (1, Lost { step: unit, of_other_size: 0 }));
        assert_eq!(bytes.len(), 2 * (9 + 1 + 3 + 3 + 3 + 9));
        let fixed = |k: usize| {
            let b = &bytes[3 * k..][..3];
            f64::from(i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8) * unit
        };
        assert_eq!([0, 1, 2, 3].map(fixed), [1.25, 2.0, -0.5, -3.5]);
        let [alphas, colours, scales, rotations, sh] = [18, 20, 26, 32, 38].map(|at| &bytes[at..]);
        assert_eq!(alphas[0], 170, "of 255 · sigmoid(0.7) = 170.4");
        // Coefficients 0 of each channel: −0.2, 0 and 0.2.
        assert_eq!(colours[..3], [120, 128, 135]);
        assert_eq!(scales[..3], [112, 88, 124]);
        let angle = 0.3_f32.sin();
        let back = [0, 1, 2].map(|k| f32::from(rotations[k]) / 127.5 - 1.0);
        let expected = [0.0, 0.6 * angle, 0.8 * angle];
        assert!(back.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.01), "{back:?}");
        // The first of degree 1 belongs to y: of red −0.15, of green 0.05, of blue 0.25, all reversed.
        let first = [0, 1, 2].map(|k| (f32::from(sh[k]) - 128.0) / 128.0);
        assert!(first.iter().zip([0.15, -0.05, -0.25]).all(|(a, b)| (a - b).abs() <= 0.032), "{first:?}");
        // The third, to x: −0.05, 0.15, 0.35.
        let third = [6, 7, 8].map(|k| (f32::from(sh[k]) - 128.0) / 128.0);
        assert!(third.iter().zip([-0.05, 0.15, 0.35]).all(|(a, b)| (a - b).abs() <= 0.032), "{third:?}");
    }

    #[test]
    fn reversed_colours_look_the_same() {
        let signs = signs(ShDegree::MAX);
        for d in [vec3(0.1_f32, 0.7, -0.7), vec3(-0.6, -0.35, 0.72)] {
            let [y, reversed] = [d, vec3(d.x, -d.y, -d.z)].map(|d| sh::basis(ShDegree::MAX, d));
            assert!((0..16).all(|k| (y[k] - signs[k] * reversed[k]).abs() < 1e-6), "{y:?} {reversed:?}");
        }
    }

    #[test]
    fn sizes_and_colours_beyond_the_layout_are_cut_off() {
        let tiny = Gaussian { scales: [-11.0, -4.0, -4.0], colour: vec![1e30; 12], ..gaussian(0.0) };
        let mut file = Vec::new();
        let lost = write(&[tiny, gaussian(0.0)], ShDegree::new(1).unwrap(), &mut file).unwrap();
        assert_eq!(lost.of_other_size, 1);
        let (_, bytes) = read(&file);
        assert_eq!((bytes[20..23].to_vec(), bytes[26], bytes[44]), (vec![255; 3], 0, 255));
    }

    #[test]
    fn far_places_fit_with_fewer_bits() {
        for (far, bits) in [(3.9, 20), (5000.0, 10), (8e6, 0), (1e9, 0)] {
            assert_eq!(fraction_bits(&[gaussian(far)]), bits, "{far}");
        }
    }
}
