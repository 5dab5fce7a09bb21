//! Rays with the colours that they should show.

use refraxel_core::Ray;

/// Rays with the colours that they should show.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Rays in world coordinates.
    pub rays: Vec<Ray<f32>>,
    /// Observed colour per ray (sRGB-encoded).
    pub target: Vec<[f32; 3]>,
    /// Radiance behind the field per ray; empty: the model's own background.
    pub behind: Vec<[f32; 3]>,
    /// Shift of the quadrature points per ray, in [0, 1) steps.
    pub offset: Vec<f32>,
    /// Whether each ray's pixel lies beside the mask of what is refractive of its view; empty: nobody knows.
    pub beside: Vec<bool>,
    /// How far along each ray something was measured [scene unit], NaN where nothing was; empty: nowhere.
    pub depth: Vec<f32>,
}

impl Batch {
    /// Whether a ray is known to pass beside what is refractive.
    #[inline(always)]
    pub fn is_beside(&self, ray: usize) -> bool {
        self.beside.get(ray) == Some(&true)
    }

    /// How far along a ray something was measured [scene unit].
    #[inline(always)]
    pub fn measured(&self, ray: usize) -> Option<f32> {
        self.depth.get(ray).copied().filter(|d| d.is_finite())
    }

    /// The first `most` rays that are `chosen`.
    #[must_use]
    pub fn filtered(&self, most: usize, chosen: impl Fn(&Ray<f32>) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.rays.len()).filter(|&k| chosen(&self.rays[k])).take(most).collect();
        Self {
            rays: kept.iter().map(|&k| self.rays[k]).collect(),
            target: kept.iter().map(|&k| self.target[k]).collect(),
            behind: kept.iter().filter_map(|&k| self.behind.get(k).copied()).collect(),
            offset: kept.iter().map(|&k| self.offset[k]).collect(),
            beside: kept.iter().filter_map(|&k| self.beside.get(k).copied()).collect(),
            depth: kept.iter().filter_map(|&k| self.depth.get(k).copied()).collect(),
        }
    }
}
