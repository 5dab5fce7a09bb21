//! A closed shell: a body of one index with a wall and air in it.

use super::proposal::{Body, INDEX, Proposal, WALL};
use crate::evidence::Unknown;
use crate::model::RegionState;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::refraction_search::shapes::{ShapeBody, Substance, shell};
use crate::verdict::Hypothesis;

/// Unknowns: the index, and the thickness of the wall [depth of the body].
pub(super) const SHELL: Proposal = Proposal {
    kind: Hypothesis::Shell,
    fits: |region| region.surface().is_some(),
    is_dear: false,
    is_sharp: true,
    unknowns: |_| unknowns(),
    bodies,
    learning: bodies,
};

fn unknowns() -> Vec<Unknown> {
    // A thicker wall and a lower index look much alike: the search goes down a valley between them.
    let walls = [0.04, 0.08, 0.14, 0.2, 0.28, 0.4, 0.6];
    vec![
        Unknown::new(INDEX, &[1.33, 1.5, 1.7], &[0.06, 0.03, 0.015, 0.01], [1.0, 4.0]),
        Unknown::new(WALL, &walls, &[0.03, 0.02, 0.01, 0.01], [0.02, 0.7]),
    ]
}

/// Glass, and the air that rules in it.
fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(surface) = region.surface() else { return Vec::new() };
    let body = |b: ShapeBody| {
        let air = RegionState { fixed_index: true, ..RegionState::default() };
        let is_air = b.substance == Substance::Air;
        if is_air { Body::given(b.surface, 1.0, air) } else { Body::searched(b.surface, at[0]) }
    };
    let shell = shell(&surface.level, at[1] * surface.depth());
    let solid = || vec![ShapeBody::new(surface.level.clone(), Substance::Glass)];
    shell.unwrap_or_else(solid).into_iter().map(body).collect()
}
