//! A convex body with flat faces: the polyhedron whose outlines are the silhouettes, where they may show one.

use super::{Body, Proposal, index_of_a_body};
use crate::model::RegionState;
use crate::options::Options;
use crate::recipe::region::Region;
use crate::verdict::Hypothesis;
use refraxel_core::IndexGrid;

/// Unknown: the index.
pub(super) const POLYHEDRON: Proposal = Proposal {
    kind: Hypothesis::Polyhedron,
    is_dear: false,
    unknowns: |_| vec![index_of_a_body()],
    bodies,
    learning: bodies,
};

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let body = |planes: &crate::model::polyhedron::Polyhedron| {
        let surface = planes.level_set(region.site.bounds, region.site.resolution);
        let state = RegionState { solid: Some(planes.clone()), ..RegionState::default() };
        Body { grid: IndexGrid::sharp(surface, at[0]), state }
    };
    region.faceted.iter().map(body).collect()
}
