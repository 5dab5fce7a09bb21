//! Photographs in the memory of a device: 8 bits per channel where they have them, from which batches are drawn.

use crate::constants::{NONE, words};
use crate::device::Device;
use crate::error::GpuError;
use crate::kernels::Kernel;
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape, Split};
use crate::sources::DRAW;
use bytemuck::{Pod, Zeroable};
use refraxel_core::{ShDegree, Vec3};
use refraxel_data::{Pixels, is_white};
use refraxel_train::rays::{Directions, Draw, Edition, Picture, RaySampler, Selection as Selects};
use std::sync::Arc;

/// Arrays of the kernel that draws, without the pools of photographs.
const OTHER_BINDINGS: u32 = 6;
/// Photographs take at most this share of the memory of an adapter that says how much it has: fields grow.
const SHARE: u64 = 2;

/// Why a batch is not drawn on a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum HostReason {
    #[error("photographs, masks and directions need {needed} byte there, and {most} are to be had")]
    TooLarge { needed: u64, most: u64 },
    #[error("its memory is exhausted")]
    Exhausted,
    #[error("lenses are inverted ray by ray: they learn, or there are too many")]
    Lenses,
    #[error("rays near borders of masks are drawn on the host")]
    NearBorders,
}

/// `Selection` of `photograph.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Selection {
    stream: [u32; 2],
    beginnings: [u32; 2],
    from_inside: u32,
    inside: u32,
    pixels: u32,
    views: u32,
    rows: u32,
    margin: u32,
    regions: u32,
    transparent: u32,
    reach: u32,
    turned: u32,
}

/// `View` of `photograph.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct View {
    right: [f32; 3],
    first: u32,
    down: [f32; 3],
    width: u32,
    forward: [f32; 3],
    height: u32,
    origin: [f32; 3],
    pixels: u32,
    focal: [f32; 2],
    center: [f32; 2],
    thickness: [f32; 3],
    is_aside: u32,
    channels: u32,
    is_real: u32,
    directions: u32,
    usable: u32,
    mask: u32,
    first_row: u32,
    padding: [u32; 2],
}

impl View {
    /// The same with what may change from step to step: its camera, its exposure, and whether it is kept aside.
    fn now(self, picture: &Picture<'_>, is_aside: bool) -> Result<Self, HostReason> {
        let camera = picture.camera;
        let axis = |k: usize| camera.world_from_camera.rotation.columns[k].cast::<f32>().to_array();
        let directions = match picture.directions() {
            Directions::Pinhole => NONE,
            Directions::Table(_) => self.directions,
            Directions::Inverted => return Err(HostReason::Lenses),
        };
        Ok(Self {
            right: axis(0),
            down: axis(1),
            forward: axis(2),
            origin: camera.world_from_camera.translation.cast::<f32>().to_array(),
            focal: camera.focal.map(|f| f as f32),
            center: camera.center.map(|c| c as f32),
            thickness: picture.exposure().thickness(),
            is_aside: is_aside.into(),
            directions,
            ..self
        })
    }
}

/// Planes of bits, and numbers of pixels, as kernels read them.
#[derive(Debug, Default)]
struct Marks {
    words: Vec<u32>,
    rows: u32,
    inside: u32,
}

impl Marks {
    /// Those of all photographs; notes in `views` where they lie.
    fn of(sampler: &RaySampler, views: &mut [View]) -> Self {
        let rows = sampler.pictures().filter_map(|p| Some(p.refractive()?.height)).sum::<u32>();
        let mut all = Self { words: vec![0; rows as usize], rows, inside: 0 };
        let mut row = 0;
        for (view, picture) in views.iter_mut().zip(sampler.pictures()) {
            (view.usable, view.mask, view.first_row) = (NONE, NONE, row);
            if picture.is_restricted() {
                view.usable = all.push(view, |pixel| picture.used(pixel));
            }
            let Some(mask) = picture.refractive() else { continue };
            view.mask = all.push(view, |pixel| is_white(mask.coverage[pixel]));
            let plane = view.mask as usize;
            for y in 0..view.height as usize {
                all.words[row as usize] = all.inside;
                let stride = view.width.div_ceil(32) as usize;
                let bits = &all.words[plane + y * stride..plane + (y + 1) * stride];
                all.inside += bits.iter().map(|w| w.count_ones()).sum::<u32>();
                row += 1;
            }
            all.push(view, |pixel| mask.coverage[pixel] == 0);
        }
        all
    }

