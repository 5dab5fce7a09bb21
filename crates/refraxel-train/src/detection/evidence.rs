//! What straight rays fail to show of each view.

use super::photographs::Small;
use crate::backend::{Backend, Layers, Marching};
use crate::evidence::Detail;
use crate::rays::WHITE;
use crate::silhouettes::{Occluders, Outlines, Silhouette, hidden_beyond};
use refraxel_core::grid::{Border, GaussianKernel};
use refraxel_core::structure::{Pictures, luminance};
use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::Mask;
use std::sync::Arc;

/// Standard deviation of the blur of differences [cell], and where it ends: texture that the grid does not resolve vanishes, what
/// bent light displaces does not.
const BLUR: (f32, usize) = (1.2, 3);

/// Residual of cells that a mask shows to be refractive: as large as that of glass where straight rays fail most.
const STATED: f32 = 0.3;

/// Colour times alpha before white.
fn over(colour: [f32; 3], alpha: f32) -> [f32; 3] {
    [0, 1, 2].map(|c| colour[c] + WHITE[c] * (1.0 - alpha))
}

/// A view on cells of some pixels.
pub(super) struct Evidence {
    /// The view, with one pixel per cell.
    pub camera: Camera,
    /// The ray through the middle of each cell; none where the lens shows nothing.
    pub rays: Vec<Option<Ray<f32>>>,
    /// Per cell how far what straight rays show is from the photograph: the root mean square over the channels of their
    /// difference, of means over the cell, times 1 − NCC of their structure, theory (4.24). Fine texture that the field does not
    /// resolve yet vanishes in the means, and shades that are wrong alone count little. Where the view has a mask, the mask says it.
    pub residual: Vec<f32>,
    /// Per cell the distance beyond which something opaque hides everything [scene unit]; 0 where the photograph says nothing.
    pub beyond: Vec<f32>,
}

impl Evidence {
    /// What straight rays show of a view, and how far that is from its photograph.
    pub(super) fn new(backend: &dyn Backend, view: &Small, marching: &Marching) -> Self {
        let asked: Vec<_> = view.rays.iter().flatten().copied().collect();
        let mut seen = backend.render(&asked, marching, Layers::All).into_iter();
        let mut differences = [0, 1, 2].map(|_| vec![0.0; view.rays.len()]);
        let mut beyond = vec![0.0; view.rays.len()];
        let [mut shown_luminance, mut photograph, mut weight] = [0, 1, 2].map(|_| vec![0.0; view.rays.len()]);
        for (cell, ray) in view.rays.iter().enumerate() {
            let shown = ray.and_then(|_| seen.next()); // one for each ray, whatever the photograph says
            let (Some(shown), Some([r, g, b, alpha])) = (shown, view.cells[cell]) else { continue };
            let mean = over([r, g, b], alpha);
            (0..3).for_each(|c| differences[c][cell] = shown.colour[c] - mean[c]);
            (shown_luminance[cell], photograph[cell], weight[cell]) =
                (luminance(shown.colour), luminance(mean), 1.0);
            beyond[cell] = hidden_beyond(&shown);
        }
        let kernel = GaussianKernel::new(BLUR.0, BLUR.1, Border::Normalised);
        let width = view.size()[0];
        for channel in &mut differences {
            kernel.along_rows(channel, width);
            kernel.across_rows(channel, width);
        }
        let alike = Detail::Coarse.structure().map(&Pictures {
            size: view.size(),
            shown: &shown_luminance,
            photograph: &photograph,
            weight: &weight,
        });
        let of = |cell: usize| {
            let difference = (differences.iter().map(|d| d[cell] * d[cell]).sum::<f32>() / 3.0).sqrt();
            difference * (1.0 - alike[cell])
        };
        let residual = match &view.stated {
            Some(covered) => covered.iter().map(|share| STATED * share).collect(),
            None => (0..view.rays.len()).map(of).collect(),
        };
        Self { camera: view.camera, rays: view.rays.clone(), residual, beyond }
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
        let [u, v] = self.camera.project_into(x.cast())?;
        let (width, height) = (self.camera.width, self.camera.height);
        let is_before_last_edges = u < f64::from(width) && v < f64::from(height);
        is_before_last_edges.then(|| v as usize * width as usize + u as usize)
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
    let silhouettes: Vec<Silhouette> = all.iter().map(|e| e.silhouette(threshold)).collect();
    Outlines::new(&silhouettes)
}
