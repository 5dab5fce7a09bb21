//! The device of a run: the CPU; a GPU where the program was built with the feature `gpu`; or the CPUs of several processes where it
//! was built with the feature `mpi`.

mod eyes;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "mpi")]
mod mpi;
#[cfg(not(feature = "mpi"))]
mod no_mpi;
#[cfg(not(feature = "gpu"))]
mod none;

pub use eyes::Eyes;
#[cfg(feature = "gpu")]
use gpu::eyes as gpu_eyes;
#[cfg(feature = "gpu")]
pub use gpu::{Gpu, bench, devices, on_gpu, open};
#[cfg(feature = "mpi")]
pub use mpi::join;
#[cfg(not(feature = "mpi"))]
pub use no_mpi::join;
#[cfg(not(feature = "gpu"))]
use none::eyes as gpu_eyes;
#[cfg(not(feature = "gpu"))]
pub use none::{Gpu, bench, devices, on_gpu, open};

use crate::exit::{Exit, Failure};
use crate::progress::Show;
use anyhow::anyhow;
use refraxel_train::backend::Backend;
use refraxel_train::cpu::{Lead, SharedBackend};
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
    Crew(Crew, Box<Options>),
}

/// The processes that train together, as the first of them sees them.
#[derive(Clone)]
pub struct Crew {
    /// Its hold on the others.
    pub lead: Arc<Lead>,
    /// How many there are, with the first.
    pub count: usize,
}

/// How a process takes part in a training.
pub enum Joined {
    /// There is no other.
    Alone,
    /// It is the first of several.
    Leads(Crew),
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
    crew: Option<&Crew>,
    needs: Needs,
    show: Show,
) -> Result<Decided, Failure> {
    if let Some(crew) = crew {
        let options = needs.saved.map_or(needs.options, |run| &run.options);
        let device = Device { name: format!("cpu of {} processes", crew.count), why: None };
        let threads = rayon::current_num_threads();
        show.say(&format!(
            "note: on the {}; this one, the first, is {}, and has {threads} threads",
            device.name,
            process::id()
        ));
        return Ok(Decided { opened: Opened::Crew(crew.clone(), Box::new(options.clone())), device });
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

/// Work that is done on a backend, whatever that is.
pub trait Work {
    /// What comes of it.
    type Out;
    /// Does the work; `make` gives a backend with a model, and with the state of an optimiser that goes on.
    fn on<B: Backend>(
        self,
        make: impl Fn(Model, Option<Optimiser>) -> Result<B, BackendError>,
    ) -> Result<Self::Out, Failure>;
}

/// Does work on the device that was opened.
pub fn work_on<W: Work>(opened: Opened, work: W) -> Result<W::Out, Failure> {
    match opened {
        Opened::Cpu => work.on(|model, state| {
            Ok(match state {
                Some(state) => CpuBackend::resumed(model, state),
                None => CpuBackend::new(model),
            })
        }),
        Opened::Gpu(gpu) => on_gpu(gpu, work),
        Opened::Crew(crew, options) => {
            work.on(|model, state| Ok(SharedBackend::new(&crew.lead, model, state, Options::clone(&options))))
        }
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
