//! Photographs that are looked at while a dataset is opened, for what its descriptions do not say: few of them, and small.

use crate::reduce::means;
use crate::region::quantile;
use crate::rigid::Posed;
use crate::{Image, Mask, Photo, Pixels, Problem, View, is_white, load_photo};
use rayon::prelude::*;
use refraxel_core::{Camera, Vec3};
use std::collections::BTreeSet;

/// Photographs that are looked at, at most.
const MOST: usize = 12;
/// Photographs that are decoded at the same time: 4 of 24 megapixels take 300 MB.
const AT_ONCE: usize = 4;
/// Longer edge of the small picture [pixel].
const EDGE: u32 = 192;
/// Samples along each edge, at most.
const SAMPLES: u32 = 96;
/// Pixels of each ring along the border that are looked at, at most.
const RING: usize = 512;
/// Depths of the rings in the shorter edge. Narrow frames are no backdrop: behind them is another colour.
const DEPTHS: [f64; 3] = [0.0, 0.02, 0.04];

/// Photographs without any value above this are dark: 14 bits in 16 reach a quarter.
const DARK: f32 = 0.26;

/// What a photograph shows, in few numbers. Colours are sRGB-encoded with straight alpha, 1 = white.
pub(crate) struct Look {
    /// The index of the view.
    pub view: usize,
    /// Columns and rows of the photograph.
    pub size: [u32; 2],
    /// The photograph without alpha, small, and its camera.
    pub small: Image,
    pub camera: Camera,
    /// Pixels all over it, with their right neighbours.
    pub samples: Vec<[[f32; 4]; 2]>,
    /// Pixels along its border.
    pub border: Vec<[f32; 4]>,
}

/// What the mask of a [`Look`] covers, at the same pixels.
pub(crate) struct MaskLook {
    /// The mask, as small as the picture.
    pub small: Mask,
    pub samples: Vec<bool>,
    pub border: Vec<bool>,
    /// Share of white, and of what is neither black nor white.
    pub white: f64,
    pub grey: f64,
}

/// Looks at a few views out of `among`, spread evenly, with the nearest neighbours of some of them. What cannot be decoded is left out:
/// who needs it will say so.
pub(crate) fn look(views: &[View], among: &[usize]) -> Vec<Look> {
    look_at(views, &chosen(|view| views[view].camera.world_from_camera.translation, among, 0.0))
}

/// A warning where no photograph has anything bright, as where the 10, 12 or 14 bits of a sensor are stored in 16, or where most
/// values are above white.
pub(crate) fn brightness(looks: &[Look]) -> Option<Problem> {
    let values = looks.iter().flat_map(|l| &l.samples).flatten().flat_map(|p| [p[0], p[1], p[2]]);
    let most = values.clone().fold(0.0, f32::max);
    let count = looks.len();
    if 0.0 < most && most < DARK {
        return Some(Problem::warning(format!(
            "the photographs are dark: of {count} that were looked at none has a value above {:.1} % of full brightness, as where 12 bits of a \
             sensor are stored in 16; multiply all of them by the same number",
            100.0 * most
        )));
    }
    let above = values.clone().filter(|v| *v > 1.0).count();
    (2 * above > values.count()).then(|| {
        Problem::warning(format!(
            "more than half of the values of {count} photographs that were looked at are above white, which is 1 in pictures of floating-point \
             numbers: divide all of them by the same number"
        ))
    })
}

/// Looks at these views.
pub(crate) fn look_at(views: &[View], chosen: &[usize]) -> Vec<Look> {
    let looks = chosen.chunks(AT_ONCE).flat_map(|some| -> Vec<Look> {
        some.par_iter()
            .filter_map(|&view| Some(Look::at(view, &views[view], &load_photo(&views[view]).ok()?)))
            .collect()
    });
    looks.collect()
}

/// A few out of `among`, spread evenly, with the nearest neighbours of some of them that are more than `least` away, by the places
/// of their cameras.
pub(crate) fn chosen(place: impl Fn(usize) -> Vec3<f64>, among: &[usize], least: f64) -> Vec<usize> {
    let spread = |count: usize| {
        (0..count.min(among.len())).map(move |k| among[k * among.len() / count.min(among.len())])
    };
    let mut chosen: BTreeSet<usize> = spread(MOST / 2).collect();
    let nearest = |of: usize, taken: &BTreeSet<usize>| {
        let others = among.iter().copied().filter(|k| !taken.contains(k));
        let far = others.map(|k| (k, (place(k) - place(of)).length())).filter(|(_, away)| *away > least);
        far.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    };
    for of in chosen.clone() {
        chosen.extend(nearest(of, &chosen));
    }
    for more in spread(MOST) {
        if chosen.len() < MOST {
            chosen.insert(more);
        }
    }
    chosen.into_iter().collect()
}

