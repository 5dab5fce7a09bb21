//! The clearcoat of opaque things on a device: `Coat` of `coats.wgsl`.

use crate::memory::Buffers;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};

/// What a straight ray ends at. The host reads where a mirrored ray begins, and writes what it shows.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Coat {
    pub position: [f32; 3],
    opacity: f32,
    slope: [f32; 3],
    share: f32,
    pub direction: [f32; 3],
    pub is_there: u32,
    pub normal: [f32; 3],
    strength: f32,
    pub light: [f32; 3],
    padding: u32,
    adjoints: [[u32; 4]; 4],
}

/// Add room for what so many straight rays end at.
pub(crate) fn fit(gpu: &Gpu, b: &mut Buffers, rays: usize) -> Result<(), GpuError> {
    b.zeros(gpu, "coats", (rays.max(1) * size_of::<Coat>()) as u64)
}
