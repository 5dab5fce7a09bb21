//! Any number of refractive regions in vacuum, which one rules where bodies overlap, and dLoss/d(their coefficients).

use super::vacuum::VACUUM;
use super::{IndexGrid, LevelSet};
use crate::{Real, Vec3};
use std::fmt;

/// Regions of refractive index in vacuum, n = 1, theory (2.23).
///
/// Bodies, the regions with a [`LevelSet`], may overlap: **where several contain a point, the last of them in the list
/// rules.** Water in a glass, and the bubble in the water, follow the glass. A surface that should touch another, as water
/// its glass, is best made a little larger than the space that it fills, so that the order decides and no gap is left.
/// Regions without level set overlap no other region.
#[derive(Clone, Debug)]
pub struct Medium<T: Copy> {
    regions: Vec<IndexGrid<T>>,
    /// Per region the others whose boxes overlap its box, from the last to the first.
    neighbours: Vec<Vec<usize>>,
}

/// The error that two regions overlap of which not both have a sharp surface.
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
            "the boxes of refractive regions {} and {} overlap, and not both have a sharp surface; let them touch at most, \
             join them into one, or give both a level set",
            self.first, self.second
        )
    }
}

impl std::error::Error for Overlap {}

impl<T: Real> Medium<T> {
    /// A medium of bodies, which rule in the order of the list, and of regions without level set whose boxes touch others
    /// at most.
    pub fn new(regions: Vec<IndexGrid<T>>) -> Result<Self, Overlap> {
        let overlap = |first: usize, second: usize| {
            let (a, b) = (regions[first].domain().bounds, regions[second].domain().bounds);
            (0..3).all(|k| a.min[k].max(b.min[k]) < a.max[k].min(b.max[k]))
        };
        let mut neighbours = vec![Vec::new(); regions.len()];
        for second in 0..regions.len() {
            for first in (0..second).filter(|&first| overlap(first, second)) {
                if regions[first].level_set().is_none() || regions[second].level_set().is_none() {
                    return Err(Overlap { first, second });
                }
                neighbours[first].insert(0, second);
                neighbours[second].insert(0, first);
            }
        }
        Ok(Self { regions, neighbours })
    }

    /// The same medium in another precision.
    pub fn cast<U: Real>(&self) -> Medium<U> {
        Medium {
            regions: self.regions.iter().map(IndexGrid::cast).collect(),
            neighbours: self.neighbours.clone(),
        }
    }

    /// The regions.
    pub fn regions(&self) -> &[IndexGrid<T>] {
        &self.regions
    }
    /// One region, whose coefficients may be changed. It keeps its box, and its surface if it has one.
    ///
    /// # Panics
    /// If there is no region of this number.
    pub fn region_mut(&mut self, region: usize) -> &mut IndexGrid<T> {
        &mut self.regions[region]
    }
    /// Number of the region whose field holds at a point, theory (2.23): the last body that contains it, or the region
    /// without level set in whose box it lies. `None` in vacuum.
    pub fn ruling_at(&self, x: Vec3<T>) -> Option<usize> {
        self.regions.iter().rposition(|r| {
            r.domain().bounds.contains(x) && r.level_set().is_none_or(|level| level.is_inside(x))
        })
    }

    /// Number of the body that rules just behind the point `x` on the surface of a body for a ray of momentum `p`, which
    /// `enters` that body or leaves it; `None` for vacuum.
    ///
    /// Of other bodies, too, `x` may lie on the surface: those are decided by the way the ray goes.
    pub(crate) fn ruling_behind(
        &self,
        surface: usize,
        enters: bool,
        x: Vec3<T>,
        p: Vec3<T>,
    ) -> Option<usize> {
        let holds = |r: &&usize| self.regions[**r].level_set().is_some_and(|level| level.holds_ahead(x, p));
        let other = self.neighbours[surface].iter().find(holds).copied();
        other.max(enters.then_some(surface))
    }

    /// Numbers of the other regions whose boxes overlap that of `region`, from the last to the first. Where there are none,
    /// the body lies in vacuum and nothing lies in it.
    ///
    /// # Panics
    /// If there is no region of this number.
    pub fn neighbours(&self, region: usize) -> &[usize] {
        &self.neighbours[region]
    }

    /// The bodies that may cut into body `region` and rule there.
    pub(crate) fn rulers_over(&self, region: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighbours[region].iter().copied().take_while(move |&other| other > region)
    }

    /// w = n²/2 [1], theory (2.4) and (2.23). Jumps at sharp surfaces.
    pub fn w(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::of(VACUUM), |r| self.regions[r].w(x))
    }
    /// The index of refraction n [1].
    pub fn index(&self, x: Vec3<T>) -> T {
        self.ruling_at(x).map_or(T::one(), |r| self.regions[r].index(x))
    }
    /// ∇w [1 / scene unit] of the region that rules at `x`. The jump at a surface is not part of it; see
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
