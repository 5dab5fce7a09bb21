//! A photograph that is looked at as a whole.

use super::{TrainingView, WHITE};
use refraxel_core::Camera;
use refraxel_data::Mask;
use std::sync::Arc;

/// The cell of each pixel of a picture that a grid of cells fills, and the pixel; all in order, x fastest.
pub(crate) fn cells([w, h]: [usize; 2], [across, down]: [usize; 2]) -> impl Iterator<Item = (usize, usize)> {
    (0..h).flat_map(move |y| {
        let row = y * down / h * across;
        (0..w).map(move |x| (row + x * across / w, y * w + x))
    })
}

/// A photograph and its view.
#[derive(Clone, Copy)]
pub struct Picture<'a> {
    /// The view.
    pub camera: &'a Camera,
    pub(super) view: &'a TrainingView,
    pub(super) transparent: bool,
}

impl Picture<'_> {
    /// The mask of what is refractive that the data have.
    pub fn mask(&self) -> Option<&Arc<Mask>> {
        self.view.stated()
    }

    /// Mean colours over a grid of cells that fills the picture, x fastest, before white where pictures are transparent.
    /// `None` where half of a cell's pixels must not be used.
    pub fn means(&self, [width, height]: [usize; 2]) -> Vec<Option<[f32; 3]>> {
        let full = [self.camera.width as usize, self.camera.height as usize];
        let mut sums = vec![[0.0_f32; 3]; width * height];
        let (mut used, mut all) = (vec![0_u32; sums.len()], vec![0_u32; sums.len()]);
        cells(full, [width, height]).for_each(|(cell, pixel)| {
            all[cell] += 1;
            if self.view.used(pixel) {
                used[cell] += 1;
                let colour = self.view.colour(pixel, self.transparent.then_some(WHITE));
                (0..3).for_each(|c| sums[cell][c] += colour[c]);
            }
        });
        let mean =
            |cell: usize| (2 * used[cell] > all[cell]).then(|| sums[cell].map(|sum| sum / used[cell] as f32));
        (0..sums.len()).map(mean).collect()
    }
}