    /// Append a bit per pixel, rows in whole words; where they begin.
    fn push(&mut self, view: &View, is_set: impl Fn(usize) -> bool) -> u32 {
        let (first, width) = (self.words.len() as u32, view.width as usize);
        for start in (0..view.height as usize).map(|y| y * width) {
            for word in (0..width).step_by(32) {
                let bits = word..width.min(word + 32);
                let bit = |(k, x): (usize, usize)| u32::from(is_set(start + x)) << k;
                self.words.push(bits.enumerate().map(bit).sum());
            }
        }
        first
    }
}

/// The words of a photograph: bytes without alpha where that says nothing, or numbers in f32.
fn words_of(picture: &Picture<'_>, channels: usize) -> Vec<u32> {
    let image = picture.image();
    let stored = image.channels as usize;
    match &image.pixels {
        Pixels::U8(bytes) => {
            let mut kept: Vec<u8> = bytes.chunks(stored).flat_map(|p| &p[..channels]).copied().collect();
            kept.resize(kept.len().next_multiple_of(4), 0);
            bytemuck::pod_collect_to_vec(&kept)
        }
        Pixels::F32(values) => {
            values.chunks(stored).flat_map(|p| &p[..channels]).map(|v| v.to_bits()).collect()
        }
    }
}

/// Where everything lies in the pools of photographs.
struct Layout {
    views: Vec<View>,
    /// Tables of directions, and their first words.
    tables: Vec<(Arc<Vec<Vec3<f32>>>, u64)>,
    pixels: u64,
    words: u64,
}

impl Layout {
    fn of(sampler: &RaySampler) -> Self {
        let mut layout = Self { views: Vec::new(), tables: Vec::new(), pixels: 0, words: 0 };
        for picture in sampler.pictures() {
            let (image, camera) = (picture.image(), picture.camera);
            let channels = if sampler.is_transparent() { image.channels } else { 3 };
            let is_real = matches!(image.pixels, Pixels::F32(_));
            let mut view = View {
                first: layout.pixels as u32,
                width: camera.width,
                height: camera.height,
                pixels: layout.words as u32,
                channels,
                is_real: is_real.into(),
                directions: NONE,
                ..View::default()
            };
            let numbers = image.len() as u64 * u64::from(channels);
            layout.pixels += image.len() as u64;
            layout.words += if is_real { numbers } else { numbers.div_ceil(4) };
            if let Directions::Table(table) = picture.directions() {
                view.directions = layout.place(table) as u32;
            }
            layout.views.push(view);
        }
        layout
    }

    /// The first word of a table, which views may share.
    fn place(&mut self, table: &Arc<Vec<Vec3<f32>>>) -> u64 {
        if let Some((_, first)) = self.tables.iter().find(|(known, _)| Arc::ptr_eq(known, table)) {
            return *first;
        }
        let first = self.words;
        self.tables.push((Arc::clone(table), first));
        self.words += 3 * table.len() as u64;
        first
    }

    /// How the words are cut into pools, if a device has room for them.
    fn split(&self, device: &Device) -> Result<Split, HostReason> {
        let split = Split::new(self.words as usize, 4, device.binding_limit);
        let adapter = &device.adapter;
        let pools = u64::from(adapter.max_bindings.saturating_sub(OTHER_BINDINGS));
        let most = (pools * device.binding_limit).min(adapter.memory.map_or(u64::MAX, |m| m / SHARE));
        let is_numbered = self.pixels < u64::from(NONE) && self.words < u64::from(NONE);
        if 4 * self.words > most || split.pools as u64 > pools || !is_numbered {
            return Err(HostReason::TooLarge { needed: 4 * self.words, most: most.min(4 * u64::from(NONE)) });
        }
        Ok(split)
    }
}

/// Photographs on a device, with what it takes to draw batches from them.
#[derive(Debug)]
pub(crate) struct Photographs {
    pub edition: Edition,
    pub kernel: Kernel,
    pub buffers: Buffers,
    /// Which masks the marks are made of.
    masks: Option<Edition>,
    marks: Marks,
    /// The views as they were written.
    views: Vec<View>,
    pixels: u32,
}

