//! The visual hulls of bodies, and where they stand.

use super::parts::{NONE, cores, parts};
use super::shapes::{self, upwards};
use super::surface::{Stand, Surface};
use crate::cancel::Cancelled;
use crate::level_set::at_nodes;
use crate::model::polyhedron::Plane;
use crate::silhouettes::{Outlines, Site, Vote};
use refraxel_core::{Aabb, LevelSet, Ray, Vec3};

/// How far a body reaches into the ground that it stands on [voxel]: what lies there is not seen, but a gap above the
/// ground would be another surface.
const SUNK: f32 = 2.0;

/// What views say about shapes.
#[derive(Clone, Copy)]
pub(super) struct Views<'a> {
    pub outlines: &'a Outlines,
    /// The same with the narrow gaps that masks have.
    pub with_gaps: &'a Outlines,
    pub vote: Vote,
    /// Rays inside masks.
    pub rays: &'a [Ray<f32>],
    /// Signed distance from what was found, where no mask shows it: the outlines are rough then.
    pub found: Option<&'a LevelSet<f32>>,
}

impl Views<'_> {
    pub(super) fn are_rough(&self) -> bool {
        self.found.is_some()
    }
}

/// The visual hull of one body.
pub(super) struct Hull<'a> {
    /// What carved it.
    pub views: Views<'a>,
    pub site: Site,
    /// Signed distance.
    pub surface: LevelSet<f32>,
    /// The plane that it stands on, normal upwards.
    pub ground: Option<Plane>,
    /// Other bodies reach into its box.
    pub is_shared: bool,
}

impl Hull<'_> {
    /// The plane under the body, normal downwards, sunk into the ground.
    pub(super) fn base(&self) -> Option<Plane> {
        let by = SUNK * self.surface.voxel();
        self.ground.map(|p| Plane::facing(-p.normal(), by - p.offset()))
    }

    /// The way up, if anybody knows it.
    pub(super) fn up(&self) -> Option<Vec3<f32>> {
        upwards(self.ground.as_ref(), self.views.outlines.cameras())
    }

    /// A surface that stands where the hull does, its way up known or not.
    pub(super) fn standing(&self, surface: Surface, up: Option<Vec3<f32>>) -> Surface {
        let is_sunk = self.ground.is_some_and(|g| surface.reaches_below(&g));
        let sunk = if is_sunk { SUNK * self.surface.voxel() } else { 0.0 };
        Surface { stand: up.map(|up| Stand::new(up, sunk)), ..surface }
    }
}

/// The visual hulls of the bodies in a box where something is, down to what they stand on; `site` makes the grid around a box, `ground` finds
/// what a hull stands on. Ends early where somebody wishes to stop.
pub(super) fn hulls<'a>(
    found: &Aabb<f32>,
    site: impl Fn(&Aabb<f32>) -> Site,
    views: Views<'a>,
    ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
) -> Result<Vec<Hull<'a>>, Cancelled> {
    let (mut found, mut at) = (*found, site(found));
    let mut whole = carved(&at, views)?;
    if let Some(standing) = standing(&whole, ground(&whole).as_ref(), &found) {
        (found, at) = (standing, site(&standing));
        whole = carved(&at, views)?;
    }
    whole.redistance();
    let cores = sure(&whole, views, ground(&whole).as_ref())?;
    let first = cores.iter().find(|c| **c != NONE);
    let are_several = cores.iter().any(|c| *c != NONE && Some(c) != first);
    // Between several bodies gaps are no wires.
    let views = if are_several { Views { outlines: views.with_gaps, ..views } } else { views };
    if are_several {
        whole = carved(&at, views)?;
        whole.redistance();
    }
    let bodies = parts(&whole, &found, &cores);
    let is_shared = bodies.len() > 1;
    let hull = |surface| Hull { views, site: at, ground: ground(&surface), surface, is_shared };
    Ok(bodies.into_iter().map(hull).collect())
}

/// The visual hull on a grid; distances are rough far from its surface, where only their sign counts.
fn carved(site: &Site, views: Views) -> Result<LevelSet<f32>, Cancelled> {
    let distance = views.outlines.hull(&site.domain(), &views.vote).distance;
    views.outlines.cancel().check()?; // else distances are missing
    let domain = site.domain();
    let reach = 4.0 * domain.voxel();
    // What was found lies within itself: views from few sides leave a hull wider than the places on which they agree.
    let beyond =
        |f: &LevelSet<f32>| at_nodes(site.bounds, site.resolution, |x| shapes::distance(f, x) - f.voxel());
    let beyond = views.found.map_or(vec![f32::MIN; distance.len()], beyond);
    let near = distance.iter().zip(beyond).map(|(d, b)| d.max(b).clamp(-reach, reach)).collect();
    let whole = LevelSet::from_coefficients(site.bounds, site.resolution, near);
    Ok(whole.unwrap_or_else(|| unreachable!("distances are finite")))
}

/// What lies so deep inside the strictest hull is surely inside [voxel].
const SURELY: f32 = 0.5;

/// Which nodes surely belong to which body: what stands above the ground in the hull that overrules one vote at most and has
/// all gaps of the masks. Rough outlines leave nothing sure: the strictest hull of one body falls to pieces.
fn sure(whole: &LevelSet<f32>, views: Views, ground: Option<&Plane>) -> Result<Vec<u32>, Cancelled> {
    if views.are_rough() {
        return Ok(vec![NONE; whole.coefficients().len()]);
    }
    let vote = Vote { share: 1.0, dissent: 1, ..views.vote };
    let distance = views.with_gaps.hull(whole.domain(), &vote).distance;
    views.outlines.cancel().check()?;
    let stands = |j: usize| ground.is_none_or(|g| g.height(whole.position(j)) > 0.0);
    let n = whole.domain().resolution.map(|n| n as usize);
    Ok(cores(n, |j| distance[j] < -SURELY * whole.voxel() && stands(j)))
}

/// A box of less than this part of the volume is worth carving again.
const SMALLER: f32 = 0.7;

/// The box of what of a hull stands above the ground, where it is much smaller than that of all of it: the hull of a flat
/// thing is mostly a root, which widens below the ground.
fn standing(whole: &LevelSet<f32>, ground: Option<&Plane>, found: &Aabb<f32>) -> Option<Aabb<f32>> {
    let (ground, nodes) = (ground?, whole.coefficients());
    let reach = 2.0 * SUNK * whole.voxel();
    let stands = |x: &Vec3<f32>| ground.height(*x) > -reach && found.contains(*x);
    let above = (0..nodes.len()).filter(|&j| nodes[j] < 0.0).map(|j| whole.position(j)).filter(stands);
    let corners = Aabb::around(above)?;
    let room = Vec3::splat(whole.voxel());
    let standing = Aabb::new((corners.min - room).max(found.min), (corners.max + room).min(found.max));
    let volume = |b: &Aabb<f32>| b.extent().to_array().iter().product::<f32>();
    (volume(&standing) < SMALLER * volume(found)).then_some(standing)
}
