//! The grid of a forward-facing capture: pictures beside each other, and depths by their disparity, theory (3.3).

use crate::{Ray, Real, Vec3};

/// The frame of a capture whose cameras look one way, theory (3.3).
///
/// With depth z ahead of the eye, a grid has its nodes at even steps of x/z, y/z and 1 − near/z: lines stay lines, and voxels
/// have about one shape in every picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Where depths begin, about the middle of the cameras [scene unit].
    pub eye: Vec3<f32>,
    /// Unit vectors to the right, down and ahead.
    pub axes: [Vec3<f32>; 3],
    /// The depth at which the grid begins [scene unit], > 0.
    pub near: f32,
    /// x/z at the left and the right edge of the grid, and y/z at the upper and the lower one.
    pub edges: [[f32; 2]; 2],
    /// How far the cameras stand apart [scene unit], > 0: over half that distance, a voxel in depth moves a point by a voxel in the
    /// pictures.
    pub baseline: f32,
}

/// A projective grid ends at this depth [nearest depth]; the background lies beyond.
pub const PROJECTED_FAR: f32 = 256.0;

impl Projection {
    /// Edge lengths of the grid in its own coordinates, as voxels shall be cubes of them: x/z, y/z, and the shift of a point
    /// between the nearest depth and infinity, seen from cameras half the baseline apart: as far as two of them are on average.
    pub(super) fn edge_lengths<T: Real>(&self) -> Vec3<T> {
        let [[left, right], [top, bottom]] = self.edges.map(|e| e.map(real::<T>));
        Vec3::new(right - left, bottom - top, T::of(0.5) * real::<T>(self.baseline) / real(self.near))
    }

    /// The point on the axis at the nearest depth.
    pub fn nearest(&self) -> Vec3<f32> {
        self.eye + self.axes[2] * self.near
    }

    /// Right, down and ahead of the eye [scene unit].
    #[inline(always)]
    pub fn local<T: Real>(&self, x: Vec3<T>) -> Vec3<T> {
        self.turned(x - cast(self.eye))
    }

    /// A direction in the frame.
    #[inline(always)]
    pub fn turned<T: Real>(&self, v: Vec3<T>) -> Vec3<T> {
        Vec3::from(self.axes.map(|axis| cast::<T>(axis).dot(v)))
    }

    /// The transpose of [`Self::turned`], which is its inverse.
    #[inline(always)]
    fn turned_back<T: Real>(&self, v: Vec3<T>) -> Vec3<T> {
        cast::<T>(self.axes[0]) * v.x + cast::<T>(self.axes[1]) * v.y + cast::<T>(self.axes[2]) * v.z
    }

    /// Coordinates u ∈ [−1, 1]³ inside the grid, of a point ahead of the eye.
    #[inline(always)]
    pub(super) fn unit<T: Real>(&self, x: Vec3<T>) -> Vec3<T> {
        let (p, [[cx, hx], [cy, hy]]) = (self.local(x), self.windows());
        let inverse = p.z.recip();
        let (one, two) = (T::one(), T::of(2.0));
        Vec3::new(
            (p.x * inverse - cx) / hx,
            (p.y * inverse - cy) / hy,
            one - two * real::<T>(self.near) * inverse,
        )
    }

    /// The inverse of [`Self::unit`]; what lies at infinity is moved to the end of the grid.
    pub(super) fn position<T: Real>(&self, u: Vec3<T>) -> Vec3<T> {
        let [[cx, hx], [cy, hy]] = self.windows::<T>();
        let (near, far) = (real::<T>(self.near), real::<T>(PROJECTED_FAR));
        let inverse = (T::of(0.5) * (T::one() - u.z)).max(far.recip()); // near / z
        let z = near / inverse;
        cast::<T>(self.eye) + self.turned_back(Vec3::new((u.x * hx + cx) * z, (u.y * hy + cy) * z, z))
    }

    /// Transpose of the derivative of [`Self::unit`] at `x`.
    #[inline]
    pub(super) fn unit_vjp<T: Real>(&self, x: Vec3<T>, d_u: Vec3<T>) -> Vec3<T> {
        let (p, [[_, hx], [_, hy]]) = (self.local(x), self.windows());
        let inverse = p.z.recip();
        // forward: u = ((x/z − cx) / hx, (y/z − cy) / hy, 1 − 2 near / z)
        let (d_x, d_y) = (d_u.x * inverse / hx, d_u.y * inverse / hy);
        let d_z = (T::of(2.0) * real::<T>(self.near) * d_u.z * inverse - d_x * p.x - d_y * p.y) * inverse;
        self.turned_back(Vec3::new(d_x, d_y, d_z))
    }

