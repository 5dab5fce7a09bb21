//! What kernels are made for: how large the arrays of a model are, and into how many pieces they are cut.

use crate::device::Device;
use crate::error::GpuError;
use refraxel_core::ShDegree;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_train::Model;

/// Arrays of the kernel with the most of them, without its pools, where all rays are straight, and where they may bend.
const OTHER_BINDINGS: [u32; 2] = [13, 19];

/// How an array with one entry per voxel, or with the words of photographs, is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Split {
    /// Voxels of every pool but the last.
    pub voxels: usize,
    pub pools: usize,
}

impl Split {
    pub(crate) fn new(voxels: usize, bytes_per_voxel: u64, binding: u64) -> Self {
        let most = (binding / bytes_per_voxel) as usize / BRICK_VOXELS * BRICK_VOXELS;
        let most = most.max(BRICK_VOXELS);
        Self { voxels: most, pools: voxels.div_ceil(most).max(1) }
    }

    /// The voxels of a pool, of so many in all.
    pub(crate) fn range(&self, pool: usize, voxels: usize) -> std::ops::Range<usize> {
        pool * self.voxels..((pool + 1) * self.voxels).min(voxels)
    }
}

/// What a field is in the memory of a device for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It learns: coefficients of colour are f32, and have a gradient.
    Learning,
    /// It is shown: they are f16, as the checkpoints of finished runs have them.
    Showing,
}

/// What kernels are made for: a purpose, a degree of colour, and the pools of colour, of its gradient, and of photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    pub purpose: Purpose,
    pub degree: ShDegree,
    pub colour: Split,
    pub gradient: Split,
    pub photographs: Split,
}

impl Shape {
    /// The shape of a model, if a device can hold it.
    pub(crate) fn new(device: &Device, model: &Model, purpose: Purpose) -> Result<Self, GpuError> {
        let bends = !model.refraction.is_none();
        Self::fitting(device, purpose, (model.field.degree, model.field.map.voxels()), bends)
    }

    /// The shape of a field of this degree and so many voxels, if a device can bind its arrays and has the memory.
    pub(crate) fn fitting(
        device: &Device,
        purpose: Purpose,
        (degree, voxels): (ShDegree, usize),
        bends: bool,
    ) -> Result<Self, GpuError> {
        let (binding, adapter) = (device.binding_limit, &device.adapter);
        let shape = Self::within(purpose, degree, voxels, binding);
        let others = OTHER_BINDINGS[usize::from(bends)];
        let (found, needed) = (adapter.max_bindings, others + 2);
        if found < needed {
            return Err(GpuError::few_bindings(&adapter.name, found, needed));
        }
        let most = (found - others) as usize;
        // The largest array in one piece, and those that are cut, with their bytes per voxel.
        let (colour, gradient) = (shape.colour_bytes(), shape.gradient_bytes());
        let ((whole, whole_bytes), (cut, cut_bytes)) = match purpose {
            Purpose::Learning => {
                (("the gradient of density", 8), ("colour and its gradient", colour + gradient))
            }
            Purpose::Showing => (("density", 4), ("colour", colour)),
        };
        if whole_bytes * voxels as u64 > binding {
            return Err(device.too_large(whole, whole_bytes * voxels as u64, binding));
        }
        if shape.colour.pools + shape.gradient.pools > most {
            return Err(device.too_large(cut, cut_bytes * voxels as u64, most as u64 * binding));
        }
        let needed = shape.field_bytes(voxels as u64);
        match adapter.memory {
            Some(found) if needed > found => {
                Err(GpuError::LittleMemory { adapter: adapter.name.clone(), needed, found })
            }
            _ => Ok(shape),
        }
    }

    /// The shape of so many voxels in bindings of so many bytes.
    pub(crate) fn within(purpose: Purpose, degree: ShDegree, voxels: usize, binding: u64) -> Self {
        let one = Split { voxels: BRICK_VOXELS, pools: 1 };
        let shape = Self { purpose, degree, colour: one, gradient: one, photographs: one };
        let colour = Split::new(voxels, shape.colour_bytes(), binding);
        let gradient = match purpose {
            Purpose::Learning => Split::new(voxels, shape.gradient_bytes(), binding),
            Purpose::Showing => one,
        };
        Self { colour, gradient, ..shape }
    }

    /// Vectors of four lanes that hold the coefficients of a voxel.
    pub(crate) fn blocks(&self) -> u32 {
        (3 * self.degree.basis()).div_ceil(4) as u32
    }

    /// Lanes of the gradient of a voxel.
    pub(crate) fn lanes(&self) -> usize {
        4 * self.blocks() as usize
    }

    /// Bytes of a voxel's coefficients, laid out as on the host.
    pub(crate) fn colour_bytes(&self) -> u64 {
        let bytes = match self.purpose {
            Purpose::Learning => 4,
            Purpose::Showing => 2,
        };
        bytes * self.degree.stride() as u64
    }

    /// Bytes of the gradient of a voxel's coefficients: fixed point, 8 bytes per lane, without padding to whole lines.
    pub(crate) fn gradient_bytes(&self) -> u64 {
        8 * self.lanes() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pools_cover_all_voxels_and_none_is_larger_than_a_binding() {
        for (voxels, binding) in [(64, 1 << 27), (64 * 5000, 1 << 20), (64 * 4097, 9_000_001)] {
            let [learning, showing] = [Purpose::Learning, Purpose::Showing]
                .map(|purpose| Shape::within(purpose, ShDegree::default(), voxels, binding));
            for (split, bytes) in [
                (learning.colour, learning.colour_bytes()),
                (learning.gradient, learning.gradient_bytes()),
                (showing.colour, showing.colour_bytes()),
            ] {
                let ranges: Vec<_> = (0..split.pools).map(|k| split.range(k, voxels)).collect();
                assert!(ranges.iter().all(|r| !r.is_empty() && r.len() as u64 * bytes <= binding));
                assert_eq!(ranges.iter().map(|r| r.len()).sum::<usize>(), voxels);
                assert!(ranges.iter().all(|r| r.start % BRICK_VOXELS == 0));
            }
        }
    }
}
