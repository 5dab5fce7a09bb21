//! Total variation, theory (4.3): what neighbouring voxels owe each other.

use super::layout::{voxels, voxels_mut};
use super::update::{BucketGradient, Touched};
use crate::backend::{BUCKET_SLOTS, Objective, TV_EPSILON};
use fearless_simd::{Simd, f32x16, prelude::*};
use fearless_simd_macros::simd;
use refraxel_core::VoxelField;
use refraxel_core::grid::{BRICK, BRICK_VOXELS, EMPTY_SLOT};

/// Add the gradient of total variation over all voxels of a bucket, theory (4.3). Each edge of the grid is evaluated once, for
/// both of its ends, unless they belong to two buckets.
#[simd]
pub(super) fn total_variation<S: Simd, const BLOCKS: usize>(
    simd: S,
    field: &VoxelField<f32>,
    bucket: usize,
    objective: &Objective,
    grad: &mut BucketGradient,
) {
    let scale = objective.tv_period as f32;
    let weights = [scale * objective.tv_density, scale * objective.tv_colour];
    let first = bucket * BUCKET_SLOTS;
    let slots = first.max(1)..(first + BUCKET_SLOTS).min(field.map.slots());
    let own = |slot: u32| slots.contains(&(slot as usize));
    for slot in slots.clone() {
        let around = neighbour_slots(field, slot as u32);
        grad.touched[slot - first].fill(if objective.tv_colour > 0.0 {
            Touched::All
        } else {
            Touched::Density
        });
        for (axis, &[below, above]) in around.iter().enumerate() {
            let edges = Edges { first: first * BRICK_VOXELS, slot: slot as u32, axis, weights };
            edges.inside::<S, BLOCKS>(simd, field, grad);
            if above != EMPTY_SLOT {
                edges.across::<S, BLOCKS>(simd, field, above, true, own(above), grad);
            }
            // A neighbour of this bucket counts these edges as its own.
            if below != EMPTY_SLOT && !own(below) {
                edges.across::<S, BLOCKS>(simd, field, below, false, false, grad);
            }
        }
    }
}

/// Edges of the grid along one axis, from the voxels of a slot on.
struct Edges {
    /// The first voxel of the bucket.
    first: usize,
    slot: u32,
    axis: usize,
    /// Weights of density and colour.
    weights: [f32; 2],
}

/// Voxels of a face of a brick.
const FACE: usize = 16;

impl Edges {
    /// Edges between voxels of the slot.
    #[inline(always)]
    fn inside<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        field: &VoxelField<f32>,
        grad: &mut BucketGradient,
    ) {
        let stride = 1 << (2 * self.axis);
        for layer in 0..BRICK - 1 {
            let here = self.face(self.slot, layer);
            self.add::<S, BLOCKS>(simd, field, here, here.map(|v| v + stride), true, grad);
        }
    }

    /// Edges to the next slot `above`, or from the one below; `both`: that slot receives its share, too.
    #[inline(always)]
    fn across<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        field: &VoxelField<f32>,
        other: u32,
        above: bool,
        both: bool,
        grad: &mut BucketGradient,
    ) {
        let [here, there] = if above { [BRICK - 1, 0] } else { [0, BRICK - 1] };
        let (here, there) = (self.face(self.slot, here), self.face(other, there));
        self.add::<S, BLOCKS>(simd, field, here, there, both, grad);
    }

    /// The voxels of a slot in one of its layers across the axis.
    #[inline(always)]
    fn face(&self, slot: u32, layer: u32) -> [u32; FACE] {
        let mut voxels = [slot * BRICK_VOXELS as u32; FACE];
        for (k, voxel) in (0..).zip(&mut voxels) {
            let low = k & ((1 << (2 * self.axis)) - 1);
            *voxel += low | layer << (2 * self.axis) | (k ^ low) << 2;
        }
        voxels
    }

    /// Add weight · ψ'(here − there) to the gradient of `here` and, where `both`, its negative to that of `there`.
    #[inline(always)]
    fn add<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        field: &VoxelField<f32>,
        here: [u32; FACE],
        there: [u32; FACE],
        both: bool,
        grad: &mut BucketGradient,
    ) {
        let [of_density, of_colour] = self.weights;
        let mut difference = [0.0; FACE];
        for k in 0..FACE {
            difference[k] = field.density[here[k] as usize] - field.density[there[k] as usize];
        }
        let mut slope = [0.0; FACE];
        charbonnier_slopes(simd, f32x16::from_slice(simd, &difference), of_density).store_slice(&mut slope);
        for k in 0..FACE {
            grad.density[here[k] as usize - self.first] += slope[k];
            if both {
                grad.density[there[k] as usize - self.first] -= slope[k];
            }
        }
        if of_colour == 0.0 {
            return;
        }
        let (colours, gradients) = (voxels::<BLOCKS>(&field.colour), voxels_mut::<BLOCKS>(&mut grad.colour));
        for k in 0..FACE {
            let [x, y] = [here[k], there[k]].map(|v| v as usize);
            for b in 0..BLOCKS {
                let d = f32x16::from_slice(simd, &colours[x][b]) - f32x16::from_slice(simd, &colours[y][b]);
                let slope = charbonnier_slopes(simd, d, of_colour);
                let g = &mut gradients[x - self.first][b];
                (f32x16::from_slice(simd, g) + slope).store_slice(g);
                if both {
                    let g = &mut gradients[y - self.first][b];
                    (f32x16::from_slice(simd, g) - slope).store_slice(g);
                }
            }
        }
    }
}

