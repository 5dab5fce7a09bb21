//! How much memory an adapter has, which wgpu does not tell: Vulkan is asked.

/// Memory of the device itself [byte]; `None` where its interface was not asked.
#[cfg(not(any(target_vendor = "apple", target_arch = "wasm32")))]
#[allow(unsafe_code)] // the only door to what lies below wgpu
pub(crate) fn memory(adapter: &wgpu::Adapter) -> Option<u64> {
    /// `VK_MEMORY_HEAP_DEVICE_LOCAL_BIT`.
    const DEVICE_LOCAL: u32 = 1;
    // SAFETY: the handle lives no longer than the adapter, and nothing is destroyed through it.
    let vulkan = unsafe { adapter.as_hal::<wgpu::hal::api::Vulkan>() }?;
    let instance = vulkan.shared_instance().raw_instance();
    // SAFETY: the physical device is one of this instance, which `vulkan` keeps alive.
    let found = unsafe { instance.get_physical_device_memory_properties(vulkan.raw_physical_device()) };
    let heaps = &found.memory_heaps[..(found.memory_heap_count as usize).min(found.memory_heaps.len())];
    let local = heaps.iter().filter(|h| h.flags.as_raw() & DEVICE_LOCAL != 0).map(|h| h.size);
    local.max()
}

/// Memory of the device itself [byte]: the interface is not asked.
#[cfg(any(target_vendor = "apple", target_arch = "wasm32"))]
pub(crate) fn memory(_: &wgpu::Adapter) -> Option<u64> {
    None
}
