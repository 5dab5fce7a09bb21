//! A body within a sharp surface, and where it ends.

use crate::model::polyhedron::{Plane, Polyhedron, cut_by};
use refraxel_core::{Domain, LevelSet, Vec3};

/// What a body is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::refraction_search) enum Substance {
    /// Glass or another solid whose index is sought.
    Glass,
    /// Nothing: n = 1.
    Air,
    /// Water: n = 1.33, or another liquid.
    Water,
}

/// A body with a sharp surface. In a list of bodies the later one rules where two overlap; n = 1 where there
/// is none.
///
/// Surfaces of a list never coincide over an area: where one body ends at another, the one that is overruled
/// reaches into the other.
#[derive(Clone, Debug)]
pub(in crate::refraction_search) struct ShapeBody {
    /// φ < 0 inside.
    pub surface: LevelSet<f32>,
    pub substance: Substance,
    /// Its planes, if all of its faces are flat.
    pub solid: Option<Polyhedron>,
    /// The planes that cut it, where others are not.
    pub cuts: Vec<Plane>,
}

impl ShapeBody {
    /// A body without flat faces.
    pub(in crate::refraction_search) fn new(surface: LevelSet<f32>, substance: Substance) -> Self {
        Self { surface, substance, solid: None, cuts: Vec::new() }
    }

    /// A body of which planes cut off a part.
    pub(super) fn cut(surface: LevelSet<f32>, cuts: Vec<Plane>, substance: Substance) -> Self {
        let surface = cut_by(surface, &cuts);
        Self { cuts, ..Self::new(surface, substance) }
    }

    /// A body all of whose faces are flat, on a grid.
    pub(super) fn of_planes(solid: Polyhedron, grid: &Domain<f32>, substance: Substance) -> Self {
        let surface = solid.level_set(grid.bounds, grid.resolution);
        Self { solid: Some(solid), ..Self::new(surface, substance) }
    }
}

/// φ of a level set, and outside of its box a lower bound of the distance from it: a spline ends there.
pub(in crate::refraction_search) fn distance(level: &LevelSet<f32>, x: Vec3<f32>) -> f32 {
    let domain = level.domain();
    let (bounds, voxel) = (domain.bounds, level.voxel());
    // The outermost cells belong to no spline.
    let low = bounds.min + Vec3::splat(1.01 * voxel);
    let high = bounds.max - Vec3::splat(1.01 * voxel);
    let nearest = x.zip(low, f32::max).zip(high, f32::min);
    level.value(nearest) + (x - nearest).length()
}

/// Lowest and highest point of a body along a unit vector [scene unit], to a small part of a voxel; `None`
/// where it is empty.
pub(super) fn span(level: &LevelSet<f32>, up: Vec3<f32>) -> Option<[f32; 2]> {
    let (voxel, inside) = (level.voxel(), |x: &Vec3<f32>| level.value(*x) < 0.0);
    let near = |j: &usize| level.coefficients()[*j].abs() < voxel;
    let onto = |x: Vec3<f32>| {
        let (phi, gradient) = level.sample(x);
        x - gradient * (phi / gradient.dot(gradient))
    };
    let feet = level.parameters().filter(near).map(|j| onto(onto(onto(level.position(j)))));
    let on_surface = feet.filter(|x| level.value(*x).abs() < 0.01 * voxel);
    let nodes = level.parameters().map(|j| level.position(j)).filter(inside);
    let heights = on_surface.chain(nodes).map(|x| up.dot(x));
    let span = heights.fold([f32::MAX, f32::MIN], |[low, high], h| [low.min(h), high.max(h)]);
    (span[0] < span[1]).then_some(span)
}
