//! Photographs read with fewer pixels than their files have: means over areas, and cameras to match.

use crate::quantize::quantize;
use crate::{Crop, Dataset, Image, Mask, Photo, PhotoSource, Pixels, Problem, Stored, View};
use refraxel_core::Camera;
use std::str::FromStr;

/// How many pixels of photographs are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Edges are this many times shorter; 1 keeps all pixels.
    Divide(u32),
    /// The longer edge has at most so many pixels; smaller photographs keep theirs.
    Longest(u32),
}

/// Up to this a number divides, from [`LEAST_LONGEST`] on it is a number of pixels.
const MOST_DIVISOR: u32 = 32;
/// The shortest longer edge that can be asked for [pixel].
const LEAST_LONGEST: u32 = 64;

impl Reduction {
    /// The size of a photograph that is reduced [pixel]; at least one pixel, and never more than there are.
    pub fn size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        let factor = match self {
            Self::Divide(divisor) => 1.0 / f64::from(divisor.max(1)),
            Self::Longest(longest) => f64::from(longest) / f64::from(width.max(height).max(1)),
        };
        [width, height].map(|n| ((f64::from(n) * factor.min(1.0)).round() as u32).clamp(1, n.max(1)))
    }
}

/// A number that is no [`Reduction`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected 1 to {MOST_DIVISOR}, by which edges are divided, or the longer edge in pixels, {LEAST_LONGEST} or more"
)]
pub struct NoReduction;

/// `4` divides, `1600` is the longer edge in pixels.
impl TryFrom<u32> for Reduction {
    type Error = NoReduction;

    fn try_from(number: u32) -> Result<Self, NoReduction> {
        match number {
            1..=MOST_DIVISOR => Ok(Self::Divide(number)),
            LEAST_LONGEST.. => Ok(Self::Longest(number)),
            _ => Err(NoReduction),
        }
    }
}

impl FromStr for Reduction {
    type Err = NoReduction;

    fn from_str(text: &str) -> Result<Self, NoReduction> {
        text.parse::<u32>().map_err(|_| NoReduction)?.try_into()
    }
}

impl From<Reduction> for u32 {
    fn from(reduction: Reduction) -> Self {
        match reduction {
            Reduction::Divide(n) | Reduction::Longest(n) => n,
        }
    }
}

/// Photographs with more pixels are read with fewer, where nobody says with how many: the finest grids show no more.
const PICTURE_PIXELS: u64 = 16 << 20;
/// All photographs together have at most so many pixels then: 6 GiB of colours with 8 bits.
const ALL_PIXELS: u64 = 2 << 30;
/// Longer edges that are chosen are multiples of this [pixel].
const STEP: u32 = 32;

impl Dataset {
    /// Reads photographs of files that are too large, one by one or together, with fewer pixels from now on, and notes it in
    /// [`Dataset::problems`]. Depends on their sizes alone. Returns what was done, if anything.
    pub fn fit(&mut self) -> Option<Reduction> {
        let sizes: Vec<[u32; 2]> =
            self.views.iter().filter(|v| v.is_file()).map(|v| size_of(&v.camera)).collect();
        let longest = fitting(&sizes)?;
        let (all, first) = (self.views.len(), self.views.iter().position(|v| v.is_longer(longest))?);
        let before = size_of(&self.views[first].camera);
        let large: Vec<usize> = (0..all).filter(|&i| self.views[i].is_file()).collect();
        let count = self.reduce(&large, Reduction::Longest(longest));
        let ([w, h], [from_w, from_h]) = (size_of(&self.views[first].camera), before);
        self.problems.push(Problem::note(format!(
            "{count} of {all} images are read with fewer pixels, and scored so, for none to have more than {} and all together \
             no more than {} megapixels: the first of {from_w}x{from_h} at {w}x{h}; their longer edge has at most {longest} pixels \
             (--downscale N chooses another size, --downscale 1 reads them whole)",
            PICTURE_PIXELS / 1_000_000,
            ALL_PIXELS / 1_000_000
        )));
        Some(Reduction::Longest(longest))
    }

