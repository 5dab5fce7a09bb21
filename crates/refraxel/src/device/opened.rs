//! What a run needs of a device, and the device that was opened for it.

#[cfg(feature = "gpu")]
use super::gpu::{Gpu, gpu_backend};
#[cfg(not(feature = "gpu"))]
use super::none::{Gpu, gpu_backend};
use super::process_group::ProcessGroup;
use crate::progress::Show;
use refraxel_core::ShDegree;
use refraxel_train::backend::Backend;
use refraxel_train::cpu::SharedBackend;
use refraxel_train::device::{Device, DeviceChoice};
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

/// What was decided.
pub struct Decided {
    /// The device.
    pub opened: Opened,
    /// Its name, and why it is that one.
    pub device: Device,
}

impl Decided {
    /// A backend with a model there, and with the state of an optimiser that goes on. Where nobody has asked for a GPU by name and the
    /// one that was found cannot hold the model, the CPU takes its place, and that is said.
    pub fn backend(
        &mut self,
        choice: DeviceChoice,
        model: Model,
        state: Option<Optimiser>,
        show: Show,
    ) -> Result<Box<dyn Backend>, BackendError> {
        if let Opened::Gpu(gpu) = &self.opened {
            match gpu_backend(gpu, &model, state.as_ref()) {
                Err(why) if choice == DeviceChoice::Auto => {
                    *self = Self::cpu(Some(why.to_string()));
                    self.say(show);
                }
                made => return made,
            }
        }
        Ok(match (&self.opened, state) {
            (Opened::ProcessGroup(group, options), state) => {
                Box::new(SharedBackend::new(&group.root, model, state, Options::clone(options)))
            }
            (_, Some(state)) => Box::new(CpuBackend::resumed(model, state)),
            (_, None) => Box::new(CpuBackend::new(model)),
        })
    }

    /// Says which device it is, unless it is the CPU and nobody would expect another.
    pub(super) fn say(&self, show: Show) {
        match &self.device {
            Device { why: Some(why), .. } => show.say(&format!("note: on the CPU, since {why}")),
            Device { name, .. } if matches!(self.opened, Opened::Gpu(_)) => {
                show.say(&format!("note: on {name}"));
            }
            _ => {}
        }
    }

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
    /// Voxels that its largest grid is expected to store.
    pub voxels: u64,
}

impl Needs<'_> {
    /// The degree of colours.
    pub fn degree(&self) -> ShDegree {
        let options = self.saved.map_or(self.options, |run| &run.options);
        ShDegree::new(options.field.sh_degree).unwrap_or_default()
    }
}
