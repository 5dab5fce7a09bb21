//! What straight rays fail to show of each view.

use crate::backend::{Backend, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Task, Watch};
use crate::initial::{Occluders, Outlines, Silhouette};
use crate::rays::{Picture, RaySampler, cells, pixel_ray};
use rayon::prelude::*;
use refraxel_core::grid::{Border, GaussianKernel};
use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::Mask;
use std::sync::Arc;

/// A ray is hidden from where it has lost this share of its light.
const OPAQUE: f32 = 0.5;
/// Standard deviation of the blur of differences [cell], and where it ends.
const BLUR: (f32, usize) = (0.8, 2);

/// Residual of cells that a mask shows to be refractive: as large as that of glass where straight rays fail most.
const STATED: f32 = 0.3;

/// The view with one pixel per cell of so many pixels.
pub(super) fn coarse(camera: &Camera, edge: f64) -> Camera {
    let cells = |n: u32| ((f64::from(n) / edge).round() as u32).clamp(1, n);
    camera.resized(cells(camera.width), cells(camera.height))
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

/// A view on cells of some pixels.
pub(super) struct Evidence {
    /// The view, with one pixel per cell.
    pub camera: Camera,
    /// The ray through the middle of each cell; none where the lens shows nothing.
    pub rays: Vec<Option<Ray<f32>>>,
    /// Per cell how far what straight rays show is from the photograph: the root mean square over the channels of their
    /// difference, of means over the cell. Fine texture that the field does not resolve yet vanishes in the means. Where the view
    /// has a mask, the mask says it.
    pub residual: Vec<f32>,
    /// Per cell the distance beyond which something opaque hides everything [scene unit]; 0 where the photograph says nothing.
    pub beyond: Vec<f32>,
}

/// Edge of a cell for so many rays through all views [pixel].
pub(super) fn cell_edge(sampler: &RaySampler, rays: u32) -> f64 {
    (sampler.pixels() as f64 / f64::from(rays)).sqrt().max(1.0)
}

/// The evidence of all views.
pub(super) fn look(
    backend: &impl Backend,
    sampler: &RaySampler,
    rays: u32,
    marching: &Marching,
    watch: &mut Watch,
) -> Result<Vec<Evidence>, Cancelled> {
    let edge = cell_edge(sampler, rays);
    let total = sampler.views() as u64;
    let mut all = Vec::with_capacity(sampler.views());
    for picture in sampler.pictures() {
        watch.progress(Task::Seeking, all.len() as u64, total)?;
        all.push(Evidence::new(backend, &picture, edge, marching));
    }
    Ok(all)
}

impl Evidence {
    fn new(backend: &impl Backend, picture: &Picture, edge: f64, marching: &Marching) -> Self {
        let camera = coarse(picture.camera, edge);
        let size = [camera.width as usize, camera.height as usize];
        let rays: Vec<_> =
            (0..size[0] * size[1]).into_par_iter().map(|cell| pixel_ray(&camera, cell)).collect();
        let asked: Vec<_> = rays.iter().flatten().copied().collect();
        let mut seen = backend.render(&asked, marching, Layers::All).into_iter();
        let means = picture.means(size);
        let mut differences = [0, 1, 2].map(|_| vec![0.0; rays.len()]);
        let mut beyond = vec![0.0; rays.len()];
        for (cell, ray) in rays.iter().enumerate() {
            let shown = ray.and_then(|_| seen.next()); // one for each ray, whatever the photograph says
            let (Some(shown), Some(mean)) = (shown, means[cell]) else { continue };
            (0..3).for_each(|c| differences[c][cell] = shown.colour[c] - mean[c]);
            let opacity = 1.0 - shown.transmittance;
            beyond[cell] = if opacity > OPAQUE { shown.depth / opacity } else { f32::INFINITY };
        }
        let kernel = GaussianKernel::new(BLUR.0, BLUR.1, Border::Normalised);
        for channel in &mut differences {
            kernel.along_rows(channel, size[0]);
            kernel.across_rows(channel, size[0]);
        }
        let of = |cell: usize| (differences.iter().map(|d| d[cell] * d[cell]).sum::<f32>() / 3.0).sqrt();
        let stated = picture.mask().map(|mask| covered(mask, size));
        let residual = match stated {
            Some(covered) => covered.into_iter().map(|share| STATED * share).collect(),
            None => (0..rays.len()).map(of).collect(),
        };
        Self { camera, rays, residual, beyond }
    }

    /// The cells whose residual is above a threshold, as a mask with what hides things.
    fn silhouette(&self, threshold: f32) -> Silhouette {
        let coverage = self.residual.iter().map(|r| if *r > threshold { 255 } else { 0 }).collect();
        let mask = Mask { width: self.camera.width, height: self.camera.height, coverage };
        let occluders = Occluders::new(&mask, 1, |cells| cells.iter().map(|c| self.beyond[*c]).collect());
        Silhouette { camera: self.camera, mask: Arc::new(mask), occluders: Some(occluders) }
    }

    /// The cell that shows a point; `None` where the view does not see it.
    pub(super) fn cell_of(&self, x: Vec3<f32>) -> Option<usize> {
        let [u, v] = self.camera.project(x.cast())?;
        let (width, height) = (self.camera.width, self.camera.height);
        let is_seen = u >= 0.0 && v >= 0.0 && u < f64::from(width) && v < f64::from(height);
        is_seen.then(|| v as usize * width as usize + u as usize)
    }

    /// Whether nothing opaque is seen at a cell by more than `margin` before a point.
    pub(super) fn reaches(&self, cell: usize, x: Vec3<f32>, margin: f32) -> bool {
        let distance = (x - self.camera.world_from_camera.translation.cast()).length();
        self.beyond[cell] + margin > distance
    }

    /// Whether something opaque is seen at a cell.
    pub(super) fn shows_something(&self, cell: usize) -> bool {
        self.beyond[cell].is_finite()
    }

    /// Whether the photograph says something at a cell.
    pub(super) fn counts(&self, cell: usize) -> bool {
        self.beyond[cell] > 0.0
    }
}

/// The outlines of what is above a threshold.
pub(super) fn outlines(all: &[Evidence], threshold: f32) -> Outlines {
    Outlines::new(&silhouettes(all, threshold))
}

/// What is above a threshold, with what hides it.
pub(super) fn silhouettes(all: &[Evidence], threshold: f32) -> Vec<Silhouette> {
    all.iter().map(|e| e.silhouette(threshold)).collect()
}
