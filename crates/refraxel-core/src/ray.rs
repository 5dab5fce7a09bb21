//! Rays in vacuum and axis-aligned boxes.

use crate::{Real, Vec3, vec3};

/// A ray as it leaves the camera, in vacuum: world position and unit direction. In a medium a path has the momentum
/// p = n dx/ds instead, see [`Segment`](crate::segment::Segment); a line x + t p is written as a ray whose direction is p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<T> {
    /// Start [scene unit].
    pub origin: Vec3<T>,
    /// Unit direction of travel, away from the camera.
    pub direction: Vec3<T>,
}

impl<T: Real> Ray<T> {
    /// The point at arc length `s` [scene unit].
    #[inline(always)]
    pub fn at(&self, s: T) -> Vec3<T> {
        self.origin + self.direction * s
    }
    /// The same ray in another precision. Its direction is rounded, not normalised again.
    pub fn cast<U: Real>(&self) -> Ray<U> {
        Ray { origin: self.origin.cast(), direction: self.direction.cast() }
    }
}

/// An axis-aligned box, the region that a field or a medium fills.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<T> {
    /// Corner with the smallest coordinates [scene unit].
    pub min: Vec3<T>,
    /// Corner with the largest coordinates [scene unit].
    pub max: Vec3<T>,
}

impl<T: Real> Aabb<T> {
    /// The box between two corners.
    pub fn new(min: Vec3<T>, max: Vec3<T>) -> Self {
        Self { min, max }
    }
    /// The cube around the origin whose faces are `half` away from it [scene unit].
    pub fn cube(half: T) -> Self {
        Self::cube_at(Vec3::zero(), half)
    }
    /// The same cube around another centre.
    pub fn cube_at(center: Vec3<T>, half: T) -> Self {
        Self::new(center - Vec3::splat(half), center + Vec3::splat(half))
    }
    /// Its corners, the one with the smallest coordinates first.
    pub fn to_arrays(self) -> [[T; 3]; 2] {
        [self.min, self.max].map(Vec3::to_array)
    }
    /// A box that contains nothing and grows by [`Aabb::include`].
    pub fn empty() -> Self {
        Self { min: Vec3::splat(T::infinity()), max: Vec3::splat(T::neg_infinity()) }
    }
    /// Grows the box to contain a point.
    pub fn include(&mut self, p: Vec3<T>) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }
    /// The least box that contains all points; `None` without any.
    pub fn around(points: impl IntoIterator<Item = Vec3<T>>) -> Option<Self> {
        let mut points = points.into_iter().peekable();
        points.peek()?;
        let mut bounds = Self::empty();
        points.for_each(|p| bounds.include(p));
        Some(bounds)
    }
    /// Edge lengths [scene unit].
    pub fn extent(&self) -> Vec3<T> {
        self.max - self.min
    }
    /// Centre [scene unit].
    pub fn center(&self) -> Vec3<T> {
        (self.min + self.max) * T::of(0.5)
    }
    /// True for a point inside or on the border.
    pub fn contains(&self, p: Vec3<T>) -> bool {
        (0..3).all(|a| p[a] >= self.min[a] && p[a] <= self.max[a])
    }
    /// The same box in another precision.
    pub fn cast<U: Real>(&self) -> Aabb<U> {
        Aabb { min: self.min.cast(), max: self.max.cast() }
    }
    /// Arc lengths `[enter, leave]` [scene unit] of the part of a ray inside the box, clipped to s ≥ 0; `None` if it misses.
    ///
    /// By the slab test (Kay & Kajiya 1986): the intersection of the intervals between the three pairs of faces.
    #[inline]
    pub fn clip(&self, ray: &Ray<T>) -> Option<[T; 2]> {
        let inv = ray.direction.map(T::recip);
        let a = (self.min - ray.origin).hadamard(inv);
        let b = (self.max - ray.origin).hadamard(inv);
        // A ray parallel to a slab gives 0 * inf = NaN on its border; Float::min/max drop the NaN.
        let near = a.min(b).max(vec3(T::zero(), T::zero(), T::zero())).max_element();
        let far = a.max(b).min_element();
        (near < far).then_some([near, far])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_the_box_enters_and_leaves_at_its_faces() {
        let unit = Aabb::cube(1.0);
        let ray = Ray { origin: vec3(-3.0, 0.5, 0.0), direction: vec3(1.0, 0.0, 0.0) };
        assert_eq!(unit.clip(&ray), Some([2.0, 4.0]));
        let inside = Ray { origin: vec3(0.0, 0.0, 0.0), direction: vec3(0.0, 0.0, -1.0) };
        assert_eq!(unit.clip(&inside), Some([0.0, 1.0]));
        let behind = Ray { origin: vec3(3.0, 0.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
        assert_eq!(unit.clip(&behind), None);
        let beside = Ray { origin: vec3(0.0, 2.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
        assert_eq!(unit.clip(&beside), None);
    }
}
