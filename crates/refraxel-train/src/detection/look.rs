//! A look: where most views see what straight rays do not show.
//!
//! A place that most views see through pixels with a large residual belongs to something that straight rays cannot explain: the
//! visual hull of the residuals. Which residual is large, and how many views must agree, is what [separates](separation) the
//! pixels of the hull from those of everything else best. Where nothing refracts, no hull separates them.

use super::Hints;
use super::complete::completed;
use super::evidence::{Evidence, outlines};
use super::hull::{Carved, bodies};
use super::refine::{Refining, Votes};
use super::separation::{Separation, separation};
use crate::cancel::{Cancel, Cancelled};
use crate::model::Gate;
use crate::refraction_search::Ground;
use refraxel_core::{Aabb, Vec3};

/// Residuals that count as large, tried one after the other: root mean square over the channels of sRGB code values.
const RESIDUALS: [f32; 5] = [0.03, 0.045, 0.07, 0.1, 0.15];
/// Shares of the views that must agree on a place.
const VOTES: [f32; 3] = [0.6, 0.75, 0.9];
/// Of hulls that separate to this part as well as the best, the largest is taken: what is taken for refractive without being so
/// costs little, haze instead of glass costs much.
const AS_GOOD: f64 = 0.8;
/// First hulls that separate less than this part of what is needed are not refined: refined shapes separated at most 2.4 times as well as
/// the hull that they came from, and first hulls of glass 0.15 to 0.46, of nothing 0.02 to 0.07.
const HOPELESS: f64 = 1.0 / 3.0;
/// Views by which hulls are compared, at most.
const COMPARED: usize = 32;
/// Nodes along the longest edge of the first hulls.
const NODES: u32 = 52;
/// Nodes along the longest edge of the refined shape at most, and voxels per cell there.
const REFINED: (u32, f32) = (96, 1.2);
/// Mean votes that what is inside must have, tried one after the other: the shapes shrink.
const BOUNDS: [f32; 8] = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85];
/// Of refined shapes that separate to this part as well as the best, the largest is taken.
const NEARLY: f64 = 0.85;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Where it is.
    pub gate: Option<Gate>,
    /// How well it separates what straight rays explain from what they do not, 0 to 1.
    pub separation: f64,
}

/// Where and how a look is taken.
pub(super) struct Looking<'a> {
    /// Nothing is sought beyond.
    pub bounds: Aabb<f32>,
    /// Edge of a voxel of the fits [scene unit].
    pub voxel: f32,
    /// Size of a cell of the photographs at a point [scene unit].
    pub cell_at: &'a dyn Fn(Vec3<f32>) -> f32,
    /// Least separation of what is found.
    pub needed: f64,
    /// What somebody knows.
    pub hints: &'a Hints,
}

/// Looks at all photographs. Nothing is found where straight rays explain them, or where what they do not explain is nowhere in
/// particular. With hints, something is there, however little it stands out.
pub(super) fn look(evidence: &[Evidence], how: &Looking, cancel: &Cancel) -> Result<Found, Cancelled> {
    let needed = if how.hints.is_empty() { how.needed } else { 0.0 };
    let first = match best_hull(evidence, how, cancel)? {
        Some((Separation { share: separation, .. }, _)) if separation < HOPELESS * needed => {
            return Ok(Found { separation, gate: None });
        }
        found => found.map(|(_, hull)| hull),
    };
    let Some(first) = first else { return Ok(Found::default()) };
    let nodes = REFINED.1 * first.bounds.extent().max_element() / (how.cell_at)(first.bounds.center());
    let nodes = (nodes.round() as u32).clamp(NODES / 2, REFINED.0);
    let ground = ground(evidence, how.voxel).under(&first.surface());
    let votes = Votes::new(&first, evidence, Refining { nodes, ground }, how.hints, cancel);
    let all: Vec<&Evidence> = evidence.iter().collect();
    let mut tried: Vec<(Separation, Gate)> = Vec::new();
    for bound in BOUNDS {
        cancel.check()?;
        let gate = votes.shape(bound, how.hints);
        tried.push((separation(&all, &gate), gate));
    }
    let most = tried.iter().map(|t| t.0.share).fold(0.0, f64::max);
    let enough = NEARLY * most;
    let best = tried.into_iter().find(|t| t.0.share >= enough);
    let Some((Separation { share: separation, .. }, gate)) = best else { return Ok(Found::default()) };
    if separation == 0.0 || separation < needed {
        return Ok(Found { separation, gate: None });
    }
    Ok(Found { separation, gate: Some(completed(&gate, ground.as_ref(), evidence)) })
}

/// One cell in so many gives a point of the ground.
const GROUND_STRIDE: usize = 7;

/// The opaque surfaces that straight rays have learned.
fn ground(evidence: &[Evidence], voxel: f32) -> Ground {
    let mut points = Vec::new();
    for view in evidence {
        let cells = (0..view.rays.len()).step_by(GROUND_STRIDE);
        let opaque = cells.filter(|cell| view.counts(*cell) && view.shows_something(*cell));
        points.extend(opaque.filter_map(|cell| Some(view.rays[cell]?.at(view.beyond[cell]))));
    }
    Ground::of(points, evidence.iter().map(|view| &view.camera), voxel)
}

/// The hull to begin with, and how well it separates the views that hulls are compared by.
fn best_hull(
    evidence: &[Evidence],
    how: &Looking,
    cancel: &Cancel,
) -> Result<Option<(Separation, Carved)>, Cancelled> {
    let few: Vec<&Evidence> = evidence.iter().step_by(evidence.len().div_ceil(COMPARED).max(1)).collect();
    let mut tried: Vec<(Separation, Carved)> = Vec::new();
    for residual in RESIDUALS {
        let outlines = outlines(evidence, residual).cancelled_by(cancel);
        let found = bodies(&outlines, &how.bounds, VOTES, NODES, how.hints);
        cancel.check()?; // hulls that ended early hold nothing
        tried.extend(found.map(|found| (separation(&few, &found.gate), found)));
    }
    let most = tried.iter().map(|t| t.0.share).fold(0.0, f64::max);
    let good = tried.into_iter().filter(|t| t.0.share >= AS_GOOD * most && t.0.share > 0.0);
    Ok(good.max_by(|a, b| a.0.covered.total_cmp(&b.0.covered)))
}
