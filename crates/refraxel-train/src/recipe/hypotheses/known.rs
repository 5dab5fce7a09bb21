//! What a file says: nothing is unknown.

use super::{Body, Proposal};
use crate::blur::gaussian_blur;
use crate::model::RegionState;
use crate::options::Options;
use crate::recipe::region::Region;
use crate::verdict::Hypothesis;

/// A body of one index.
pub(in crate::recipe) const HELD: Proposal = Proposal {
    kind: Hypothesis::Known,
    is_dear: false,
    is_sharp: false,
    unknowns: |_| Vec::new(),
    bodies: sharp,
    learning: sharp,
};

/// A field.
pub(in crate::recipe) const HELD_SMOOTH: Proposal = Proposal { bodies: smooth, learning: smooth, ..HELD };

fn sharp(region: &Region, _: &[f32], _: &Options) -> Vec<Body> {
    let most = region.known.iter().flatten().copied().fold(1.0, f32::max);
    let state = RegionState { fixed_index: region.holds_index(), ..RegionState::default() };
    region.surface.iter().map(|s| Body::given(s.clone(), most, state.clone())).collect()
}

fn smooth(region: &Region, _: &[f32], options: &Options) -> Vec<Body> {
    let Some(mut n) = region.known.clone() else { return Vec::new() };
    gaussian_blur(&mut n, region.site.resolution, options.shape.smooth);
    vec![Body::field(region.site.from_nodes(&n), region)]
}
