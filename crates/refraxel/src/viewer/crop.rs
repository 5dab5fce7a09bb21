//! What is shown of the field: all of it, or what lies in a box.

use super::error::SceneError;
use rayon::prelude::*;
use refraxel_core::field::EMPTY_DENSITY;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::{Aabb, Vec3};
use refraxel_data::LocalOrigin;
use refraxel_train::backend::Marching;
use refraxel_train::{Backend, CpuBackend};

/// The field of a backend, of which a part may be hidden.
#[derive(Debug, Default)]
pub struct Crop {
    /// The densities as they were learned, while some are hidden.
    whole: Option<Vec<f32>>,
    bounds: Option<Aabb<f32>>,
}

impl Crop {
    /// Shows what lies in a box [scene unit], or everything. Voxels outside become empty; what refracts stays.
    pub fn set(&mut self, bounds: Option<Aabb<f32>>, backend: &mut CpuBackend, marching: &Marching) {
        if bounds == self.bounds {
            return;
        }
        self.bounds = bounds;
        let whole = self.whole.take().unwrap_or_else(|| backend.model().field.density.to_vec());
        backend.edit(|model| {
            let (domain, map) = (model.field.domain, &model.field.map);
            let bricks = model.field.density.par_chunks_mut(BRICK_VOXELS).zip(whole.par_chunks(BRICK_VOXELS));
            // The first one is the empty brick.
            bricks.enumerate().skip(1).for_each(|(slot, (shown, whole))| {
                for (local, (shown, whole)) in shown.iter_mut().zip(whole).enumerate() {
                    let node = Vec3::from(map.node(slot * BRICK_VOXELS + local).map(|k| k as f32));
                    let is_shown = bounds.is_none_or(|bounds| bounds.contains(domain.position(node)));
                    *shown = if is_shown { *whole } else { EMPTY_DENSITY as f32 };
                }
            });
        });
        backend.refresh_occupancy(marching);
        self.whole = bounds.map(|_| whole);
    }

    /// Whether anything is hidden.
    pub fn is_on(&self) -> bool {
        self.bounds.is_some()
    }
}

/// The box that a page asks for, in the coordinates of the renderer.
pub fn checked(corners: Option<[[f64; 3]; 2]>, origin: LocalOrigin) -> Result<Option<Aabb<f32>>, SceneError> {
    let Some([low, high]) = corners else { return Ok(None) };
    if !(0..3).all(|axis| low[axis] < high[axis] && (high[axis] - low[axis]).is_finite()) {
        let why = format!("edits.crop: found {low:?} to {high:?}; expected a box of finite size");
        return Err(SceneError::Look(why));
    }
    Ok(Some(origin.to_local(Aabb { min: low.into(), max: high.into() }).cast()))
}
