//! Where a ray meets matter: quadrature points in occupied cells, with their optical depths and transmittances.
//!
//! Straight rays for now; a bent path only has to produce the same [`Sample`]s.

use super::optics16::absorb;
use crate::backend::Marching;
use fearless_simd::prelude::*;
use refraxel_core::grid::{BRICK, Cell, EMPTY_SLOT, trilinear};
use refraxel_core::{BrickMap, Domain, Extent, Ray, Vec3, VoxelField};

/// A quadrature point that matters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Voxels around the point and their weights.
    pub corners: [u32; 8],
    pub weights: [f32; 8],
    /// The same, as cell and position within it.
    pub cell: Cell,
    pub fraction: Vec3<f32>,
    /// Arc length of the midpoint [scene unit].
    pub t: f32,
    /// Optical depth τ, dτ/dθ, opacity 1 − e^(−τ), and the transmittance in front.
    pub tau: f32,
    pub slope: f32,
    pub alpha: f32,
    pub before: f32,
    /// Colour; filled by shading.
    pub colour: [f32; 3],
}

/// World to node coordinates with everything that does not depend on the point worked out.
#[derive(Clone, Copy, Debug)]
struct NodeMap {
    center: Vec3<f32>,
    unit_per_world: Vec3<f32>,
    nodes_per_unit: Vec3<f32>,
    reach: f32,
    contracted: bool,
    /// Largest growth of the L∞ distance by the contraction relative to the inside, 4/m − 3/m² at m = 3/2.
    stretch: f32,
    last_cell: [u32; 3],
}

impl NodeMap {
    fn new(domain: &Domain<f32>) -> Self {
        let contracted = domain.extent == Extent::Contracted;
        Self {
            center: domain.bounds.center(),
            unit_per_world: domain.unit_per_world(),
            nodes_per_unit: domain.nodes_per_unit(),
            reach: if contracted { 2.0 } else { 1.0 },
            contracted,
            stretch: if contracted { 4.0 / 3.0 } else { 1.0 },
            last_cell: domain.resolution.map(|n| n - 2),
        }
    }

    /// Node coordinates and the factor by which steps grow here.
    #[inline(always)]
    fn node(&self, x: Vec3<f32>) -> (Vec3<f32>, f32) {
        let mut u = (x - self.center).hadamard(self.unit_per_world);
        let mut growth = 1.0;
        if self.contracted {
            let m = u.map(f32::abs).max_element();
            if m > 1.0 {
                let inv = 1.0 / m;
                u *= inv * (2.0 - inv);
                growth = m;
            }
        }
        ((u + Vec3::splat(self.reach)).hadamard(self.nodes_per_unit), growth)
    }
}

/// What marching needs to know of the field, besides its parameters.
#[derive(Clone, Debug)]
pub(super) struct Marcher {
    nodes: NodeMap,
    domain: Domain<f32>,
    /// One bit per cell of each slot: may hold a sample above the cut-off.
    pub(super) occupied: Vec<u64>,
    density_scale: f32,
    voxel: f32,
}

/// Points awaiting their optical depth.
struct Pending {
    len: usize,
    theta: [f32; 16],
    scale_length: [f32; 16],
    points: [Sample; 16],
}

const BLANK: Sample = Sample {
    corners: [0; 8],
    weights: [0.0; 8],
    cell: Cell { slot: 0, local: 0 },
    fraction: Vec3 { x: 0.0, y: 0.0, z: 0.0 },
    t: 0.0,
    tau: 0.0,
    slope: 0.0,
    alpha: 0.0,
    before: 0.0,
    colour: [0.0; 3],
};

impl Marcher {
    /// A marcher that takes every stored cell for occupied.
    pub(super) fn new(field: &VoxelField<f32>) -> Self {
        let mut occupied = vec![u64::MAX; field.map.slots()];
        occupied[EMPTY_SLOT as usize] = 0;
        Self {
            nodes: NodeMap::new(&field.domain),
            domain: field.domain,
            occupied,
            density_scale: field.density_scale(),
            voxel: field.domain.voxel(),
        }
    }