    /// Reads these views with fewer pixels from now on; what is in memory is reduced at once. Cameras are those of the smaller
    /// photographs. Returns how many views have fewer pixels than before.
    ///
    /// # Panics
    /// When an index is not one of [`Dataset::views`].
    pub fn reduce(&mut self, indices: &[usize], reduction: Reduction) -> usize {
        indices.iter().filter(|&&index| self.views[index].reduce(reduction)).count()
    }
}

/// The longer edge at which photographs of these sizes are within the limits; `None` where they are.
fn fitting(sizes: &[[u32; 2]]) -> Option<u32> {
    let pixels = |[w, h]: [u32; 2]| u64::from(w) * u64::from(h);
    let fits = |longest: u32| {
        let reduced = sizes.iter().map(|&size| pixels(Reduction::Longest(longest).size(size)));
        let (most, sum) = reduced.fold((0, 0), |(most, sum), n| (n.max(most), sum + n));
        most <= PICTURE_PIXELS && sum <= ALL_PIXELS
    };
    let whole = sizes.iter().flatten().copied().max()?;
    if fits(whole) {
        return None;
    }
    // Fewest steps that fit and most that do not: sizes grow with the longer edge.
    let (mut fitting, mut beyond) = (LEAST_LONGEST / STEP, whole.div_ceil(STEP));
    while beyond - fitting > 1 {
        let middle = fitting.midpoint(beyond);
        *if fits(middle * STEP) { &mut fitting } else { &mut beyond } = middle;
    }
    Some(fitting * STEP)
}

impl View {
    fn is_file(&self) -> bool {
        matches!(self.source, PhotoSource::Files { .. })
    }

    fn is_longer(&self, longest: u32) -> bool {
        self.is_file() && self.camera.width.max(self.camera.height) > longest
    }

    /// Whether the view has fewer pixels than before.
    fn reduce(&mut self, reduction: Reduction) -> bool {
        let before = size_of(&self.camera);
        let [width, height] = reduction.size(before);
        if [width, height] == before {
            return false;
        }
        self.camera = self.camera.resized(width, height);
        match &mut self.source {
            PhotoSource::Files { stored, .. } => {
                *stored = stored.or(Some(Stored { size: before, crop: Crop::default() }));
            }
            PhotoSource::Memory(photo) => *photo = photo.reduced([width, height]),
        }
        true
    }
}

/// Width and height of a camera's picture [pixel].
pub(crate) fn size_of(camera: &Camera) -> [u32; 2] {
    [camera.width, camera.height]
}

impl Photo {
    /// The photo with fewer pixels, each the mean of the area that it covers: of colour weighted with alpha, and of coverage.
    /// Means are those of the sRGB code values, as a field of code values shows them. 8 bits stay 8 bits.
    ///
    /// # Panics
    /// If the size is larger than that of the photo, or 0.
    pub fn reduced(&self, size: [u32; 2]) -> Self {
        let mask = self.mask.as_ref().map(|mask| mask.reduced(size));
        Self { depth: self.depth.clone(), ..Self::new(self.image.reduced(size), mask) }
    }
}

impl Image {
    /// As [`Photo::reduced`].
    fn reduced(&self, size: [u32; 2]) -> Self {
        let from = [self.width, self.height];
        let has_alpha = self.channels == 4;
        let mut means = if has_alpha {
            means::<4>(from, size, |y, row| {
                self.row(y, row);
                row.iter_mut().for_each(|[r, g, b, alpha]| [r, g, b].into_iter().for_each(|c| *c *= *alpha));
            })
        } else {
            means::<3>(from, size, |y, row| self.row(y, row))
        };
        if has_alpha {
            for pixel in means.chunks_exact_mut(4).filter(|pixel| pixel[3] > 0.0) {
                (0..3).for_each(|c| pixel[c] /= pixel[3]);
            }
        }
        let pixels = match &self.pixels {
            Pixels::U8(_) => Pixels::U8(means.into_iter().map(quantize).collect()),
            Pixels::F32(_) => Pixels::F32(means),
        };
        Self { width: size[0], height: size[1], channels: self.channels, pixels }
    }

