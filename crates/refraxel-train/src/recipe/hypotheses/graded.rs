//! A lens whose index rises from 1 at its surface to the middle: w = n²/2 is a parabola of the depth.

use super::{Body, Proposal, index_of_a_body};
use crate::options::Options;
use crate::recipe::region::Region;
use crate::verdict::Hypothesis;

/// Unknown: the index in the middle.
pub(super) const GRADED: Proposal = Proposal {
    kind: Hypothesis::Graded,
    is_dear: false,
    is_sharp: false,
    unknowns: |_| vec![index_of_a_body()],
    bodies,
    learning: bodies,
};

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let (rise, depth) = (0.5 * (at[0] * at[0] - 1.0), region.depth());
    let n = region.distance.iter().map(|d| {
        let s = (-d / depth).clamp(0.0, 1.0);
        (1.0 + 2.0 * rise * (1.0 - (1.0 - s) * (1.0 - s))).sqrt()
    });
    let n: Vec<f32> = n.collect();
    vec![Body::field(region.site.from_nodes(&n), region)]
}
