//! Where a grid lies in the world: in a box, in a box and a contraction of all space around it, or before the cameras of a
//! forward-facing capture, theory (3.2) and (3.3).

use super::projection::{Perspective, Projection};
use crate::{Aabb, Ray, Real, Vec3};

/// Whether the grid ends at its box or reaches to infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// The grid fills the box. Rays that leave it meet the background.
    Bounded,
    /// The middle half of the grid along each axis fills the box; the outer half holds all space around, contracted.
    Contracted,
    /// The grid fills what the cameras of a forward-facing capture see, from a nearest depth on. Rays that leave it meet the
    /// background.
    Projective(Projection),
}

impl Extent {
    /// Whether photographs show things beyond the box too.
    pub fn is_unbounded(&self) -> bool {
        *self != Self::Bounded
    }

    /// The kind of grid in a word.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Bounded => "bounded",
            Self::Contracted => "contracted",
            Self::Projective(_) => "projective",
        }
    }
}

/// Map between the world and the nodes of a grid, theory (3.2) and (3.3).
///
/// World x → u = (x − centre)/half ∈ [−1, 1]³ inside the box. With m = ‖u‖∞ > 1 and [`Extent::Contracted`],
/// u → u (2/m − 1/m²), so that all space lies in [−2, 2]³. Node coordinates run from 0 to n − 1 over that range.
/// Source: cuboid contraction of DVGO v2, after mip-NeRF 360. Of [`Extent::Projective`], u are the coordinates of its
/// [`Projection`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain<T> {
    /// The box in the world [scene unit]; of a contracted grid the inner box, of a projective one the box of the subject.
    pub bounds: Aabb<T>,
    /// Whether the grid ends at the box.
    pub extent: Extent,
    /// Nodes per axis, each at least 2.
    pub resolution: [u32; 3],
}

/// Contracted grids end where the distance from the centre [half edge of the box] exceeds this; the background lies beyond.
pub const CONTRACTED_FAR: f64 = 64.0;

/// d(contracted u)/du = `scale` I + `slope` u eᵀ, e being the axis of the largest |u|.
struct Contraction<T> {
    /// Normalised coordinates before contraction.
    u: Vec3<T>,
    /// Number of the axis e.
    axis: usize,
    scale: T,
    slope: T,
}

impl<T: Real> Domain<T> {
    /// A domain with `longest` ≥ 2 nodes along the longest edge, whose voxels are as close to cubes as whole numbers of
    /// nodes allow; at least 2 nodes per axis.
    pub fn with_longest(bounds: Aabb<T>, extent: Extent, longest: u32) -> Self {
        let e = match &extent {
            Extent::Projective(projection) => projection.edge_lengths(),
            Extent::Bounded | Extent::Contracted => bounds.extent(),
        };
        let spacing = e.max_element().f64() / f64::from(longest - 1);
        let resolution = e.to_array().map(|l| ((l.f64() / spacing).round() as u32 + 1).max(2));
        Self { bounds, extent, resolution }
    }

    /// The same domain in another precision.
    pub fn cast<U: Real>(&self) -> Domain<U> {
        Domain { bounds: self.bounds.cast(), extent: self.extent, resolution: self.resolution }
    }

    /// Largest coordinate ϱ of the normalised, contracted space, theory (3.2): 1 or 2.
    #[inline(always)]
    fn reach(&self) -> T {
        match self.extent {
            Extent::Bounded | Extent::Projective(_) => T::one(),
            Extent::Contracted => T::of(2.0),
        }
    }

    /// d(node)/du along each axis inside the box [node]: (n − 1)/2 divided by the reach.
    #[inline(always)]
    pub fn nodes_per_unit(&self) -> Vec3<T> {
        let s = T::of(0.5) / self.reach();
        Vec3::from(self.resolution.map(|n| T::of(f64::from(n - 1)) * s))
    }

    /// du/dx along each axis [1 / scene unit]: one over half an edge of the box.
    #[inline(always)]
    pub fn unit_per_world(&self) -> Vec3<T> {
        self.bounds.extent().map(|e| T::of(2.0) / e)
    }

    /// Edge length of a voxel inside the box [scene unit], the smallest of the three axes; of a projective grid that of the
    /// nearest ones in the pictures.
    pub fn voxel(&self) -> T {
        if let Extent::Projective(projection) = &self.extent {
            let edges = projection.edge_lengths::<T>();
            let nodes = Vec3::from(self.resolution.map(|n| T::of(f64::from(n - 1))));
            return edges.zip(nodes, |e, n| e / n).min_element() * T::of(f64::from(projection.near));
        }
        self.nodes_per_unit().hadamard(self.unit_per_world()).map(T::recip).min_element()
    }

