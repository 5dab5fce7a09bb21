//! What surfaces mirror, as kernels read it and find it: `Cache` of `probes.wgsl` and `Reflection` of `reflections.wgsl`.

use crate::bending::Followed;
use crate::bodies::MAX_REGIONS;
use crate::constants::{COATED, MIRRORS, READS_CACHES, STATUS_REFLECTIONS};
use crate::memory::Buffers;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient};
use refraxel_train::backend::{Layers, MirrorGradient};
use refraxel_train::model::{Mirror, MirrorSource, Model};

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

/// The caches of a clearcoat: strength and radiance, behind those of all regions.
fn caches_of_coat(clearcoat: Option<&Clearcoat<f32>>) -> impl Iterator<Item = &ProbeGrid<f32>> {
    clearcoat.into_iter().flat_map(|c| [&c.strength, &c.radiance])
}

/// Describe a cache, and append its coefficients.
fn push(cache: &ProbeGrid<f32>, strength: f32, probes: &mut Vec<f32>) -> Cache {
    let (nodes, extent) = (cache.resolution(), cache.bounds().extent());
    let first = probes.len() as u32;
    probes.extend(&cache.coefficients);
    Cache {
        lowest: cache.bounds().min.to_array(),
        first,
        scale: [0, 1, 2].map(|a| (nodes[a] - 1) as f32 / extent[a]),
        basis: cache.degree().basis() as u32,
        nodes,
        strength,
    }
}

/// Arrays with everything that kernels read of what a model mirrors.
pub(crate) fn upload(gpu: &Gpu, b: &mut Buffers, model: &Model) -> Result<(), GpuError> {
    let (mut all, mut probes) = (Vec::new(), Vec::<f32>::new());
    for mirror in &model.reflection.mirrors {
        all.extend(caches(mirror).map(|cache| push(cache, mirror.strength, &mut probes)));
    }
    all.resize(2 * MAX_REGIONS, Cache::default());
    all.extend(caches_of_coat(model.clearcoat.as_ref()).map(|cache| push(cache, 1.0, &mut probes)));
    all.resize(2 * MAX_REGIONS + 2, Cache::default());
    let needed = 8 * gradient_len(model) as u64;
    if needed > gpu.binding_limit() {
        return Err(GpuError::too_large(gpu, "the gradient of radiance caches", needed, gpu.binding_limit()));
    }
    b.put(gpu, "caches", &all)?;
    b.put(gpu, "probes", &probes)
}

/// Coefficients of all caches.
pub(crate) fn coefficients(model: &Model) -> usize {
    let of_mirrors = model.reflection.mirrors.iter().flat_map(caches);
    of_mirrors.chain(caches_of_coat(model.clearcoat.as_ref())).map(|c| c.coefficients.len()).sum()
}

/// Numbers of the gradient of what a model mirrors: the coefficients of all caches, and the strength of each mirror.
pub(crate) fn gradient_len(model: &Model) -> usize {
    coefficients(model) + model.reflection.mirrors.len()
}

/// dLoss/d(what surfaces mirror).
#[derive(Debug, Default)]
pub(crate) struct Gradient {
    pub mirrors: Vec<MirrorGradient>,
    pub clearcoat: Option<ClearcoatGradient<f32>>,
}

impl Gradient {
    /// As kernels sum it up.
    pub(crate) fn of(model: &Model, sums: &[f64]) -> Self {
        let (caches, strengths) = sums.split_at(coefficients(model));
        let mut rest = caches.iter();
        let mut next = |like: &ProbeGrid<f32>| {
            rest.by_ref().take(like.coefficients.len()).map(|d| *d as f32).collect::<Vec<f32>>()
        };
        let of_mirror = |(mirror, strength): (&Mirror, &f64)| {
            let (outer, inner) = (next(&mirror.outer), next(&mirror.inner));
            MirrorGradient { strength: *strength, outer, inner }
        };
        let mirrors = model.reflection.mirrors.iter().zip(strengths).map(of_mirror).collect();
        let of_coat = |c: &Clearcoat<f32>| {
            let (strength, radiance) = (next(&c.strength), next(&c.radiance));
            ClearcoatGradient { strength, radiance }
        };
        Self { mirrors, clearcoat: model.clearcoat.as_ref().map(of_coat) }
    }
}

/// Where the light comes from that surfaces mirror; `None` where none does.
pub(crate) fn source(model: &Model, layers: Layers) -> Option<MirrorSource> {
    let source = match layers {
        Layers::All => model.reflection.source,
        Layers::Mirroring(source) => source,
        Layers::Transmitted => return None,
    };
    (!model.reflection.is_none() || model.clearcoat.is_some()).then_some(source)
}

/// Bits of `Task::wants` for surfaces that mirror light of this source.
pub(crate) fn wants(model: &Model, source: Option<MirrorSource>) -> u32 {
    let Some(source) = source else { return 0 };
    let bit = |wanted: bool, bit: u32| if wanted { bit } else { 0 };
    bit(!model.reflection.is_none(), MIRRORS)
        | bit(model.clearcoat.is_some(), COATED)
        | bit(source.reads_caches(), READS_CACHES)
}

/// The reflections of the paths of a portion of rays: a head of the list of each, then those that were found.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub buffers: Buffers,
    /// How many there may be, the heads included.
    room: usize,
    /// Portions of up to so many rays have room.
    rays: usize,
    /// Dispatches that took the last paths to their ends.
    pub dispatches: usize,
}

impl Found {
    /// Some room where nothing mirrors: kernels bind the list all the same.
    pub(crate) fn bind_nothing(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        self.fit(gpu, 1, 1)
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
                return Err(GpuError::too_large(gpu, "the list of reflections", needed, most));
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
        find: impl Fn(&Buffers) -> Result<Followed, GpuError>,
    ) -> Result<usize, GpuError> {
        let mut room = rays * (1 + AT_FIRST);
        loop {
            self.fit(gpu, rays, room)?;
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.buffers.clear(&mut encoder, "reflections", (rays * size_of::<Reflection>()) as u64);
            gpu.queue.submit([encoder.finish()]);
            model.write_at(gpu, "status", 4 * u64::from(STATUS_REFLECTIONS), &[rays as u32]);
            room = find(&self.buffers)?.reflections;
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
