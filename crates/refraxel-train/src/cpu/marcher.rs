//! Where a path meets matter: quadrature points in occupied cells, with their optical depths and transmittances.
//!
//! A path is marched segment by segment, theory (3.1); a straight ray is a path of one.

use super::node_map::{LANE, NodeMap, Places, stretch};
use super::optics16::absorb;
use super::prefetch::prefetch;
use super::sample::Sample;
use super::view::View;
use crate::backend::Marching;
use fearless_simd::prelude::*;
use rayon::prelude::*;
use refraxel_core::grid::bricks::Entry;
use refraxel_core::grid::{BRICK, Cell, trilinear};
use refraxel_core::radiance::{GROUP, Segment, thinning_phase};
use refraxel_core::{Domain, Vec3, VoxelField};

/// What marching needs to know of the field.
#[derive(Clone, Copy)]
pub(super) struct Marcher<'a> {
    field: &'a VoxelField<f32>,
    /// One bit per cell of each slot: may hold a sample above the cut-off.
    occupied: &'a [u64],
    nodes: NodeMap<'a>,
    density_scale: f32,
    voxel: f32,
}

/// Where the march along a path stands.
pub(super) struct MarchState {
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
    /// Points of smaller optical depth are left out by chance; the opacity of those that are not; and how much of one is due.
    thin: f32,
    thin_alpha: f32,
    due: f32,
    /// Step inside the box [scene unit].
    step: f32,
    /// The march ends below this transmittance.
    min_transmittance: f32,
}

impl<'a> Marcher<'a> {
    /// A marcher through a field of which only the `occupied` cells may hold matter.
    pub(super) fn new(field: &'a VoxelField<f32>, occupied: &'a [u64]) -> Self {
        let (density_scale, voxel) = (field.density_scale(), field.domain.voxel());
        Self { field, occupied, nodes: NodeMap::new(field), density_scale, voxel }
    }

