//! Where normals of a surface crowd around one direction: a flat face begins there.

use refraxel_core::{LevelSet, Real, Vec3};

/// A point of a surface and its unit normal.
#[derive(Clone, Copy, Debug)]
pub(in crate::refraction_search) struct Point<T> {
    pub x: Vec3<T>,
    pub normal: Vec3<T>,
}

/// Points of a surface near its nodes, those that `chosen` admits, thinned evenly to `most` at most.
pub(in crate::refraction_search) fn points(
    surface: &LevelSet<f32>,
    most: usize,
    chosen: impl Fn(Vec3<f32>) -> bool,
) -> Vec<Point<f32>> {
    let near = |j: &usize| surface.coefficients()[*j].abs() < 0.5 * surface.voxel();
    let nodes: Vec<usize> =
        surface.parameters().filter(near).filter(|j| chosen(surface.position(*j))).collect();
    let stride = nodes.len().div_ceil(most).max(1);
    let point = |&j: &usize| {
        let x = surface.position(j);
        let (phi, gradient) = surface.sample(x);
        let normal = gradient.normalized();
        Point { x: x - normal * phi, normal }
    };
    nodes.iter().step_by(stride).map(point).filter(|p| p.normal.is_finite()).collect()
}

/// Points of about the same normal.
pub(in crate::refraction_search) struct Crowd<T> {
    pub points: Vec<Point<T>>,
    /// The direction of their mean normal.
    pub normal: Vec3<T>,
}

impl<T: Real> Crowd<T> {
    /// The points whose normals are within an angle, by its cosine, of the one that most others are near; `None` without points.
    pub(in crate::refraction_search) fn densest(all: &[Point<T>], cosine: T) -> Option<Self> {
        let near = |m: Vec3<T>| all.iter().filter(move |p| p.normal.dot(m) > cosine);
        let center = all.iter().map(|p| p.normal).max_by_key(|m| near(*m).count())?;
        let points: Vec<Point<T>> = near(center).copied().collect();
        let normal = points.iter().fold(Vec3::zero(), |sum, p| sum + p.normal).normalized();
        Some(Self { points, normal })
    }

    /// Distance from the origin of the plane of their mean normal that goes through their middle [unit of the points].
    pub(in crate::refraction_search) fn offset(&self) -> T {
        let sum: T = self.points.iter().map(|p| self.normal.dot(p.x)).sum();
        sum / T::of(self.points.len() as f64)
    }
}
