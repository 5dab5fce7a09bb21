//! How long kernels take by the clock of the device, and how fast its memory is.

use crate::clock::KernelTime;
use crate::error::GpuError;
use crate::gpu::Gpu;
use crate::kernels::Kernel;
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape};
use crate::sources::COPY;
use refraxel_core::ShDegree;
use std::time::Instant;

/// The array that is copied [byte]: larger than the caches of any GPU, and the same for software.
const COPIED: u64 = 256 << 20;
const COPIED_BY_SOFTWARE: u64 = 16 << 20;
/// How often it is copied.
const COPIES: usize = 10;

impl Gpu {
    /// Takes the times of all kernels from now on, up to 2048 passes; false where the adapter has no clock.
    pub fn start_clock(&self) -> bool {
        self.device.start_clock()
    }

    /// What kernels have taken since the clock was started; nothing where it was not.
    pub fn stop_clock(&self) -> Result<Vec<KernelTime>, GpuError> {
        self.device.stop_clock()
    }

    /// Bytes per second, read and written, of a kernel that copies a large array.
    pub fn copy_rate(&self) -> Result<f64, GpuError> {
        let device = &self.device;
        let most = if device.iteration_limit().is_some() { COPIED_BY_SOFTWARE } else { COPIED };
        let bytes = most.min(device.binding_limit) / 16 * 16;
        let any_shape = Shape::within(Purpose::Showing, ShDegree::MAX, 1, device.binding_limit);
        let (kernel, mut buffers) = (Kernel::new(device, &COPY, &any_shape), Buffers::default());
        buffers.zeros(device, "original", bytes)?;
        buffers.zeros(device, "duplicate", bytes)?;
        let copy = |times| {
            let mut encoder = device.encoder();
            kernel.run_often(device, &mut encoder, &[&buffers], (bytes / 16) as usize, times);
            device.submit(encoder);
            buffers.read_word(device, "duplicate", 0)
        };
        copy(1)?; // pages and clocks wake up
        self.start_clock();
        let start = Instant::now();
        copy(COPIES)?;
        let by_host = start.elapsed().as_secs_f64();
        let seconds = self.stop_clock()?.first().map_or(by_host, |t| t.seconds);
        device.fault().map_or(Ok((2 * bytes * COPIES as u64) as f64 / seconds), Err)
    }
}
