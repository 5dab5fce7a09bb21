//! Sharp bodies that are traced with a soft edge while they learn, theory (4.16).

use crate::refraction::Refraction;
use rayon::prelude::*;
use refraxel_core::{IndexGrid, Interpolation, LevelSet, Vec3};

/// A body behind its soft edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Soft {
    /// Its surface, in the middle of the edge.
    pub surface: LevelSet<f32>,
    /// Its index.
    pub index: f32,
    /// Width of the edge, from vacuum to the index [voxel of the level set].
    pub width: f32,
}

/// Narrower edges are steps between nodes; the surface takes over [voxel].
pub const LEAST_WIDTH: f32 = 0.75;

impl Soft {
    /// Share of the body at a node, and its derivative by φ [1 / scene unit]: theory (4.16).
    fn share(&self, node: usize) -> (f32, f32) {
        let (width, c) = (self.width * self.surface.voxel(), self.surface.coefficients()[node]);
        // Between its neighbours' coefficients φ is within two voxels of this one where it is a distance.
        if c.abs() > width + 2.0 * self.surface.voxel() || !self.surface.is_parameter(node) {
            return (if c < 0.0 { 1.0 } else { 0.0 }, 0.0);
        }
        let u = (0.5 - self.surface.value(self.surface.position(node)) / width).clamp(0.0, 1.0);
        (u * u * (3.0 - 2.0 * u), -6.0 * u * (1.0 - u) / width)
    }

    /// n²/2 of the body above that of vacuum.
    fn rise(&self) -> f32 {
        0.5 * (self.index * self.index - 1.0)
    }

    /// The field that is traced.
    pub fn grid(&self, interpolation: Interpolation) -> IndexGrid<f32> {
        let domain = self.surface.domain();
        let mut grid = IndexGrid::vacuum(domain.bounds, domain.resolution, interpolation);
        let nodes: Vec<usize> = grid.parameters().collect();
        let shares: Vec<f32> = nodes.par_iter().map(|&j| self.share(j).0).collect();
        let coefficients = grid.coefficients_mut();
        nodes.into_iter().zip(shares).for_each(|(j, s)| coefficients[j] = 0.5 + self.rise() * s);
        grid.find_flat_cells(None);
        grid
    }

    /// Transpose of [`Self::grid`]: from dLoss/dcoefficients of w to those of φ (added to) and of the index.
    pub fn grid_vjp(&self, d_w: &[f32], d_phi: &mut [f32]) -> f32 {
        let mut d_index = 0.0;
        for (node, &d) in d_w.iter().enumerate().filter(|(_, d)| **d != 0.0) {
            let (share, slope) = self.share(node);
            d_index += d * self.index * share;
            if slope != 0.0 {
                let d_value = d * self.rise() * slope;
                self.surface.scatter(self.surface.position(node), d_value, Vec3::zero(), d_phi);
            }
        }
        d_index
    }

    /// The body with the surface itself.
    pub fn body(&self) -> IndexGrid<f32> {
        IndexGrid::sharp(self.surface.clone(), self.index)
    }
}

impl Refraction {
    /// Trace all bodies of one index with an edge of this width [voxel] from now on, or their surfaces where it is less than
    /// [`LEAST_WIDTH`].
    pub fn set_width(&mut self, width: f32) {
        for region in 0..self.states.len() {
            let body = self.body(region);
            let Some((surface, index)) = body.level_set().cloned().zip(body.interior_index()) else {
                continue;
            };
            let interpolation = body.interpolation();
            let soft = (width >= LEAST_WIDTH).then_some(Soft { surface, index, width });
            *self.medium.region_mut(region) = soft.as_ref().map_or(body, |s| s.grid(interpolation));
            self.states[region].soft = soft;
        }
    }

    /// A region as what it will be: a body with its surface, also while it has a soft edge.
    pub fn body(&self, region: usize) -> IndexGrid<f32> {
        let soft = self.states.get(region).and_then(|e| e.soft.as_ref());
        soft.map_or_else(|| self.medium.regions()[region].clone(), Soft::body)
    }

    /// Width of the soft edges [voxel]; 0 where all surfaces are sharp.
    pub fn width(&self) -> f32 {
        self.states.iter().filter_map(|e| e.soft.as_ref()).map(|s| s.width).fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::{Aabb, Medium};

    fn ball(width: f32) -> Soft {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let surface = LevelSet::from_samples(cube, [25; 3], |x: Vec3<f32>| x.length() - 0.6);
        Soft { surface, index: 1.5, width }
    }

    #[test]
    fn the_gradient_of_the_surface_and_of_the_index_is_that_of_the_field() {
        let (soft, random) = (ball(3.0), Random::new(7));
        let n = soft.surface.coefficients().len();
        let noise = |stream: u64| (0..n).map(move |j| random.uniform(j as u64, stream) as f32 - 0.5);
        let d_w: Vec<f32> = noise(0).collect();
        let mut d_phi = vec![0.0; n];
        let d_index = soft.grid_vjp(&d_w, &mut d_phi);
        let loss = |soft: &Soft| -> f64 {
            let grid = soft.grid(Interpolation::CubicBSpline);
            grid.coefficients().iter().zip(&d_w).map(|(c, d)| f64::from(*c) * f64::from(*d)).sum()
        };
        // Differences of f32 fields: 1e-3 of the derivative along a direction.
        let along = |e: f32| {
            let mut moved = soft.clone();
            let inner: Vec<usize> = moved.surface.parameters().collect();
            let direction: Vec<f32> = noise(1).collect();
            inner.into_iter().for_each(|j| moved.surface.coefficients_mut()[j] += e * direction[j]);
            moved
        };
        let by_phi = (loss(&along(2e-3)) - loss(&along(-2e-3))) / 4e-3;
        let inner = noise(1).enumerate().filter(|(j, _)| soft.surface.is_parameter(*j));
        let expected: f64 = inner.map(|(j, v)| f64::from(v) * f64::from(d_phi[j])).sum();
        assert!((by_phi - expected).abs() < 0.02 * expected.abs() + 1e-3, "{by_phi} {expected}");
        let with = |index: f32| loss(&Soft { index, ..soft.clone() });
        let by_index = (with(1.51) - with(1.49)) / 0.02;
        assert!((by_index - f64::from(d_index)).abs() < 1e-3 * by_index.abs(), "{by_index} {d_index}");
    }

    #[test]
    fn a_body_returns_from_behind_its_soft_edge() {
        let mut r = Refraction::none();
        r.medium = Medium::new(vec![ball(0.0).body()]).unwrap();
        r.states = vec![Default::default()];
        let before = r.clone();
        r.set_width(3.0);
        assert!((r.width(), r.medium.regions()[0].level_set().is_none()) == (3.0, true));
        let [inside, outside] = [0.3, 0.9].map(|x| r.index(Vec3::new(x, 0.0, 0.0)));
        assert!((inside - 1.5).abs() < 1e-5 && outside == 1.0, "{inside} {outside}");
        let middle = r.index(Vec3::new(0.6, 0.0, 0.0));
        assert!((middle - (1.0_f32 + 0.625).sqrt()).abs() < 0.03, "{middle}");
        assert_eq!(r.body(0).coefficients(), before.medium.regions()[0].coefficients());
        r.set_width(0.1);
        assert_eq!((r.width(), &r.states), (0.0, &before.states));
        assert_eq!(r.medium.regions()[0].level_set(), before.medium.regions()[0].level_set());
    }
}
