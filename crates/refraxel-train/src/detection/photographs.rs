//! Photographs with few pixels: what straight rays learn from while the detector looks.

use crate::rays::{Picture, RaySampler, cells, pixel_ray};
use rayon::prelude::*;
use refraxel_core::{Camera, Ray};
use refraxel_data::Mask;

/// A photograph on cells of some pixels.
pub(super) struct Small {
    /// The view, with one pixel per cell.
    pub camera: Camera,
    /// The ray through the middle of each cell; none where the lens shows nothing.
    pub rays: Vec<Option<Ray<f32>>>,
    /// Mean colour of each cell times its alpha, and mean alpha; none where the photograph says nothing.
    pub cells: Vec<Option<[f32; 4]>>,
    /// Share of each cell that the data's mask of refractive things covers, where there is one.
    pub stated: Option<Vec<f32>>,
}

/// The view with one pixel per cell of so many pixels.
pub(super) fn coarse(camera: &Camera, edge: f64) -> Camera {
    let cells = |n: u32| ((f64::from(n) / edge).round() as u32).clamp(1, n);
    camera.resized(cells(camera.width), cells(camera.height))
}

/// Edge of a cell for so many cells of all views [pixel].
pub(super) fn cell_edge(sampler: &RaySampler, cells: u32) -> f64 {
    (sampler.pixels() as f64 / f64::from(cells)).sqrt().max(1.0)
}

/// All photographs with about so many cells together. Cameras are where they are by now.
pub(super) fn small(sampler: &RaySampler, cells: u32) -> Vec<Small> {
    let edge = cell_edge(sampler, cells);
    let pictures: Vec<Picture> = sampler.pictures().collect();
    pictures.par_iter().map(|picture| Small::new(picture, edge)).collect()
}

impl Small {
    fn new(picture: &Picture, edge: f64) -> Self {
        let camera = coarse(picture.camera, edge);
        let size = [camera.width as usize, camera.height as usize];
        let rays: Vec<_> = (0..size[0] * size[1]).map(|cell| pixel_ray(&camera, cell)).collect();
        let mut cells = picture.reduced(size);
        cells.iter_mut().zip(&rays).filter(|(_, ray)| ray.is_none()).for_each(|(cell, _)| *cell = None);
        Self { camera, rays, cells, stated: picture.mask().map(|mask| covered(mask, size)) }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.camera.width as usize, self.camera.height as usize]
    }
}

/// Share of each cell that a mask covers.
fn covered(mask: &Mask, grid: [usize; 2]) -> Vec<f32> {
    let full = [mask.width as usize, mask.height as usize];
    let (mut sums, mut counts) = (vec![0.0_f32; grid[0] * grid[1]], vec![0.0_f32; grid[0] * grid[1]]);
    cells(full, grid).for_each(|(cell, pixel)| {
        sums[cell] += f32::from(mask.coverage[pixel]) / 255.0;
        counts[cell] += 1.0;
    });
    sums.iter().zip(&counts).map(|(sum, count)| sum / count.max(1.0)).collect()
}
