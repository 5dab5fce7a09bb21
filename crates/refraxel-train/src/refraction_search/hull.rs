//! The shape of a region from silhouettes.

use super::facets::{Face, faces, fills, lid};
use super::parts::{NONE, cores, parts};
use super::region::{Region, Water};
use super::shapes::{
    self, Basin, Contours, Ellipsoid, Faceted, Levels, Revolution, ellipsoid, polyhedron, revolution, upwards,
};
use crate::cancel::Cancelled;
use crate::level_set::at_nodes;
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::options::Options;
use crate::silhouettes::{Outlines, Site, Vote};
use refraxel_core::{Aabb, Camera, LevelSet, Ray, Vec3};

/// Steps and strength of the smoothing of a hull's surface, theory (2.31).
const SMOOTHING: (u32, f32) = (10, 0.6);
/// How far a body reaches into the ground that it stands on [voxel]: what lies there is not seen, but a gap above the
/// ground would be another surface.
const SUNK: f32 = 2.0;

/// What views say about shapes.
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
    fn are_rough(&self) -> bool {
        self.found.is_some()
    }
}

/// The plane under a body, normal downwards, sunk into the ground.
fn sunk(ground: Option<Plane>, surface: &LevelSet<f32>) -> Option<Plane> {
    ground.map(|p| Plane::facing(-p.normal(), SUNK * surface.voxel() - p.offset()))
}

/// What silhouettes show where they touch a hull.
struct Outlined {
    round: Option<Ellipsoid>,
    /// Sunk into what it stands on.
    faceted: Option<Polyhedron>,
}

/// A body whose outlines leave those of an ellipsoid by at most this part of its radius is taken for one: where masks show them, and
/// where they were found without masks.
const ELLIPSOID: [f64; 2] = [0.01, 0.03];

impl Outlined {
    fn new(surface: &LevelSet<f32>, views: &Views, ground: Option<Plane>, options: &Options) -> Self {
        let under = ground.map(|p| Plane::facing(-p.normal(), -p.offset()));
        let contours = Contours::new(views.outlines, surface, under.as_ref());
        let tolerance = ELLIPSOID[usize::from(views.are_rough())];
        let round = contours.as_ref().and_then(|c| ellipsoid(c, tolerance));
        let may_have_faces = round.is_none() && options.shape.faces.is_on();
        let contours = contours.filter(|_| may_have_faces);
        let found = contours.and_then(|c| polyhedron(&c, surface, under.as_ref()));
        let faceted = found.map(|Faceted { body, .. }| Polyhedron { base: sunk(ground, surface), ..body });
        Self { round, faceted }
    }
}