    /// The length over which density is counted [scene unit]: the longest edge of the box, or twice as many voxels as a
    /// projective grid has in depth.
    pub fn depth(&self) -> T {
        match &self.extent {
            Extent::Projective(projection) => T::of(f64::from(projection.baseline)),
            Extent::Bounded | Extent::Contracted => self.bounds.extent().max_element(),
        }
    }

    /// Normalised coordinates u [1], before contraction: in [−1, 1]³ inside the box.
    #[inline(always)]
    fn unit(&self, x: Vec3<T>) -> Vec3<T> {
        (x - self.bounds.center()).hadamard(self.unit_per_world())
    }

    /// Node coordinates g of a world point, theory (3.2); the point lies inside the grid when each is in [0, n − 1].
    #[inline(always)]
    pub fn node(&self, x: Vec3<T>) -> Vec3<T> {
        let u = match &self.extent {
            Extent::Bounded => self.unit(x),
            Extent::Contracted => {
                let u = self.unit(x);
                let inv = u.map(T::abs).max_element().max(T::one()).recip();
                u * (inv * (T::of(2.0) - inv))
            }
            Extent::Projective(projection) => projection.unit(x),
        };
        (u + Vec3::splat(self.reach())).hadamard(self.nodes_per_unit())
    }

    /// Transpose of the derivative of [`Self::node`]: dLoss/dx [1 / scene unit] from dLoss/dnode.
    ///
    /// Not differentiable on the box faces of a contracted domain and where two |u| tie for the largest.
    pub fn node_vjp(&self, x: Vec3<T>, d_node: Vec3<T>) -> Vec3<T> {
        let d_u = d_node.hadamard(self.nodes_per_unit());
        if let Extent::Projective(projection) = &self.extent {
            return projection.unit_vjp(x, d_u);
        }
        let Some(c) = self.contraction(x) else { return d_u.hadamard(self.unit_per_world()) };
        let mut out = d_u * c.scale;
        out[c.axis] += c.slope * c.u.dot(d_u);
        out.hadamard(self.unit_per_world())
    }

    /// The derivative of [`Self::node`] along `v` [scene unit], the transpose of [`Self::node_vjp`].
    pub fn node_jvp(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        if let Extent::Projective(projection) = &self.extent {
            return projection.unit_jvp(x, v).hadamard(self.nodes_per_unit());
        }
        let v = v.hadamard(self.unit_per_world());
        let Some(c) = self.contraction(x) else { return v.hadamard(self.nodes_per_unit()) };
        (v * c.scale + c.u * (c.slope * v[c.axis])).hadamard(self.nodes_per_unit())
    }

    /// The derivative of the contraction at `x`; `None` where nothing is contracted.
    #[inline]
    fn contraction(&self, x: Vec3<T>) -> Option<Contraction<T>> {
        let u = self.unit(x);
        let abs = u.map(T::abs);
        let m = abs.max_element();
        if self.extent != Extent::Contracted || m <= T::one() {
            return None;
        }
        let (inv, two) = (m.recip(), T::of(2.0));
        let axis = (0..3).find(|&a| abs[a] == m).unwrap_or(0);
        let slope = u[axis].signum() * (two * inv * inv * (inv - T::one()));
        Some(Contraction { u, axis, scale: inv * (two - inv), slope })
    }

    /// Coordinates of a node from its number, x fastest.
    pub fn coordinates(&self, node: usize) -> Vec3<T> {
        let n = self.resolution.map(|n| n as usize);
        Vec3::from([node % n[0], node / n[0] % n[1], node / (n[0] * n[1])].map(|i| T::of(i as f64)))
    }

    /// World position of a node from its number [scene unit].
    pub fn place(&self, node: usize) -> Vec3<T> {
        self.position(self.coordinates(node))
    }

    /// World position of node coordinates [scene unit], the inverse of [`Self::node`]. The outermost nodes of a contracted
    /// domain lie at infinity, as do the last ones of a projective domain; their positions are moved to where these end.
    pub fn position(&self, node: Vec3<T>) -> Vec3<T> {
        let mut u = node.zip(self.nodes_per_unit(), |a, b| a / b) - Vec3::splat(self.reach());
        if let Extent::Projective(projection) = &self.extent {
            return projection.position(u);
        }
        let m = u.map(T::abs).max_element();
        if self.extent == Extent::Contracted && m > T::one() {
            let far = T::of(CONTRACTED_FAR);
            let true_m = if m < T::of(2.0) { (T::of(2.0) - m).recip().min(far) } else { far };
            u *= true_m / m;
        }
        u.zip(self.unit_per_world(), |a, b| a / b) + self.bounds.center()
    }

