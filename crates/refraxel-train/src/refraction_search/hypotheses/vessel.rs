//! An open vessel: glass with a wall and a base, empty or filled with water up to a level.

use super::proposal::{Body, FILLING, INDEX, Proposal, WALL, WATER};
use crate::evidence::Unknown;
use crate::model::RegionState;
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::refraction_search::shapes::{ShapeBody, Substance, Vessel, vessel};
use crate::verdict::Hypothesis;

/// Unknowns: the index of the glass, the thickness of wall and base [depth of the body], the height of the water above the
/// base [height of the vessel], that of its foot above where it seems to stand [voxel], and the index of what fills it.
pub(super) const VESSEL: Proposal = Proposal {
    kind: Hypothesis::Vessel,
    fits: |region| region.surface().is_some_and(|s| s.stand.is_some()),
    is_dear: true,
    is_sharp: true,
    unknowns: |region| unknowns(region.sunk() > 0.0),
    bodies,
    learning: bodies,
};

/// A base is at most half as thick as a vessel is wide: seen through its side, a thicker one passes for a lower part of what fills it.
const THICKEST_BASE: f32 = 0.5;

/// Index of what fills it, as it begins: water.
const OF_WATER: f32 = 1.33;

/// Glasses are of 1.46 to 1.6, and a thin wall hardly tells. The foot of what stands nowhere is not sought.
fn unknowns(stands: bool) -> Vec<Unknown> {
    vec![
        Unknown::new(INDEX, &[1.5], &[0.04, 0.02], [1.45, 1.65]),
        Unknown::new(WALL, &[0.06, 0.12, 0.2], &[0.03, 0.015], [0.02, 0.9]),
        Unknown::new("base", &[0.15, 0.35], &[0.08, 0.04], [0.02, THICKEST_BASE]),
        Unknown::new(WATER, &[0.0, 0.3, 0.5, 0.7, 0.9], &[0.05, 0.02], [0.0, 1.0]),
        Unknown::new("foot", &[0.0], if stands { &[0.5, 0.5] } else { &[] }, [-2.0, 2.0]),
        Unknown::new(FILLING, &[OF_WATER], &[0.02, 0.01], [1.2, 1.6]),
    ]
}

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let Some(outer) = region.surface() else { return Vec::new() };
    let (depth, sunk) = (outer.depth(), region.sunk());
    let solid = || ShapeBody::new(outer.level.clone(), Substance::Glass);
    let found = region.vessel_side().and_then(|side| {
        let [low, high] = side.span;
        let raised = if sunk > 0.0 { (sunk + at[4] * region.unit).max(0.0) } else { 0.0 };
        let assumed =
            Vessel { wall: at[1] * depth, base: at[2] * depth, water: at[3] * (high - low), raised };
        vessel(side, &assumed)
    });
    // Nodes of a surface follow pixels, which dents walls thinner than a voxel: what was measured is better.
    let body = |b: ShapeBody| {
        let fixed_index = b.substance == Substance::Air;
        let (solid, cuts) = (b.solid, b.cuts);
        let state = RegionState { fixed_index, fixed_surface: true, solid, cuts, ..RegionState::default() };
        match b.substance {
            Substance::Glass => Body { state, ..Body::searched(b.surface, at[0]) },
            Substance::Water => Body::given(b.surface, at[5], state),
            Substance::Air => Body::given(b.surface, 1.0, state),
        }
    };
    found.unwrap_or_else(|| vec![solid()]).into_iter().map(body).collect()
}