impl Look {
    /// The small photograph and its camera.
    pub fn posed(&self) -> Posed<'_> {
        Posed { image: &self.small, camera: &self.camera }
    }

    fn at(view: usize, of: &View, photo: &Photo) -> Self {
        let image = &*photo.image;
        let size = [image.width, image.height];
        let samples =
            sampled(size).into_iter().map(|[at, next]| [image.rgba(at), image.rgba(next)]).collect();
        let border = along_border(size).into_iter().map(|at| image.rgba(at)).collect();
        let [width, height] = small_size(size);
        let camera = of.camera.resized(width, height);
        let pixels = means::<3>(size, [width, height], |y, row| image.row(y, row));
        let small = Image { width, height, channels: 3, pixels: Pixels::F32(pixels) };
        Self { view, size, small, camera, samples, border }
    }
}

impl MaskLook {
    pub fn at(mask: &Mask) -> Self {
        let size = [mask.width, mask.height];
        let is_white = |at: usize| is_white(mask.coverage[at]);
        Self {
            small: mask.reduced(small_size(size)),
            samples: sampled(size).into_iter().map(|[at, _]| is_white(at)).collect(),
            border: along_border(size).into_iter().map(is_white).collect(),
            white: mask.white_share(),
            grey: mask.grey_share(),
        }
    }
}

fn small_size([width, height]: [u32; 2]) -> [u32; 2] {
    let scale = (f64::from(EDGE) / f64::from(width.max(height))).min(1.0);
    [width, height].map(|n| ((f64::from(n) * scale).round() as u32).max(1))
}

/// Pixels all over a picture, and their right neighbours.
fn sampled([width, height]: [u32; 2]) -> Vec<[usize; 2]> {
    let spread = |n: u32| {
        let count = n.min(SAMPLES);
        (0..count).map(move |k| (u64::from(k) * u64::from(n) / u64::from(count)) as usize)
    };
    let next = |x: usize| if x + 1 < width as usize { x + 1 } else { x };
    let row = |y: usize| spread(width).map(move |x| [x, next(x)].map(|x| y * width as usize + x));
    spread(height).flat_map(row).collect()
}

/// Pixels of a few rings along the border of a picture.
fn along_border([width, height]: [u32; 2]) -> Vec<usize> {
    let [w, h] = [width, height].map(|n| n as usize);
    let depths: BTreeSet<usize> = DEPTHS.iter().map(|d| (d * w.min(h) as f64) as usize).collect();
    let mut pixels = Vec::new();
    for d in depths {
        let rows = [d, h - 1 - d].into_iter().flat_map(|y| (d..w - d).map(move |x| y * w + x));
        let columns = [d, w - 1 - d].into_iter().flat_map(|x| (d + 1..h - 1 - d).map(move |y| y * w + x));
        let ring: Vec<usize> = rows.chain(columns).collect();
        pixels.extend(ring.iter().step_by(ring.len().div_ceil(RING).max(1)));
    }
    pixels
}

/// The colour that most of some pixels have to within [`SAME`], as far as there are any.
pub(crate) fn common_colour(pixels: impl Iterator<Item = [f32; 3]> + Clone) -> Option<[f32; 3]> {
    let cell = |rgb: [f32; 3]| rgb.map(|c| (c.clamp(0.0, 1.0) * 255.0 / 8.0) as usize);
    let mut counts = std::collections::HashMap::new();
    for rgb in pixels.clone() {
        *counts.entry(cell(rgb)).or_insert(0_usize) += 1;
    }
    let (most, _) = counts.into_iter().max_by_key(|(cell, count)| (*count, *cell))?;
    // Noise around a border of cells lies in several of them: the median of all that are near.
    let middle = most.map(|c| (c as f32 + 0.5) * 8.0 / 255.0);
    let near: Vec<[f32; 3]> = pixels.filter(|rgb| is_within(*rgb, middle, 8.0)).collect();
    Some(if near.is_empty() { middle } else { median_colour(&near) })
}

/// The median of some colours, channel by channel.
///
/// # Panics
/// If there are none.
pub(crate) fn median_colour(colours: &[[f32; 3]]) -> [f32; 3] {
    [0, 1, 2].map(|c| quantile(colours.iter().map(|rgb| rgb[c]), 0.5).expect("colours to take the median of"))
}

/// Levels of 255 by which pixels of one colour differ: JPEG keeps plain areas to within 2.
pub(crate) const SAME: f32 = 3.0;

/// Whether two colours differ by at most so many levels of 255 in each channel.
pub(crate) fn is_within(a: [f32; 3], b: [f32; 3], levels: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= (levels + 0.01) / 255.0)
}

pub(crate) fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}
