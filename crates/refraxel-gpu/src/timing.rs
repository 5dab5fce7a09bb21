//! How long kernels take by the clock of the device, and how fast its memory is.

use crate::device::Device;
use crate::error::GpuError;
use crate::gpu::Gpu;
use crate::kernels::Kernel;
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape};
use crate::sources::COPY;
use refraxel_core::ShDegree;
use serde::Serialize;
use std::time::Instant;
use wgpu::BufferUsages;

/// Passes that a clock takes the time of; wgpu has 4096 places in a set of queries.
const MOST_PASSES: u32 = wgpu::QUERY_SET_MAX_QUERIES / 2;
/// The array that is copied [byte]: larger than the caches of any GPU, and the same for software.
const COPIED: u64 = 256 << 20;
const COPIED_BY_SOFTWARE: u64 = 16 << 20;
/// How often it is copied.
const COPIES: usize = 10;

/// What all passes of a kernel have taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KernelTime {
    /// Its name.
    pub kernel: &'static str,
    /// How many there were.
    pub passes: usize,
    /// Their sum by the clock of the device.
    pub seconds: f64,
}

/// Times of passes while they are taken.
#[derive(Debug)]
pub(crate) struct Clock {
    queries: wgpu::QuerySet,
    /// The kernels of all passes so far.
    passes: Vec<&'static str>,
}

impl Clock {
    pub(crate) fn new(device: &Device) -> Self {
        let queries = device.handle.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MOST_PASSES,
        });
        Self { queries, passes: Vec::new() }
    }

    /// Where the times of another pass of this kernel go: the set, and the first of two places. `None` where it is full.
    pub(crate) fn place(&mut self, kernel: &'static str) -> Option<(wgpu::QuerySet, u32)> {
        let place = 2 * self.passes.len() as u32;
        (place < 2 * MOST_PASSES).then(|| {
            self.passes.push(kernel);
            (self.queries.clone(), place)
        })
    }

    /// The sums per kernel, in the order in which these ran first.
    pub(crate) fn read(self, device: &Device, period: f64) -> Result<Vec<KernelTime>, GpuError> {
        if self.passes.is_empty() {
            return Ok(Vec::new());
        }
        let places = 2 * self.passes.len() as u32;
        let bytes = 8 * u64::from(places);
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        let resolved = device.buffer("times", bytes, usage)?;
        let mut encoder = device.encoder();
        encoder.resolve_query_set(&self.queries, 0..places, &resolved, 0);
        device.submit(encoder);
        let ticks: Vec<[u64; 2]> = bytemuck::pod_collect_to_vec(&device.read(&resolved, bytes)?);
        let mut times: Vec<KernelTime> = Vec::new();
        for (kernel, [start, end]) in self.passes.into_iter().zip(ticks) {
            let seconds = end.saturating_sub(start) as f64 * period;
            match times.iter_mut().find(|t| t.kernel == kernel) {
                Some(known) => (known.passes, known.seconds) = (known.passes + 1, known.seconds + seconds),
                None => times.push(KernelTime { kernel, passes: 1, seconds }),
            }
        }
        Ok(times)
    }
}

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
        let bytes = most.min(device.binding_limit()) / 16 * 16;
        let any_shape = Shape::within(Purpose::Showing, ShDegree::MAX, 1, device.binding_limit());
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