    /// The derivative of [`Self::unit`] at `x` along `v`.
    #[inline]
    pub(super) fn unit_jvp<T: Real>(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        let inverse = self.local(x).z.recip();
        self.rate(x, v) * (inverse * inverse)
    }

    /// How fast u moves along a line through `x` in direction `v`, times z²: the same everywhere on it.
    #[inline(always)]
    pub(super) fn rate<T: Real>(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        let (p, w, [[_, hx], [_, hy]]) = (self.local(x), self.turned(v), self.windows());
        Vec3::new(
            (w.x * p.z - p.x * w.z) / hx,
            (w.y * p.z - p.y * w.z) / hy,
            T::of(2.0) * real::<T>(self.near) * w.z,
        )
    }

    /// Middle and half width of x/z and of y/z.
    #[inline(always)]
    fn windows<T: Real>(&self) -> [[T; 2]; 2] {
        let half = T::of(0.5);
        self.edges.map(|[low, high]| {
            let (low, high) = (real::<T>(low), real::<T>(high));
            [half * (low + high), half * (high - low)]
        })
    }

    /// Interval of arc length of a ray inside the grid [scene unit], from `near` on; of a line x + t p, that of t.
    pub(super) fn clip<T: Real>(&self, ray: &Ray<T>, near: T) -> Option<[T; 2]> {
        let (p, v) = (self.local(ray.origin), self.turned(ray.direction));
        let first = real::<T>(self.near);
        let [[left, right], [top, bottom]] = self.edges.map(|e| e.map(real::<T>));
        // Inside, a + b t is not negative for any of these.
        let sides = [
            [p.z - first, v.z],
            [first * real::<T>(PROJECTED_FAR) - p.z, -v.z],
            [p.x - left * p.z, v.x - left * v.z],
            [right * p.z - p.x, right * v.z - v.x],
            [p.y - top * p.z, v.y - top * v.z],
            [bottom * p.z - p.y, bottom * v.z - v.y],
        ];
        let mut range = [near, T::of(f64::from(f32::MAX))];
        for [a, b] in sides {
            let at = -a / b;
            if b > T::zero() {
                range[0] = range[0].max(at);
            } else if b < T::zero() {
                range[1] = range[1].min(at);
            } else if a < T::zero() {
                return None;
            }
        }
        (range[0] < range[1]).then_some(range)
    }
}

/// A line in the parameter λ in which it moves through a projective grid at an even speed, λ = 0 at the point of depth z₀:
/// t − t₀ = λ z₀² / (1 − λ z₀ dz/dt).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perspective<T> {
    /// t at λ = 0.
    pub start: T,
    /// Depth there, and how fast it grows with t.
    pub depth: T,
    /// dz/dt.
    pub slope: T,
    /// u at λ = 0, and du/dλ.
    pub unit: Vec3<T>,
    /// See `unit`.
    pub rate: Vec3<T>,
}

impl<T: Real> Perspective<T> {
    /// λ of a parameter of the line.
    #[inline(always)]
    pub fn lambda(&self, t: T) -> T {
        let t = t - self.start;
        t / (self.depth * (self.depth + self.slope * t))
    }

    /// The parameter of λ.
    #[inline(always)]
    pub fn t(&self, lambda: T) -> T {
        let scaled = lambda * self.depth;
        self.start + scaled * self.depth / (T::one() - scaled * self.slope)
    }
}

#[inline(always)]
fn real<T: Real>(v: f32) -> T {
    T::of(f64::from(v))
}

