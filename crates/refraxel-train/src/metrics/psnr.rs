use super::error::MetricsError;
use super::rgb8::{Rgb8, same_size};
use refraxel_data::is_white;

/// Fewest pixels of a region for which a masked PSNR is reported.
const MIN_REGION: u64 = 64;

/// Peak signal-to-noise ratio [dB], theory (5.2): −10 log₁₀ of the mean squared error of 8-bit values / 255.
///
/// Infinite for equal images. An error of one grey level everywhere is 48.13 dB.
pub fn psnr(render: Rgb8<'_>, truth: Rgb8<'_>) -> Result<f64, MetricsError> {
    same_size(render, truth)?;
    let sum = render.pixels().iter().zip(truth.pixels()).map(|(a, b)| squared_error(a, b)).sum();
    Ok(decibel(sum, render.pixels().len() as u64))
}

/// PSNR [dB] over the pixels inside (white in `coverage`) and outside the mask; `None` for a region below 64 pixels.
///
/// The mean runs over the pixels of the region only, so a small object is not flattered by its large surroundings.
pub fn masked_psnr(
    render: Rgb8<'_>,
    truth: Rgb8<'_>,
    coverage: &[u8],
) -> Result<(Option<f64>, Option<f64>), MetricsError> {
    same_size(render, truth)?;
    if coverage.len() != truth.pixels().len() {
        return Err(MetricsError::MaskSize { mask: coverage.len(), image: truth.pixels().len() });
    }
    let (mut sum, mut count) = ([0; 2], [0; 2]);
    for ((a, b), &c) in render.pixels().iter().zip(truth.pixels()).zip(coverage) {
        let region = usize::from(is_white(c));
        sum[region] += squared_error(a, b);
        count[region] += 1;
    }
    let region = |k: usize| (count[k] >= MIN_REGION).then(|| decibel(sum[k], count[k]));
    Ok((region(1), region(0)))
}

fn squared_error(a: &[u8; 3], b: &[u8; 3]) -> u64 {
    let d2 = |k: usize| u32::from(a[k].abs_diff(b[k])).pow(2);
    u64::from(d2(0) + d2(1) + d2(2))
}

fn decibel(sum: u64, pixels: u64) -> f64 {
    if sum == 0 {
        return f64::INFINITY;
    }
    -10.0 * (sum as f64 / (pixels as f64 * 3.0 * 255.0 * 255.0)).log10()
}

#[cfg(test)]
mod tests {
    use super::super::examples::{disc, pair};
    use super::*;

    #[test]
    fn one_grey_level_is_48_decibel() {
        let (a, b) = ([[10, 20, 30]; 4], [[11, 19, 31]; 4]);
        let got = psnr(Rgb8::new(&a, 2, 2), Rgb8::new(&b, 2, 2));
        assert_eq!(got, Ok(20.0 * 255f64.log10()));
    }

    #[test]
    fn equal_images_are_infinitely_good() {
        let a = [[9, 8, 7]; 64];
        let view = Rgb8::new(&a, 8, 8);
        assert_eq!(psnr(view, view), Ok(f64::INFINITY));
        assert_eq!(masked_psnr(view, view, &[255; 64]), Ok((Some(f64::INFINITY), None)));
    }

    // numpy: -10*log10(((a/255 - b/255)**2).mean()) of `examples::pair`, and of its pixels in `disc > 127`.
    #[test]
    fn agrees_with_numpy() {
        for (w, h, all, inside, outside) in PSNR_CASES {
            let (a, b) = pair(w, h);
            let (a, b) = (Rgb8::new(&a, w, h), Rgb8::new(&b, w, h));
            let masked = masked_psnr(a, b, &disc(w, h)).unwrap();
            for (got, want) in
                [(psnr(a, b).unwrap(), all), (masked.0.unwrap(), inside), (masked.1.unwrap(), outside)]
            {
                assert!((got - want).abs() < 1e-9, "{w}x{h}: {got} against {want}");
            }
        }
    }

    #[test]
    fn region_below_64_pixels_is_not_scored() {
        let (a, b) = pair(16, 8);
        let (a, b) = (Rgb8::new(&a, 16, 8), Rgb8::new(&b, 16, 8));
        let mut coverage = [0; 128];
        coverage[..63].fill(255);
        let (inside, outside) = masked_psnr(a, b, &coverage).unwrap();
        assert!(inside.is_none() && outside.is_some());
        coverage[63] = 128;
        let (inside, outside) = masked_psnr(a, b, &coverage).unwrap();
        assert!(inside.is_some() && outside.is_some());
    }

    #[test]
    fn other_sizes_are_named() {
        let a = [[0; 3]; 6];
        let error = psnr(Rgb8::new(&a, 3, 2), Rgb8::new(&a, 2, 3)).unwrap_err();
        assert!(error.to_string().contains("3x2") && error.to_string().contains("2x3"), "{error}");
        let a = Rgb8::new(&a, 3, 2);
        assert_eq!(masked_psnr(a, a, &[0; 5]), Err(MetricsError::MaskSize { mask: 5, image: 6 }));
    }

    const PSNR_CASES: [(usize, usize, f64, f64, f64); 3] = [
        (24, 20, 31.628470616911, 31.621463707060, 31.630531401254),
        (31, 47, 31.649246961769, 31.598783947491, 31.662706151900),
        (97, 64, 31.630602739388, 31.606557737709, 31.637429532434),
    ];
}
