//! What a model and its kernels ask of the memory of a device.

use crate::backend::GpuBackend;
use crate::error::GpuError;
use crate::gradients::touched;
use crate::shape::{Purpose, Shape};
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_train::backend::{Batch, Objective};

/// Corners of a cell.
const CORNERS: u64 = 8;
/// Bytes of a number of fixed point that is added to, read and written.
const ADDED: u64 = 16;

impl Shape {
    /// Bytes of a field of so many voxels, with everything that it needs to learn if it does.
    pub(crate) fn field_bytes(&self, voxels: u64) -> u64 {
        let per_voxel = match self.purpose {
            // Density, two moments, the gradients of density and colour.
            Purpose::Learning => 4 + 8 + 8 + self.gradient_bytes(),
            Purpose::Showing => 4,
        };
        voxels * (per_voxel + self.colour_bytes())
    }

    /// Bytes that a kernel reads and writes of the field where so many samples are taken, and so many voxels move; caches may answer for
    /// memory. `None` for kernels that ask for other things.
    fn bytes_of(&self, kernel: &str, samples: u64, moved: u64, voxels: u64) -> Option<u64> {
        let colour = 16 * u64::from(self.blocks());
        let read = CORNERS * (4 + colour);
        let added = CORNERS * ADDED * (1 + self.lanes() as u64);
        match kernel {
            "render" | "render_bent" => Some(samples * read),
            "learn" | "learn_bent" => Some(samples * (read + added)),
            // Density, colour, moments and gradients are read and written; of all voxels, the bit that says whether they move.
            "update" => Some(moved * 2 * (4 + 8 + colour + 8 + self.gradient_bytes()) + voxels / 8),
            "occupancy" => Some(4 * voxels),
            _ => None,
        }
    }
}

impl GpuBackend {
    /// Voxels that a step on this batch would move.
    pub fn moved(&self, batch: &Batch, objective: &Objective) -> Result<u64, GpuError> {
        touched(self.model(), batch, objective)
    }

    /// Bytes that a kernel reads and writes of the field where rays take so many samples, and so many voxels move; those that caches
    /// answer for are among them. `None` for kernels that ask for other things than the field.
    pub fn bytes_of(&self, kernel: &str, samples: u64, moved: u64) -> Option<u64> {
        let voxels = self.model().held.field.map.slots() * BRICK_VOXELS;
        self.model().kernels.shape.bytes_of(kernel, samples, moved, voxels as u64)
    }
}
