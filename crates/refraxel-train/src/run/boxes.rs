//! Boxes as they are stored: two corners.

use refraxel_core::{Aabb, Vec3};

/// A box from its corners.
pub(super) fn bounds_of(corners: [[f32; 3]; 2]) -> Aabb<f32> {
    Aabb::new(Vec3::from(corners[0]), Vec3::from(corners[1]))
}

/// Whether corners are those of a box of finite size.
pub(super) fn is_box([low, high]: [[f32; 3]; 2]) -> bool {
    (0..3).all(|a| low[a] < high[a] && (high[a] - low[a]).is_finite())
}
