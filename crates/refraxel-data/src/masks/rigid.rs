//! Which side of masks shows a rigid scene: patches of a photograph are sought along their rays in the nearest other one.
//!
//! Opaque things that stand still are found again, whatever the light. What moves with the camera, changes from view to view or
//! refracts is not.

use super::meaning::Seen;
use crate::region::quantile;
use rayon::prelude::*;
use refraxel_core::{Camera, Vec3};

/// Half the edge of a patch [pixel of the small picture].
const HALF: i64 = 2;
/// Pixels of a patch.
const PIXELS: usize = (2 * HALF as usize + 1) * (2 * HALF as usize + 1);
/// Depths along a ray, even in their inverse.
const DEPTHS: usize = 64;
/// The nearest of them, in median distances of the cameras from what they look at.
const NEAREST: f64 = 0.25;
/// Patches of one side of one photograph, at most.
const PATCHES: usize = 30;
/// Least standard deviation of the values of a patch, of 1: plain ones are found everywhere.
const TEXTURE: f32 = 0.02;
/// Patches of a side without which nothing is said of it.
const FEWEST: usize = 40;

/// How much better patches of one side of the masks are found where their rays lead than in the mirrored picture, as a difference of
/// correlations; with its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    pub mean: f64,
    pub error: f64,
}

/// The scores of what is white and of what is black, where enough of it has texture.
pub(super) fn sides(seen: &[Seen]) -> [Option<Score>; 2] {
    let distance = distance(seen);
    let pairs: Vec<(usize, usize)> = (0..seen.len()).filter_map(|k| Some((k, nearest(seen, k)?))).collect();
    let found: Vec<[Vec<f64>; 2]> = pairs
        .par_iter()
        .map(|&(k, other)| [true, false].map(|white| gains(&seen[k], &seen[other], white, distance)))
        .collect();
    [0, 1].map(|side| score(&found.iter().flat_map(|of| of[side].iter().copied()).collect::<Vec<f64>>()))
}

fn score(gains: &[f64]) -> Option<Score> {
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / count;
    (gains.len() >= FEWEST).then(|| Score { mean, error: (variance / count).sqrt() })
}

fn place(seen: &Seen) -> Vec3<f64> {
    seen.look.camera.world_from_camera.translation
}

/// The nearest other view.
fn nearest(seen: &[Seen], of: usize) -> Option<usize> {
    let away = |k: &usize| (place(&seen[*k]) - place(&seen[of])).length();
    (0..seen.len()).filter(|k| *k != of && away(k) > 0.0).min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// How far away the cameras stand from what they look at, roughly: half of the width of where they stand will do.
fn distance(seen: &[Seen]) -> f64 {
    let mean = seen.iter().fold(Vec3::zero(), |sum, s| sum + place(s)) / seen.len().max(1) as f64;
    quantile(seen.iter().map(|s| (place(s) - mean).length()), 0.5)
}

/// How well patches of what is white and of what is black are found at the same pixels of the nearest other view: 1 where nothing moves in
/// the picture.
pub(super) fn stillness(seen: &[Seen]) -> Option<[f64; 2]> {
    let of = |white: bool| {
        let pairs = (0..seen.len()).filter_map(|k| Some((&seen[k], &seen[nearest(seen, k)?])));
        let alike = pairs.filter(|(from, to)| from.mask.small.coverage.len() == to.mask.small.coverage.len());
        let correlations = alike.flat_map(|(from, to)| {
            let there = move |at| [from, to].map(|s| normalized(window(s, at)));
            patches(from, white).into_iter().filter_map(move |at| match there(at) {
                [Some(here), Some(there)] => Some(product(&here, &there)),
                _ => None,
            })
        });
        let all: Vec<f64> = correlations.collect();
        (all.len() >= FEWEST).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    Some([of(true)?, of(false)?])
}

fn product(a: &Patch, b: &Patch) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a * b)).sum()
}

/// For each patch of one side, how much better it is found than in the mirrored picture.
fn gains(from: &Seen, to: &Seen, white: bool, distance: f64) -> Vec<f64> {
    let patches = patches(from, white);
    let step = patches.len().div_ceil(PATCHES).max(1);
    let gain = |&[x, y]: &[i64; 2]| {
        let rays = rays(&from.look.camera, [x, y])?;
        let patch = normalized(window(from, [x, y]))?;
        let best = |mirrored: bool| {
            let at_depth = |k: usize| {
                let inverse = (1.0 - k as f64 / DEPTHS as f64) / (NEAREST * distance);
                correlation(&patch, &rays, 1.0 / inverse, to, mirrored)
            };
            (0..DEPTHS).filter_map(at_depth).reduce(f64::max)
        };
        Some(best(false)? - best(true)?)
    };
    patches.iter().step_by(step).filter_map(gain).collect()
}

/// Centres of patches that lie on one side.
fn patches(from: &Seen, white: bool) -> Vec<[i64; 2]> {
    let mask = &from.mask.small;
    let [w, h] = [mask.width, mask.height].map(i64::from);
    let is_on_side = |[x, y]: [i64; 2]| {
        let c = mask.coverage[(y * w + x) as usize];
        if white { c > 200 } else { c < 55 }
    };
    let centres = (HALF..h - HALF).step_by(2).flat_map(|y| (HALF..w - HALF).step_by(2).map(move |x| [x, y]));
    centres.filter(|&[x, y]| offsets().all(|[dx, dy]| is_on_side([x + dx, y + dy]))).collect()
}

fn offsets() -> impl Iterator<Item = [i64; 2]> {
    (-HALF..=HALF).flat_map(|y| (-HALF..=HALF).map(move |x| [x, y]))
}

type Patch = [[f32; 3]; PIXELS];

fn window(from: &Seen, [x, y]: [i64; 2]) -> Patch {
    let image = &from.look.small;
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
fn correlation(patch: &Patch, rays: &Rays, depth: f64, to: &Seen, mirrored: bool) -> Option<f64> {
    let mut there = [[0.0; 3]; PIXELS];
    for (value, direction) in there.iter_mut().zip(&rays.directions) {
        *value = sample(to, to.look.camera.project(rays.origin + *direction * depth)?, mirrored)?;
    }
    Some(product(patch, &normalized(there)?))
}

/// The colour at a place in the picture.
fn sample(of: &Seen, [u, v]: [f64; 2], mirrored: bool) -> Option<[f32; 3]> {
    let image = &of.look.small;
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
