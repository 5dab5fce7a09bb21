//! Sums of gradients, read from a device.

use crate::bodies;
use crate::caches;
use crate::constants::{STATUS_LOSS, from_fixed};
use crate::error::GpuError;
use crate::field::{gradients, texel_values};
use crate::loaded::LoadedModel;
use refraxel_core::index::MediumGradient;
use refraxel_core::{AlignedVec, FieldGradient};

/// What the host moves a step by, and some words that were read with it.
pub(crate) struct HostSums {
    pub words: Vec<u32>,
    /// Of what bends rays.
    pub medium: MediumGradient<f32>,
    /// Of what regions absorb.
    pub absorption: Vec<[f64; 3]>,
    pub mirrored: caches::Gradient,
}

impl HostSums {
    /// The sums of the gradient of what the host moves, and so many words of the array `name` from the byte `offset`: all in one
    /// read-back.
    pub(crate) fn read(model: &LoadedModel, name: &str, offset: u64, words: usize) -> Result<Self, GpuError> {
        let refraction = &model.held.refraction;
        let index = if refraction.is_none() { 0 } else { bodies::gradient_len(refraction) };
        let mirrored = caches::gradient_len(&model.held);
        let parts = [
            (name, offset, 4 * words),
            ("index_gradient", 0, 8 * index),
            ("probe_gradient", 0, 8 * mirrored),
        ];
        let [words, index, mirrored] = model.buffers.read_parts(model.device(), parts)?;
        let sums = |bytes: &[u8]| -> Vec<f64> {
            let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(bytes);
            words.iter().map(|w| from_fixed(w[0], w[1])).collect()
        };
        let (medium, absorption) = bodies::gradient(refraction, &sums(&index));
        let mirrored = caches::Gradient::of(&model.held, &sums(&mirrored));
        Ok(Self { words: bytemuck::pod_collect_to_vec(&words), medium, absorption, mirrored })
    }
}

/// The sums of gradients of texels.
pub(crate) fn of_texels(model: &LoadedModel) -> Result<Vec<[f32; 3]>, GpuError> {
    let texels = numbers(model, "texel_gradient", texel_values(&model.held.background))?;
    Ok(texels.as_chunks::<3>().0.to_vec())
}

/// The sums of gradients of the field.
pub(crate) fn of_field(model: &LoadedModel) -> Result<FieldGradient<f32>, GpuError> {
    let (shape, field) = (&model.kernels.shape, &model.held.field);
    let (voxels, stride, lanes) = (field.map.voxels(), field.degree.stride(), shape.lanes());
    let density = AlignedVec::from_slice(&numbers(model, "density_gradient", voxels)?);
    let mut colour = AlignedVec::filled(voxels * stride, 0.0);
    for k in 0..shape.gradient.pools {
        let range = shape.gradient.range(k, voxels);
        let part = numbers(model, &format!("colour_gradient_{k}"), range.len() * lanes)?;
        for (voxel, d) in range.zip(part.chunks_exact(lanes)) {
            colour[voxel * stride..voxel * stride + lanes].copy_from_slice(d);
        }
    }
    Ok(FieldGradient { density, colour })
}

/// The first `n` fixed-point numbers of an array.
fn numbers(model: &LoadedModel, name: &str, n: usize) -> Result<Vec<f32>, GpuError> {
    let words: Vec<[u32; 2]> = model.buffers.read(model.device(), name, n)?;
    Ok(words.iter().map(|w| from_fixed(w[0], w[1]) as f32).collect())
}

/// Sums are 0 again; what failed before stays.
pub(crate) fn clear(model: &LoadedModel) {
    let mut encoder = model.device().encoder();
    for (name, _) in gradients(&model.kernels.shape, &model.held) {
        model.buffers.clear_all(&mut encoder, &name);
    }
    if let Some(status) = model.buffers.get("status") {
        encoder.clear_buffer(status, 4 * u64::from(STATUS_LOSS), None);
    }
    model.device().submit(encoder);
}