impl Photographs {
    /// Take them there.
    pub(crate) fn new(device: &Device, sampler: &RaySampler) -> Result<Self, HostReason> {
        if sampler.pictures().any(|p| matches!(p.directions(), Directions::Inverted)) {
            return Err(HostReason::Lenses);
        }
        let layout = Layout::of(sampler);
        let split = layout.split(device)?;
        let mut buffers = Buffers::default();
        for pool in 0..split.pools {
            let bytes = 4 * split.range(pool, layout.words as usize).len() as u64;
            buffers.zeros(device, &format!("photographs_{pool}"), bytes).map_err(exhausted)?;
        }
        buffers.zeros(device, "selection", size_of::<Selection>() as u64).map_err(exhausted)?;
        for (view, picture) in layout.views.iter().zip(sampler.pictures()) {
            put(device, &buffers, split, view.pixels, &words_of(&picture, view.channels as usize));
        }
        for (table, first) in &layout.tables {
            // Where the lens sees nothing: 0, which kernels can tell from a direction.
            let seen = |d: &Vec3<f32>| if d.is_finite() { d.to_array() } else { [0.0; 3] };
            let words: Vec<u32> = table.iter().flat_map(seen).map(f32::to_bits).collect();
            put(device, &buffers, split, *first as u32, &words);
        }
        // The degree of colours is nothing to photographs.
        let shape = Shape {
            photographs: split,
            ..Shape::within(Purpose::Learning, ShDegree::MAX, 1, device.binding_limit)
        };
        let (kernel, edition) = (Kernel::new(device, &DRAW, &shape), sampler.photographs_edition().clone());
        let (marks, pixels) = (Marks::default(), layout.pixels as u32);
        Ok(Self { edition, kernel, buffers, masks: None, marks, views: layout.views, pixels })
    }

    /// Bring up to date what has changed since the last batch.
    pub(crate) fn update(&mut self, device: &Device, sampler: &RaySampler) -> Result<(), HostReason> {
        let mut views = self.views.clone();
        let has_new_masks = self.masks.as_ref() != Some(sampler.masks_edition());
        if has_new_masks {
            let marks = Marks::of(sampler, &mut views);
            let (needed, most) = (4 * marks.words.len() as u64, device.binding_limit);
            if needed > most {
                return Err(HostReason::TooLarge { needed, most });
            }
            self.buffers.put(device, "marks", &marks.words).map_err(exhausted)?;
            (self.marks.rows, self.marks.inside) = (marks.rows, marks.inside);
            self.masks = Some(sampler.masks_edition().clone());
        }
        for (k, (view, picture)) in views.iter_mut().zip(sampler.pictures()).enumerate() {
            *view = view.now(&picture, sampler.is_aside(k))?;
        }
        if has_new_masks || views != self.views {
            self.buffers.put(device, "views", &views).map_err(exhausted)?;
            self.views = views;
        }
        Ok(())
    }

    /// Say which batch comes next, of rays that may bend in so many regions.
    pub(crate) fn select(&self, device: &Device, draw: &Draw<'_>, regions: usize) {
        let margin = match draw.selection {
            Selects::Outside(margin) => margin.min(NONE - 1),
            _ => NONE,
        };
        let (beginnings, turned) = draw.turns();
        let selection = Selection {
            stream: words(draw.stream()),
            beginnings: words(beginnings),
            from_inside: draw.rays_inside() as u32,
            inside: self.marks.inside,
            pixels: self.pixels,
            views: self.views.len() as u32,
            rows: self.marks.rows,
            margin,
            regions: regions as u32,
            transparent: draw.sampler.is_transparent().into(),
            reach: draw.reach,
            turned,
        };
        self.buffers.write(device, "selection", &[selection]);
    }

    /// Whether some photograph has another exposure than all have in common.
    pub(crate) fn are_exposed(&self) -> bool {
        self.views.iter().any(|v| v.thickness != [0.0; 3])
    }
}

/// Write words across pools.
fn put(device: &Device, buffers: &Buffers, split: Split, first: u32, words: &[u32]) {
    let (mut at, mut rest) = (first as usize, words);
    while !rest.is_empty() {
        let (pool, within) = (at / split.voxels, at % split.voxels);
        let (part, others) = rest.split_at(rest.len().min(split.voxels - within));
        buffers.write_at(device, &format!("photographs_{pool}"), 4 * within as u64, part);
        device.flush(); // the driver keeps a copy until then
        (at, rest) = (at + part.len(), others);
    }
}

fn exhausted(_: GpuError) -> HostReason {
    HostReason::Exhausted
}
