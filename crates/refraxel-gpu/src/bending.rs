//! What kernels are told of rays that may bend, where their paths are kept, and the dispatches that follow them.

use crate::bodies;
use crate::caches;
use crate::constants::{STATUS_CUT, STATUS_LONGEST, STATUS_OVER, STATUS_REFLECTIONS, STATUS_WORDS};
use crate::device::Device;
use crate::error::GpuError;
use crate::kernels::Kernel;
use crate::memory::Buffers;
use bytemuck::{Pod, Zeroable};
use refraxel_train::backend::{Marching, Objective};
use refraxel_train::model::{MAX_SEGMENTS, Model};

/// Bytes of a `Checkpoint` of `checkpoint.wgsl`, of a `WayBack` of `learn_bent.wgsl`, and of a `Step` of `trace_vjp.wgsl`.
const CHECKPOINT_BYTES: usize = 112;
const WAY_BYTES: usize = 80;
const STEP_BYTES: usize = 112;
/// Bytes of checkpoints that are kept at a time. Longer batches learn in portions.
const KEPT: u64 = 64 << 20;
/// Dispatches that follow paths before the device is asked whether all are over.
const MOST_DISPATCHES: usize = 64;

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
    replay: u32,
    most_segments: u32,
    is_smooth: u32,
    strengths_from: u32,
    least_weight: f32,
    coat_index: f32,
}

impl Bending {
    /// Rays that are shown, and keep nothing but where they stand.
    pub(crate) fn shown(device: &Device, model: &Model, marching: &Marching, rays: usize) -> Self {
        let regions = model.refraction.medium.regions();
        Self {
            rays: rays as u32,
            taps: 4,
            regions: regions.len() as u32,
            replay: device.replay as u32,
            most_segments: MAX_SEGMENTS as u32,
            is_smooth: regions.iter().any(|r| r.level_set().is_none()).into(),
            strengths_from: caches::coefficients(model) as u32,
            least_weight: marching.min_optical_depth,
            coat_index: model.clearcoat.as_ref().map_or(1.0, |c| c.ior),
            ..Self::default()
        }
    }

    /// The same for paths of at most so many segments.
    pub(crate) fn up_to(self, segments: usize) -> Self {
        Self { most_segments: segments as u32, ..self }
    }

    /// What is learned from paths, so many of which are kept at a time. Adjoints count whole unless they are `clipped`.
    pub(crate) fn learning(
        device: &Device,
        objective: &Objective,
        model: &Model,
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
            absorption_from: bodies::coefficients(&model.refraction) as u32,
            ..Self::shown(device, model, &objective.marching, 0)
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
    /// Make room for the paths of so many rays, or for as many of them as are kept at a time: one checkpoint before every block of
    /// segments, and one for where they stand.
    pub(crate) fn fit(&mut self, device: &Device, rays: usize) -> Result<(), GpuError> {
        let replay = device.replay;
        let bytes = ((MAX_SEGMENTS.div_ceil(replay) + 1) * CHECKPOINT_BYTES) as u64;
        let most = (KEPT.min(device.binding_limit) / bytes) as usize;
        let keeps = rays.clamp(1, most.max(1));
        if keeps > self.keeps {
            self.buffers.zeros(device, "checkpoints", keeps as u64 * bytes)?;
            self.buffers.zeros(device, "ways", (keeps * WAY_BYTES) as u64)?;
            self.buffers.zeros(device, "steps", (keeps * replay * STEP_BYTES) as u64)?;
            self.keeps = keeps;
        }
        Ok(())
    }

    /// Room for where the paths of so many rays stand.
    pub(crate) fn standing(device: &Device, rays: usize) -> Result<Self, GpuError> {
        let mut buffers = Buffers::default();
        buffers.zeros(device, "checkpoints", (rays * CHECKPOINT_BYTES) as u64)?;
        Ok(Self { buffers, keeps: 0 })
    }
}

/// What is known of paths at their ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Followed {
    /// Dispatches that the longest needed.
    pub dispatches: usize,
    /// Records of reflections by now.
    pub reflections: usize,
}

/// Follow the paths of a portion of rays to their ends, as many segments per dispatch as the device takes. How many dispatches are
/// needed nobody knows before: first half as many again are sent as were needed `before`, then growing numbers, and the device is asked in
/// between.
pub(crate) fn follow(
    device: &Device,
    kernel: &Kernel,
    of: &[&Buffers],
    portion: &Bending,
    before: usize,
) -> Result<Followed, GpuError> {
    let find = |name| of.iter().find(|buffers| buffers.get(name).is_some());
    let (Some(paths), Some(model)) = (find("checkpoints"), find("status")) else {
        unreachable!("paths have a place where they stand, and the device one to tell of them")
    };
    model.write(device, "bending", &[*portion]);
    model.write_at(device, "status", 4 * u64::from(STATUS_OVER), &[0_u32; 2]);
    let mut encoder = device.encoder();
    paths.clear(&mut encoder, "checkpoints", (portion.rays as usize * CHECKPOINT_BYTES) as u64);
    let mut dispatches = (before + before / 2).clamp(1, MOST_DISPATCHES);
    loop {
        kernel.run_often(device, &mut encoder, of, portion.rays as usize, dispatches);
        device.submit(encoder);
        let status: Vec<u32> = model.read(device, "status", STATUS_WORDS as usize)?;
        if status[STATUS_CUT as usize] != 0 {
            return Err(device.cut_short());
        }
        if status[STATUS_OVER as usize] >= portion.rays {
            let longest = status[STATUS_LONGEST as usize] as usize;
            return Ok(Followed {
                dispatches: longest.div_ceil(device.replay),
                reflections: status[STATUS_REFLECTIONS as usize] as usize,
            });
        }
        encoder = device.encoder();
        dispatches = (2 * dispatches).min(MOST_DISPATCHES);
    }
}

/// Follow them back, given what [`follow`] has returned.
pub(crate) fn follow_back(
    device: &Device,
    kernel: &Kernel,
    of: &[&Buffers],
    portion: &Bending,
    blocks: usize,
) {
    let mut encoder = device.encoder();
    if let Some(paths) = of.iter().find(|buffers| buffers.get("ways").is_some()) {
        paths.clear(&mut encoder, "ways", u64::from(portion.rays) * WAY_BYTES as u64);
    }
    kernel.run_often(device, &mut encoder, of, portion.rays as usize, blocks.max(1));
    device.submit(encoder);
}
