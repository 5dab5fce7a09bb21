//! What a run needs of a device, and the device that was opened for it.

#[cfg(feature = "gpu")]
use super::gpu::{Gpu, gpu_backend};
#[cfg(not(feature = "gpu"))]
use super::none::{Gpu, gpu_backend};
use super::process_group::ProcessGroup;
use refraxel_train::backend::Backend;
use refraxel_train::cpu::SharedBackend;
use refraxel_train::device::Device;
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::run::Run;
use refraxel_train::session::BackendError;
use refraxel_train::{CpuBackend, Options};

/// The device that work is done on.
pub enum Opened {
    /// The CPU.
    Cpu,
    /// A GPU.
    Gpu(Gpu),
    /// The CPUs of several processes; what is learned there is stored with these options.
    ProcessGroup(ProcessGroup, Box<Options>),
}

impl Opened {
    /// A backend with a model there, and with the state of an optimiser that goes on.
    pub fn backend(&self, model: Model, state: Option<Optimiser>) -> Result<Box<dyn Backend>, BackendError> {
        Ok(match (self, state) {
            (Self::Cpu, Some(state)) => Box::new(CpuBackend::resumed(model, state)),
            (Self::Cpu, None) => Box::new(CpuBackend::new(model)),
            (Self::Gpu(gpu), state) => gpu_backend(gpu, model, state)?,
            (Self::ProcessGroup(group, options), state) => {
                Box::new(SharedBackend::new(&group.root, model, state, Options::clone(options)))
            }
        })
    }
}

/// What was decided.
pub struct Decided {
    /// The device.
    pub opened: Opened,
    /// Its name, and why it is that one.
    pub device: Device,
}

impl Decided {
    pub(super) fn cpu(why: Option<String>) -> Self {
        Self { opened: Opened::Cpu, device: Device { why, ..Device::cpu() } }
    }
}

/// What a run needs of a device: its options, and the run that goes on, if there is one.
#[derive(Clone, Copy)]
pub struct Needs<'a> {
    /// What the run may come to need.
    pub options: &'a Options,
    /// What it has learned and decided so far.
    pub saved: Option<&'a Run>,
    /// Some photographs that it learns from have depth maps.
    pub has_depth: bool,
}
