//! A body of one index whose edge is some voxels wide.

use super::proposal::{Body, Proposal, index_of_a_body};
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::verdict::Hypothesis;

pub(super) const SMOOTH: Proposal = Proposal {
    kind: Hypothesis::Smooth,
    is_dear: false,
    is_sharp: false,
    unknowns: |_| vec![index_of_a_body()],
    bodies,
    learning: bodies,
};

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    vec![Body::field(region.site.from_occupancy(&region.occupancy, at[0]), region)]
}