/// weight · ψ'(d) of the Charbonnier penalty, theory (4.3).
#[inline(always)]
fn charbonnier_slopes<S: Simd>(simd: S, d: f32x16<S>, weight: f32) -> f32x16<S> {
    let square = d.mul_add(d, f32x16::splat(simd, TV_EPSILON * TV_EPSILON));
    d * weight / square.sqrt()
}

/// Slots below and above along each axis; [`EMPTY_SLOT`] where there is none.
fn neighbour_slots(field: &VoxelField<f32>, slot: u32) -> [[u32; 2]; 3] {
    let brick = field.map.brick_of(slot);
    std::array::from_fn(|axis| {
        [-1_i32, 1].map(|step| {
            let mut b = brick;
            b[axis] = b[axis].wrapping_add_signed(step);
            field.map.slot(b)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::tape::{BUCKET_VOXELS, buckets};
    use super::*;
    use fearless_simd::{Level, dispatch};
    use refraxel_core::grid::bricks::coordinates;
    use refraxel_core::priors::charbonnier_slope;
    use refraxel_core::{Aabb, BrickMap, Domain, Extent, ShDegree};

    /// Values without order in a box of which a third is not stored: several buckets.
    fn rough_field() -> VoxelField<f32> {
        let domain = Domain::with_longest(Aabb::cube(1.0), Extent::Bounded, 32);
        let keep = |b: [u32; 3]| !(b[0] + 2 * b[1] + b[2]).is_multiple_of(3);
        let map = BrickMap::new(domain.resolution, keep);
        let mut field = VoxelField::uniform(domain, map, ShDegree::new(1).unwrap(), 0.0);
        field.density.iter_mut().enumerate().for_each(|(i, v)| *v = 0.1 * (i as f32 * 1.7).sin());
        field.colour.iter_mut().enumerate().for_each(|(i, v)| *v = 0.1 * (i as f32 * 0.9).cos());
        field
    }

    #[test]
    fn every_edge_counts_for_both_of_its_ends_also_across_buckets() {
        let (field, tv_density, tv_colour) = (rough_field(), 0.3, 0.7);
        let usual = crate::backend::conformance::scenes::objective();
        let objective = Objective { tv_density, tv_colour, tv_period: 2, ..usual };
        let stride = field.degree.stride();
        let (mut density, mut colour) = (Vec::new(), Vec::new());
        assert!(buckets(&field.map) > 2);
        for bucket in 0..buckets(&field.map) {
            let mut grad = BucketGradient::new(stride);
            dispatch!(Level::new(), simd => total_variation::<_, 1>(simd, &field, bucket, &objective, &mut grad));
            density.extend_from_slice(&grad.density[..]);
            colour.extend_from_slice(&grad.colour[..]);
        }
        assert_eq!(density.len(), buckets(&field.map) * BUCKET_VOXELS);
        for node in coordinates(field.domain.resolution) {
            let voxel = field.map.voxel(node);
            if voxel < BRICK_VOXELS {
                continue;
            }
            let (mut d_density, mut d_colour) = (0.0, vec![0.0; stride]);
            for (axis, step) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
                let mut next = node;
                next[axis] = next[axis].wrapping_add_signed(step);
                let inside = next[axis] < field.domain.resolution[axis];
                let Some(other) = inside.then(|| field.map.voxel(next)).filter(|v| *v >= BRICK_VOXELS) else {
                    continue;
                };
                let d = field.density[voxel] - field.density[other];
                d_density += 2.0 * tv_density * charbonnier_slope(d, TV_EPSILON);
                for lane in 0..stride {
                    let d = field.colour[voxel * stride + lane] - field.colour[other * stride + lane];
                    d_colour[lane] += 2.0 * tv_colour * charbonnier_slope(d, TV_EPSILON);
                }
            }
            // Six terms of at most 1.4: some units in the last place.
            assert!((density[voxel] - d_density).abs() < 5e-6, "{node:?}");
            let of_voxel = &colour[voxel * stride..][..stride];
            assert!(of_voxel.iter().zip(&d_colour).all(|(a, b)| (a - b).abs() < 5e-6), "{node:?}");
        }
    }
}
