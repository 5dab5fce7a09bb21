//! What surfaces mirror, as kernels read it and find it: `Cache` of `probes.wgsl` and `Reflection` of `reflections.wgsl`.

use crate::bodies::MAX_REGIONS;
use crate::constants::{MIRRORS, READS_CACHES, STATUS_REFLECTIONS, STATUS_WORDS};
use crate::memory::Buffers;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use refraxel_core::radiance::ProbeGrid;
use refraxel_train::backend::{Layers, MirrorGradient};
use refraxel_train::model::{Mirror, MirrorSource, Reflection as Mirrors};

/// Surfaces per ray for which there is room at first.
const AT_FIRST: usize = 4;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Cache {
    lowest: [f32; 3],
    first: u32,
    scale: [f32; 3],
    basis: u32,
    nodes: [u32; 3],
    strength: f32,
}

/// `Reflection` of `reflections.wgsl`. The host reads where a mirrored ray begins, and writes what it shows.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Reflection {
    pub position: [f32; 3],
    segment: u32,
    pub direction: [f32; 3],
    reflectance: f32,
    pub normal: [f32; 3],
    pub region: u32,
    geometry: [u32; 24],
    pub light: [f32; 3],
    reached: f32,
    adjoints: [[u32; 4]; 9],
}

/// Bytes of a `Passing` of `find_reflections.wgsl`.
const PASSING_BYTES: usize = 4 * 64 + 16;

/// The caches of a mirror, the outer one first: region r has those of numbers 2 r and 2 r + 1.
fn caches(mirror: &Mirror) -> [&ProbeGrid<f32>; 2] {
    [&mirror.outer, &mirror.inner]
}

/// Arrays with everything that kernels read and write of mirrors.
pub(crate) fn upload(gpu: &Gpu, b: &mut Buffers, reflection: &Mirrors) -> Result<(), GpuError> {
    let (mut all, mut probes) = (Vec::new(), Vec::<f32>::new());
    for mirror in &reflection.mirrors {
        for cache in caches(mirror) {
            let (nodes, extent) = (cache.resolution(), cache.bounds().extent());
            all.push(Cache {
                lowest: cache.bounds().min.to_array(),
                first: probes.len() as u32,
                scale: [0, 1, 2].map(|a| (nodes[a] - 1) as f32 / extent[a]),
                basis: cache.degree().basis() as u32,
                nodes,
                strength: mirror.strength,
            });
            probes.extend(&cache.coefficients);
        }
    }
    let needed = 8 * gradient_len(reflection) as u64;
    if needed > gpu.binding_limit() {
        let (what, adapter) = ("the gradient of radiance caches", gpu.adapter().name.clone());
        return Err(GpuError::TooLarge { what, adapter, needed, most: gpu.binding_limit() });
    }
    all.resize(2 * MAX_REGIONS, Cache::default());
    b.put(gpu, "caches", &all)?;
    b.put(gpu, "probes", &probes)
}

/// Coefficients of all caches.
pub(crate) fn coefficients(reflection: &Mirrors) -> usize {
    reflection.mirrors.iter().flat_map(caches).map(|c| c.coefficients.len()).sum()
}

/// Numbers of the gradient of mirrors: the coefficients of their caches, and the strength of each.
pub(crate) fn gradient_len(reflection: &Mirrors) -> usize {
    coefficients(reflection) + reflection.mirrors.len()
}

/// The gradient of mirrors as kernels sum it up.
pub(crate) fn gradient(reflection: &Mirrors, sums: &[f64]) -> Vec<MirrorGradient> {
    let (caches, strengths) = sums.split_at(coefficients(reflection));
    let mut rest = caches.iter();
    let of_mirror = |(mirror, strength): (&Mirror, &f64)| {
        let mut next = |n: usize| rest.by_ref().take(n).map(|d| *d as f32).collect();
        let outer = next(mirror.outer.coefficients.len());
        MirrorGradient { strength: *strength, outer, inner: next(mirror.inner.coefficients.len()) }
    };
    reflection.mirrors.iter().zip(strengths).map(of_mirror).collect()
}

/// Where the light comes from that surfaces mirror; `None` where none does.
pub(crate) fn source(reflection: &Mirrors, layers: Layers) -> Option<MirrorSource> {
    let source = match layers {
        Layers::All => reflection.source,
        Layers::Mirroring(source) => source,
        Layers::Transmitted => return None,
    };
    (!reflection.is_none()).then_some(source)
}

/// Bits of `Task::wants` for mirrors with light of this source.
pub(crate) fn wants(source: Option<MirrorSource>) -> u32 {
    let reads = source.is_some_and(MirrorSource::reads_caches);
    source.map_or(0, |_| MIRRORS) | if reads { READS_CACHES } else { 0 }
}

/// The reflections of the paths of a portion of rays: a head of the list of each, then those that were found.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub buffers: Buffers,
    /// How many there may be, the heads included.
    room: usize,
    /// Portions of up to so many rays have room.
    rays: usize,
}

impl Found {
    /// Room where nothing mirrors: kernels cannot bind nothing.
    pub(crate) fn nothing(gpu: &Gpu) -> Result<Self, GpuError> {
        let mut found = Self::default();
        found.fit(gpu, 1, 1)?;
        Ok(found)
    }

    fn fit(&mut self, gpu: &Gpu, rays: usize, room: usize) -> Result<(), GpuError> {
        if rays > self.rays {
            self.buffers.zeros(gpu, "passings", (rays * PASSING_BYTES) as u64)?;
            self.rays = rays;
        }
        if room > self.room {
            let needed = (room * size_of::<Reflection>()) as u64;
            let most = gpu.binding_limit();
            if needed > most {
                let (what, adapter) = ("the list of reflections", gpu.adapter().name.clone());
                return Err(GpuError::TooLarge { what, adapter, needed, most });
            }
            self.buffers.zeros(gpu, "reflections", needed)?;
            self.room = room;
        }
        Ok(())
    }

    /// Fill the list of the paths of so many rays by `find`, as often as it takes to have room for it; how long it is.
    pub(crate) fn fill(
        &mut self,
        gpu: &Gpu,
        model: &Buffers,
        rays: usize,
        find: impl Fn(&Buffers) -> Result<usize, GpuError>,
    ) -> Result<usize, GpuError> {
        let mut room = rays * (1 + AT_FIRST);
        loop {
            self.fit(gpu, rays, room)?;
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.buffers.clear(&mut encoder, "reflections", (rays * size_of::<Reflection>()) as u64);
            gpu.queue.submit([encoder.finish()]);
            model.write_at(gpu, "status", 4 * u64::from(STATUS_REFLECTIONS), &[rays as u32]);
            find(&self.buffers)?;
            let status: Vec<u32> = model.read(gpu, "status", STATUS_WORDS as usize)?;
            room = status[STATUS_REFLECTIONS as usize] as usize;
            if room <= self.room {
                return Ok(room);
            }
        }
    }

    /// Those that were found, behind the heads.
    pub(crate) fn read(&self, gpu: &Gpu, rays: usize, found: usize) -> Result<Vec<Reflection>, GpuError> {
        let mut all = self.buffers.read(gpu, "reflections", found)?;
        Ok(all.split_off(rays))
    }

    /// Write them again.
    pub(crate) fn write(&self, gpu: &Gpu, rays: usize, found: &[Reflection]) {
        self.buffers.write_at(gpu, "reflections", (rays * size_of::<Reflection>()) as u64, found);
    }
}
