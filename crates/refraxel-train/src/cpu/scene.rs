//! Everything that a ray can meet, ready for the kernels.

use super::layout::Layout;
use super::marcher::Marcher;
use crate::model::{Model, Reflection, Refraction};
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{Background, VoxelField};

/// A model with what the kernels have worked out from it. Parts can be exchanged for one rendering.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub field: &'a VoxelField<f32>,
    pub background: &'a Background<f32>,
    pub refraction: &'a Refraction,
    pub reflection: &'a Reflection,
    pub clearcoat: Option<&'a Clearcoat<f32>>,
    pub layout: &'a Layout,
    pub marcher: Marcher<'a>,
}

impl<'a> Scene<'a> {
    /// The scene of a model, of whose field only the `occupied` cells may hold matter.
    pub(super) fn new(model: &'a Model, occupied: &'a [u64], layout: &'a Layout) -> Self {
        Self {
            field: &model.field,
            background: &model.background,
            refraction: &model.refraction,
            reflection: &model.reflection,
            clearcoat: model.clearcoat.as_ref(),
            layout,
            marcher: Marcher::new(&model.field, occupied),
        }
    }
}
