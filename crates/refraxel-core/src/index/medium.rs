//! Any number of refractive regions in vacuum, and dLoss/d(their coefficients).

use super::{IndexGrid, LevelSet, VACUUM};
use crate::{Real, Vec3};
use std::fmt;

/// Regions of refractive index that do not overlap; n = 1 between them.
#[derive(Clone, Debug)]
pub struct Medium<T: Copy> {
    regions: Vec<IndexGrid<T>>,
}

/// The error that the boxes of two regions overlap.
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
    /// One region, whose coefficients may be changed.
    ///
    /// # Panics
    /// If there is no region of this number.
    pub fn region_mut(&mut self, region: usize) -> &mut IndexGrid<T> {
        &mut self.regions[region]
    }
    /// Number of the region whose box contains a point; `None` in the vacuum between the boxes.
    pub fn region_at(&self, x: Vec3<T>) -> Option<usize> {
        self.regions.iter().position(|r| r.domain().bounds.contains(x))
    }

    /// Number of the region whose field holds at a point: the one that contains it, unless its level set says that the
    /// point lies outside the body, theory (2.23).
    pub fn ruling_at(&self, x: Vec3<T>) -> Option<usize> {
        self.region_at(x).filter(|&r| self.regions[r].level_set().is_none_or(|l| l.is_inside(x)))
    }

    /// w = n²/2 [1], theory (2.4) and (2.23). Jumps at sharp surfaces.
    pub fn w(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::of(VACUUM), |r| self.regions[r].w(x))
    }
    /// The index of refraction n [1].
    pub fn index(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::one(), |r| self.regions[r].index(x))
    }
    /// ∇w [1 / scene unit] of the region that holds at `x`. The jump at a surface is not part of it; see
    /// [`Event`](crate::optics::Event).
    pub fn gradient(&self, x: Vec3<T>) -> Vec3<T> {
        self.ruling_at(x).map_or(Vec3::zero(), |r| self.regions[r].gradient(x))
    }

    /// A gradient of zeros.
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

/// What collects dLoss/d(coefficients) along paths: a dense [`MediumGradient`], or a list that is scattered later.
pub trait IndexGradient<T: Copy> {
    /// Adds the transpose of one evaluation of a region's field at `x`, given dLoss/dw and dLoss/d(force) there. `grid` is
    /// the region of number `region`.
    fn add(&mut self, region: usize, grid: &IndexGrid<T>, x: Vec3<T>, d_w: T, d_force: Vec3<T>);
    /// Adds the transpose of one evaluation of a region's level set at `x`, given dLoss/dφ and dLoss/d(∇φ) there. `level`
    /// is the level set of the region of number `region`.
    fn add_level_set(
        &mut self,
        region: usize,
        level: &LevelSet<T>,
        x: Vec3<T>,
        d_phi: T,
        d_gradient: Vec3<T>,
    );
}

/// dLoss/d(coefficients) of a medium, dense: per region one number per node, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumGradient<T> {
    /// With respect to the coefficients of w [1].
    pub index: Vec<Vec<T>>,
    /// With respect to the coefficients of φ [1 / scene unit]; empty for regions without level set.
    pub level_set: Vec<Vec<T>>,
}

impl<T: Real> IndexGradient<T> for MediumGradient<T> {
    fn add(&mut self, region: usize, grid: &IndexGrid<T>, x: Vec3<T>, d_w: T, d_force: Vec3<T>) {
        grid.scatter(x, d_w, d_force, &mut self.index[region]);
    }
    fn add_level_set(
        &mut self,
        region: usize,
        level: &LevelSet<T>,
        x: Vec3<T>,
        d_phi: T,
        d_gradient: Vec3<T>,
    ) {
        level.scatter(x, d_phi, d_gradient, &mut self.level_set[region]);
    }
}
