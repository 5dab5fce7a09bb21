//! The device of an adapter: buffers, transfers, and what goes wrong.

use crate::adapters::{Adapter, AdapterKind, choose, describe, enumerate};
use crate::clock::{Clock, KernelTime};
use crate::error::GpuError;
use refraxel_train::device::DeviceChoice;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use wgpu::{BufferUsages, MapMode, PollType};

/// Arrays that the largest kernel binds besides its pools, and the least number of pools.
const LEAST_BINDINGS: u32 = 16;
/// Bytes that are read back at once.
const STAGING: u64 = 32 << 20;
/// Iterations of all loops of an invocation after which llvmpipe (Mesa) leaves them without a word.
const SOFTWARE_ITERATIONS: u64 = 65_535;
/// Segments that one dispatch takes a path further. More of them need more memory for each, less for checkpoints: at 32 a ray takes
/// 9.7 KiB.
const REPLAY: usize = 32;
/// The same on software adapters, so that their limit of iterations is not met.
const SOFTWARE_REPLAY: usize = 8;
/// Time in which hardware answers, however much work there is: dispatches are short, and some tens of them are sent at a time.
const PATIENCE: Duration = Duration::from_secs(120);

/// The device of an adapter that was opened. Clones are the same device.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    pub handle: wgpu::Device,
    queue: wgpu::Queue,
    /// What was opened.
    pub adapter: Adapter,
    /// Largest array that a kernel binds [byte].
    pub binding_limit: u64,
    /// Workgroups along each dimension of a dispatch.
    pub workgroup_limit: u32,
    /// Segments that one dispatch takes a path further: computed again from one checkpoint, and kept meanwhile.
    pub replay: usize,
    /// How long the host waits for an answer; for ever where a program on the CPU gives it.
    pub patience: Option<Duration>,
    /// What takes the times of kernels, where somebody asks for them.
    clock: Arc<Mutex<Option<Clock>>>,
    /// The first thing that went wrong.
    fault: Arc<Mutex<Option<GpuError>>>,
    traffic: Arc<Counts>,
}

/// What has travelled between host and device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// To the device [byte].
    pub written: u64,
    /// Back [byte].
    pub read: u64,
    /// How often the host has waited for what it read.
    pub waits: u64,
}

impl std::ops::Sub for Traffic {
    type Output = Self;
    fn sub(self, before: Self) -> Self {
        Self {
            written: self.written - before.written,
            read: self.read - before.read,
            waits: self.waits - before.waits,
        }
    }
}

/// The same while it is counted.
#[derive(Debug, Default)]
struct Counts {
    written: AtomicU64,
    read: AtomicU64,
    waits: AtomicU64,
}

impl Device {
    /// Open the adapter that is meant; `None` where that is the CPU.
    pub(crate) fn open(choice: DeviceChoice) -> Result<Option<Self>, GpuError> {
        if choice == DeviceChoice::Cpu {
            return Ok(None);
        }
        let found = enumerate();
        let described: Vec<Adapter> = found.iter().enumerate().map(|(n, a)| describe(n, a)).collect();
        match choose(choice, &described)? {
            None => Ok(None),
            Some(n) => Self::of(&found[n], described[n].clone()).map(Some),
        }
    }

