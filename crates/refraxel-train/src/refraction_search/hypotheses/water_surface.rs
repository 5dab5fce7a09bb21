//! Water that is seen from above only: an open surface, whose sides nobody sees. Waves are learned.

use super::proposal::{Body, INDEX, Proposal};
use crate::evidence::Unknown;
use crate::options::Options;
use crate::refraction_search::region::{Region, Water};
use crate::verdict::Hypothesis;
use refraxel_core::LevelSet;

/// Unknowns: the index, and the level of the water [range that the masks allow]. What lies below is seen through the water
/// alone, so that the field knows nothing of it yet: the masks tell the level, and neither is searched.
pub(super) const WATER_SURFACE: Proposal = Proposal {
    kind: Hypothesis::WaterSurface,
    fits: |region| region.water().is_some(),
    is_dear: true,
    is_sharp: true,
    unknowns: |region| unknowns(region.water().map_or(0.5, |w| w.level)),
    bodies,
    learning: bodies,
};

fn unknowns(level: f32) -> Vec<Unknown> {
    vec![Unknown::new(INDEX, &[1.33], &[], [1.0, 4.0]), Unknown::new("level", &[level], &[], [0.0, 1.0])]
}

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(Water { highest, up, range: [low, high], .. }) = region.water() else { return Vec::new() };
    let level = low + at[1] * (high - low);
    let below = |j: usize| up.dot(highest.position(j)) - level;
    let phi = highest.coefficients().iter().enumerate().map(|(j, c)| c.max(below(j))).collect();
    let domain = highest.domain();
    let surface = LevelSet::from_coefficients(domain.bounds, domain.resolution, phi);
    let surface = surface.unwrap_or_else(|| highest.clone());
    vec![Body::searched(surface, at[0])]
}