#[inline(always)]
fn cast<T: Real>(v: Vec3<f32>) -> Vec3<T> {
    v.map(real)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, Domain, Extent, vec3};

    /// A frame that looks along (1, 2, 0.5), and its grid.
    fn domain() -> Domain<f64> {
        let ahead = vec3(1.0_f32, 2.0, 0.5).normalized();
        let right = ahead.cross(vec3(0.0, 0.0, 1.0)).normalized();
        let frame = Projection {
            eye: vec3(0.5, -1.0, 2.0),
            axes: [right, ahead.cross(right), ahead],
            near: 1.5,
            edges: [[-0.8, 0.6], [-0.4, 0.5]],
            baseline: 0.7,
        };
        let bounds = Aabb::new(Vec3::zero(), Vec3::splat(1.0));
        Domain::with_longest(bounds, Extent::Projective(frame), 65)
    }

    fn frame(d: &Domain<f64>) -> Projection {
        let Extent::Projective(frame) = d.extent else { unreachable!() };
        frame
    }

    /// Points at depths from the nearest to the farthest.
    fn points(d: &Domain<f64>) -> Vec<Vec3<f64>> {
        let top = Vec3::from(d.resolution.map(|n| f64::from(n - 1)));
        [[0.1, 0.9, 0.05], [0.5, 0.4, 0.5], [0.8, 0.2, 0.9], [0.3, 0.6, 0.99]]
            .map(|share| d.position(top.hadamard(Vec3::from(share))))
            .to_vec()
    }

    #[test]
    fn voxels_are_cubes_of_pictures_and_disparity() {
        let d = domain();
        assert_eq!(d.resolution, [65, 42, 12]);
        // A voxel in depth shifts a point seen from half the baseline apart by as much as a voxel in the picture is wide.
        let shift = 0.5 * f64::from(frame(&d).baseline / frame(&d).near) / 11.0;
        assert!((shift - 1.4 / 64.0).abs() < 1e-3, "{shift}");
        assert!((d.voxel() - 1.5 * 1.4 / 64.0).abs() < 1e-3, "{}", d.voxel());
    }

    #[test]
    fn position_inverts_node_and_what_lies_at_infinity_is_at_the_end() {
        let d = domain();
        for x in points(&d) {
            // The axes are orthonormal to the rounding of f32.
            assert!((d.position(d.node(x)) - x).length() < 1e-6 * x.length(), "{x:?}");
        }
        let end = d.position(vec3(32.0, 20.0, 21.0));
        assert!((frame(&d).local(end).z - 1.5 * f64::from(PROJECTED_FAR)).abs() < 1e-3, "{end:?}");
    }

    #[test]
    fn node_vjp_matches_central_differences_and_node_jvp_is_its_transpose() {
        let (d, v, w) = (domain(), vec3(0.7, -1.3, 0.4), vec3(-0.2, 0.9, 1.1));
        for x in points(&d) {
            let g = d.node_vjp(x, v);
            let e = 1e-5 * frame(&d).local(x).z;
            for a in 0..3 {
                let mut s = Vec3::zero();
                s[a] = e;
                let fd = (d.node(x + s) - d.node(x - s)).dot(v) / (2.0 * e);
                assert!((fd - g[a]).abs() < 1e-6 * g.length().max(1e-3), "axis {a}: {fd} vs {}", g[a]);
            }
            let (forward, backward) = (d.node_jvp(x, w).dot(v), g.dot(w));
            assert!((forward - backward).abs() < 1e-12, "{forward} vs {backward}");
        }
    }

    #[test]
    fn a_clipped_ray_touches_the_border_of_the_grid_at_both_ends() {
        let d = domain();
        let inside = points(&d);
        for (from, to) in [(0, 1), (1, 2), (0, 3), (2, 1)] {
            let ray = Ray { origin: inside[from], direction: (inside[to] - inside[from]).normalized() };
            let [a, b] = d.clip(&ray, -1e9).unwrap();
            for t in [a, b] {
                let g = d.node(ray.at(t));
                let off = (0..3).map(|k| {
                    // The last 1/256 of the depths is not part of the grid.
                    let top = f64::from(d.resolution[k] - 1) * if k == 2 { 255.0 / 256.0 } else { 1.0 };
                    (g[k].abs()).min((g[k] - top).abs())
                });
                assert!(off.fold(f64::INFINITY, f64::min) < 1e-4, "{g:?}");
            }
        }
        // Behind the eye, and beside the frustum.
        let ahead = frame(&d).axes[2].cast::<f64>();
        let behind = Ray { origin: frame(&d).eye.cast::<f64>() - ahead, direction: -ahead };
        assert_eq!(d.clip(&behind, 0.0), None);
    }

    #[test]
    fn lines_move_evenly_through_the_grid() {
        let d = domain();
        let (start, p) = (points(&d)[0], vec3(0.9, 1.4, 0.7));
        let (line, speed) = d.perspective(start, p, 0.3).unwrap();
        let at = |lambda: f64| d.node(start + p * line.t(lambda));
        let whole = at(0.2) - at(0.0);
        for share in [0.1, 0.5, 0.8] {
            assert!((at(0.2 * share) - at(0.0) - whole * share).length() < 1e-9);
            assert!((line.lambda(line.t(0.2 * share)) - 0.2 * share).abs() < 1e-12);
        }
        assert!((whole.length() - speed / d.voxel() * 0.2).abs() < 1e-9);
        let unit = |lambda: f64| line.unit + line.rate * lambda;
        assert!(
            (unit(0.2) - unit(0.0)).hadamard(d.nodes_per_unit()).zip(whole, |a, b| a - b).length() < 1e-9
        );
    }
}
