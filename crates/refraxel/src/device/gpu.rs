//! GPUs: a backend on one, and the list of them.

use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::table::bytes;
use refraxel_gpu::{Adapter, AdapterKind, GpuBackend, adapters};
use refraxel_train::backend::Backend;
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::session::BackendError;
use serde::Serialize;
use std::borrow::Cow;

/// A GPU that was opened.
pub use refraxel_gpu::Gpu;

/// A backend with a model on a GPU, and with the state of an optimiser that goes on.
pub fn gpu_backend(
    gpu: &Gpu,
    model: &Model,
    state: Option<&Optimiser>,
) -> Result<Box<dyn Backend>, BackendError> {
    let state = state.map_or_else(|| Cow::Owned(Optimiser::new(model)), Cow::Borrowed);
    Ok(Box::new(GpuBackend::resumed(gpu.clone(), model, &state)?))
}

/// "NVIDIA GeForce RTX 4090 (vulkan)".
pub(super) fn name(adapter: &Adapter) -> String {
    format!("{} ({})", adapter.name, adapter.api)
}

#[derive(Serialize)]
struct Devices {
    kind: &'static str,
    /// What `--device auto` is for a run that a GPU can do.
    auto: String,
    adapters: Vec<Adapter>,
}

/// `refraxel inspect --devices`: lists all adapters.
pub fn devices(json: bool) -> Result<(), Failure> {
    let adapters = adapters();
    let hardware = adapters.iter().find(|a| a.kind != AdapterKind::Software);
    let auto = hardware.map_or_else(|| "cpu".to_owned(), |a| format!("gpu:{}", a.number));
    let found = Devices { kind: "devices", auto, adapters };
    Console::new(json).result(&found.text(), &found).or_exit(Exit::Io)
}

impl Devices {
    fn text(&self) -> String {
        if self.adapters.is_empty() {
            return "no GPU was found, nor a Vulkan driver that has one: training uses the CPU".to_owned();
        }
        let mut lines: Vec<String> = self.adapters.iter().map(described).collect();
        lines.push(match self.auto.as_str() {
            "cpu" => "--device auto is the CPU: software adapters are taken by number only".to_owned(),
            gpu => format!("--device auto is {gpu}, but for runs that trace other than by leapfrog"),
        });
        lines.join("\n")
    }
}

/// One adapter.
fn described(a: &Adapter) -> String {
    let kind = match a.kind {
        AdapterKind::Discrete => "a card of its own",
        AdapterKind::Integrated => "part of the processor",
        AdapterKind::Virtual => "a share of a card",
        AdapterKind::Software => "software, slower than --device cpu",
        AdapterKind::Other => "of a kind that the driver does not name",
    };
    let known = [(a.half, "f16"), (a.atomics_64, "64-bit atomics"), (a.atomics_f32, "f32 atomics")];
    let features: Vec<&str> = known.iter().filter(|(has, _)| *has).map(|(_, what)| *what).collect();
    let features = if features.is_empty() { "none of those known".to_owned() } else { features.join(", ") };
    format!(
        "gpu:{}      {}: {kind}\n  driver   {} ({})\n  memory   {}\n  limits   {} in an array that a kernel binds, {} of them, {} in a buffer\n  \
         features {features}",
        a.number,
        a.name,
        a.driver,
        a.api,
        a.memory.map_or_else(|| "unknown".to_owned(), bytes),
        bytes(a.max_binding),
        a.max_bindings,
        bytes(a.max_buffer),
    )
}

/// A model that a GPU shows.
pub mod viewer {
    use super::Gpu;
    use refraxel_core::Ray;
    use refraxel_core::radiance::Pixel;
    use refraxel_gpu::GpuRenderer;
    use refraxel_train::Refraction;
    use refraxel_train::backend::{Layers, Marching};
    use refraxel_train::model::Model;

    /// A model in the memory of a GPU. What is wrong is said in words.
    pub struct ModelViewer(GpuRenderer);

    impl ModelViewer {
        /// A model as it is seen by this marching.
        pub fn new(gpu: Gpu, model: &Model, marching: &Marching) -> Result<Self, String> {
            GpuRenderer::new(gpu, model, marching).map(Self).map_err(|e| e.to_string())
        }

        /// Bends the rays otherwise.
        pub fn set_medium(&mut self, medium: &Refraction) -> Result<(), String> {
            self.0.set_medium(medium.clone()).map_err(|e| e.to_string())
        }

        /// What rays show, over the background.
        pub fn render(&self, rays: &[Ray<f32>], layers: Layers) -> Result<Vec<Pixel<f32>>, String> {
            self.0.render(rays, layers).map_err(|e| e.to_string())
        }
    }
}
