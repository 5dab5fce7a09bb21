//! Reflections on the paths of rays, as kernels find them: `Reflection` of `reflections.wgsl`.

use crate::bending::Followed;
use crate::constants::{COATED, MIRRORS, READS_CACHES, STATUS_REFLECTIONS};
use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use bytemuck::{Pod, Zeroable};
use refraxel_train::backend::Layers;
use refraxel_train::model::{MirrorSource, Model};

/// Surfaces per ray for which there is room at first.
const AT_FIRST: usize = 4;

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
    pub(crate) fn bind_nothing(&mut self, device: &Device) -> Result<(), GpuError> {
        self.fit(device, 1, 1)
    }

    fn fit(&mut self, device: &Device, rays: usize, room: usize) -> Result<(), GpuError> {
        if rays > self.rays {
            self.buffers.zeros(device, "passings", (rays * PASSING_BYTES) as u64)?;
            self.rays = rays;
        }
        if room > self.room {
            self.buffers.zeros(device, "reflections", (room * size_of::<Reflection>()) as u64)?;
            self.room = room;
        }
        Ok(())
    }

    /// Fill the list of the paths of so many rays by `find`, as often as it takes to have room for it; how long it is.
    pub(crate) fn fill(
        &mut self,
        device: &Device,
        model: &Buffers,
        rays: usize,
        find: impl Fn(&Buffers) -> Result<Followed, GpuError>,
    ) -> Result<usize, GpuError> {
        let mut room = rays * (1 + AT_FIRST);
        loop {
            self.fit(device, rays, room)?;
            let mut encoder = device.encoder();
            self.buffers.clear(&mut encoder, "reflections", (rays * size_of::<Reflection>()) as u64);
            device.submit(encoder);
            model.write_at(device, "status", 4 * u64::from(STATUS_REFLECTIONS), &[rays as u32]);
            room = find(&self.buffers)?.reflections;
            if room <= self.room {
                return Ok(room);
            }
        }
    }

    /// Those that were found, behind the heads.
    pub(crate) fn read(
        &self,
        device: &Device,
        rays: usize,
        found: usize,
    ) -> Result<Vec<Reflection>, GpuError> {
        let mut all = self.buffers.read(device, "reflections", found)?;
        Ok(all.split_off(rays))
    }

    /// Write them again.
    pub(crate) fn write(&self, device: &Device, rays: usize, found: &[Reflection]) {
        self.buffers.write_at(device, "reflections", (rays * size_of::<Reflection>()) as u64, found);
    }
}
