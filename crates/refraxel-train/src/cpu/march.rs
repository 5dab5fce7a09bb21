//! Where a path meets matter: quadrature points in occupied cells, with their optical depths and transmittances.
//!
//! A path is marched segment by segment, theory (3.1); a straight ray is a path of one.

use super::optics16::absorb;
use super::prefetch::prefetch;
use crate::backend::Marching;
use fearless_simd::{f32x16, i32x16, prelude::*};
use refraxel_core::grid::bricks::Entry;
use refraxel_core::grid::{BRICK, Cell, EMPTY_SLOT, trilinear};
use refraxel_core::radiance::{GROUP, Segment};
use refraxel_core::{BrickMap, Domain, Extent, Vec3, VoxelField};

/// A quadrature point that matters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Voxels around the point and their weights.
    pub corners: [u32; 8],
    pub weights: [f32; 8],
    /// The same, as cell and position within it.
    pub cell: Cell,
    pub fraction: Vec3<f32>,
    /// Which marched_segment of the packet it lies on, and the midpoint's parameter there [scene unit].
    pub segment: u32,
    pub t: f32,
    /// Optical depth τ, dτ/dθ, opacity 1 − e^(−τ), and the transmittance in front.
    pub tau: f32,
    pub slope: f32,
    pub alpha: f32,
    pub before: f32,
    /// Colour; filled by shading.
    pub colour: [f32; 3],
    /// dLoss/d(T a) beyond what the colour explains.
    pub d_weight: f32,
}

/// World to node coordinates, with everything that does not depend on the point worked out.
#[derive(Clone, Copy, Debug)]
struct NodeMap {
    center: Vec3<f32>,
    unit_per_world: Vec3<f32>,
    nodes_per_unit: Vec3<f32>,
    reach: f32,
    contracted: bool,
    last_cell: [i32; 3],
    brick_strides: [i32; 3],
}

/// Where sixteen points of a ray lie in the grid.
struct Places {
    /// Index of the brick in the map's table.
    brick: [i32; GROUP],
    /// Position of the cell in its brick.
    local: [i32; GROUP],
    /// Position in the cell, per axis.
    fraction: [[f32; GROUP]; 3],
}

const LANE: [f32; GROUP] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

impl NodeMap {
    fn new(field: &VoxelField<f32>) -> Self {
        let domain = &field.domain;
        let contracted = domain.extent == Extent::Contracted;
        Self {
            center: domain.bounds.center(),
            unit_per_world: domain.unit_per_world(),
            nodes_per_unit: domain.nodes_per_unit(),
            reach: if contracted { 2.0 } else { 1.0 },
            contracted,
            last_cell: domain.resolution.map(|n| n as i32 - 2),
            brick_strides: field.map.brick_strides().map(|s| s as i32),
        }
    }

    /// Bound on the nodes per unit of arc length, in the L∞ norm, that a ray inside the box moves through. The contraction
    /// mixes the axes, so outside any axis may move as fast as the finest grid along the fastest direction.
    #[inline(always)]
    fn fastest(&self, direction: Vec3<f32>) -> f32 {
        let unit = direction.map(f32::abs).hadamard(self.unit_per_world);
        if self.contracted {
            self.nodes_per_unit.max_element() * unit.max_element()
        } else {
            unit.hadamard(self.nodes_per_unit).max_element()
        }
    }

    /// Factor by which steps grow at a point.
    #[inline(always)]
    fn growth(&self, x: Vec3<f32>) -> f32 {
        if !self.contracted {
            return 1.0;
        }
        (x - self.center).hadamard(self.unit_per_world).map(f32::abs).max_element().max(1.0)
    }

