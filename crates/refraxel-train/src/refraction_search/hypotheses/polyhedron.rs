//! A convex body with flat faces: the polyhedron whose outlines are the silhouettes, where they may show one.

use super::proposal::{Body, Proposal, index_of_a_body};
use crate::model::polyhedron::Polyhedron;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::verdict::Hypothesis;

/// Unknown: the index.
pub(super) const POLYHEDRON: Proposal = Proposal {
    kind: Hypothesis::Polyhedron,
    fits: |region| region.polyhedron().is_some(),
    is_dear: false,
    is_sharp: true,
    unknowns: |_| vec![index_of_a_body()],
    bodies,
    learning: bodies,
};

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let body = |planes: &Polyhedron| {
        let mut body = Body::searched(planes.level_set(region.site.bounds, region.site.resolution), at[0]);
        body.state.solid = Some(planes.clone());
        body
    };
    region.polyhedron().into_iter().map(body).collect()
}
