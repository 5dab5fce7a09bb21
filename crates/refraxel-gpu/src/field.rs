//! A model and its optimiser's state in the memory of a device, and back.

use crate::bending::Bending;
use crate::bodies;
use crate::caches;
use crate::constants::{OUTCOME_WORDS, STATUS_WORDS};
use crate::device::Device;
use crate::error::GpuError;
use crate::gates;
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape};
use bytemuck::{Pod, Zeroable};
use half::f16;
use refraxel_core::{AlignedVec, Background, EnvironmentMap, Vec3, VoxelField};
use refraxel_train::model::{ClearcoatMoments, IndexMoments, MirrorMoments, Model, Optimiser, Refraction};
use refraxel_train::run::nearest_half;

/// Outcomes of steps that a device keeps until the host reads them.
pub(crate) const OUTCOMES: usize = 64;

/// `Scene` of `scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Scene {
    center: [f32; 3],
    reach: f32,
    unit_per_world: [f32; 3],
    density_scale: f32,
    nodes_per_unit: [f32; 3],
    voxel: f32,
    lowest: [f32; 3],
    extent: u32,
    highest: [f32; 3],
    slots: u32,
    last_cell: [u32; 3],
    rows: u32,
    brick_strides: [u32; 3],
    padding_0: u32,
    bricks: [u32; 3],
    padding_1: u32,
    plain: [f32; 3],
    padding_2: u32,
    right: [f32; 3],
    padding_3: u32,
    down: [f32; 3],
    padding_4: u32,
    ahead: [f32; 3],
    padding_5: u32,
}

impl Scene {
    fn of(model: &Model) -> Self {
        let (domain, map) = (&model.field.domain, &model.field.map);
        let placement = domain.placement();
        let [right, down, ahead] = placement.axes.map(Vec3::to_array);
        let (rows, plain) = match &model.background {
            Background::Constant(c) => (0, *c),
            Background::Environment(map) => (map.height() as u32, [0.0; 3]),
        };
        Self {
            center: placement.center.to_array(),
            reach: placement.reach,
            unit_per_world: placement.unit_per_world.to_array(),
            density_scale: model.field.density_scale(),
            nodes_per_unit: domain.nodes_per_unit().to_array(),
            voxel: domain.voxel(),
            lowest: placement.lowest.to_array(),
            extent: placement.extent,
            highest: placement.highest.to_array(),
            slots: map.slots() as u32,
            last_cell: domain.resolution.map(|n| n - 2),
            rows,
            brick_strides: map.brick_strides(),
            bricks: map.bricks_per_axis(),
            plain,
            right,
            down,
            ahead,
            ..Self::default()
        }
    }
}

/// The numbers of texels' values.
pub(crate) fn texel_values(background: &Background<f32>) -> usize {
    match background {
        Background::Constant(_) => 0,
        Background::Environment(map) => 3 * map.texels.len(),
    }
}

/// Arrays with everything that kernels read of a field to show it; one bit of `occupied` per cell of each slot.
pub(crate) fn upload_shown(
    device: &Device,
    shape: &Shape,
    model: &Model,
    occupied: &[u64],
) -> Result<Buffers, GpuError> {
    let (field, map) = (&model.field, &model.field.map);
    let (voxels, stride) = (map.voxels(), field.degree.stride());
    let mut b = Buffers::default();
    b.filled(device, "scene", &[Scene::of(model)])?;
    b.zeros(device, "task", size_of::<crate::task::Task>() as u64)?;
    b.zeros(device, "bending", size_of::<Bending>() as u64)?;
    b.filled(device, "table", &map.table_words().collect::<Vec<_>>())?;
    b.filled(device, "forward", map.forward_rows())?;
    b.filled(device, "occupied", occupied)?;
    b.filled(device, "density", &field.density[..])?;
    for k in 0..shape.colour.pools {
        let range = shape.colour.range(k, voxels);
        let (name, colour) = (format!("colour_{k}"), &field.colour[range.start * stride..range.end * stride]);
        match shape.purpose {
            Purpose::Learning => b.filled(device, &name, colour)?,
            Purpose::Showing => {
                let halves: Vec<f16> = colour.iter().map(|c| nearest_half(*c)).collect();
                b.filled(device, &name, &halves)?;
            }
        }
    }
    let texels = match &model.background {
        Background::Constant(_) => &[][..],
        Background::Environment(map) => &map.texels[..],
    };
    b.filled(device, "texels", texels)?;
    Ok(b)
}

/// Arrays with everything that kernels read and write of a model.
pub(crate) fn upload(
    device: &Device,
    shape: &Shape,
    model: &Model,
    optimiser: &Optimiser,
) -> Result<Buffers, GpuError> {
    let map = &model.field.map;
    let mut b = upload_shown(device, shape, model, &optimiser.occupied)?;
    let bricks: Vec<[u32; 3]> = (0..map.slots()).map(|s| map.brick_of(s as u32)).collect();
    b.filled(device, "brick_of_slot", &bricks)?;
    b.filled(device, "density_moment", &optimiser.density[..])?;
    b.filled(device, "colour_moment", &optimiser.colour[..])?;
    b.filled(device, "texel_moment", &optimiser.background)?;
    for (name, bytes) in gradients(shape, model) {
        b.zeros(device, &name, bytes)?;
    }
    b.zeros(device, "status", 4 * u64::from(STATUS_WORDS))?;
    b.zeros(device, "outcomes", 4 * (OUTCOME_WORDS * OUTCOMES) as u64)?;
    upload_medium(device, &mut b, &model.refraction)?;
    upload_mirrors(device, &mut b, model)?;
    device.flush();
    device.fault().map_or(Ok(b), Err)
}

