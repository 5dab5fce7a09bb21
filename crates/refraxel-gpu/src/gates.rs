//! Which straight rays may bend, as kernels read it: `Gate` of `gate.wgsl`.

use crate::constants::NONE;
use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use bytemuck::{Pod, Zeroable};
use refraxel_train::Refraction;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Gate {
    lowest: [f32; 3],
    shares: u32,
    highest: [f32; 3],
    clearances: u32,
    scale: [f32; 3],
    padding_0: u32,
    nodes: [u32; 3],
    padding_1: u32,
}

/// Arrays with the gates of all regions.
pub(crate) fn upload(device: &Device, b: &mut Buffers, refraction: &Refraction) -> Result<(), GpuError> {
    let (mut gates, mut bytes) = (Vec::new(), Vec::new());
    for (k, region) in refraction.medium.regions().iter().enumerate() {
        let gate = refraction.gate(k);
        let domain = gate.map_or(region.domain(), |gate| gate.domain());
        let mut of = Gate {
            lowest: domain.bounds.min.to_array(),
            shares: NONE,
            highest: domain.bounds.max.to_array(),
            scale: domain.nodes_per_unit().hadamard(domain.unit_per_world()).to_array(),
            nodes: domain.resolution,
            ..Gate::default()
        };
        if let Some(gate) = gate {
            of.shares = bytes.len() as u32;
            bytes.extend(gate.values());
            of.clearances = bytes.len() as u32;
            bytes.extend(gate.clearances());
        }
        gates.push(of);
    }
    // Kernels cannot bind less than one.
    gates.resize(gates.len().max(1), Gate::default());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    if bytes.len() as u64 > device.binding_limit {
        let (needed, most) = (bytes.len() as u64, device.binding_limit);
        return Err(device.too_large("which rays bend", needed, most));
    }
    b.put(device, "gates", &gates)?;
    b.put(device, "gate_bytes", &bytes)
}