    /// The cells around the points at t + (0, 1, … 15) dt of a segment. Points outside the grid land on its border.
    #[inline(always)]
    fn locate<S: Simd>(&self, simd: S, segment: &Segment<f32>, t: f32, dt: f32) -> Places {
        let t = f32x16::from_slice(simd, &LANE).mul_add(f32x16::splat(simd, dt), f32x16::splat(simd, t));
        let mut u = [t; 3];
        for a in 0..3 {
            let (scale, start) = (self.unit_per_world[a], segment.start[a] - self.center[a]);
            let slope = f32x16::splat(simd, segment.momentum[a] * scale);
            u[a] = t.mul_add(slope, f32x16::splat(simd, start * scale));
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

/// Where the march along a path stands.
pub(super) struct Front {
    /// Transmittance so far.
    pub transmittance: f32,
    /// Nothing behind this point can be seen.
    pub opaque: bool,
    /// Steps from the start of the next segment to its first point.
    phase: f32,
    /// Where the samples start that still await their optical depth.
    first: usize,
    /// Their lengths, times the density scale.
    scale_length: [f32; GROUP],
    /// Points of lower raw density are transparent.
    theta_min: f32,
}

const BLANK: Sample = Sample {
    corners: [0; 8],
    weights: [0.0; 8],
    cell: Cell { slot: 0, local: 0 },
    fraction: Vec3 { x: 0.0, y: 0.0, z: 0.0 },
    segment: 0,
    t: 0.0,
    tau: 0.0,
    slope: 0.0,
    alpha: 0.0,
    before: 0.0,
    colour: [0.0; 3],
    d_weight: 0.0,
};

impl Marcher {
    /// A marcher that takes every stored cell for occupied.
    pub(super) fn new(field: &VoxelField<f32>) -> Self {
        let mut occupied = vec![u64::MAX; field.map.slots()];
        occupied[EMPTY_SLOT as usize] = 0;
        Self {
            nodes: NodeMap::new(field),
            domain: field.domain,
            occupied,
            density_scale: field.density_scale(),
            voxel: field.domain.voxel(),
        }
    }

    /// The domain that clips segments.
    pub(super) fn domain(&self) -> &Domain<f32> {
        &self.domain
    }

    /// The front at the start of a path, whose samples will follow those in `out`; `offset` in steps.
    #[inline(always)]
    pub(super) fn start(&self, offset: f32, marching: &Marching, out: &[Sample]) -> Front {
        Front {
            transmittance: 1.0,
            opaque: false,
            phase: offset,
            first: out.len(),
            scale_length: [0.0; GROUP],
            theta_min: self.theta_min(marching),
        }
    }

    /// Append the points of a segment of the path; true if there are any. They have their optical depths after
    /// [`Self::finish`].
    #[inline(always)]
    pub(super) fn march<S: Simd>(
        &self,
        simd: S,
        field: &VoxelField<f32>,
        (segment, marched_segment): (&Segment<f32>, u32),
        marching: &Marching,
        (front, out): (&mut Front, &mut Vec<Sample>),
    ) -> bool {
        let [t0, t1] = segment.range;
        let per_t = segment.momentum.length().recip();
        let step = marching.step * self.voxel;
        let nodes_per_step = self.nodes.fastest(segment.momentum) * step * per_t;
        let density = &field.density[..];
        let mut growth = self.nodes.growth(segment.at(t0));
        let mut dt = step * growth * per_t;
        let mut t = t0 + front.phase * dt;
        let mut any = false;
        while t <= t1 {
            let needed = (((t1 - t) / dt) as usize + 1).min(GROUP);
            let places = self.nodes.locate(simd, segment, t, dt);
            let bricks_to_steps = BRICK as f32 / (nodes_per_step * stretch(growth));
            let entries = self.entries(&field.map, &places, needed);
            let mut lane = 0;
            while lane < needed {
                match entries[lane & 15].slot() {
                    Err(far) => lane += (((far - 1) as f32 * bricks_to_steps) as usize).max(1),
                    Ok(slot) => {
                        let cell = Cell { slot, local: places.local[lane & 15] as u32 };
                        if self.occupied[slot as usize] >> (cell.local & 63) & 1 != 0 {
                            let [x, y, z] = &places.fraction;
                            let fraction = Vec3::new(x[lane & 15], y[lane & 15], z[lane & 15]);
                            let corners = field.map.corners(cell);
                            let t = t + dt * LANE[lane & 15];
                            any = true;
                            front.push(
                                Sample { corners, cell, fraction, segment: marched_segment, t, ..BLANK },
                                density,
                                self.density_scale * step * growth,
                                out,
                            );
                            if out.len() - front.first == GROUP {
                                self.finish(simd, density, marching, (front, out));
                                if front.opaque {
                                    return true;
                                }
                            }
                        }
                        lane += 1;
                    }
                }
            }
            if self.nodes.contracted && needed == GROUP {
                // The next group starts at a new step length, half a step in.
                let end = t + dt * (GROUP as f32 - 0.5);
                growth = self.nodes.growth(segment.at(end));
                dt = step * growth * per_t;
                t = end + 0.5 * dt;
            } else {
                t += dt * lane.max(needed) as f32;
            }
        }
        front.phase = (t - t1) / dt;
        any
    }

    /// What the grid holds at the first `needed` places; fetches ahead what their cells will need.
    #[inline(always)]
    fn entries(&self, map: &BrickMap, places: &Places, needed: usize) -> [Entry; GROUP] {
        let mut entries = [map.entry(places.brick[0] as usize); GROUP];
        for lane in 0..needed.min(GROUP) {
            entries[lane] = map.entry(places.brick[lane] as usize);
            if let Ok(slot) = entries[lane].slot() {
                prefetch(map.forward_rows(), slot as usize);
                prefetch(&self.occupied, slot as usize);
            }
        }
        entries
    }

    /// Give the points that await it their optical depths and keep those that matter.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(
        &self,
        simd: S,
        density: &[f32],
        marching: &Marching,
        (front, out): (&mut Front, &mut Vec<Sample>),
    ) {
        let mut theta = [0.0; GROUP];
        for (s, theta) in out[front.first..].iter_mut().zip(&mut theta) {
            s.weights = trilinear::weights(s.fraction);
            for k in 0..8 {
                *theta += s.weights[k] * density[s.corners[k] as usize];
            }
        }
        let [tau, slope, alpha] = absorb(simd, &theta, &front.scale_length);
        let mut kept = front.first;
        for (i, from) in (front.first..out.len()).enumerate() {
            if theta[i] < front.theta_min {
                continue;
            }
            if kept != from {
                out[kept] = out[from];
            }
            let s = &mut out[kept];
            (s.tau, s.slope, s.alpha, s.before) = (tau[i], slope[i], alpha[i], front.transmittance);
            kept += 1;
            front.transmittance *= 1.0 - alpha[i];
            if front.transmittance < marching.min_transmittance {
                front.opaque = true;
                break;
            }
        }
        out.truncate(kept);
        front.first = kept;
    }

    /// Raw density at which the optical depth of a voxel reaches the cut-off: softplus⁻¹. Outside the box of a contracted
    /// domain steps and voxels grow together, so one threshold serves.
    #[inline(always)]
    fn theta_min(&self, marching: &Marching) -> f32 {
        let cut = marching.min_optical_depth / (self.density_scale * self.voxel);
        if cut > 0.0 { cut.exp_m1().ln() } else { f32::NEG_INFINITY }
    }

    /// Recompute which cells may hold a sample of optical depth above the cut-off: those with a corner above it.
    pub(super) fn refresh(&mut self, field: &VoxelField<f32>, marching: &Marching) {
        use rayon::prelude::*;
        let theta_min = self.theta_min(marching);
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

impl Front {
    /// Append a point.
    #[inline(always)]
    fn push(&mut self, point: Sample, density: &[f32], scale_length: f32, out: &mut Vec<Sample>) {
        // A brick's plane of 4 × 4 densities is one cache line: two lines for most cells.
        prefetch(density, point.corners[0] as usize);
        prefetch(density, point.corners[7] as usize);
        self.scale_length[(out.len() - self.first) & 15] = scale_length;
        out.push(point);
    }
}

/// Bound on how much faster than inside the box a step can move through the nodes of a contracted grid: the contraction
/// stretches L∞ distances by at most 4/m − 3/m² ≤ 4/3, and steps grow with m, which a group of steps can lower by a
/// quarter.
#[inline(always)]
fn stretch(growth: f32) -> f32 {
    if growth > 1.0 { (growth * 4.0 / 3.0).min(16.0 / 3.0) } else { 4.0 / 3.0 }
}
