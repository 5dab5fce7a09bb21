//! Caches of what surfaces and clearcoats mirror, as kernels read them and sum up their gradient: `Cache` of `probes.wgsl`.

use crate::bodies::MAX_REGIONS;
use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use bytemuck::{Pod, Zeroable};
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient};
use refraxel_train::backend::MirrorGradient;
use refraxel_train::model::{Mirror, Model};

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
pub(crate) fn upload(device: &Device, b: &mut Buffers, model: &Model) -> Result<(), GpuError> {
    let (mut all, mut probes) = (Vec::new(), Vec::<f32>::new());
    for mirror in &model.reflection.mirrors {
        all.extend(caches(mirror).map(|cache| push(cache, mirror.strength, &mut probes)));
    }
    all.resize(2 * MAX_REGIONS, Cache::default());
    all.extend(caches_of_coat(model.clearcoat.as_ref()).map(|cache| push(cache, 1.0, &mut probes)));
    all.resize(2 * MAX_REGIONS + 2, Cache::default());
    let needed = 8 * gradient_len(model) as u64;
    if needed > device.binding_limit {
        return Err(device.too_large("the gradient of radiance caches", needed, device.binding_limit));
    }
    b.put(device, "caches", &all)?;
    b.put(device, "probes", &probes)
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
