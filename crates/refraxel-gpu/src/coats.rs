//! The clearcoat of opaque things on a device: `Coat` of `coats.wgsl`.

use crate::constants::COATED;
use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use crate::task::Task;
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

/// Make room for what the straight rays of a task end at, where there is a clearcoat.
pub(crate) fn fit(device: &Device, b: &mut Buffers, task: &Task) -> Result<(), GpuError> {
    let rays = if task.wants & COATED == 0 { 1 } else { u64::from(task.rays) };
    let bytes = rays * size_of::<Coat>() as u64;
    let fits = b.get("coats").is_some_and(|coats| coats.size() >= bytes);
    if fits { Ok(()) } else { b.zeros(device, "coats", bytes) }
}
