//! Rays in the memory of a device.

use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use crate::task::{Lesson, RayAdjoint, Seen};

/// Rays on a device, with room for what they show and receive.
#[derive(Debug, Default)]
pub(crate) struct RayBuffers {
    pub buffers: Buffers,
    capacity: usize,
}

impl RayBuffers {
    /// Make room for so many rays, and for their gradients if they are wanted.
    pub(crate) fn fit(&mut self, device: &Device, n: usize, wants_gradients: bool) -> Result<(), GpuError> {
        if n > self.capacity || self.buffers.get("lessons").is_none() {
            self.buffers.zeros(device, "lessons", (n * size_of::<Lesson>()) as u64)?;
            self.buffers.zeros(device, "seen", (n * size_of::<Seen>()) as u64)?;
            self.capacity = n;
        }
        let gradients = if wants_gradients { n } else { 1 };
        let bytes = (gradients * size_of::<RayAdjoint>()) as u64;
        let fits = self.buffers.get("ray_gradients").is_some_and(|b| b.size() >= bytes);
        if fits { Ok(()) } else { self.buffers.zeros(device, "ray_gradients", bytes) }
    }

    /// Put rays there.
    pub(crate) fn fill(
        &mut self,
        device: &Device,
        lessons: &[Lesson],
        wants_gradients: bool,
    ) -> Result<(), GpuError> {
        self.fit(device, lessons.len(), wants_gradients)?;
        self.buffers.write(device, "lessons", lessons);
        Ok(())
    }
}
