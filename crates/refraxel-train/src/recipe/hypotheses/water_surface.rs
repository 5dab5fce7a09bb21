//! Water that is seen from above only: an open surface, whose sides nobody sees. Waves are learned.

use super::{Body, INDEX, Proposal, Unknown};
use crate::options::Options;
use crate::recipe::region::{Region, Water};
use crate::verdict::Hypothesis;
use refraxel_core::LevelSet;

/// Unknowns: the index, and the level of the water [range that the masks allow].
pub(super) const WATER_SURFACE: Proposal = Proposal {
    kind: Hypothesis::WaterSurface,
    is_dear: true,
    is_sharp: true,
    unknowns: |_| unknowns(),
    bodies,
    learning: bodies,
};

fn unknowns() -> Vec<Unknown> {
    let index =
        Unknown { name: INDEX, first: vec![1.25, 1.33, 1.45], fine: vec![0.03, 0.01], range: [1.0, 4.0] };
    let first = (0..9).map(|k| k as f32 / 8.0).collect();
    vec![index, Unknown { name: "level", first, fine: vec![0.05, 0.02], range: [0.0, 1.0] }]
}

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(Water { highest, up, range: [low, high] }) = &region.water else { return Vec::new() };
    let level = low + at[1] * (high - low);
    let below = |j: usize| up.dot(highest.position(j)) - level;
    let phi = highest.coefficients().iter().enumerate().map(|(j, c)| c.max(below(j))).collect();
    let domain = highest.domain();
    let surface = LevelSet::from_coefficients(domain.bounds, domain.resolution, phi);
    let surface = surface.unwrap_or_else(|| highest.clone());
    vec![Body::sought(surface, at[0])]
}
