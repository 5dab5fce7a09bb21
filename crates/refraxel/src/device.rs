//! The device of a run: the CPU, or a GPU where the program was built with the feature `gpu`.

#[cfg(feature = "gpu")]
mod gpu;
#[cfg(not(feature = "gpu"))]
mod none;

#[cfg(feature = "gpu")]
pub use gpu::{Gpu, bench, devices, on_gpu, open};
#[cfg(not(feature = "gpu"))]
pub use none::{Gpu, bench, devices, on_gpu, open};

use crate::exit::{Exit, Failure};
use crate::progress::Show;
use refraxel_train::backend::Backend;
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
pub fn decide(choice: DeviceChoice, needs: Needs, show: Show) -> Result<Decided, Failure> {
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
    }
}

/// A device that cannot be used, or no longer.
fn unusable(error: impl Into<anyhow::Error>) -> Failure {
    Failure::new(Exit::Device, error)
}
