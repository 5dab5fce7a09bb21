//! The ray through a pixel, and what a pixel covers.

use refraxel_core::{Camera, Ray, Vec3};

/// The ray through the centre of pixel `row * width + column`.
pub fn pixel_ray(camera: &Camera, pixel: usize) -> Option<Ray<f32>> {
    ray_within(camera, pixel, [0.5; 2])
}

/// The ray through a point of a pixel; (0, 0) is its upper left corner, (1, 1) its lower right one.
pub fn ray_within(camera: &Camera, pixel: usize, at: [f64; 2]) -> Option<Ray<f32>> {
    let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
    camera.ray(f64::from(x) + at[0], f64::from(y) + at[1]).map(|r| r.cast())
}

/// Size of a pixel at a point, the median over some cameras [scene unit]: distance over focal length.
pub fn pixel_size<'a>(cameras: impl Iterator<Item = &'a Camera>, at: Vec3<f64>) -> f64 {
    let size = |c: &Camera| (c.world_from_camera.translation - at).length() / c.focal[0].max(c.focal[1]);
    let mut sizes: Vec<f64> = cameras.map(size).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied().unwrap_or(1.0)
}