/// Arrays with everything that kernels read and write of what bends rays.
pub(crate) fn upload_medium(
    device: &Device,
    b: &mut Buffers,
    refraction: &Refraction,
) -> Result<(), GpuError> {
    gates::upload(device, b, refraction)?;
    if refraction.is_none() {
        return Ok(());
    }
    b.zeros(device, "index_gradient", 8 * bodies::gradient_len(refraction) as u64)?;
    bodies::upload(device, b, refraction)
}

/// Arrays with everything that kernels read and write of what mirrors.
pub(crate) fn upload_mirrors(device: &Device, b: &mut Buffers, model: &Model) -> Result<(), GpuError> {
    b.zeros(device, "probe_gradient", 8 * caches::gradient_len(model) as u64)?;
    caches::upload(device, b, model)
}

/// Names and sizes of the arrays that are 0 between two steps.
pub(crate) fn gradients(shape: &Shape, model: &Model) -> Vec<(String, u64)> {
    let voxels = model.field.map.voxels();
    let mut all = vec![
        ("density_gradient".to_owned(), 8 * voxels as u64),
        ("texel_gradient".to_owned(), 8 * texel_values(&model.background) as u64),
        ("touched".to_owned(), 8 * model.field.map.slots() as u64),
    ];
    for k in 0..shape.gradient.pools {
        let of_pool = shape.gradient.range(k, voxels).len() as u64;
        all.push((format!("colour_gradient_{k}"), of_pool * shape.gradient_bytes()));
    }
    all
}

/// A model without the values that a device holds.
pub(crate) fn without_values(model: &Model) -> Model {
    let field = &model.field;
    Model {
        field: VoxelField {
            domain: field.domain,
            map: field.map.clone(),
            degree: field.degree,
            density: AlignedVec::from_slice(&[]),
            colour: AlignedVec::from_slice(&[]),
        },
        background: model.background.clone(),
        refraction: model.refraction.clone(),
        reflection: model.reflection.clone(),
        clearcoat: model.clearcoat.clone(),
    }
}

/// A model of this shape that has learned nothing.
pub(crate) fn blank(held: &Model) -> Model {
    let field = &held.field;
    let field = VoxelField::uniform(field.domain, field.map.clone(), field.degree, 0.0);
    Model { field, ..without_values(held) }
}

/// Moments of what the host moves.
#[derive(Clone, Debug, Default)]
pub(crate) struct HostMoments {
    pub index: Vec<IndexMoments>,
    pub reflection: Vec<MirrorMoments>,
    pub clearcoat: ClearcoatMoments,
}

impl HostMoments {
    pub(crate) fn of(optimiser: &Optimiser) -> Self {
        let Optimiser { index, reflection, clearcoat, .. } = optimiser;
        Self { index: index.clone(), reflection: reflection.clone(), clearcoat: clearcoat.clone() }
    }
}

/// The model and the optimiser's state, read from a device; `held` is the model without its values, `moments` what the host has of
/// the state.
pub(crate) fn download(
    device: &Device,
    shape: &Shape,
    buffers: &Buffers,
    held: &Model,
    moments: &HostMoments,
) -> Result<(Model, Optimiser), GpuError> {
    let (map, degree) = (held.field.map.clone(), held.field.degree);
    let (voxels, stride) = (map.voxels(), degree.stride());
    let aligned = |name: &str| -> Result<AlignedVec<f32>, GpuError> {
        Ok(AlignedVec::from_slice(&buffers.read::<f32>(device, name, voxels)?))
    };
    let mut colour = AlignedVec::filled(voxels * stride, 0.0);
    for k in 0..shape.colour.pools {
        let range = shape.colour.range(k, voxels);
        let part = buffers.read::<f32>(device, &format!("colour_{k}"), range.len() * stride)?;
        colour[range.start * stride..range.end * stride].copy_from_slice(&part);
    }
    let field = VoxelField { domain: held.field.domain, map, degree, density: aligned("density")?, colour };
    let texels = texel_values(&held.background) / 3;
    let background = match &held.background {
        Background::Constant(c) => Background::Constant(*c),
        Background::Environment(old) => {
            let texels = buffers.read::<[f32; 3]>(device, "texels", texels)?;
            let map = EnvironmentMap::from_texels(old.height(), texels);
            Background::Environment(map.unwrap_or_else(|| old.clone()))
        }
    };
    let model = Model { field, background, ..without_values(held) };
    let optimiser = Optimiser {
        density: aligned("density_moment")?,
        colour: aligned("colour_moment")?,
        background: buffers.read(device, "texel_moment", texels)?,
        occupied: buffers.read(device, "occupied", model.field.map.slots())?,
        index: moments.index.clone(),
        reflection: moments.reflection.clone(),
        clearcoat: moments.clearcoat.clone(),
    };
    Ok((model, optimiser))
}
