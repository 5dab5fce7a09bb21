//! Any number of refractive regions in vacuum.

use super::{IndexGrid, VACUUM};
use crate::{Real, Vec3};
use std::fmt;

/// Regions of refractive index that do not overlap; n = 1 between them.
#[derive(Clone, Debug)]
pub struct Medium<T: Copy> {
    regions: Vec<IndexGrid<T>>,
}

/// Two regions whose boxes overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// Index of the first region.
    pub first: usize,
    /// Index of the second region.
    pub second: usize,
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the boxes of refractive regions {} and {} overlap; let them touch at most, or join them into one",
            self.first, self.second
        )
    }
}

impl std::error::Error for Overlap {}

impl<T: Real> Medium<T> {
    /// A medium of regions whose boxes touch at most.
    pub fn new(regions: Vec<IndexGrid<T>>) -> Result<Self, Overlap> {
        for second in 0..regions.len() {
            for first in 0..second {
                let (a, b) = (regions[first].domain().bounds, regions[second].domain().bounds);
                if (0..3).all(|k| a.min[k].max(b.min[k]) < a.max[k].min(b.max[k])) {
                    return Err(Overlap { first, second });
                }
            }
        }
        Ok(Self { regions })
    }

    /// The same medium in another precision.
    pub fn cast<U: Real>(&self) -> Medium<U> {
        Medium { regions: self.regions.iter().map(IndexGrid::cast).collect() }
    }

    /// The regions.
    pub fn regions(&self) -> &[IndexGrid<T>] {
        &self.regions
    }
    /// One region, to change its coefficients.
    pub fn region_mut(&mut self, region: usize) -> &mut IndexGrid<T> {
        &mut self.regions[region]
    }
    /// The region that contains a point; `None` in the vacuum between.
    pub fn region_at(&self, x: Vec3<T>) -> Option<usize> {
        self.regions.iter().position(|r| r.domain().bounds.contains(x))
    }

    /// w = n²/2.
    pub fn w(&self, x: Vec3<T>) -> T {
        self.region_at(x).map_or(T::of(VACUUM), |r| self.regions[r].w(x))
    }
    /// The index of refraction.
    pub fn index(&self, x: Vec3<T>) -> T {
        self.region_at(x).map_or(T::one(), |r| self.regions[r].index(x))
    }
    /// ∇w.
    pub fn gradient(&self, x: Vec3<T>) -> Vec3<T> {
        self.region_at(x).map_or(Vec3::zero(), |r| self.regions[r].gradient(x))
    }

    /// dLoss/dcoefficients of zero: one array per region, one number per node.
    pub fn zero_gradient(&self) -> Vec<Vec<T>> {
        self.regions.iter().map(|r| vec![T::zero(); r.coefficients().len()]).collect()
    }
}

/// What receives dLoss/d(coefficients) of rays.
pub trait IndexGradient<T: Copy> {
    /// Add the transpose of one evaluation of a region at `x`, given dLoss/dw and dLoss/d(force) there.
    fn add(&mut self, region: (usize, &IndexGrid<T>), x: Vec3<T>, d: (T, Vec3<T>));
}

/// Dense: one array per region, one number per node, as from [`Medium::zero_gradient`].
impl<T: Real> IndexGradient<T> for Vec<Vec<T>> {
    fn add(&mut self, (region, grid): (usize, &IndexGrid<T>), x: Vec3<T>, (d_w, d_force): (T, Vec3<T>)) {
        grid.scatter(x, d_w, d_force, &mut self[region]);
    }
}
