//! A body of one index whose edge is some voxels wide.

use super::proposal::{Body, Proposal, index_of_a_body};
use crate::blur::gaussian_blur;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::refraction_search::surface::Surface;
use crate::verdict::Hypothesis;

/// Standard deviation of the blur of a shape whose index learns [voxel of the index grid].
pub(super) const BLUR: f32 = 0.7;

pub(super) const SMOOTH: Proposal = Proposal {
    kind: Hypothesis::Smooth,
    fits: |region| region.surface().is_some(),
    is_dear: false,
    is_sharp: false,
    unknowns: |_| vec![index_of_a_body()],
    bodies,
    learning: bodies,
};

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(mut occupancy) = region.surface().map(Surface::shares) else { return Vec::new() };
    gaussian_blur(&mut occupancy, region.site.resolution, BLUR);
    vec![Body::field(region.site.of_occupancy(&occupancy, at[0]), region)]
}
