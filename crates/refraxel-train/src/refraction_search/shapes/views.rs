//! Exact silhouettes of ideal bodies, for tests.

use super::body::{ShapeBody, Substance};
use crate::random::Random;
use crate::silhouettes::around::{FAR, FIELD, cameras_between, mask};
use crate::silhouettes::{Outlines, Silhouette, Vote};
use rayon::prelude::*;
use refraxel_core::{Aabb, Camera, Domain, Extent, LevelSet, Ray, Vec3};
use refraxel_data::Mask;

/// Width of a picture [pixel].
pub(super) const SIZE: u32 = 200;

/// What a pixel covers at the middle of the body [scene unit].
pub(super) fn footprint() -> f64 {
    FAR * (0.5 * FIELD).tan() / (0.5 * f64::from(SIZE))
}

/// `count` cameras spread evenly over the part of a sphere whose height above the horizon has a sine in this
/// range.
pub(super) fn cameras(count: usize, sines: [f64; 2]) -> Vec<Camera> {
    cameras_between(sines, count, FIELD, SIZE)
}

/// What rays meet.
pub(super) fn silhouette(camera: &Camera, meets: impl Fn(&Ray<f64>) -> bool) -> Silhouette {
    let mask = mask(camera, 6, |u, v| camera.ray(u, v).is_some_and(|r| meets(&r)));
    Silhouette { camera: *camera, mask: mask.into(), occluders: None }
}

/// Silhouettes in all views.
pub(super) fn silhouettes(cameras: &[Camera], meets: impl Fn(&Ray<f64>) -> bool + Sync) -> Vec<Silhouette> {
    cameras.par_iter().map(|c| silhouette(c, &meets)).collect()
}

/// Whether a ray meets a body given by a lower bound of the distance from it.
pub(super) fn meets_body(distance: impl Fn(Vec3<f64>) -> f64) -> impl Fn(&Ray<f64>) -> bool {
    move |ray| {
        let mut t = FAR - 2.0;
        for _ in 0..80 {
            let d = distance(ray.at(t));
            if d < 1e-4 {
                return true;
            }
            t += d;
            if t > FAR + 2.0 {
                return false;
            }
        }
        false
    }
}

/// Masks whose edges are displaced by up to `pixels`, differently in each pixel.
pub(super) fn shaken(views: Vec<Silhouette>, pixels: f64) -> Vec<Silhouette> {
    let shake = |(v, mut view): (usize, Silhouette)| {
        let random = Random::new(v as u64);
        let (w, h) = (view.mask.width as i64, view.mask.height as i64);
        let old = &view.mask.coverage;
        let mut coverage = old.clone();
        for i in 0..w * h {
            let by = |k: u64| ((2.0 * random.uniform(i as u64, k) - 1.0) * pixels).round() as i64;
            let (x, y) = ((i % w + by(0)).clamp(0, w - 1), (i / w + by(1)).clamp(0, h - 1));
            coverage[i as usize] = old[(y * w + x) as usize];
        }
        view.mask = Mask { coverage, width: view.mask.width, height: view.mask.height }.into();
        view
    };
    views.into_iter().enumerate().map(shake).collect()
}

/// The visual hull in a cube of half width `half`, as a level set.
pub(super) fn hull(outlines: &Outlines, half: f32, nodes: u32) -> LevelSet<f32> {
    let bounds = Aabb::cube(half);
    let domain = Domain { bounds, extent: Extent::Bounded, resolution: [nodes; 3] };
    let reach = 4.0 * domain.voxel();
    let distance = outlines.hull(&domain, &Vote::default()).distance;
    let near = distance.iter().map(|d| d.clamp(-reach, reach)).collect();
    let mut surface = LevelSet::from_coefficients(bounds, [nodes; 3], near).unwrap();
    surface.redistance();
    surface
}

/// The index at a point of bodies of which the later one rules.
pub(super) fn index(bodies: &[ShapeBody], x: Vec3<f32>) -> f32 {
    let ruling = bodies.iter().rev().find(|b| b.surface.is_inside(x));
    ruling.map_or(1.0, |b| match b.substance {
        Substance::Glass => 1.5,
        Substance::Air => 1.0,
        Substance::Water => 1.33,
    })
}

/// The values of an index along a line, and how long each lasts [scene unit], to 1e-4.
pub(super) fn runs(index: impl Fn(f32) -> f32, [from, to]: [f32; 2]) -> Vec<(f32, f32)> {
    const STEP: f32 = 1e-4;
    let mut runs: Vec<(f32, f32)> = Vec::new();
    for k in 0..((to - from) / STEP) as usize {
        let n = index(from + STEP * k as f32);
        match runs.last_mut() {
            Some(last) if last.0 == n => last.1 += STEP,
            _ => runs.push((n, STEP)),
        }
    }
    runs
}