    /// The first C channels of a row.
    pub(crate) fn row<const C: usize>(&self, y: usize, row: &mut [[f32; C]]) {
        let (width, channels) = (self.width as usize, self.channels as usize);
        let at = y * width * channels..(y + 1) * width * channels;
        match &self.pixels {
            Pixels::U8(v) => {
                for (out, pixel) in row.iter_mut().zip(v[at].chunks_exact(channels)) {
                    (0..C).for_each(|c| out[c] = f32::from(pixel[c]) / 255.0);
                }
            }
            Pixels::F32(v) => {
                for (out, pixel) in row.iter_mut().zip(v[at].chunks_exact(channels)) {
                    out.copy_from_slice(&pixel[..C]);
                }
            }
        }
    }
}

impl Mask {
    /// As [`Photo::reduced`].
    pub(crate) fn reduced(&self, size: [u32; 2]) -> Self {
        let width = self.width as usize;
        let means = means::<1>([self.width, self.height], size, |y, row| {
            let coverage = &self.coverage[y * width..(y + 1) * width];
            row.iter_mut().zip(coverage).for_each(|(out, v)| *out = [f32::from(*v)]);
        });
        let coverage = means.iter().map(|v| v.round() as u8).collect();
        Self { width: size[0], height: size[1], coverage }
    }
}

/// Means over areas of `to` pixels that cover the `from` pixels evenly: first along rows, then across them. A pixel that lies in
/// two areas counts in both, by its parts. `fill` writes the pixels of a row.
pub(crate) fn means<const C: usize>(
    from: [u32; 2],
    to: [u32; 2],
    fill: impl Fn(usize, &mut [[f32; C]]),
) -> Vec<f32> {
    let ([width, height], [across, down]) = (from.map(|n| n as usize), to.map(|n| n as usize));
    assert!(across > 0 && down > 0 && across <= width && down <= height, "{from:?} to {to:?}");
    let (columns, rows) = (shares(width, across), shares(height, down));
    let mut means = vec![0.0_f32; across * down * C];
    let (mut pixels, mut row) = (vec![[0.0_f32; C]; width], vec![[0.0_f32; C]; across]);
    for (y, parts) in rows.iter().enumerate() {
        fill(y, &mut pixels);
        row.fill([0.0; C]);
        for (pixel, parts) in pixels.iter().zip(&columns) {
            for &(at, share) in parts.iter().filter(|(_, share)| *share > 0.0) {
                (0..C).for_each(|c| row[at][c] += share * pixel[c]);
            }
        }
        for &(at, share) in parts.iter().filter(|(_, share)| *share > 0.0) {
            let out = &mut means[at * across * C..(at + 1) * across * C];
            out.iter_mut().zip(row.as_flattened()).for_each(|(mean, v)| *mean += share * v);
        }
    }
    means
}

