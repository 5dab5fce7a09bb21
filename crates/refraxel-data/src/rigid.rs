//! Whether photographs show a rigid scene as their poses say: patches of one are sought along their rays in the nearest other one.
//!
//! Opaque things that stand still are found again, whatever the light. What moves with the camera, changes from view to view or
//! refracts is not, and hardly anything is where poses are wrong.

use crate::Image;
use crate::region::quantile;
use rayon::prelude::*;
use refraxel_core::{Camera, Vec3};

/// Half the edge of a patch [pixel of the small picture].
pub(crate) const HALF: i64 = 2;
/// Pixels of a patch.
const PIXELS: usize = (2 * HALF as usize + 1) * (2 * HALF as usize + 1);
/// Depths along a ray; their inverses lie closer to each other far away, where scenes before one row of cameras are.
const DEPTHS: usize = 96;
/// The nearest of them, in median distances of the cameras from their middle.
const NEAREST: f64 = 0.25;
/// Patches of one kind in one photograph, at most.
const PATCHES: usize = 30;
/// Least standard deviation of the values of a patch, of 1: plain ones are found everywhere.
const TEXTURE: f32 = 0.02;
/// Patches without which nothing is said.
pub(crate) const FEWEST: usize = 40;
/// Photographs that show a rigid scene have a [`Score`] above this.
pub(crate) const RIGID: f64 = 0.06;

/// A small photograph and its camera.
#[derive(Clone, Copy)]
pub(crate) struct Posed<'a> {
    pub image: &'a Image,
    pub camera: &'a Camera,
}

/// How much better patches are found where their rays lead than in the mirrored picture, as a difference of correlations; with its
/// standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Score {
    pub mean: f64,
    pub error: f64,
}

impl Score {
    /// That of the patches of several photographs, if there are enough.
    pub fn of(gains: &[f64]) -> Option<Self> {
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / count;
        (gains.len() >= FEWEST).then(|| Self { mean, error: (variance / count).sqrt() })
    }

    /// Whether that is a rigid scene, beyond two standard errors.
    pub fn is_rigid(self) -> bool {
        self.mean - 2.0 * self.error > RIGID
    }

    /// Whether it is larger than another one by more than so many standard errors.
    pub fn is_above(self, other: Self, errors: f64) -> bool {
        self.mean - other.mean > errors * self.error.hypot(other.error)
    }
}

/// The score of whole photographs, of pairs whose cameras are at least this share of their [`distance`] apart.
pub(crate) fn score(posed: &[Posed], least: f64) -> Option<Score> {
    let distance = distance(posed);
    let of_pair = |(k, other): (usize, usize)| gains_of_all(posed[k], posed[other], distance);
    let found: Vec<Vec<f64>> = pairs(posed, least * distance).into_par_iter().map(of_pair).collect();
    Score::of(&found.concat())
}

/// [`gains`] of patches from all over a photograph.
pub(crate) fn gains_of_all(from: Posed, to: Posed, distance: f64) -> Vec<f64> {
    gains(from, to, &centres([from.image.width, from.image.height], |_| true), distance)
}

/// Each photograph and the one whose camera is nearest to its own, but more than `least` away, where there is one.
pub(crate) fn pairs(posed: &[Posed], least: f64) -> Vec<(usize, usize)> {
    let away = |a: usize, b: usize| (place(posed[a]) - place(posed[b])).length();
    let nearest = |of: usize| {
        let others = (0..posed.len()).filter(|&k| k != of && away(k, of) > least);
        others.min_by(|&a, &b| away(a, of).total_cmp(&away(b, of)))
    };
    (0..posed.len()).filter_map(|k| Some((k, nearest(k)?))).collect()
}

fn place(posed: Posed) -> Vec3<f64> {
    posed.camera.world_from_camera.translation
}

/// How far away the cameras stand from what they look at, roughly: half of the width of where they stand will do.
pub(crate) fn distance(posed: &[Posed]) -> f64 {
    distance_of(posed.iter().map(|p| place(*p)))
}

/// [`distance`] by the places of the cameras.
pub(crate) fn distance_of(places: impl ExactSizeIterator<Item = Vec3<f64>> + Clone) -> f64 {
    let count = places.len().max(1) as f64;
    let mean = places.clone().fold(Vec3::zero(), |sum, p| sum + p) / count;
    quantile(places.map(|p| (p - mean).length()), 0.5).unwrap_or(0.0)
}

/// Centres of patches of a picture of this size all of whose pixels are wanted.
pub(crate) fn centres([width, height]: [u32; 2], is_wanted: impl Fn([i64; 2]) -> bool) -> Vec<[i64; 2]> {
    let [w, h] = [width, height].map(i64::from);
    let all = (HALF..h - HALF).step_by(2).flat_map(|y| (HALF..w - HALF).step_by(2).map(move |x| [x, y]));
    all.filter(|&[x, y]| offsets().all(|[dx, dy]| is_wanted([x + dx, y + dy]))).collect()
}

