//! The device of a run: the CPU; a GPU where the program was built with the feature `gpu`; or the CPUs of several processes where it
//! was built with the feature `mpi`.

#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "mpi")]
mod mpi;
#[cfg(not(feature = "mpi"))]
mod no_mpi;
#[cfg(not(feature = "gpu"))]
mod none;
mod viewer;

#[cfg(feature = "gpu")]
use gpu::viewer as gpu_eyes;
#[cfg(feature = "gpu")]
pub use gpu::{Gpu, bench, devices, gpu_backend, open};
#[cfg(feature = "mpi")]
pub use mpi::join;
#[cfg(not(feature = "mpi"))]
pub use no_mpi::join;
#[cfg(not(feature = "gpu"))]
use none::viewer as gpu_eyes;
#[cfg(not(feature = "gpu"))]
pub use none::{Gpu, bench, devices, gpu_backend, open};
pub use viewer::ModelViewer;

use crate::exit::{Exit, Failure};
use crate::progress::Show;
use anyhow::anyhow;
use refraxel_train::backend::Backend;
use refraxel_train::cpu::{Root, SharedBackend};
use refraxel_train::device::{Device, DeviceChoice};
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::run::Run;
use refraxel_train::session::BackendError;
use refraxel_train::{CpuBackend, Options};
use std::process;
use std::sync::Arc;

/// The device that work is done on.
pub enum Opened {
    /// The CPU.
    Cpu,
    /// A GPU.
    Gpu(Gpu),
    /// The CPUs of several processes; what is learned there is stored with these options.
    ProcessGroup(ProcessGroup, Box<Options>),
}

/// The processes that train together, as the first of them sees them.
#[derive(Clone)]
pub struct ProcessGroup {
    /// Its hold on the others.
    pub root: Arc<Root>,
    /// How many there are, with the first.
    pub count: usize,
}

/// How a process takes part in a training.
pub enum Joined {
    /// There is no other.
    Alone,
    /// It is the first of several.
    Leads(ProcessGroup),
    /// It has helped the first one, which needs it no more.
    Helped,
}

/// What was decided.
pub struct Decided {
    /// The device.
    pub opened: Opened,
    /// Its name, and why it is that one.
    pub device: Device,
}

impl Decided {
    fn cpu(why: Option<String>) -> Self {
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
}

/// Opens the device of a run, before any other work, and says why it is the CPU where a GPU would do.
pub fn decide(
    choice: DeviceChoice,
    group: Option<&ProcessGroup>,
    needs: Needs,
    show: Show,
) -> Result<Decided, Failure> {
    if let Some(group) = group {
        let options = needs.saved.map_or(needs.options, |run| &run.options);
        let device = Device { name: format!("cpu of {} processes", group.count), why: None };
        let threads = rayon::current_num_threads();
        show.say(&format!(
            "note: on the {}; this one, the first, is {}, and has {threads} threads",
            device.name,
            process::id()
        ));
        return Ok(Decided {
            opened: Opened::ProcessGroup(group.clone(), Box::new(options.clone())),
            device,
        });
    }
    let decided = open(choice, Some(needs))?;
    match &decided.device {
        Device { why: Some(why), .. } => show.say(&format!("note: on the CPU, since {why}")),
        Device { name, .. } if matches!(decided.opened, Opened::Gpu(_)) => {
            show.say(&format!("note: on {name}"));
        }
        _ => {}
    }
    Ok(decided)
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

/// A device that cannot be used, or no longer.
fn unusable(error: impl Into<anyhow::Error>) -> Failure {
    Failure::new(Exit::Device, error)
}

/// Several processes are asked for where one works.
fn only_train() -> Failure {
    unusable(anyhow!(
        "several processes share one training, `mpirun -n N refraxel train … --device mpi`, and nothing else"
    ))
}
