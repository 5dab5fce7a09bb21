//! Named buffers.

use crate::device::Device;
use crate::error::GpuError;
use std::collections::HashMap;
use wgpu::BufferUsages;

/// Bytes that are handed to the driver at once: it keeps a copy of them until they have arrived.
const PORTION: usize = 32 << 20;

/// The buffers of a scene, or of a batch, by the names that kernels have for them.
#[derive(Debug, Default)]
pub(crate) struct Buffers(HashMap<String, wgpu::Buffer>);

impl Buffers {
    pub(crate) fn get(&self, name: &str) -> Option<&wgpu::Buffer> {
        self.0.get(name)
    }

    /// Add an array of zeros.
    pub(crate) fn zeros(&mut self, device: &Device, name: &str, bytes: u64) -> Result<(), GpuError> {
        let most = device.binding_limit;
        let uniform =
            matches!(name, "scene" | "task" | "bending" | "regions" | "lattices" | "caches" | "selection");
        if !uniform && bytes > most {
            return Err(device.too_large(&format!("the array `{name}`"), bytes, most));
        }
        let kind = if uniform { BufferUsages::UNIFORM } else { BufferUsages::STORAGE };
        let usage = kind | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        self.0.insert(name.to_owned(), device.buffer(name, bytes, usage)?);
        Ok(())
    }

    /// Add an array with these values.
    pub(crate) fn filled(
        &mut self,
        device: &Device,
        name: &str,
        values: &[impl bytemuck::NoUninit],
    ) -> Result<(), GpuError> {
        self.zeros(device, name, size_of_val(values) as u64)?;
        self.write(device, name, values);
        Ok(())
    }

    /// Set the first bytes of an array to 0, or what there is of it.
    pub(crate) fn clear(&self, encoder: &mut wgpu::CommandEncoder, name: &str, bytes: u64) {
        if let Some(buffer) = self.get(name) {
            encoder.clear_buffer(buffer, 0, Some(bytes.min(buffer.size())));
        }
    }

    /// Set an array to 0, if there is one.
    pub(crate) fn clear_all(&self, encoder: &mut wgpu::CommandEncoder, name: &str) {
        if let Some(buffer) = self.get(name) {
            encoder.clear_buffer(buffer, 0, None);
        }
    }

    /// Write an array of these values over the one of this name, or add it where that has another size.
    pub(crate) fn put(
        &mut self,
        device: &Device,
        name: &str,
        values: &[impl bytemuck::NoUninit],
    ) -> Result<(), GpuError> {
        match self.get(name) {
            Some(buffer) if buffer.size() == Device::padded(size_of_val(values) as u64) => {
                self.write(device, name, values);
                Ok(())
            }
            _ => self.filled(device, name, values),
        }
    }

    /// Write the first values of an array.
    ///
    /// # Panics
    /// If there is no such array.
    pub(crate) fn write(&self, device: &Device, name: &str, values: &[impl bytemuck::NoUninit]) {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        for (k, part) in bytes.chunks(PORTION).enumerate() {
            device.write(&self.0[name], (k * PORTION) as u64, part);
            if bytes.len() > PORTION {
                device.flush();
            }
        }
    }

    /// Write some values of an array, from this byte on.
    ///
    /// # Panics
    /// If there is no such array.
    pub(crate) fn write_at(
        &self,
        device: &Device,
        name: &str,
        offset: u64,
        values: &[impl bytemuck::NoUninit],
    ) {
        device.write(&self.0[name], offset, bytemuck::cast_slice(values));
    }

    /// Parts of arrays, each with its first byte and its size [byte], in one read-back. What is empty need not be there.
    pub(crate) fn read_parts<const N: usize>(
        &self,
        device: &Device,
        parts: [(&str, u64, usize); N],
    ) -> Result<[Vec<u8>; N], GpuError> {
        let wanted = |(name, offset, bytes): (&str, u64, usize)| {
            let buffer = self.get(name).filter(|_| bytes > 0)?;
            Some((buffer, offset, bytes as u64))
        };
        let read = device.read_parts(&parts.map(wanted).into_iter().flatten().collect::<Vec<_>>())?;
        let mut rest = read.into_iter();
        Ok(parts.map(|part| wanted(part).and_then(|_| rest.next()).unwrap_or_default()))
    }

    /// One word of an array.
    pub(crate) fn read_word(&self, device: &Device, name: &str, number: u32) -> Result<u32, GpuError> {
        let [bytes] = self.read_parts(device, [(name, 4 * u64::from(number), 4)])?;
        Ok(bytemuck::pod_read_unaligned(&bytes))
    }

    /// The first `n` values of an array.
    ///
    /// # Panics
    /// If there is no such array.
    pub(crate) fn read<T: bytemuck::Pod>(
        &self,
        device: &Device,
        name: &str,
        n: usize,
    ) -> Result<Vec<T>, GpuError> {
        let bytes = device.read(&self.0[name], (n * size_of::<T>()) as u64)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }
}