    /// Append the samples of a straight ray; returns the transmittance at its end.
    #[inline(always)]
    pub(super) fn march<S: Simd>(
        &self,
        simd: S,
        field: &VoxelField<f32>,
        (ray, offset): (&Ray<f32>, f32),
        marching: &Marching,
        out: &mut Vec<Sample>,
    ) -> f32 {
        let mut transmittance = 1.0;
        let Some([t0, t1]) = self.domain.clip(ray, marching.near) else { return transmittance };
        let step = marching.step * self.voxel;
        let rate = self.nodes.nodes_per_unit.hadamard(self.nodes.unit_per_world);
        let fastest = ray.direction.map(f32::abs).hadamard(rate).max_element() * self.nodes.stretch;
        let per_step = 1.0 / (fastest * step);
        let mut pending = Pending { len: 0, theta: [0.0; 16], scale_length: [0.0; 16], points: [BLANK; 16] };
        let mut t = t0 + (offset - 0.5) * step;
        let mut growth = self.nodes.node(ray.at(t.max(t0))).1;
        loop {
            let dt = step * growth;
            let middle = t + 0.5 * dt;
            if middle > t1 {
                break;
            }
            let (g, next_growth) = self.nodes.node(ray.at(middle));
            let mut steps = 1.0;
            if middle >= t0 {
                let base = self.base(g);
                let far = field.map.bricks_to_content(base);
                if far > 0 {
                    steps = free_steps(far, per_step / growth);
                } else if self.push(field, (g, base), (middle, dt), &mut pending) && pending.len == 16 {
                    if self.flush(simd, &mut pending, marching, &mut transmittance, out) {
                        return transmittance;
                    }
                }
            }
            t += steps * dt;
            if self.nodes.contracted {
                growth = if steps > 1.0 { self.nodes.node(ray.at(t)).1 } else { next_growth };
            }
        }
        self.flush(simd, &mut pending, marching, &mut transmittance, out);
        transmittance
    }

    /// Lowest node of the cell around node coordinates inside the grid.
    #[inline(always)]
    fn base(&self, g: Vec3<f32>) -> [u32; 3] {
        let last = self.nodes.last_cell;
        [(g.x as u32).min(last[0]), (g.y as u32).min(last[1]), (g.z as u32).min(last[2])]
    }

    /// Queue the point if its cell is occupied.
    #[inline(always)]
    fn push(
        &self,
        field: &VoxelField<f32>,
        (g, base): (Vec3<f32>, [u32; 3]),
        (t, ds): (f32, f32),
        pending: &mut Pending,
    ) -> bool {
        let cell = field.map.cell(base);
        if self.occupied[cell.slot as usize] >> cell.local & 1 == 0 {
            return false;
        }
        let fraction = g - Vec3::from(base.map(|b| b as f32));
        let (corners, weights) = (field.map.corners(cell), trilinear::weights(fraction));
        let mut theta = 0.0;
        for k in 0..8 {
            theta += weights[k] * field.density[corners[k] as usize];
        }
        let i = pending.len & 15;
        pending.theta[i] = theta;
        pending.scale_length[i] = self.density_scale * ds;
        pending.points[i] = Sample { corners, weights, cell, fraction, t, ..BLANK };
        pending.len += 1;
        true
    }

    /// Give the queued points their optical depths and keep those that matter; true when the ray has become opaque.
    #[inline(always)]
    fn flush<S: Simd>(
        &self,
        simd: S,
        pending: &mut Pending,
        marching: &Marching,
        transmittance: &mut f32,
        out: &mut Vec<Sample>,
    ) -> bool {
        let [tau, slope, alpha] = absorb(simd, &pending.theta, &pending.scale_length);
        for i in 0..std::mem::take(&mut pending.len) {
            if tau[i] < marching.min_optical_depth {
                continue;
            }
            out.push(Sample {
                tau: tau[i],
                slope: slope[i],
                alpha: alpha[i],
                before: *transmittance,
                ..pending.points[i]
            });
            *transmittance *= 1.0 - alpha[i];
            if *transmittance < marching.min_transmittance {
                return true;
            }
        }
        false
    }

    /// Recompute which cells may hold a sample of optical depth above the cut-off: those with a corner above it.
    pub(super) fn refresh(&mut self, field: &VoxelField<f32>, marching: &Marching) {
        use rayon::prelude::*;
        let tau_per_softplus = self.density_scale * self.voxel * marching.step;
        let cut = marching.min_optical_depth / tau_per_softplus;
        // softplus⁻¹; everything is occupied without a cut-off. Steps grow outside the box of a contracted domain, by
        // the same factor as the matter there spreads, so one threshold serves.
        let theta_min = if cut > 0.0 { cut.exp_m1().ln() } else { f32::NEG_INFINITY };
        self.occupied.par_iter_mut().enumerate().skip(1).for_each(|(slot, bits)| {
            *bits = (0..64).fold(0, |bits, local| {
                let corners = field.map.corners(Cell { slot: slot as u32, local });
                let any = corners.iter().any(|&v| field.density[v as usize] > theta_min);
                bits | u64::from(any) << local
            });
        });
    }

    /// Share of stored cells that are occupied.
    pub(super) fn occupancy(&self, map: &BrickMap) -> f64 {
        let set: u64 = self.occupied.iter().map(|b| u64::from(b.count_ones())).sum();
        set as f64 / (map.voxels() as f64).max(1.0)
    }
}

/// Whole steps that stay in bricks known to be empty, when the nearest content is `far` bricks away.
#[inline(always)]
fn free_steps(far: u8, steps_per_node: f32) -> f32 {
    (f32::from(far - 1) * BRICK as f32 * steps_per_node).floor().max(1.0)
}
