//! What a camera sees at the edge of its picture.

use refraxel_core::{Camera, Ray};

/// Rays through the border of the image, corners included.
pub(super) fn border(camera: &Camera) -> impl Iterator<Item = Ray<f64>> + '_ {
    const STEPS: usize = 8; // per side
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    (0..STEPS).flat_map(move |i| {
        let t = i as f64 / STEPS as f64;
        let around = [[t * w, 0.0], [w, t * h], [w - t * w, h], [0.0, h - t * h]];
        around.into_iter().filter_map(|[u, v]| camera.ray(u, v))
    })
}
