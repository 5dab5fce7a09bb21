//! What a file says: nothing is unknown.

use super::proposal::{Body, Proposal};
use super::smooth::BLUR;
use crate::blur::gaussian_blur;
use crate::model::RegionState;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::verdict::Hypothesis;

/// A body of one index.
pub(in crate::refraction_search) const HELD: Proposal = Proposal {
    kind: Hypothesis::Known,
    fits: Region::is_known,
    is_dear: false,
    is_sharp: false,
    unknowns: |_| Vec::new(),
    bodies: sharp,
    learning: sharp,
};

/// A field.
pub(in crate::refraction_search) const HELD_SMOOTH: Proposal =
    Proposal { bodies: smooth, learning: smooth, ..HELD };

fn sharp(region: &Region, _: &[f32], _: &Options) -> Vec<Body> {
    let most = region.known().unwrap_or_default().iter().copied().fold(1.0, f32::max);
    let state = RegionState { fixed_index: region.holds_index(), ..RegionState::default() };
    region.surface().into_iter().map(|s| Body::given(s.level.clone(), most, state.clone())).collect()
}

fn smooth(region: &Region, _: &[f32], _: &Options) -> Vec<Body> {
    let Some(mut n) = region.known().map(<[f32]>::to_vec) else { return Vec::new() };
    if region.state.gate.is_some() {
        gaussian_blur(&mut n, region.site.resolution, BLUR); // it may learn
    }
    vec![Body::field(region.site.of_nodes(&n), region)]
}