    fn of(found: &wgpu::Adapter, adapter: Adapter) -> Result<Self, GpuError> {
        let name = || adapter.name.clone();
        if adapter.max_bindings < LEAST_BINDINGS {
            return Err(GpuError::few_bindings(&adapter.name, adapter.max_bindings, LEAST_BINDINGS));
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("refraxel"),
            required_features: found.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: found.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (handle, queue) = pollster::block_on(found.request_device(&descriptor))
            .map_err(|e| GpuError::Open { adapter: name(), reason: e.to_string() })?;
        // A buffer is bound as a whole.
        let binding_limit = adapter.max_binding.min(adapter.max_buffer);
        let workgroup_limit = handle.limits().max_compute_workgroups_per_dimension;
        let (replay, patience) = match adapter.kind {
            AdapterKind::Software => (SOFTWARE_REPLAY, None),
            _ => (REPLAY, Some(PATIENCE)),
        };
        let device = Self {
            handle,
            queue,
            adapter,
            binding_limit,
            workgroup_limit,
            replay,
            patience,
            clock: Arc::default(),
            fault: Arc::default(),
            traffic: Arc::default(),
        };
        let (name, fault) = (device.adapter.name.clone(), Arc::clone(&device.fault));
        device.handle.set_device_lost_callback(move |_, reason| {
            note(&fault, GpuError::Lost { adapter: name.clone(), reason });
        });
        let (name, fault) = (device.adapter.name.clone(), Arc::clone(&device.fault));
        device.handle.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&fault, GpuError::Driver { adapter: name.clone(), reason: error.to_string() });
        }));
        Ok(device)
    }

    /// Take the times of kernels from now on; false where the adapter has no clock.
    pub(crate) fn start_clock(&self) -> bool {
        let has_clock = self.handle.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        *locked(&self.clock) = has_clock.then(|| Clock::new(&self.handle));
        has_clock
    }

    /// The times that were taken since.
    pub(crate) fn stop_clock(&self) -> Result<Vec<KernelTime>, GpuError> {
        let Some(clock) = locked(&self.clock).take().filter(|clock| clock.bytes() > 0) else {
            return Ok(Vec::new());
        };
        let resolved =
            self.buffer("times", clock.bytes(), BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC)?;
        let mut encoder = self.encoder();
        clock.resolve(&mut encoder, &resolved);
        self.submit(encoder);
        let times = self.read(&resolved, clock.bytes())?;
        Ok(clock.sums(&times, 1e-9 * f64::from(self.queue.get_timestamp_period())))
    }

    /// Where the times of a pass of this kernel go, if they are taken.
    pub(crate) fn times(&self, kernel: &'static str) -> Option<(wgpu::QuerySet, u32)> {
        locked(&self.clock).as_mut()?.place(kernel)
    }

    /// Iterations of all loops of an invocation, where a device bounds them.
    pub(crate) fn iteration_limit(&self) -> Option<u64> {
        (self.adapter.kind == AdapterKind::Software).then_some(SOFTWARE_ITERATIONS)
    }

    /// The first thing that went wrong, after which nothing can be relied on.
    pub(crate) fn fault(&self) -> Option<GpuError> {
        locked(&self.fault).clone()
    }

    pub(crate) fn fail(&self, error: GpuError) {
        note(&self.fault, error);
    }

    /// The error that something needs so many bytes, and so many can be bound at most.
    pub(crate) fn too_large(&self, what: &str, needed: u64, most: u64) -> GpuError {
        GpuError::TooLarge { what: what.to_owned(), adapter: self.adapter.name.clone(), needed, most }
    }

    /// The error that the device left loops before their end.
    pub(crate) fn cut_short(&self) -> GpuError {
        let (adapter, most) = (self.adapter.name.clone(), self.iteration_limit().unwrap_or(0));
        GpuError::CutShort { adapter, most }
    }

    /// Commands, to be [submitted](Self::submit).
    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.handle.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Enqueue commands, behind what was written before.
    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Send what was written: the driver keeps a copy until then.
    pub(crate) fn flush(&self) {
        self.queue.submit([]);
    }

    /// Size of a buffer for so many bytes: kernels cannot bind nothing, and copies move whole words.
    pub(crate) fn padded(bytes: u64) -> u64 {
        bytes.max(16).next_multiple_of(16)
    }

    /// A buffer of zeros.
    pub(crate) fn buffer(
        &self,
        what: &str,
        bytes: u64,
        usage: BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let size = Self::padded(bytes);
        let scope = self.handle.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        let buffer = self.handle.create_buffer(&descriptor);
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(_) => Err(GpuError::OutOfMemory {
                what: what.to_owned(),
                bytes: size,
                adapter: self.adapter.name.clone(),
            }),
        }
    }

    /// Write bytes to a buffer, from an offset on.
    pub(crate) fn write(&self, buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        self.traffic.written.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.queue.write_buffer(buffer, offset, bytes);
    }

    /// What has travelled between host and device so far.
    pub(crate) fn traffic(&self) -> Traffic {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let Counts { written, read, waits } = &*self.traffic;
        Traffic { written: of(written), read: of(read), waits: of(waits) }
    }

    /// Parts of buffers, each from an offset on, after everything that was submitted: in one read-back.
    pub(crate) fn read_parts(&self, parts: &[(&wgpu::Buffer, u64, u64)]) -> Result<Vec<Vec<u8>>, GpuError> {
        let all = parts.iter().map(|(_, _, bytes)| bytes).sum();
        let usage = BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let gathered = self.buffer("gathered", all, usage)?;
        let mut encoder = self.encoder();
        let mut at = 0;
        for &(buffer, offset, bytes) in parts {
            encoder.copy_buffer_to_buffer(buffer, offset, &gathered, at, bytes);
            at += bytes;
        }
        self.submit(encoder);
        let mut rest = &self.read(&gathered, all)?[..];
        let mut next = |bytes: u64| rest.split_off(..bytes as usize).unwrap_or_default().to_vec();
        Ok(parts.iter().map(|(_, _, bytes)| next(*bytes)).collect())
    }

    /// The first bytes of a buffer, after everything that was submitted.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, GpuError> {
        if let Some(fault) = self.fault() {
            return Err(fault); // nobody waits again for a device that does not answer
        }
        self.traffic.read.fetch_add(bytes, Ordering::Relaxed);
        let mut out = Vec::with_capacity(bytes as usize);
        let staging =
            self.buffer("staging", STAGING.min(bytes), BufferUsages::MAP_READ | BufferUsages::COPY_DST)?;
        for first in (0..bytes).step_by(STAGING as usize) {
            let part = STAGING.min(bytes - first);
            let mut encoder = self.encoder();
            encoder.copy_buffer_to_buffer(buffer, first, &staging, 0, part.next_multiple_of(4));
            self.submit(encoder);
            self.traffic.waits.fetch_add(1, Ordering::Relaxed);
            let adapter = || self.adapter.name.clone();
            let failed = |reason| self.first_fault(GpuError::Driver { adapter: adapter(), reason });
            let slice = staging.slice(..part.next_multiple_of(4));
            slice.map_async(MapMode::Read, |_| ()); // a failure shows in the mapped range
            let wait = PollType::Wait { submission_index: None, timeout: self.patience };
            match self.handle.poll(wait) {
                Err(wgpu::PollError::Timeout) => return Err(self.stalled()),
                waited => waited.map_err(|e| failed(e.to_string()))?,
            };
            let mapped = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
            out.extend_from_slice(&mapped[..part as usize]);
            drop(mapped);
            staging.unmap();
        }
        Ok(out)
    }

    /// The error that the device has not answered.
    fn stalled(&self) -> GpuError {
        let seconds = self.patience.unwrap_or_default().as_secs();
        self.first_fault(GpuError::Stalled { adapter: self.adapter.name.clone(), seconds })
    }

    /// What went wrong first, or else this.
    fn first_fault(&self, error: GpuError) -> GpuError {
        self.fail(error);
        self.fault().unwrap_or_else(|| unreachable!("a fault was noted"))
    }
}

/// Note what went wrong, unless something has before. That the device is gone explains what its driver reported meanwhile.
fn note(fault: &Mutex<Option<GpuError>>, error: GpuError) {
    let mut known = locked(fault);
    let is_explained = matches!((&*known, &error), (Some(GpuError::Driver { .. }), GpuError::Lost { .. }));
    if known.is_none() || is_explained {
        *known = Some(error);
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