    /// Interval of arc length of a ray inside the grid [scene unit], from `near` on; `None` if the ray misses it. Of a line
    /// x + t p, the interval of t.
    #[inline]
    pub fn clip(&self, ray: &Ray<T>, near: T) -> Option<[T; 2]> {
        let region = match &self.extent {
            Extent::Projective(projection) => return projection.clip(ray, near),
            Extent::Bounded => self.bounds,
            Extent::Contracted => {
                let (c, h) = (self.bounds.center(), self.bounds.extent() * T::of(0.5 * CONTRACTED_FAR));
                Aabb::new(c - h, c + h)
            }
        };
        let [a, b] = region.clip(ray)?;
        let a = a.max(near);
        (a < b).then_some([a, b])
    }

    /// Factor by which the quadrature step grows at a point, theory (3.3): 1 inside the box, in proportion to the distance from the
    /// centre outside.
    #[inline(always)]
    pub fn growth(&self, x: Vec3<T>) -> T {
        match self.extent {
            Extent::Bounded | Extent::Projective(_) => T::one(),
            Extent::Contracted => self.unit(x).map(T::abs).max_element().max(T::one()),
        }
    }

    /// The parameter in which the line x(t) = `start` + t `momentum` moves evenly through a projective grid, from t₀ on, and
    /// how many voxels of the nearest depth [scene unit] it moves through per unit of that; `None` in other grids.
    pub fn perspective(&self, start: Vec3<T>, momentum: Vec3<T>, t0: T) -> Option<(Perspective<T>, T)> {
        let Extent::Projective(projection) = &self.extent else { return None };
        let at = start + momentum * t0;
        let line = Perspective {
            start: t0,
            depth: projection.local(at).z,
            slope: projection.turned(momentum).z,
            unit: projection.unit(at),
            rate: projection.rate(start, momentum),
        };
        let nodes = line.rate.hadamard(self.nodes_per_unit()).length();
        Some((line, nodes * self.voxel()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3;

    fn contracted() -> Domain<f64> {
        let bounds = Aabb::new(vec3(-1.0, -2.0, 0.0), vec3(3.0, 2.0, 3.0));
        Domain::with_longest(bounds, Extent::Contracted, 65)
    }

    #[test]
    fn position_inverts_node_inside_and_outside_the_box() {
        for x in [vec3(0.3, 0.2, 1.0), vec3(9.0, -4.0, 2.0), vec3(-30.0, 40.0, -70.0)] {
            let back = contracted().position(contracted().node(x));
            assert!((back - x).length() < 1e-9 * x.length().max(1.0), "{x:?} -> {back:?}");
        }
    }

    #[test]
    fn the_contraction_keeps_all_space_inside_the_grid_and_is_continuous_at_the_box() {
        let d = contracted();
        let far = d.node(vec3(1e9, -1e9, 1e9));
        assert!((0..3).all(|a| far[a] >= 0.0 && far[a] <= f64::from(d.resolution[a] - 1)));
        let (inside, outside) = (d.node(vec3(2.999_999, 0.0, 1.0)), d.node(vec3(3.000_001, 0.0, 1.0)));
        assert!((inside - outside).length() < 1e-4);
    }

    #[test]
    fn node_vjp_matches_central_differences() {
        let (d, e, v) = (contracted(), 1e-5, vec3(0.7, -1.3, 0.4));
        for x in [vec3(0.3, 0.2, 1.0), vec3(9.0, -4.0, 2.0), vec3(0.0, 1.0, 8.0)] {
            let g = d.node_vjp(x, v);
            for a in 0..3 {
                let mut s = Vec3::zero();
                s[a] = e;
                let fd = (d.node(x + s) - d.node(x - s)).dot(v) / (2.0 * e);
                assert!((fd - g[a]).abs() < 1e-8, "axis {a}: {fd} vs {}", g[a]);
            }
        }
    }

    #[test]
    fn node_jvp_is_the_transpose_of_node_vjp() {
        let (d, v, w) = (contracted(), vec3(0.7, -1.3, 0.4), vec3(-0.2, 0.9, 1.1));
        for x in [vec3(0.3, 0.2, 1.0), vec3(9.0, -4.0, 2.0), vec3(0.0, 1.0, 8.0)] {
            let (forward, backward) = (d.node_jvp(x, v).dot(w), d.node_vjp(x, w).dot(v));
            assert!((forward - backward).abs() < 1e-12, "{forward} vs {backward}");
        }
    }

    #[test]
    fn voxels_are_nearly_cubic() {
        let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(2.0, 1.0, 0.5));
        let d = Domain::<f64>::with_longest(bounds, Extent::Bounded, 129);
        assert_eq!(d.resolution, [129, 65, 33]);
        assert!((d.voxel() - 2.0 / 128.0).abs() < 1e-12);
    }
}
