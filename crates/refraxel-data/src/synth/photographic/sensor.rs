//! From light to a file's pixels: exposure, white balance, noise.

use super::imperfection::{Imperfection, Imperfections};
use crate::image::{Image, Pixels};
use crate::quantize::quantize;
use crate::synth::hash::{mix, signed, unit};
use crate::synth::render::Frame;
use crate::synth::texture::srgb_from_linear;
use std::f64::consts::TAU;

/// Exposure and colour temperature change by at most this share.
pub const EXPOSURE: f64 = 0.08;
/// Electrons that the sensor counts where the picture is white; their shot noise is 2 % there.
pub const WHITE_ELECTRONS: f64 = 2500.0;
/// Standard deviation of the noise of reading [electron].
pub const READ_NOISE: f64 = 3.0;
/// Quality of the JPEG files, of 100.
pub const JPEG_QUALITY: u8 = 90;

/// How one photograph is exposed and read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::synth) struct Sensor {
    /// Factors of linear red, green and blue.
    pub gains: [f64; 3],
    /// Seed of the noise of this photograph, where there is noise.
    noise: Option<u64>,
}

impl Sensor {
    /// Of the photograph with this seed: exposure scales all colours, colour temperature red against blue.
    pub fn new(with: Imperfections, seed: u64) -> Sensor {
        let amount = if with.has(Imperfection::Exposure) { EXPOSURE } else { 0.0 };
        let (light, warmth) = (1.0 + amount * signed(seed, 0), amount * signed(seed, 1));
        let gains = [light * (1.0 + warmth), light, light * (1.0 - warmth)];
        Sensor { gains, noise: with.has(Imperfection::Noise).then(|| mix(seed, 2)) }
    }

    /// What is read for linear light in one channel; `at` numbers pixels and channels.
    ///
    /// Variance of the reading [electron²]: light + read noise². The Poisson distribution of the light is taken for a normal one.
    fn reading(&self, light: f64, at: u64) -> f64 {
        let Some(seed) = self.noise else { return light };
        let electrons = light.max(0.0) * WHITE_ELECTRONS;
        let deviation = (electrons + READ_NOISE * READ_NOISE).sqrt();
        (electrons + deviation * normal(seed, at)) / WHITE_ELECTRONS
    }
}

/// A draw from the normal distribution of variance 1 (Box & Muller 1958).
fn normal(seed: u64, at: u64) -> f64 {
    let [radius, angle] = [unit(mix(seed, 2 * at)), unit(mix(seed, 2 * at + 1))];
    (-2.0 * (1.0 - radius).ln()).sqrt() * (TAU * angle).cos()
}

/// The picture that a sensor makes of a frame, sRGB with 8 bits.
pub(in crate::synth) fn developed(frame: &Frame, sensor: &Sensor) -> Image {
    let channel = |(i, &light): (usize, &f64)| {
        let read = sensor.reading(light * sensor.gains[i % 3], i as u64);
        quantize(srgb_from_linear(read))
    };
    let pixels = frame.color.iter().flatten().enumerate().map(channel).collect();
    Image { width: frame.size[0], height: frame.size[1], channels: 3, pixels: Pixels::U8(pixels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(one: Imperfection) -> Imperfections {
        let others = Imperfection::ALL.into_iter().filter(|&i| i != one);
        others.fold(Imperfections::ALL, Imperfections::without)
    }

    #[test]
    fn noise_has_the_stated_deviation_and_leaves_the_mean() {
        let sensor = Sensor::new(only(Imperfection::Noise), 5);
        assert_eq!(sensor.gains, [1.0; 3]);
        for light in [0.0, 0.2, 0.8] {
            let n = 40_000;
            let off: Vec<f64> = (0..n).map(|i| sensor.reading(light, i) - light).collect();
            let mean = off.iter().sum::<f64>() / n as f64;
            let deviation = (off.iter().map(|o| o * o).sum::<f64>() / n as f64).sqrt();
            let expected = (light * WHITE_ELECTRONS + READ_NOISE.powi(2)).sqrt() / WHITE_ELECTRONS;
            assert!(mean.abs() < 4.0 * expected / (n as f64).sqrt()); // four standard errors
            assert!((deviation / expected - 1.0).abs() < 0.02, "{light}: {deviation}");
        }
    }

    #[test]
    fn exposure_and_white_balance_stay_within_the_stated_share_and_use_it() {
        let gains: Vec<[f64; 3]> =
            (0..200).map(|seed| Sensor::new(only(Imperfection::Exposure), seed).gains).collect();
        let share = |of: fn(&[f64; 3]) -> f64| {
            let all = gains.iter().map(of);
            (all.clone().fold(f64::INFINITY, f64::min), all.fold(0.0, f64::max))
        };
        for (least, most) in [share(|g| g[1]), share(|g| 1.0 + 0.5 * (g[0] - g[2]) / g[1])] {
            assert!((1.0 - EXPOSURE..0.95).contains(&least) && (1.05..1.0 + EXPOSURE).contains(&most));
        }
        assert_eq!(Sensor::new(only(Imperfection::Jpeg), 3), Sensor { gains: [1.0; 3], noise: None });
    }
}
