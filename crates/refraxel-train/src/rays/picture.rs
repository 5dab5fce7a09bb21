//! A photograph that is looked at as a whole.

use super::view::{DirectionTable, TrainingView};
use refraxel_core::radiance::Filter;
use refraxel_core::{Camera, Lens};
use refraxel_data::{Image, Mask};
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

/// How the directions of a photograph's pixels are found.
#[derive(Clone, Copy, Debug)]
pub enum Directions<'a> {
    /// By the focal lengths and the centre of a camera without distortion.
    Pinhole,
    /// In a table of unit directions in the camera frame, one per pixel; NaN where the lens sees nothing.
    Table(&'a DirectionTable),
    /// The lens is inverted ray by ray.
    Inverted,
}

impl<'a> Picture<'a> {
    /// Name of the view.
    pub fn name(&self) -> &'a str {
        &self.view.name
    }

    /// The mask of what is refractive that the data have.
    pub fn mask(&self) -> Option<&Arc<Mask>> {
        self.view.stated()
    }

    /// The mask of what is refractive as it is by now: that of the data, or what was found, with its border where it was moved.
    pub fn refractive(&self) -> Option<&Arc<Mask>> {
        self.view.refractive()
    }

    /// Its pixels.
    pub fn image(&self) -> &'a Image {
        &self.view.photo.image
    }

    /// Whether a mask keeps some of its pixels from being used.
    pub fn is_restricted(&self) -> bool {
        self.view.photo.mask.is_some() && self.mask().is_none()
    }

    /// Whether a mask lets the pixel count.
    pub fn used(&self, pixel: usize) -> bool {
        self.view.used(pixel)
    }

    /// What gives it the exposure that all have in common.
    pub fn exposure(&self) -> &'a Filter<f32> {
        &self.view.exposure
    }

    /// How the directions of its pixels are found.
    pub fn directions(&self) -> Directions<'a> {
        let is_given = self.camera.has_lens_of(&self.view.given);
        match &self.view.directions {
            _ if self.camera.lens == Lens::Pinhole => Directions::Pinhole,
            Some(table) if is_given => Directions::Table(table),
            _ => Directions::Inverted,
        }
    }

    /// Means over a grid of cells that fills the picture, x fastest: of colour times alpha, and of alpha, which is 1 where pictures
    /// are not transparent. At most 4 × 4 pixels of a cell are looked at, evenly spread. `None` where half of them must
    /// not be used.
    pub fn reduced(&self, [width, height]: [usize; 2]) -> Vec<Option<[f32; 4]>> {
        let full = [self.camera.width as usize, self.camera.height as usize];
        let columns: Vec<Vec<usize>> = (0..width).map(|cell| sampled(cell, width, full[0])).collect();
        let mut means = Vec::with_capacity(width * height);
        for row in 0..height {
            let rows = sampled(row, height, full[1]);
            means.extend(columns.iter().map(|columns| self.mean(columns, &rows)));
        }
        means
    }

    /// The mean over some pixels.
    fn mean(&self, columns: &[usize], rows: &[usize]) -> Option<[f32; 4]> {
        let (mut sum, mut used, width) = ([0.0_f32; 4], 0, self.camera.width as usize);
        for pixel in rows.iter().flat_map(|y| columns.iter().map(move |x| y * width + x)) {
            if self.used(pixel) {
                used += 1;
                let [r, g, b, alpha] = self.rgba(pixel);
                sum.iter_mut().zip([r * alpha, g * alpha, b * alpha, alpha]).for_each(|(s, v)| *s += v);
            }
        }
        (2 * used > columns.len() * rows.len()).then(|| sum.map(|s| s / used as f32))
    }

    fn rgba(&self, pixel: usize) -> [f32; 4] {
        if self.transparent {
            return self.view.photo.image.rgba(pixel);
        }
        let [r, g, b] = self.view.colour(pixel, None);
        [r, g, b, 1.0]
    }
}

/// Rows and columns of a cell that are looked at, at most: the mean of 16 pixels errs by a quarter of their deviation, and large
/// photographs cost no more than small ones.
const SAMPLED: usize = 4;

/// The pixels of a cell along an edge of so many cells and pixels.
pub(super) fn sampled(cell: usize, cells: usize, pixels: usize) -> Vec<usize> {
    let start = |cell: usize| (cell * pixels).div_ceil(cells);
    let (from, to) = (start(cell), start(cell + 1));
    let count = (to - from).min(SAMPLED);
    (0..count).map(|k| from + (2 * k + 1) * (to - from) / (2 * count)).collect()
}
