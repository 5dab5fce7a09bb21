//! The ray through a pixel.

use refraxel_core::{Camera, Ray};

/// The ray through the centre of pixel `row * width + column`.
pub fn pixel_ray(camera: &Camera, pixel: usize) -> Option<Ray<f32>> {
    ray_within(camera, pixel, [0.5; 2])
}

/// The ray through a point of a pixel; (0, 0) is its upper left corner, (1, 1) its lower right one.
pub fn ray_within(camera: &Camera, pixel: usize, at: [f64; 2]) -> Option<Ray<f32>> {
    let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
    camera.ray(f64::from(x) + at[0], f64::from(y) + at[1]).map(|r| r.cast())
}
