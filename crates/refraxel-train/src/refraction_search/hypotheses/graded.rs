//! A lens whose index rises from 1 at its surface to the middle: w = n²/2 is a power of a parabola of the depth. The power is
//! 1 for a Luneburg lens, about 2 for a fish eye and 3 for a bell-shaped field that has faded at the border of its masks.

use super::proposal::{Body, Proposal, index_of_a_body};
use crate::evidence::Unknown;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::verdict::Hypothesis;

/// Unknowns: the index in the middle, and the power.
pub(super) const GRADED: Proposal = Proposal {
    kind: Hypothesis::Graded,
    fits: |region| region.surface().is_some(),
    is_dear: true,
    is_sharp: false,
    unknowns: |_| unknowns(),
    bodies,
    learning: bodies,
};

fn unknowns() -> Vec<Unknown> {
    // The one in the middle is the guess before any search: a parabola.
    vec![index_of_a_body(), Unknown::new("power", &[2.0, 1.0, 3.0], &[0.3, 0.15, 0.1], [1.0, 6.0])]
}

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(surface) = region.surface() else { return Vec::new() };
    let (rise, depth) = (0.5 * (at[0] * at[0] - 1.0), surface.depth());
    let n = surface.distance.iter().map(|d| {
        let s = (-d / depth).clamp(0.0, 1.0);
        (1.0 + 2.0 * rise * (1.0 - (1.0 - s) * (1.0 - s)).powf(at[1])).sqrt()
    });
    let n: Vec<f32> = n.collect();
    vec![Body::field(region.site.of_nodes(&n), region)]
}
