//! An adapter that was opened, with the kernels that were compiled for it.

use crate::adapters::Adapter;
use crate::device::{Device, Traffic};
use crate::error::GpuError;
use crate::kernels::Kernels;
use crate::shape::Shape;
use refraxel_train::device::DeviceChoice;
use refraxel_train::model::MAX_SEGMENTS;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use wgpu::PollType;

/// An adapter that was opened. Shared by the backends that use it.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(crate) device: Device,
    /// Kernels that were compiled, by what they were compiled for.
    kernels: Arc<Mutex<Vec<Arc<Kernels>>>>,
}

impl Gpu {
    /// Open the adapter that is meant; `None` where that is the CPU.
    pub fn open(choice: DeviceChoice) -> Result<Option<Self>, GpuError> {
        let device = Device::open(choice)?;
        Ok(device.map(|device| Self { device, kernels: Arc::default() }))
    }

    /// What was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.device.adapter
    }

    /// The same device with smaller bindings, so that small scenes are split as large ones are on other devices.
    #[must_use]
    pub fn with_binding_limit(mut self, bytes: u64) -> Self {
        self.device.binding_limit = bytes.min(self.device.binding_limit);
        self
    }

    /// The same device with fewer workgroups along each dimension of a dispatch, at least 1.
    #[must_use]
    pub fn with_workgroup_limit(mut self, most: u32) -> Self {
        self.device.workgroup_limit = most.clamp(1, self.device.workgroup_limit);
        self
    }

    /// The same device, which fails where it does not answer within this time.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.device.patience = Some(patience);
        self
    }

    /// The same device as if it had only so much memory [byte].
    #[must_use]
    pub fn with_memory(mut self, bytes: u64) -> Self {
        self.device.adapter.memory = Some(bytes);
        self
    }

    /// Gives the device up, as a driver does that is reset.
    pub fn lose(&self) {
        self.device.handle.destroy();
        // Whoever wants to know is told once all work has ended.
        let _ = self.device.handle.poll(PollType::wait_indefinitely());
    }

    /// The same device with another number of segments per dispatch, at least 1: more than a software adapter takes, or as few as
    /// it does.
    #[must_use]
    pub fn with_replay(mut self, segments: usize) -> Self {
        self.device.replay = segments.clamp(1, MAX_SEGMENTS);
        self
    }

    /// The first thing that went wrong, after which nothing can be relied on.
    pub fn fault(&self) -> Option<GpuError> {
        self.device.fault()
    }

    /// What has travelled between host and device so far.
    pub fn traffic(&self) -> Traffic {
        self.device.traffic()
    }

    /// The kernels of a shape.
    pub(crate) fn kernels(&self, shape: Shape) -> Result<Arc<Kernels>, GpuError> {
        let mut known = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernels) = known.iter().find(|k| k.shape == shape) {
            return Ok(Arc::clone(kernels));
        }
        let kernels = Arc::new(Kernels::new(&self.device, shape)?);
        known.push(Arc::clone(&kernels));
        Ok(kernels)
    }
}
