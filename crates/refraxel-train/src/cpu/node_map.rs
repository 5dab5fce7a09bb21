//! From points of a ray to cells of the grid, sixteen at a time, theory (3.1)–(3.3).

use fearless_simd::{f32x16, i32x16, prelude::*};
use refraxel_core::grid::Perspective;
use refraxel_core::radiance::{GROUP, Segment};
use refraxel_core::{Domain, Extent, Vec3, VoxelField};

/// World to node coordinates, with everything that does not depend on the point worked out.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeMap<'a> {
    domain: &'a Domain<f32>,
    center: Vec3<f32>,
    unit_per_world: Vec3<f32>,
    nodes_per_unit: Vec3<f32>,
    reach: f32,
    pub contracted: bool,
    last_cell: [i32; 3],
    brick_strides: [i32; 3],
}

/// A segment in the coordinates of the grid: its points are even steps of a parameter apart, which is t but in a projective grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// u, before a contraction, at parameter 0 and per unit of it.
    start: [f32; 3],
    slope: [f32; 3],
    /// The part that lies in the grid.
    pub range: [f32; 2],
    /// Parameter per scene unit inside the box.
    pub per_length: f32,
    /// Bound on the nodes per unit of the parameter, in the L∞ norm, inside the box. A contraction mixes the axes, so outside any
    /// axis may move as fast as the finest grid along the fastest direction.
    pub fastest: f32,
    perspective: Option<Perspective<f32>>,
}

impl Line {
    /// t of a parameter.
    #[inline(always)]
    pub(super) fn t(&self, parameter: f32) -> f32 {
        self.perspective.map_or(parameter, |p| p.t(parameter))
    }
}

/// Where sixteen points of a ray lie in the grid.
pub(super) struct Places {
    /// Index of the brick in the map's table.
    pub brick: [i32; GROUP],
    /// Position of the cell in its brick.
    pub local: [i32; GROUP],
    /// Position in the cell, per axis.
    pub fraction: [[f32; GROUP]; 3],
}

/// Numbers of the lanes of a group.
pub(super) const LANE: [f32; GROUP] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

impl<'a> NodeMap<'a> {
    pub(super) fn new(field: &'a VoxelField<f32>) -> Self {
        let domain = &field.domain;
        let contracted = domain.extent == Extent::Contracted;
        Self {
            domain,
            center: domain.bounds.center(),
            unit_per_world: domain.unit_per_world(),
            nodes_per_unit: domain.nodes_per_unit(),
            reach: if contracted { 2.0 } else { 1.0 },
            contracted,
            last_cell: domain.resolution.map(|n| n as i32 - 2),
            brick_strides: field.map.brick_strides().map(|s| s as i32),
        }
    }

    /// A segment, as the grid sees it.
    #[inline(always)]
    pub(super) fn line(&self, segment: &Segment<f32>) -> Line {
        let Segment { start, momentum, range } = segment;
        if let Some((perspective, per_lambda)) = self.domain.perspective(*start, *momentum, range[0]) {
            return Line {
                start: perspective.unit.to_array(),
                slope: perspective.rate.to_array(),
                range: [0.0, perspective.lambda(range[1])],
                per_length: per_lambda.recip(),
                fastest: perspective.rate.map(f32::abs).hadamard(self.nodes_per_unit).max_element(),
                perspective: Some(perspective),
            };
        }
        let slope = momentum.hadamard(self.unit_per_world);
        let speed = slope.map(f32::abs);
        let fastest = if self.contracted {
            self.nodes_per_unit.max_element() * speed.max_element()
        } else {
            speed.hadamard(self.nodes_per_unit).max_element()
        };
        Line {
            start: (*start - self.center).hadamard(self.unit_per_world).to_array(),
            slope: slope.to_array(),
            range: *range,
            per_length: momentum.length().recip(),
            fastest,
            perspective: None,
        }
    }

    /// [`Domain::growth`], bit by bit, without its three divisions: the march asks for it once per group of a contracted grid.
    #[inline(always)]
    pub(super) fn growth(&self, x: Vec3<f32>) -> f32 {
        if !self.contracted {
            return 1.0;
        }
        (x - self.center).hadamard(self.unit_per_world).map(f32::abs).max_element().max(1.0)
    }

    /// The cells around the points at t + (0, 1, … 15) dt of a line. Points outside the grid land on its border.
    #[inline(always)]
    pub(super) fn locate<S: Simd>(&self, simd: S, line: &Line, t: f32, dt: f32) -> Places {
        let t = f32x16::from_slice(simd, &LANE).mul_add(f32x16::splat(simd, dt), f32x16::splat(simd, t));
        let mut u = [t; 3];
        for a in 0..3 {
            u[a] = t.mul_add(f32x16::splat(simd, line.slope[a]), f32x16::splat(simd, line.start[a]));
        }
        if self.contracted {
            let one = f32x16::splat(simd, 1.0);
            let m = u[0].abs().max(u[1].abs()).max(u[2].abs()).max(one);
            // u (2/m − 1/m²), which is u itself for m = 1.
            let inverse = one / m;
            let scale = inverse * (-inverse + 2.0);
            for a in 0..3 {
                u[a] *= scale;
            }
        }
        let mut out = Places { brick: [0; GROUP], local: [0; GROUP], fraction: [[0.0; GROUP]; 3] };
        let (mut brick, mut local) = (i32x16::splat(simd, 0), i32x16::splat(simd, 0));
        for a in 0..3 {
            let g = ((u[a] + self.reach) * self.nodes_per_unit[a]).max(f32x16::splat(simd, 0.0));
            let base = simd.cvt_i32_f32x16(g).min(i32x16::splat(simd, self.last_cell[a]));
            (g - simd.cvt_f32_i32x16(base)).store_slice(&mut out.fraction[a]);
            brick += (base >> 2) * self.brick_strides[a];
            local += (base & 3) << (2 * a as u32);
        }
        brick.store_slice(&mut out.brick);
        local.store_slice(&mut out.local);
        out
    }
}

/// Bound on how much faster than inside the box a step can move through the nodes of a contracted grid: the contraction
/// stretches L∞ distances by at most 4/m − 3/m² ≤ 4/3, and steps grow with m, which a group of steps can lower by a
/// quarter.
#[inline(always)]
pub(super) fn stretch(growth: f32) -> f32 {
    if growth > 1.0 { (growth * 4.0 / 3.0).min(16.0 / 3.0) } else { 4.0 / 3.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, BrickMap, ShDegree, vec3};

    #[test]
    fn growth_is_that_of_the_domain_bit_by_bit() {
        let bounds: Aabb<f32> = Aabb::new(vec3(-1.0, -2.0, 0.0), vec3(3.0, 2.0, 3.3));
        for extent in [Extent::Bounded, Extent::Contracted] {
            let domain = Domain::with_longest(bounds, extent, 17);
            let map = BrickMap::new(domain.resolution, |_| true);
            let field = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), 0.0);
            for x in [vec3(0.5, 0.1, 1.3), vec3(-7.3, 2.9, 1.1), vec3(1.7, 31.0, -9.9)] {
                assert_eq!(NodeMap::new(&field).growth(x), field.domain.growth(x), "{extent:?}, {x:?}");
            }
        }
    }
}
