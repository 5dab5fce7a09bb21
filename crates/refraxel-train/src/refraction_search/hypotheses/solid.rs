//! A body of one index with a sharp surface: the visual hull, or the polyhedron that it is. Masks may all be too large or
//! too small, which no mask can tell; what is seen through the body does, so that the surface may lie off the hull.

use super::proposal::{Body, OFFSET, Proposal, index_of_a_body};
use crate::evidence::Unknown;
use crate::options::{Options, StartShape};
use crate::refraction_search::region::Region;
use crate::verdict::Hypothesis;
use refraxel_core::{Domain, IndexGrid, LevelSet};

/// Unknowns: the index, and how far the surface lies outside the hull [voxel].
pub(in crate::refraction_search) const SOLID: Proposal = Proposal {
    kind: Hypothesis::Solid,
    fits: |region| region.surface().is_some(),
    is_dear: false,
    is_sharp: true,
    unknowns: |_| unknowns(),
    bodies,
    learning,
};

fn unknowns() -> Vec<Unknown> {
    let offset = Unknown::new(OFFSET, &[-2.8, 0.0, 2.8], &[0.7, 0.35, 0.2], [-FURTHEST, FURTHEST]);
    vec![index_of_a_body(), offset]
}

/// Most voxels that a surface lies off its hull; the grid has room for six.
const FURTHEST: f32 = 4.0;

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(surface) = region.surface() else { return Vec::new() };
    let by = at[1] * region.unit;
    let solid = surface.planes().map(|s| s.grown(by));
    let level = match &solid {
        Some(solid) => solid.level_set(region.site.bounds, region.site.resolution),
        None if by == 0.0 => surface.level.clone(),
        None => surface.level.raised(-by),
    };
    let mut body = Body::searched(level, at[0]);
    body.state.solid = solid;
    vec![body]
}

/// Edge length of the voxels on which a surface learns, divided by that of the voxels on which it was found.
const COARSENING: f32 = 1.4;

/// The same body on the coarser grid where its nodes learn: pictures say less of a surface than a search needs. Planes and
/// surfaces that are held stay as they are.
fn learning(region: &Region, at: &[f32], options: &Options) -> Vec<Body> {
    let mut found = bodies(region, at, options);
    let is_held = options.surface.rate == 0.0 || options.shape.start == StartShape::File;
    if found.iter().all(|body| body.state.solid.is_none()) && !is_held {
        found.iter_mut().for_each(|body| coarsen(&mut body.grid, COARSENING));
    }
    found
}

fn coarsen(grid: &mut IndexGrid<f32>, by: f32) {
    let (Some(level), Some(index)) = (grid.level_set(), grid.interior_index()) else { return };
    let Domain { bounds, resolution, .. } = *level.domain();
    let coarser = resolution.map(|n| ((n - 1) as f32 / by).round() as u32 + 1);
    if coarser != resolution {
        *grid = IndexGrid::sharp(LevelSet::from_samples(bounds, coarser, |x| level.value(x)), index);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouettes::Site;
    use refraxel_core::{Aabb, Vec3};

    #[test]
    fn a_body_learns_on_a_coarser_grid_unless_it_is_held() {
        let bounds = Aabb::cube(1.0);
        let interpolation = Options::default().index.interpolation.into();
        let site = Site { bounds, resolution: [57; 3], interpolation };
        let region = Region::body(site, |x| x.length() - 0.6);
        let resolution = |options: &Options| {
            let body = learning(&region, &[1.5, 0.0], options).remove(0);
            let level = body.grid.level_set().unwrap();
            for x in [Vec3 { x: 0.6, y: 0.0, z: 0.0 }, Vec3 { x: 0.36, y: -0.48, z: 0.0 }] {
                assert!(level.value(x).abs() < 0.01 * level.voxel(), "{}", level.value(x));
            }
            assert_eq!(body.grid.interior_index(), Some(1.5));
            level.domain().resolution
        };
        let usual = Options::default();
        let (mut held, mut known) = (usual.clone(), usual.clone());
        known.shape.start = StartShape::File;
        held.surface.rate = 0.0;
        assert_eq!([&usual, &held, &known].map(resolution), [[41; 3], [57; 3], [57; 3]]);
    }
}
