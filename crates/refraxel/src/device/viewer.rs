//! What shows a model that does not learn: a GPU where one was opened, else the CPU.

#[cfg(feature = "gpu")]
use super::choice::open;
#[cfg(feature = "gpu")]
use super::gpu::viewer as gpu_eyes;
#[cfg(not(feature = "gpu"))]
use super::no_choice::open;
#[cfg(not(feature = "gpu"))]
use super::none::viewer as gpu_eyes;
use super::opened::Opened;
use super::refusals::unusable;
use crate::exit::Failure;
use crate::progress::Show;
use anyhow::anyhow;
use refraxel_core::Ray;
use refraxel_core::radiance::Pixel;
use refraxel_train::backend::{Backend, Layers, Marching};
use refraxel_train::device::{Device, DeviceChoice};
use refraxel_train::{CpuBackend, Refraction};
use std::sync::OnceLock;

/// Shows what a backend on the CPU holds, on a GPU where one was opened. Where that fails, the CPU goes on.
#[derive(Default)]
pub struct ModelViewer {
    /// What was opened; nothing where nobody asked for a GPU.
    opened: Option<Device>,
    /// And where it is said that it failed.
    gpu: Option<(gpu_eyes::ModelViewer, Show)>,
    /// Why the GPU is not used any more.
    failed: OnceLock<String>,
}

impl ModelViewer {
    /// Opens the device that is asked for, with what `cpu` holds, as it is seen by this marching. `auto` is the CPU where no GPU can
    /// show it.
    pub fn open(
        choice: DeviceChoice,
        cpu: &CpuBackend,
        marching: &Marching,
        show: Show,
    ) -> Result<Self, Failure> {
        let decided = open(choice, None)?;
        let on_cpu = |why: Option<String>| {
            why.iter().for_each(|why| show.say(&format!("note: on the CPU, since {why}")));
            Ok(Self { opened: Some(Device { why, ..Device::cpu() }), ..Self::default() })
        };
        let Device { name, why } = decided.device;
        let Opened::Gpu(gpu) = decided.opened else { return on_cpu(why) };
        match gpu_eyes::ModelViewer::new(gpu, &cpu.snapshot().model, marching) {
            Ok(gpu) => {
                show.say(&format!("note: on {name}"));
                Ok(Self { opened: Some(Device { name, why }), gpu: Some((gpu, show)), ..Self::default() })
            }
            Err(why) if choice == DeviceChoice::Auto => on_cpu(Some(format!("{name} cannot show it: {why}"))),
            Err(why) => Err(unusable(anyhow!(why))),
        }
    }

    /// The device that shows it, and why it is that one.
    pub fn device(&self) -> Device {
        match self.failed.get() {
            Some(why) => Device { why: Some(format!("the GPU failed: {why}")), ..Device::cpu() },
            None => self.opened.clone().unwrap_or_else(Device::cpu),
        }
    }

    /// Bends the rays otherwise.
    pub fn set_medium(&mut self, medium: &Refraction) {
        let bent = self.gpu.as_mut().map(|(gpu, _)| gpu.set_medium(medium));
        self.take(bent.unwrap_or(Ok(())));
    }

    /// What rays show, over the background, of what `cpu` holds.
    pub fn render(
        &self,
        cpu: &CpuBackend,
        rays: &[Ray<f32>],
        marching: &Marching,
        layers: Layers,
    ) -> Vec<Pixel<f32>> {
        let gpu = self.gpu.as_ref().filter(|_| self.failed.get().is_none());
        match gpu.map(|(gpu, _)| gpu.render(rays, layers)) {
            Some(Ok(pixels)) => return pixels,
            Some(Err(why)) => self.take(Err(why)),
            None => {}
        }
        cpu.render(rays, marching, layers)
    }

    /// Leaves a GPU that failed.
    fn take(&self, result: Result<(), String>) {
        let (Err(why), Some((_, show))) = (result, &self.gpu) else { return };
        let note = format!("note: on the CPU from here on, since the GPU failed: {why}");
        if self.failed.set(why).is_ok() {
            show.say(&note);
        }
    }
}
