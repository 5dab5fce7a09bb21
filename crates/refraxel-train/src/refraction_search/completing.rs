//! Masks for views that have none, where others have some: the hull of the masks that there are shows where the same things are
//! seen. Such masks say which rays meet something refractive; shapes are carved from stated ones alone.

use crate::model::Gate;
use crate::rays::RaySampler;
use crate::silhouettes::{Outlines, Search, Silhouette, Spacing, Vote};
use refraxel_core::{Aabb, Domain, Extent};

/// Fewer masks than this carve nothing that is worth projecting.
pub const LEAST: usize = 4;
/// Share of the masks that must show a place. What hides things is not known yet, and what is taken for refractive without being
/// so costs little.
const SHARE: f32 = 0.75;
/// Nodes along the longest edge of a hull.
const NODES: u32 = 80;
/// Longest edge of the maps of masks [sample].
const LONGEST: usize = 320;

/// The hulls of the stated masks in a box; `None` where they are too few, or agree nowhere.
pub(crate) fn hulls(sampler: &RaySampler, bounds: &Aabb<f32>) -> Option<Vec<Gate>> {
    let silhouettes: Vec<Silhouette> = sampler.masked_views().map(|v| Silhouette::of(&v, None)).collect();
    if silhouettes.len() < LEAST {
        return None;
    }
    let outlines = Outlines::with_maps(&silhouettes, LONGEST);
    let vote = Vote { share: SHARE, ..Vote::default() };
    let search = Search { vote, spacing: Spacing::Longest(NODES), ..Search::default() };
    let boxes = outlines.locate(bounds, &search).ok()?;
    let hull = |bounds: &Aabb<f32>| {
        let domain = Domain::with_longest(*bounds, Extent::Bounded, NODES);
        outlines.gate(domain, &vote)
    };
    Some(boxes.iter().map(hull).collect())
}
