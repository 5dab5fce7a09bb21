//! What cameras around the origin show of ideal bodies, for tests.

use super::hull::Hull;
use super::{Occluders, Silhouette};
use rayon::prelude::*;
use refraxel_core::{Camera, Ray, Vec3, vec3};
use refraxel_data::Mask;

/// Distance of the cameras from the origin [scene unit], and their usual field of view [rad].
pub(crate) const FAR: f64 = 4.0;
pub(crate) const FIELD: f64 = 0.69;

/// A ball.
#[derive(Clone, Copy)]
pub(crate) struct Ball(pub Vec3<f64>, pub f64);

impl Ball {
    /// Arc length where a ray enters; infinite where it misses.
    fn enter(&self, ray: &Ray<f64>) -> f64 {
        let to = self.0 - ray.origin;
        let along = to.dot(ray.direction);
        let inside = self.1 * self.1 - (to.dot(to) - along * along);
        if inside < 0.0 || along < 0.0 { f64::INFINITY } else { along - inside.sqrt() }
    }
}

/// Arc length where a ray enters the first of these balls; infinite where it misses all.
pub(crate) fn first(balls: &[Ball], ray: &Ray<f64>) -> f64 {
    balls.iter().map(|b| b.enter(ray)).fold(f64::INFINITY, f64::min)
}

/// `count` cameras of `size`² pixels, spread over a sphere by the golden angle.
pub(crate) fn cameras(count: usize, size: u32) -> Vec<Camera> {
    cameras_between([1.0, -1.0], count, FIELD, size)
}

/// `count` cameras spread over the part of a sphere where the sine of the height above the horizon goes from the first of
/// `sines` to the second, with this field of view [rad] and `size`² pixels.
pub(crate) fn cameras_between(sines: [f64; 2], count: usize, field: f64, size: u32) -> Vec<Camera> {
    let eye = |i: usize| {
        let z = sines[0] + (sines[1] - sines[0]) * (i as f64 + 0.5) / count as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), i as f64 * 2.399_963);
        vec3(r * angle.cos(), r * angle.sin(), z) * FAR
    };
    let look = |i| Camera::look_at(eye(i), Vec3::zero(), vec3(0.1, 0.2, 1.0), field, [size; 2]);
    (0..count).map(look).collect()
}

/// Coverage of the pixels of an image by `inside`: sampled at the corners of pixels, and `n`² times where these differ.
pub(super) fn cover(size: [usize; 2], n: usize, inside: impl Fn(f64, f64) -> bool) -> Vec<u8> {
    let row = size[0] + 1;
    let corner = |k: usize| inside((k % row) as f64, (k / row) as f64);
    let corners: Vec<bool> = (0..row * (size[1] + 1)).map(corner).collect();
    let share = |i: usize| {
        let (x, y) = (i % size[0], i / size[0]);
        let k = y * row + x;
        let around = [k, k + 1, k + row, k + row + 1].map(|k| corners[k]);
        if around == [around[0]; 4] {
            return if around[0] { 255 } else { 0 };
        }
        let at = |p: usize, k: usize| p as f64 + (k as f64 + 0.5) / n as f64;
        let hits = (0..n * n).filter(|k| inside(at(x, k % n), at(y, k / n))).count();
        (hits as f64 * 255.0 / (n * n) as f64).round() as u8
    };
    (0..size[0] * size[1]).map(share).collect()
}

/// A camera's mask of what `shows` at a place in the picture [pixel], see [`cover`].
pub(crate) fn mask(camera: &Camera, n: usize, shows: impl Fn(f64, f64) -> bool) -> Mask {
    let size = [camera.width, camera.height].map(|n| n as usize);
    Mask { width: camera.width, height: camera.height, coverage: cover(size, n, shows) }
}

/// How far a camera sees before opaque balls.
pub(crate) fn occluders(camera: &Camera, mask: &Mask, opaque: &[Ball]) -> Occluders {
    let beyond = |p: &usize| {
        let [u, v] = [p % mask.width as usize, p / mask.width as usize].map(|p| p as f64 + 0.5);
        first(opaque, &camera.ray(u, v).unwrap()) as f32
    };
    Occluders::new(mask, 1, |pixels| pixels.iter().map(beyond).collect())
}

/// Intersection over union of a hull and balls.
pub(super) fn iou(hull: &Hull, balls: &[Ball]) -> f64 {
    let truth = |i: usize| {
        let x = hull.domain.place(i).cast::<f64>();
        balls.iter().any(|Ball(centre, radius)| (x - *centre).length() < *radius)
    };
    let count = |f: &dyn Fn(bool, bool) -> bool| {
        (0..hull.fraction.len()).filter(|&i| f(truth(i), hull.fraction[i] >= 0.5)).count() as f64
    };
    count(&|a, b| a && b) / count(&|a, b| a || b)
}

/// Silhouettes of glass balls, cut by opaque balls in front of them.
pub(crate) fn silhouettes(cameras: &[Camera], glass: &[Ball], opaque: &[Ball]) -> Vec<Silhouette> {
    let view = |camera: &Camera| {
        let shows = |ray: Ray<f64>| first(glass, &ray) < first(opaque, &ray);
        let mask = mask(camera, 6, |u, v| shows(camera.ray(u, v).unwrap()));
        let occluders = (!opaque.is_empty()).then(|| occluders(camera, &mask, opaque));
        Silhouette { camera: *camera, mask: mask.into(), occluders }
    };
    cameras.par_iter().map(view).collect()
}
