//! Where the rays begin that show what a surface mirrors: the reference for the caches.

use refraxel_core::{Medium, Ray, Vec3};

/// Distance from the surface at which a secondary ray begins [voxel of the field]: it must not meet where it comes from.
const LIFT: f32 = 1e-2;
/// The same where an opaque thing ends or the index changes gradually, over some voxels [voxel of the field or the index].
const OUT_OF_THE_EDGE: f32 = 2.0;

/// How far from a surface of a region a secondary ray begins [scene unit], in a field of this voxel [scene unit]; from an opaque
/// thing without a region.
///
/// # Panics
/// If the medium has no region of this number.
pub fn distance(medium: &Medium<f32>, voxel: f32, region: Option<usize>) -> f32 {
    let Some(region) = region else { return OUT_OF_THE_EDGE * voxel };
    let grid = &medium.regions()[region];
    if grid.level_set().is_some() { LIFT * voxel } else { OUT_OF_THE_EDGE * grid.voxel() }
}

/// A mirrored ray from a surface with this normal, that far on its side of it.
pub fn lifted(mirrored: Ray<f32>, normal: Vec3<f32>, away: f32) -> Ray<f32> {
    let side = away * mirrored.direction.dot(normal).signum();
    Ray { origin: mirrored.origin + normal * side, ..mirrored }
}