fn offsets() -> impl Iterator<Item = [i64; 2]> {
    (-HALF..=HALF).flat_map(|y| (-HALF..=HALF).map(move |x| [x, y]))
}

/// How alike two pictures are at one place, as a correlation; `None` where one of them is plain.
pub(crate) fn alike(a: &Image, b: &Image, at: [i64; 2]) -> Option<f64> {
    Some(product(&normalized(window(a, at))?, &normalized(window(b, at))?))
}

/// For some of the patches around these centres, how much better each is found than in the mirrored picture.
pub(crate) fn gains(from: Posed, to: Posed, centres: &[[i64; 2]], distance: f64) -> Vec<f64> {
    let textured = centres.iter().filter_map(|&at| Some((at, normalized(window(from.image, at))?)));
    let textured: Vec<([i64; 2], Patch)> = textured.collect();
    let step = textured.len().div_ceil(PATCHES).max(1);
    let gain = |(at, patch): &([i64; 2], Patch)| {
        let rays = rays(from.camera, *at)?;
        let best = |mirrored: bool| {
            let at_depth = |k: usize| {
                let share = 1.0 - k as f64 / DEPTHS as f64;
                correlation(patch, &rays, NEAREST * distance / (share * share), to, mirrored)
            };
            (0..DEPTHS).filter_map(at_depth).reduce(f64::max)
        };
        Some(best(false)? - best(true)?)
    };
    textured.iter().step_by(step).filter_map(gain).collect()
}

type Patch = [[f32; 3]; PIXELS];

fn product(a: &Patch, b: &Patch) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a * b)).sum()
}

fn window(image: &Image, [x, y]: [i64; 2]) -> Patch {
    let mut patch = [[0.0; 3]; PIXELS];
    for (value, [dx, dy]) in patch.iter_mut().zip(offsets()) {
        let [r, g, b, _] = image.rgba(((y + dy) * i64::from(image.width) + x + dx) as usize);
        *value = [r, g, b];
    }
    patch
}

/// Without its mean colour, and of length 1; `None` where it is plain.
fn normalized(mut patch: Patch) -> Option<Patch> {
    for c in 0..3 {
        let mean = patch.iter().map(|p| p[c]).sum::<f32>() / PIXELS as f32;
        patch.iter_mut().for_each(|p| p[c] -= mean);
    }
    let square: f32 = patch.iter().flatten().map(|v| v * v).sum();
    let length = square.sqrt();
    (length > TEXTURE * ((3 * PIXELS) as f32).sqrt()).then(|| patch.map(|p| p.map(|v| v / length)))
}

/// Places and steps per depth along the axis: the rays of a patch.
struct Rays {
    origin: Vec3<f64>,
    directions: [Vec3<f64>; PIXELS],
}

fn rays(camera: &Camera, [x, y]: [i64; 2]) -> Option<Rays> {
    let mut directions = [Vec3::zero(); PIXELS];
    for (direction, [dx, dy]) in directions.iter_mut().zip(offsets()) {
        let ray = camera.ray((x + dx) as f64 + 0.5, (y + dy) as f64 + 0.5)?;
        *direction = ray.direction / ray.direction.dot(camera.forward()).max(0.1);
    }
    Some(Rays { origin: camera.world_from_camera.translation, directions })
}

/// The correlation of a patch with what another view shows at this depth; `None` out of its picture.
fn correlation(patch: &Patch, rays: &Rays, depth: f64, to: Posed, mirrored: bool) -> Option<f64> {
    let mut there = [[0.0; 3]; PIXELS];
    for (value, direction) in there.iter_mut().zip(&rays.directions) {
        *value = sample(to.image, to.camera.project(rays.origin + *direction * depth)?, mirrored)?;
    }
    Some(product(patch, &normalized(there)?))
}

/// The colour at a place in the picture.
fn sample(image: &Image, [u, v]: [f64; 2], mirrored: bool) -> Option<[f32; 3]> {
    let [w, h] = [image.width as usize, image.height as usize];
    let u = if mirrored { w as f64 - u } else { u };
    let (x, y) = (u - 0.5, v - 0.5);
    if !(x >= 0.0 && y >= 0.0 && x < (w - 1) as f64 && y < (h - 1) as f64) {
        return None;
    }
    let (column, row) = (x as usize, y as usize);
    let (s, t) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let at = |dx: usize, dy: usize| image.rgba((row + dy) * w + column + dx);
    let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
    let mix = |k: usize| (1.0 - t) * ((1.0 - s) * a[k] + s * b[k]) + t * ((1.0 - s) * c[k] + s * d[k]);
    Some([mix(0), mix(1), mix(2)])
}
