//! Any number of refractive regions in vacuum.

use super::{IndexGrid, LevelSet, VACUUM};
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

    /// The region whose field rules at a point: that which contains it, unless its level set says that the point lies
    /// outside the body.
    pub fn ruling_at(&self, x: Vec3<T>) -> Option<usize> {
        self.region_at(x).filter(|&r| self.regions[r].level_set().is_none_or(|l| l.is_inside(x)))
    }

    /// w = n²/2.
    pub fn w(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::of(VACUUM), |r| self.regions[r].w(x))
    }
    /// The index of refraction.
    pub fn index(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::one(), |r| self.regions[r].index(x))
    }
    /// ∇w, without what a surface adds.
    pub fn gradient(&self, x: Vec3<T>) -> Vec3<T> {
        self.ruling_at(x).map_or(Vec3::zero(), |r| self.regions[r].gradient(x))
    }

    /// dLoss/dcoefficients of zero.
    pub fn zero_gradient(&self) -> MediumGradient<T> {
        let zeros = |c: &[T]| vec![T::zero(); c.len()];
        MediumGradient {
            index: self.regions.iter().map(|r| zeros(r.coefficients())).collect(),
            level_set: (self.regions.iter())
                .map(|r| r.level_set().map_or(Vec::new(), |l| zeros(l.coefficients())))
                .collect(),
        }
    }
}

/// What receives dLoss/d(coefficients) of rays.
pub trait IndexGradient<T: Copy> {
    /// Add the transpose of one evaluation of a region's field at `x`, given dLoss/dw and dLoss/d(force) there.
    fn add(&mut self, region: (usize, &IndexGrid<T>), x: Vec3<T>, d: (T, Vec3<T>));
    /// Add the transpose of one evaluation of a region's level set at `x`, given dLoss/dφ and dLoss/d(∇φ) there.
    fn add_level_set(&mut self, region: (usize, &LevelSet<T>), x: Vec3<T>, d: (T, Vec3<T>));
}

/// dLoss/d(coefficients) of a medium, dense: per region one number per node.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumGradient<T> {
    /// With respect to the coefficients of w.
    pub index: Vec<Vec<T>>,
    /// With respect to the coefficients of φ [1 / scene unit]; empty for regions without level set.
    pub level_set: Vec<Vec<T>>,
}

impl<T: Real> IndexGradient<T> for MediumGradient<T> {
    fn add(&mut self, (region, grid): (usize, &IndexGrid<T>), x: Vec3<T>, (d_w, d_force): (T, Vec3<T>)) {
        grid.scatter(x, d_w, d_force, &mut self.index[region]);
    }
    fn add_level_set(&mut self, (region, level): (usize, &LevelSet<T>), x: Vec3<T>, d: (T, Vec3<T>)) {
        level.scatter(x, d.0, d.1, &mut self.level_set[region]);
    }
}
