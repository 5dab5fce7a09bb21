//! The layers of a picture: what rays return becomes colours.

use super::protocol::Shown;
use super::scene::Scene;
use crate::colour_map::ColourMap;
use crate::verbs::render::depth;
use crate::verbs::render::refractive::Refractive;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::quantize;
use refraxel_train::Backend;
use refraxel_train::evaluation::Light;
use refraxel_train::model::index_edit::index_range;
use refraxel_train::rays::ray_within;
use std::ops::Range;

/// Less opaque pixels have no depth.
const VISIBLE: f32 = 0.1;
/// Edge of a tile, whose rays share their voxels [pixel].
const TILE: u32 = 8;
/// What has no value.
const NOTHING: [u8; 3] = [246, 246, 248];

impl Shown {
    /// Renderings per pixel: mirrored light is a difference of two.
    pub fn rays_per_pixel(self) -> f64 {
        if self == Self::Reflection { 2.0 } else { 1.0 }
    }

    /// Several rays per pixel make it better.
    pub fn is_averaged(self) -> bool {
        !matches!(self, Self::Index | Self::Normal)
    }
}

/// Sums over the rays of each pixel.
pub struct Canvas {
    shown: Shown,
    size: [u32; 2],
    /// Colour, opacity, and depth times opacity.
    sums: Vec<[f32; 5]>,
    /// Rays per pixel.
    counts: Vec<u32>,
    /// Depths of the first and of the last colour, from the first pass.
    depths: Option<[f32; 2]>,
}

impl Canvas {
    /// An empty canvas.
    pub fn new(shown: Shown, size: [u32; 2]) -> Self {
        let mut canvas = Self { shown, size, sums: Vec::new(), counts: Vec::new(), depths: None };
        canvas.clear(size);
        canvas
    }

    /// Starts anew, in another size.
    pub fn clear(&mut self, size: [u32; 2]) {
        let count = size[0] as usize * size[1] as usize;
        self.size = size;
        self.sums.clear();
        self.sums.resize(count, [0.0; 5]);
        self.counts.clear();
        self.counts.resize(count, 0);
    }

    /// One more ray in each pixel of some rows, at this place of the pixel.
    pub fn paint(&mut self, scene: &Scene, camera: &Camera, rows: Range<u32>, at: [f64; 2]) {
        if !self.shown.is_averaged() {
            return self.paint_medium(scene, camera, rows);
        }
        let order = tiles(self.size[0], rows);
        let rays: Vec<(usize, Ray<f32>)> =
            order.into_iter().filter_map(|p| Some((p, ray_within(camera, p, at)?))).collect();
        let only: Vec<Ray<f32>> = rays.iter().map(|(_, ray)| *ray).collect();
        for ((p, _), pixel) in rays.iter().zip(self.render(scene, &only)) {
            let [r, g, b] = pixel.colour;
            let added = [r, g, b, 1.0 - pixel.transmittance, pixel.depth];
            self.sums[*p].iter_mut().zip(added).for_each(|(sum, x)| *sum += x);
            self.counts[*p] += 1;
        }
    }

    fn render(&self, scene: &Scene, rays: &[Ray<f32>]) -> Vec<Pixel<f32>> {
        let light = match self.shown {
            Shown::Reflection => Light::Reflected,
            Shown::Transmission => Light::Transmitted,
            _ => Light::All,
        };
        light.of(rays, |rays, layers| scene.render(rays, layers))
    }

    /// The refractive media that the rays of some rows meet.
    fn paint_medium(&mut self, scene: &Scene, camera: &Camera, rows: Range<u32>) {
        let (medium, domain) = (scene.backend().medium(), scene.backend().domain());
        let center = [camera.center[0], camera.center[1] - f64::from(rows.start)];
        let strip = Camera { height: rows.end - rows.start, center, ..*camera };
        let first = rows.start as usize * self.size[0] as usize;
        let met = Refractive::of(medium, domain, scene.marching().near, &strip);
        for (k, met) in met.met().iter().enumerate() {
            if let Some(met) = met {
                let Vec3 { x, y, z } = met.normal;
                self.sums[first + k] = [x, -y, -z, met.index, met.depth];
                self.counts[first + k] = 1;
            }
        }
    }

    /// The colours, three bytes per pixel, and the values of the first and of the last where they stand for numbers.
    pub fn colours(&mut self, scene: &Scene) -> (Vec<u8>, Option<[f32; 2]>) {
        let range = match self.shown {
            Shown::Index => {
                let [low, high] = index_range(scene.backend().medium());
                Some([low, high.max(low + 1e-3)])
            }
            Shown::Depth => Some(self.depth_range()),
            Shown::Opacity => Some([0.0, 1.0]),
            _ => None,
        };
        let [low, high] = range.unwrap_or([0.0, 1.0]);
        let colour = |(sum, &count): (&[f32; 5], &u32)| {
            let share = 1.0 / count.max(1) as f32;
            let [r, g, b, opacity, depth] = sum.map(|x| share * x);
            match self.shown {
                Shown::Index | Shown::Normal if count == 0 => NOTHING,
                Shown::Index => ColourMap::Viridis.at((opacity - low) / (high - low)),
                Shown::Normal => [r, g, b].map(|x| quantize(0.5 * (x + 1.0))),
                Shown::Depth if opacity <= VISIBLE => NOTHING,
                Shown::Depth => ColourMap::Viridis.at((high - depth / opacity) / (high - low)),
                Shown::Opacity => [quantize(opacity); 3],
                _ => [r, g, b].map(quantize),
            }
        };
        let pixels = self.sums.iter().zip(&self.counts).flat_map(colour).collect();
        (pixels, range)
    }

    /// The depths of the first and of the last colour, which stay those of the first pass.
    fn depth_range(&mut self) -> [f32; 2] {
        let (sums, counts) = (&self.sums, &self.counts);
        *self.depths.get_or_insert_with(|| {
            let seen = sums.iter().zip(counts).filter(|(s, c)| s[3] > depth::OPAQUE * **c as f32);
            depth::range(seen.map(|(s, _)| s[4] / s[3]).collect()).unwrap_or([0.0, 0.0_f32.next_up()])
        })
    }
}

/// The pixels of some rows in tiles.
fn tiles(width: u32, rows: Range<u32>) -> Vec<usize> {
    let mut order = Vec::with_capacity((width * (rows.end - rows.start)) as usize);
    for ty in rows.clone().step_by(TILE as usize) {
        for tx in (0..width).step_by(TILE as usize) {
            for y in ty..(ty + TILE).min(rows.end) {
                order.extend((tx..(tx + TILE).min(width)).map(|x| (y * width + x) as usize));
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_every_pixel_of_their_rows_once() {
        let mut order = tiles(19, 8..21);
        order.sort_unstable();
        assert_eq!(order, (8 * 19..21 * 19).collect::<Vec<_>>());
    }
}