/// The visual hull on a grid; distances are rough far from its surface, where only their sign counts.
fn carved(site: &Site, views: &Views) -> Result<LevelSet<f32>, Cancelled> {
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
fn sure(whole: &LevelSet<f32>, views: &Views, ground: Option<&Plane>) -> Result<Vec<u32>, Cancelled> {
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

/// How far water reaches behind what any view shows of its surface [voxel].
const BEYOND: f32 = 3.0;

/// Masks that coincide less at the best level show more than a surface. It was 0.93 for a pool, and at most 0.6 for what is also seen
/// from the side.
const COINCIDE: f64 = 0.75;

/// Water below an open surface, if all views look down on it and see nothing else of it.
fn water(site: &Site, views: &Views, up: Vec3<f32>) -> Option<Water> {
    let basin = Basin { bounds: site.bounds, up, voxel: site.domain().voxel() };
    let Levels { best, range } = basin.levels(views.outlines)?;
    let above = |c: &Camera| up.dot(c.world_from_camera.translation.cast()) > range[1];
    if best.score < COINCIDE || !views.outlines.cameras().all(above) {
        return None;
    }
    let highest = basin.water(views.outlines, range[1], BEYOND * basin.voxel).surface;
    let level = (best.height - range[0]) / (range[1] - range[0]).max(f32::EPSILON);
    Some(Water { highest, up, range, level })
}

impl Region {
    /// The bodies of a visual hull, down to what they stand on, with flat faces where they may have some, their surfaces
    /// smoothed. `found` is the box where something is, and `site` makes the grid around a box. Ends early where somebody wishes to
    /// stop.
    pub(super) fn hulls(
        found: &Aabb<f32>,
        site: impl Fn(&Aabb<f32>) -> Site,
        views: &Views,
        ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
        options: &Options,
    ) -> Result<Vec<Self>, Cancelled> {
        let go_on = || views.outlines.cancel().check();
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
        let views = if are_several { &Views { outlines: views.with_gaps, ..*views } } else { views };
        if are_several {
            whole = carved(&at, views)?;
            whole.redistance();
        }
        let bodies = parts(&whole, &found, &cores);
        let is_shared = bodies.len() > 1;
        let region = |surface: LevelSet<f32>| {
            let ground = ground(&surface);
            let Outlined { round, faceted } = Outlined::new(&surface, views, ground, options);
            go_on()?;
            let upright = upwards(ground.as_ref(), views.outlines.cameras());
            let may_be_turned = round.is_none() && options.shape.faces.is_on();
            let about = upright.filter(|_| may_be_turned);
            let revolution = about.and_then(|up| revolution(&surface, up, ground.as_ref()));
            go_on()?;
            let (revolution, perhaps) = match revolution {
                Some(body) if body.is_sure => (Some(body), None),
                unsure => (None, unsure.filter(|_| !views.are_rough())),
            };
            let up = revolution.as_ref().map(|t| t.axis().up).or(upright);
            let faceted = faceted.filter(|_| revolution.is_none());
            let water = up.filter(|_| !is_shared).and_then(|up| water(&at, views, up));
            go_on()?;
            let standing = |hull: Self, up: Option<Vec3<f32>>| {
                let sunk =
                    ground.filter(|g| hull.reaches_below(g)).map_or(0.0, |_| SUNK * at.domain().voxel());
                Self { is_shared, up, sunk, ..hull }
            };
            let of_turned = |body: &Revolution| {
                let hull = Self::revolution(at, body, &surface, views, ground);
                Self { axis: Some(body.axis()), ..standing(hull, Some(body.axis().up)) }
            };
            let revolved = perhaps.map(|body| Box::new(of_turned(&body)));
            let hull = match (&round, &revolution) {
                (Some(body), _) => standing(Self::round(at, body, surface, ground), up),
                (_, Some(body)) => of_turned(body),
                _ => standing(Self::hull(at, surface, views, ground, options), up),
            };
            Ok(Self { faceted, round, water, revolved, ..hull })
        };
        bodies.into_iter().map(region).collect()
    }

    /// An ellipsoid on what it stands on, instead of a hull.
    fn round(site: Site, body: &Ellipsoid, hull: LevelSet<f32>, ground: Option<Plane>) -> Self {
        let base = sunk(ground, &hull);
        let under = |x: Vec3<f32>| base.map_or(f32::MIN, |b| b.height(x));
        let distance = |x: Vec3<f32>| (body.distance(x.cast()) as f32).max(under(x));
        let mut surface = LevelSet::from_samples(site.bounds, site.resolution, distance);
        surface.redistance();
        Self::new(site, surface)
    }

    /// A body of revolution between what it stands on and its upper end, if that is flat: a hull goes on above it as a roof.
    fn revolution(
        site: Site,
        body: &Revolution,
        hull: &LevelSet<f32>,
        views: &Views,
        ground: Option<Plane>,
    ) -> Self {
        let mut ends = Polyhedron { faces: Vec::new(), base: sunk(ground, hull) };
        let roofed = body.surface(&site.domain(), &ends);
        ends.faces.extend(lid(&roofed, views.rays, body.axis().up));
        Self::new(site, body.surface(&site.domain(), &ends))
    }

    fn hull(
        site: Site,
        mut surface: LevelSet<f32>,
        views: &Views,
        ground: Option<Plane>,
        options: &Options,
    ) -> Self {
        let base = sunk(ground, &surface);
        let faces = if options.shape.faces.is_on() {
            // Without what it has grown into the ground.
            faces(&Polyhedron { faces: Vec::new(), base }.cut(&surface), views.rays, base.as_ref())
        } else {
            Vec::new()
        };
        for _ in 0..SMOOTHING.0 {
            surface.smooth(SMOOTHING.1);
        }
        // After the smoothing: edges stay as sharp as the grid.
        let body = |chosen: &dyn Fn(&Face) -> bool| {
            let faces = faces.iter().filter(|f| chosen(f)).map(|f| f.plane).collect();
            Polyhedron { faces, base }
        };
        let solid = body(&|_| true);
        if fills(&solid.cut(&surface), &solid) {
            let surface = solid.level_set(site.bounds, site.resolution);
            return Self { solid: Some(solid), ..Self::new(site, surface) };
        }
        let bounds = body(&|f| f.large);
        if bounds.planes().next().is_some() {
            surface = bounds.cut(&surface);
        }
        surface.redistance();
        Self::new(site, surface)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;
    use crate::silhouettes::Silhouette;
    use refraxel_core::vec3;
    use refraxel_data::Mask;

    /// Something in the middle, seen from four sides; some rows of pixels may show that it is two things.
    fn silhouettes(gap: std::ops::Range<u32>) -> Vec<Silhouette> {
        let is_inside =
            |[x, y]: [u32; 2]| (16..48).contains(&x) && (12..52).contains(&y) && !gap.contains(&y);
        let of = |k: u32| {
            let (y, x) = (1.571 * f64::from(k)).sin_cos();
            let camera =
                Camera::look_at(vec3(4.0 * x, 4.0 * y, 0.2), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [64; 2]);
            let coverage = (0..64 * 64).map(|p| if is_inside([p % 64, p / 64]) { 255 } else { 0 }).collect();
            Silhouette { camera, mask: Mask { width: 64, height: 64, coverage }.into(), occluders: None }
        };
        (0..4).map(of).collect()
    }

    fn site(bounds: &Aabb<f32>) -> Site {
        let interpolation = Options::default().index.interpolation.into();
        Site { bounds: *bounds, resolution: [33; 3], interpolation }
    }

    #[test]
    fn outlines_that_were_found_divide_no_body() {
        let (whole, halves) = (silhouettes(0..0), silhouettes(30..36));
        let (outlines, with_gaps) = (Outlines::new(&whole), Outlines::new(&halves));
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let around = LevelSet::from_samples(cube, [9; 3], |x| x.length() - 2.0);
        let bodies = |found| {
            let views =
                Views { outlines: &outlines, with_gaps: &with_gaps, vote: Vote::default(), rays: &[], found };
            Region::hulls(&cube, site, &views, |_| None, &Options::default()).unwrap().len()
        };
        assert_eq!([None, Some(&around)].map(bodies), [2, 1]);
    }

    #[test]
    fn a_wish_to_stop_ends_the_making_of_hulls() {
        let (cancel, options, silhouettes) = (Cancel::new(), Options::default(), silhouettes(0..0));
        let outlines = Outlines::new(&silhouettes).cancelled_by(&cancel);
        let vote = Vote::default();
        let views = Views { outlines: &outlines, with_gaps: &outlines, vote, rays: &[], found: None };
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let hulls = || Region::hulls(&cube, site, &views, |_| None, &options).map(|bodies| bodies.len());
        assert_eq!(hulls(), Ok(1));
        cancel.cancel();
        assert_eq!(hulls(), Err(Cancelled));
    }
}
