//! What kernels are told of rays that may bend, and where the paths of those that learn are kept.

use crate::memory::Buffers;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use refraxel_train::Refraction;
use refraxel_train::backend::Objective;
use refraxel_train::model::MAX_SEGMENTS;

/// Segments that are computed again from one checkpoint, and kept meanwhile. More of them need more of the second, less of the
/// first: at 32 a ray takes 8.6 KiB.
pub(crate) const REPLAY: usize = 32;
/// Checkpoints of a path: one before every [`REPLAY`]-th segment, and one at its end.
const CHECKPOINTS: usize = MAX_SEGMENTS / REPLAY + 1;
/// Bytes of a `Checkpoint` of `path.wgsl`, and of a `Step` of `trace_vjp.wgsl`.
const CHECKPOINT_BYTES: usize = 80;
const STEP_BYTES: usize = 112;
/// Bytes of checkpoints that are kept at a time. Longer batches learn in portions.
const KEPT: u64 = 64 << 20;

/// `Bending` of `bending.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Bending {
    pub first: u32,
    pub rays: u32,
    keeps: u32,
    surface_events: u32,
    index_events: u32,
    weight: f32,
    clip: f32,
    absorption_from: u32,
    taps: u32,
    regions: u32,
    silhouette: f32,
    padding: u32,
}

impl Bending {
    /// Rays that are shown, and keep nothing.
    pub(crate) fn shown(refraction: &Refraction, rays: usize) -> Self {
        let regions = refraction.medium.regions().len() as u32;
        Self { rays: rays as u32, taps: 4, regions, ..Self::default() }
    }

    /// What is learned from paths, so many of which are kept at a time. Adjoints count whole unless they are `clipped`.
    pub(crate) fn learning(
        objective: &Objective,
        refraction: &Refraction,
        keeps: usize,
        clipped: bool,
    ) -> Self {
        let index = objective.index.as_ref();
        Self {
            keeps: keeps as u32,
            surface_events: index.map_or(u32::MAX, |o| o.surface_events),
            index_events: index.map_or(u32::MAX, |o| o.index_events),
            weight: objective.bent_weight,
            silhouette: index.map_or(0.0, |o| o.silhouette),
            clip: index.filter(|_| clipped).map_or(f32::MAX, |o| o.clip.min(f32::MAX)),
            absorption_from: crate::bodies::coefficients(refraction) as u32,
            ..Self::shown(refraction, 0)
        }
    }

    /// The same for each portion of so many rays.
    pub(crate) fn portions(self, rays: usize) -> impl Iterator<Item = Self> {
        let keeps = self.keeps.max(1) as usize;
        (0..rays).step_by(keeps).map(move |first| Self {
            first: first as u32,
            rays: keeps.min(rays - first) as u32,
            ..self
        })
    }
}

/// Where paths are kept.
#[derive(Debug, Default)]
pub(crate) struct Paths {
    pub buffers: Buffers,
    /// How many at a time.
    pub keeps: usize,
}

impl Paths {
    /// Make room for the paths of so many rays, or for as many of them as are kept at a time.
    pub(crate) fn fit(&mut self, gpu: &Gpu, rays: usize) -> Result<(), GpuError> {
        let bytes = (CHECKPOINTS * CHECKPOINT_BYTES) as u64;
        let most = (KEPT.min(gpu.binding_limit()) / bytes) as usize;
        let keeps = rays.clamp(1, most.max(1));
        if keeps > self.keeps {
            self.buffers.zeros(gpu, "checkpoints", keeps as u64 * bytes)?;
            self.buffers.zeros(gpu, "steps", (keeps * REPLAY * STEP_BYTES) as u64)?;
            self.keeps = keeps;
        }
        Ok(())
    }

    /// Room that kernels bind and do not use.
    pub(crate) fn none(gpu: &Gpu) -> Result<Self, GpuError> {
        let mut buffers = Buffers::default();
        buffers.zeros(gpu, "checkpoints", CHECKPOINT_BYTES as u64)?;
        Ok(Self { buffers, keeps: 0 })
    }
}
