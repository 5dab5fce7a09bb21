//! The rays that are measured.

use crate::backend::Batch;
use crate::random::Random;
use refraxel_core::{Camera, Ray, Vec3, vec3};

fn batch_of(rays: Vec<Ray<f32>>) -> Batch {
    let n = rays.len();
    Batch { rays, target: vec![[0.5; 3]; n], offset: vec![0.5; n], ..Batch::default() }
}

/// Rays from cameras all around at distance 4 towards points near the box's middle.
pub(super) fn random_batch(n: usize) -> Batch {
    let random = Random::new(1);
    let rays = (0..n as u64).map(|i| {
        let u = |k: u64| random.uniform(i, k) as f32;
        let (azimuth, height) = (std::f32::consts::TAU * u(0), 0.1 + 0.8 * u(1));
        let flat = (1.0 - height * height).sqrt();
        let origin = vec3(flat * azimuth.cos(), flat * azimuth.sin(), height) * 4.0;
        let target = vec3(u(2) - 0.5, u(3) - 0.5, u(4) - 0.5) * 1.2;
        Ray { origin, direction: (target - origin).normalized() }
    });
    batch_of(rays.collect())
}

/// The middle of a picture in 8 × 8 tiles.
pub(super) fn coherent_batch(n: usize) -> Batch {
    let side = ((n as f64).sqrt() as u32).next_multiple_of(8);
    let eye = vec3(2.6, 1.9, 2.4);
    let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.35, [side, side]);
    let rays = (0..n as u32).map(|i| {
        let (tile, within) = (i / 64, i % 64);
        let (x, y) = (tile % (side / 8) * 8 + within % 8, tile / (side / 8) * 8 + within / 8);
        camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5).expect("a pinhole has no blind pixel").cast()
    });
    batch_of(rays.collect())
}
