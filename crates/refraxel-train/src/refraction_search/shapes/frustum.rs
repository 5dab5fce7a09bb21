//! An upright body with straight sides, the frustum of a cone: what the outlines of a vessel or a jar are when they are rough.

use crate::model::axis::Axis;
use crate::model::polyhedron::tangents;
use refraxel_core::{LevelSet, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;

/// Heights between these shares of a body tell its radii: its ends are rounded, or hidden.
const MIDDLE: [f32; 2] = [0.2, 0.8];
/// Fewest slices that say anything [voxel].
const LEAST_SLICES: usize = 6;

/// A frustum of a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::refraction_search) struct Frustum {
    pub axis: Axis,
    /// Radius in the middle of its height [scene unit].
    radius: f32,
    /// By how much the radius grows with the height [1].
    slope: f32,
    /// Lower and upper end along the axis [scene unit].
    span: [f32; 2],
}

impl Frustum {
    /// The cylinder that a body is, about: by areas and middles of its slices across `up`. `None` where it has too few of them.
    pub(in crate::refraction_search) fn of(body: &LevelSet<f32>, up: Vec3<f32>) -> Option<Self> {
        let (voxel, inside) =
            (body.voxel(), body.parameters().map(|j| body.position(j)).filter(|x| body.is_inside(*x)));
        let mut slices = BTreeMap::<i32, (f32, Vec3<f32>)>::new();
        for x in inside {
            let (count, sum) =
                slices.entry((up.dot(x) / voxel).floor() as i32).or_insert((0.0, Vec3::zero()));
            (*count, *sum) = (*count + 1.0, *sum + x);
        }
        let (low, high) = (*slices.first_key_value()?.0 as f32, *slices.last_key_value()?.0 as f32 + 1.0);
        let [from, to] = MIDDLE.map(|share| low + share * (high - low));
        let middle: Vec<&(f32, Vec3<f32>)> = slices
            .iter()
            .filter(|(k, _)| (from..=to).contains(&(**k as f32 + 0.5)))
            .map(|(_, s)| s)
            .collect();
        if middle.len() < LEAST_SLICES {
            return None;
        }
        let radius = middle.iter().map(|(n, _)| (n / PI).sqrt() * voxel).sum::<f32>() / middle.len() as f32;
        let (count, sum) =
            middle.iter().fold((0.0, Vec3::zero()), |(n, s), (count, sum)| (n + count, s + *sum));
        let at = sum / count;
        Some(Self {
            axis: Axis { at, up },
            radius,
            slope: 0.0,
            span: [low, high].map(|h| h * voxel - up.dot(at)),
        })
    }

    /// Another one: `width` times its radius, a slope more, moved across its axis [radius], and tilted [1].
    pub(in crate::refraction_search) fn changed(
        &self,
        width: f32,
        slope: f32,
        [x, y]: [f32; 2],
        [s, t]: [f32; 2],
    ) -> Self {
        let [u, v] = tangents(self.axis.up);
        let at = self.axis.at + (u * x + v * y) * self.radius;
        let up = (self.axis.up + u * s + v * t).normalized();
        Self { axis: Axis { at, up }, radius: width * self.radius, slope: self.slope + slope, ..*self }
    }

    /// About the distance from the surface, negative inside [scene unit].
    pub(in crate::refraction_search) fn distance(&self, x: Vec3<f32>) -> f32 {
        let ([radius, height], [low, high]) = (self.axis.place(x), self.span);
        let side = radius - self.radius - self.slope * (height - 0.5 * (low + high));
        (side / self.slope.hypot(1.0)).max(low - height).max(height - high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn a_cylinder_is_found_again_and_changed() {
        let bounds = Aabb::cube(1.0);
        let axis = Axis { at: vec3(0.1, -0.05, 0.0), up: vec3(0.1, 0.05, 1.0).normalized() };
        let true_one = Frustum { axis, radius: 0.4, slope: 0.0, span: [-0.6, 0.5] };
        let body = LevelSet::from_samples(bounds, [65; 3], |x| true_one.distance(x));
        let found = Frustum::of(&body, axis.up).unwrap();
        let voxel = body.voxel();
        assert!((found.radius - 0.4).abs() < 0.3 * voxel, "{found:?}");
        let ends = found.span.map(|h| axis.up.dot(found.axis.at - axis.at) + h);
        assert!((ends[0] + 0.6).abs() < voxel && (ends[1] - 0.5).abs() < voxel, "{found:?}");
        assert!(true_one.axis.place(found.axis.at)[0] < 0.1 * voxel, "{found:?}");
        let other = true_one.changed(1.1, -0.1, [0.5, 0.0], [0.0, 0.1]);
        assert!((other.radius - 0.44).abs() < 1e-6 && (other.slope + 0.1).abs() < 1e-6);
        assert!(((other.axis.at - axis.at).length() - 0.2).abs() < 1e-5);
        assert!((other.axis.up.dot(axis.up).acos() - 0.1_f32.atan()).abs() < 1e-3);
    }

    #[test]
    fn what_has_hardly_any_height_has_no_side() {
        let bounds = Aabb::cube(1.0);
        let plate =
            LevelSet::from_samples(bounds, [33; 3], |x: Vec3<f32>| x.length().max(x.z.abs() * 8.0) - 0.6);
        assert!(Frustum::of(&plate, vec3(0.0, 0.0, 1.0)).is_none());
    }
}
