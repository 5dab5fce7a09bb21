//! An open vessel: glass with a wall and a base, empty or filled with water up to a level.

use super::{Body, INDEX, Proposal, Unknown};
use crate::model::RegionState;
use crate::options::Options;
use crate::recipe::region::Region;
use crate::recipe::shapes::{ShapeBody, Substance, Vessel, vessel};
use crate::verdict::Hypothesis;
use refraxel_core::{IndexGrid, Vec3};

/// Unknowns: the index of the glass, the thickness of wall and base [depth of the body], the height of the water above the
/// base [height of the vessel].
pub(super) const VESSEL: Proposal =
    Proposal { kind: Hypothesis::Vessel, is_dear: true, unknowns: |_| unknowns(), bodies, learning: bodies };

/// Index of the water, as it begins.
const WATER: f32 = 1.33;

fn unknowns() -> Vec<Unknown> {
    let unknown = |name, first: &[f32], fine: &[f32], range| Unknown {
        name,
        first: first.to_vec(),
        fine: fine.to_vec(),
        range,
    };
    vec![
        unknown(INDEX, &[1.5], &[0.04], [1.0, 4.0]),
        unknown("wall", &[0.07, 0.13, 0.26], &[0.03, 0.01], [0.02, 0.9]),
        unknown("base", &[0.2], &[0.1, 0.05], [0.02, 0.9]),
        unknown("water", &[0.0, 0.35, 0.6, 0.85], &[0.08, 0.03], [0.0, 1.0]),
    ]
}

fn bodies(region: &Region, at: &[f32], _: &Options) -> Vec<Body> {
    let (Some(surface), Some(up)) = (&region.surface, region.up) else { return Vec::new() };
    let (wall, base) = (at[1] * region.depth(), at[2] * region.depth());
    let assumed = Vessel { up, wall, base, water: at[3] * height(region, up) };
    let body = |b: ShapeBody| {
        let index = if b.substance == Substance::Water { WATER } else { at[0] };
        Body { grid: IndexGrid::sharp(b.surface, index), state: RegionState::default() }
    };
    // The glass first: its index is the one that is sought.
    let mut bodies: Vec<Body> = vessel(surface, &assumed).unwrap_or_default().into_iter().map(body).collect();
    if bodies.is_empty() {
        bodies.push(Body { grid: IndexGrid::sharp(surface.clone(), at[0]), state: RegionState::default() });
    }
    bodies
}

/// Height of the body [scene unit].
fn height(region: &Region, up: Vec3<f32>) -> f32 {
    let nodes = region.surface.iter().flat_map(|s| {
        let inside = s.parameters().filter(|&j| s.coefficients()[j] < 0.0);
        inside.map(|j| up.dot(s.position(j)))
    });
    let [low, high] = nodes.fold([f32::MAX, f32::MIN], |[a, b], h| [a.min(h), b.max(h)]);
    (high - low).max(0.0)
}
