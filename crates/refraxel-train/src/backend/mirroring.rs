//! What mirrors, and where its light is kept.

use crate::model::Model;

/// Which radiance caches look at the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Caches {
    /// Those of refractive surfaces.
    Reflection,
    /// Those of the clearcoat of opaque things.
    Clearcoat,
}

/// What a model mirrors, without the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mirroring {
    /// Refractive regions whose surfaces mirror.
    pub regions: usize,
    /// Opaque things have a clearcoat.
    pub clearcoat: bool,
}

impl Mirroring {
    /// What a model mirrors.
    pub fn of(model: &Model) -> Self {
        let Model { reflection, clearcoat, .. } = model;
        Self { regions: reflection.mirrors.len(), clearcoat: clearcoat.is_some() }
    }
}
