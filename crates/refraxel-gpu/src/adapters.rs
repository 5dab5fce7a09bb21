//! Which adapters a machine has, and which one is meant.

use crate::error::GpuError;
use refraxel_train::device::DeviceChoice;
use serde::Serialize;

/// What an adapter is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AdapterKind {
    /// A card of its own.
    Discrete,
    /// Part of the processor, with its memory.
    Integrated,
    /// A share of a card of another machine.
    Virtual,
    /// Something that the driver does not name.
    Other,
    /// A program on the CPU, slower than the CPU backend.
    Software,
}

/// An adapter of this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Adapter {
    /// Its number for `gpu:N`.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// What it is made of.
    pub kind: AdapterKind,
    /// The interface: vulkan, metal, dx12.
    pub api: String,
    /// Driver and its version.
    pub driver: String,
    /// Its own memory [byte]; `None` where its interface does not tell. Part of a processor: a share of that of the machine.
    pub memory: Option<u64>,
    /// Largest array that a kernel can bind [byte].
    pub max_binding: u64,
    /// Largest buffer [byte].
    pub max_buffer: u64,
    /// Arrays that a kernel can bind.
    pub max_bindings: u32,
    /// Half precision in kernels.
    pub half: bool,
    /// Atomic additions of 64 bits.
    pub atomics_64: bool,
    /// Atomic additions of f32.
    pub atomics_f32: bool,
}

/// The adapters of this machine, best first; empty without a driver, or without the library that finds drivers.
pub fn adapters() -> Vec<Adapter> {
    enumerate().iter().enumerate().map(|(number, a)| describe(number, a)).collect()
}

/// All adapters in the order of their numbers.
pub(crate) fn enumerate() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12,
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    // Stable: equal ones stay in the order of the driver.
    found.sort_by_key(|a| kind(a.get_info().device_type));
    found
}

fn kind(of: wgpu::DeviceType) -> AdapterKind {
    match of {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
        wgpu::DeviceType::Other => AdapterKind::Other,
    }
}

pub(crate) fn describe(number: usize, adapter: &wgpu::Adapter) -> Adapter {
    let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
    Adapter {
        number,
        name: info.name,
        kind: kind(info.device_type),
        api: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        memory: crate::adapter_memory::memory(adapter),
        max_binding: limits.max_storage_buffer_binding_size,
        max_buffer: limits.max_buffer_size,
        max_bindings: limits.max_storage_buffers_per_shader_stage,
        half: features.contains(wgpu::Features::SHADER_F16),
        atomics_64: features.contains(wgpu::Features::SHADER_INT64_ATOMIC_ALL_OPS),
        atomics_f32: features.contains(wgpu::Features::SHADER_FLOAT32_ATOMIC),
    }
}

/// Which of the adapters is meant; `None` for the CPU.
pub(crate) fn choose(choice: DeviceChoice, found: &[Adapter]) -> Result<Option<usize>, GpuError> {
    let hardware = found.iter().position(|a| a.kind != AdapterKind::Software);
    match choice {
        DeviceChoice::Cpu | DeviceChoice::Mpi => Ok(None),
        DeviceChoice::Auto => Ok(hardware),
        DeviceChoice::Gpu => hardware.map(Some).ok_or_else(|| GpuError::NoAdapter { found: listed(found) }),
        DeviceChoice::Adapter(n) if n < found.len() => Ok(Some(n)),
        DeviceChoice::Adapter(n) => {
            Err(GpuError::NoAdapter { found: format!("there is no adapter {n}; {}", listed(found)) })
        }
    }
}

/// What was found, for a message.
fn listed(found: &[Adapter]) -> String {
    if found.is_empty() {
        return "no adapter was found".to_owned();
    }
    let name = |a: &Adapter| {
        let software = if a.kind == AdapterKind::Software { ", runs on the CPU" } else { "" };
        format!("gpu:{} is {} ({}{software})", a.number, a.name, a.api)
    };
    format!("found {}", found.iter().map(name).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(number: usize, kind: AdapterKind) -> Adapter {
        Adapter {
            number,
            name: format!("adapter {number}"),
            kind,
            api: "vulkan".to_owned(),
            driver: String::new(),
            memory: None,
            max_binding: 1 << 27,
            max_buffer: 1 << 30,
            max_bindings: 32,
            half: false,
            atomics_64: false,
            atomics_f32: false,
        }
    }

    #[test]
    fn software_adapters_are_used_only_by_number() {
        let found = [adapter(0, AdapterKind::Software)];
        assert_eq!(choose(DeviceChoice::Auto, &found), Ok(None));
        assert_eq!(choose(DeviceChoice::Adapter(0), &found), Ok(Some(0)));
        let error = choose(DeviceChoice::Gpu, &found).unwrap_err().to_string();
        assert!(error.contains("gpu:0 is adapter 0 (vulkan, runs on the CPU)"), "{error}");
        let error = choose(DeviceChoice::Adapter(1), &found).unwrap_err().to_string();
        assert!(error.contains("no adapter 1"), "{error}");
        let both = [adapter(0, AdapterKind::Integrated), adapter(1, AdapterKind::Software)];
        assert_eq!(choose(DeviceChoice::Auto, &both), Ok(Some(0)));
        assert_eq!(choose(DeviceChoice::Cpu, &both), Ok(None));
        assert!(choose(DeviceChoice::Gpu, &[]).unwrap_err().to_string().contains("no adapter was found"));
    }
}