    /// The domain that clips segments.
    pub(super) fn domain(&self) -> &'a Domain<f32> {
        &self.field.domain
    }

    /// The front at the start of a path, whose samples will follow the `first` ones of a list; `offset` in steps.
    #[inline(always)]
    pub(super) fn start(&self, offset: f32, view: &View, first: usize) -> MarchState {
        let (marching, thin) = (view.marching, view.thin);
        MarchState {
            transmittance: 1.0,
            opaque: false,
            phase: offset,
            first,
            scale_length: [0.0; GROUP],
            theta_min: marching.theta_min(self.field),
            thin,
            thin_alpha: -(-thin).exp_m1(),
            due: thinning_phase(offset),
            step: marching.step * self.voxel,
            min_transmittance: marching.min_transmittance,
        }
    }

    /// Append the points of a segment of the path, the packet's marched segment `number`; true if there are any. They have
    /// their optical depths after [`Self::finish`].
    #[inline(always)]
    pub(super) fn march<S: Simd>(
        &self,
        simd: S,
        segment: &Segment<f32>,
        number: u32,
        front: &mut MarchState,
        out: &mut Vec<Sample>,
    ) -> bool {
        let line = self.nodes.line(segment);
        let [t0, t1] = line.range;
        let (step, per_t) = (front.step, line.per_length);
        let nodes_per_step = line.fastest * step * per_t;
        let density = &self.field.density[..];
        let mut growth = self.nodes.growth(segment.at(segment.range[0]));
        let mut dt = step * growth * per_t;
        let mut t = t0 + front.phase * dt;
        let mut any = false;
        while t <= t1 {
            let needed = (((t1 - t) / dt) as usize + 1).min(GROUP);
            let places = self.nodes.locate(simd, &line, t, dt);
            let bricks_to_steps = BRICK as f32 / (nodes_per_step * stretch(growth));
            let entries = self.entries(&places, needed);
            let mut lane = 0;
            while lane < needed {
                match entries[lane & 15].slot() {
                    Err(far) => lane += (((far - 1) as f32 * bricks_to_steps) as usize).max(1),
                    Ok(slot) => {
                        if let Some(point) = self.point(&places, lane & 15, slot) {
                            let t = line.t(t + dt * LANE[lane & 15]);
                            let scale_length = self.density_scale * step * growth;
                            any = true;
                            front.push(Sample { segment: number, t, ..point }, density, scale_length, out);
                            if out.len() - front.first == GROUP {
                                self.finish(simd, front, out);
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

    /// About the first brick on a segment that holds matter: bricks of which the segment cuts no more than a corner may be
    /// left out.
    #[inline(always)]
    pub(super) fn first_slot<S: Simd>(&self, simd: S, segment: &Segment<f32>) -> Option<u32> {
        let line = self.nodes.line(segment);
        let [mut t, end] = line.range;
        let per_brick = BRICK as f32 / line.fastest;
        while t <= end {
            let growth = self.nodes.growth(segment.at(t)); // 1 in a projective grid, whatever t
            let dt = per_brick * growth;
            let needed = (((end - t) / dt) as usize + 1).min(GROUP);
            let places = self.nodes.locate(simd, &line, t, dt);
            let steps_per_brick = stretch(growth).recip();
            let mut lane = 0;
            while lane < needed {
                match self.field.map.entry(places.brick[lane & 15] as usize).slot() {
                    Err(far) => lane += (((far - 1) as f32 * steps_per_brick) as usize).max(1),
                    Ok(slot) if self.occupied[slot as usize] != 0 => return Some(slot),
                    Ok(_) => lane += 1,
                }
            }
            t += dt * lane.max(needed) as f32;
        }
        None
    }

    /// The point in a lane, which lies in a stored brick, unless its cell holds no matter.
    #[inline(always)]
    fn point(&self, places: &Places, lane: usize, slot: u32) -> Option<Sample> {
        let cell = Cell { slot, local: places.local[lane] as u32 };
        if self.occupied[slot as usize] >> (cell.local & 63) & 1 == 0 {
            return None;
        }
        let [x, y, z] = &places.fraction;
        let fraction = Vec3::new(x[lane], y[lane], z[lane]);
        Some(Sample { corners: self.field.map.corners(cell), cell, fraction, ..Sample::BLANK })
    }

    /// What the grid holds at the first `needed` places; fetches ahead what their cells will need.
    #[inline(always)]
    fn entries(&self, places: &Places, needed: usize) -> [Entry; GROUP] {
        let map = &self.field.map;
        let mut entries = [map.entry(places.brick[0] as usize); GROUP];
        for lane in 0..needed.min(GROUP) {
            entries[lane] = map.entry(places.brick[lane] as usize);
            if let Ok(slot) = entries[lane].slot() {
                prefetch(map.forward_rows(), slot as usize);
                prefetch(self.occupied, slot as usize);
            }
        }
        entries
    }

    /// Give the points that await it their optical depths and keep those that matter.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&self, simd: S, front: &mut MarchState, out: &mut Vec<Sample>) {
        let density = &self.field.density[..];
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
            let Some([tau, slope, alpha]) = front.thinned([tau[i], slope[i], alpha[i]]) else { continue };
            if kept != from {
                out[kept] = out[from];
            }
            let s = &mut out[kept];
            (s.tau, s.slope, s.alpha, s.before) = (tau, slope, alpha, front.transmittance);
            kept += 1;
            front.transmittance *= 1.0 - alpha;
            if front.transmittance < front.min_transmittance {
                front.opaque = true;
                break;
            }
        }
        out.truncate(kept);
        front.first = kept;
    }
}

/// Find out which cells may hold a sample of optical depth above the cut-off: those with a corner above it. One bit per cell,
/// 64 per slot; the bits of the empty brick stay.
pub(super) fn refresh(occupied: &mut [u64], field: &VoxelField<f32>, marching: &Marching) {
    let theta_min = marching.theta_min(field);
    occupied.par_iter_mut().enumerate().skip(1).for_each(|(slot, bits)| {
        *bits = (0..64).fold(0, |bits, local| {
            let corners = field.map.corners(Cell { slot: slot as u32, local });
            let any = corners.iter().any(|&v| field.density[v as usize] > theta_min);
            bits | u64::from(any) << local
        });
    });
}

impl MarchState {
    /// The optical depth of a point, dτ/dθ and its opacity, as they count; none if it is left out, theory (4.6).
    #[inline(always)]
    fn thinned(&mut self, point: [f32; 3]) -> Option<[f32; 3]> {
        let [tau, slope, _] = point;
        if tau >= self.thin || tau.is_nan() {
            return Some(point);
        }
        let share = tau / self.thin;
        self.due += share;
        if self.due < 1.0 {
            return None;
        }
        self.due -= 1.0;
        Some([self.thin, slope / share, self.thin_alpha])
    }

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