/// Of each of `from` pixels in a row the areas that it lies in, and the share that it has in their means.
fn shares(from: usize, to: usize) -> Vec<[(usize, f32); 2]> {
    let scale = to as f64 / from as f64;
    let parts = |pixel: usize| {
        let (start, end) = (pixel as f64 * scale, (pixel + 1) as f64 * scale);
        let first = (start as usize).min(to - 1);
        let border = ((first + 1) as f64).min(end);
        let last = (first + 1).min(to - 1);
        let rest = if last > first { (end - border).max(0.0) } else { 0.0 };
        [(first, (border - start) as f32), (last, rest as f32)]
    };
    (0..from).map(parts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: u32, height: u32, at: impl Fn(u32, u32) -> u8) -> Image {
        let pixel = |k: u32| [at(k % width, k / width); 3];
        let pixels = Pixels::U8((0..width * height).flat_map(pixel).collect());
        Image { width, height, channels: 3, pixels }
    }

    #[test]
    fn numbers_divide_or_are_the_longer_edge() {
        assert_eq!("4".parse(), Ok(Reduction::Divide(4)));
        assert_eq!("1600".parse(), Ok(Reduction::Longest(1600)));
        for wrong in ["0", "40", "-2", "1.5", "half"] {
            assert!(wrong.parse::<Reduction>().is_err(), "{wrong}");
        }
        assert_eq!(Reduction::Divide(4).size([4000, 3001]), [1000, 750]);
        assert_eq!(Reduction::Longest(1600).size([4000, 3000]), [1600, 1200]);
        assert_eq!(Reduction::Longest(1600).size([800, 1000]), [800, 1000], "nothing grows");
        assert_eq!(Reduction::Divide(8).size([5, 3]), [1, 1]);
    }

    #[test]
    fn photographs_are_read_whole_unless_one_or_all_are_too_large() {
        let megapixels = |[w, h]: [u32; 2]| f64::from(w) * f64::from(h) / f64::from(1 << 20);
        assert_eq!(fitting(&[[4000, 4000]; 100]), None);
        assert_eq!(fitting(&[]), None);
        let alone = fitting(&[[11656, 8742]; 12]).unwrap();
        assert!(
            (15.5..=16.0).contains(&megapixels(Reduction::Longest(alone).size([11656, 8742]))),
            "{alone}"
        );
        let together = fitting(&[[4000, 3000]; 1000]).unwrap();
        let each = megapixels(Reduction::Longest(together).size([3000, 4000]));
        assert!((1950.0..=2048.0).contains(&(1000.0 * each)), "{together}");
        assert_eq!(fitting(&[[100, 80]; 1_000_000]), Some(LEAST_LONGEST), "no smaller than can be asked for");
    }

    #[test]
    fn pixels_are_means_of_the_areas_that_they_cover() {
        // 3 to 2: the middle column counts half in each.
        let image = grey(3, 1, |x, _| [30, 60, 120][x as usize]);
        let Pixels::U8(found) = image.reduced([2, 1]).pixels else { panic!("8 bits stay 8 bits") };
        assert_eq!(found, [40, 40, 40, 100, 100, 100]); // (30 + 60/2)/1.5, (60/2 + 120)/1.5
        let image = grey(4, 4, |x, y| (10 * x + 40 * y) as u8);
        let Pixels::U8(found) = image.reduced([2, 2]).pixels else { panic!("8 bits stay 8 bits") };
        assert_eq!(found.chunks(3).map(|p| p[0]).collect::<Vec<_>>(), [25, 45, 105, 125]);
    }

    #[test]
    fn the_mean_of_a_picture_stays() {
        let wave = |x: u32, y: u32| ((x * 7 + y * 13) % 256) as u8;
        let values: Vec<f32> = (0..97 * 53).map(|k| f32::from(wave(k % 97, k / 97)) / 255.0).collect();
        let image = Image { width: 97, height: 53, channels: 1, pixels: Pixels::F32(values) };
        let mean = |v: &[f32]| v.iter().sum::<f32>() / v.len() as f32;
        let Pixels::F32(before) = &image.pixels else { panic!("floats") };
        for size in [[97, 53], [41, 20], [96, 1], [1, 52]] {
            let after = means::<1>([97, 53], size, |y, row| image.row(y, row));
            assert!((mean(&after) - mean(before)).abs() < 1e-5, "{size:?}"); // sums of 5000 f32
        }
    }

    #[test]
    fn what_is_transparent_lends_no_colour() {
        let pixels = Pixels::F32(vec![1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
        let image = Image { width: 2, height: 1, channels: 4, pixels };
        assert_eq!(image.reduced([1, 1]).pixels, Pixels::F32(vec![1.0, 0.0, 0.0, 0.5]));
    }

    #[test]
    fn masks_keep_their_share() {
        let mask = Mask { width: 4, height: 2, coverage: vec![255, 255, 0, 0, 255, 255, 255, 0] };
        assert_eq!(mask.reduced([2, 1]).coverage, [255, 64]);
    }
}
