//! The scene that is measured on.

use crate::cpu::CpuBackend;
use crate::model::Model;
use refraxel_core::sh::ShDegree;
use refraxel_core::{Aabb, Background, BrickMap, Domain, Extent, VoxelField, vec3};

pub(super) fn scene(resolution: u32) -> CpuBackend {
    CpuBackend::new(model(resolution))
}

/// A translucent box of smooth structure.
pub(super) fn model(resolution: u32) -> Model {
    let bounds = Aabb::new(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
    let domain = Domain::with_longest(bounds, Extent::Bounded, resolution);
    let map = BrickMap::dense(domain.resolution);
    let mut field = VoxelField::uniform(domain, map, ShDegree::new(2).expect("2 is a degree"), -3.0);
    for (i, v) in field.density.iter_mut().enumerate() {
        *v = -3.0 + (i as f32 * 1e-3).sin();
    }
    for (i, v) in field.colour.iter_mut().enumerate() {
        *v = 0.2 * (i as f32 * 0.37).sin();
    }
    field.clear_empty_brick();
    Model::straight(field, Background::Constant([1.0; 3]))
}
