//! The shape of a region from silhouettes.

use super::facets::{Face, faces, fills};
use super::parts::parts;
use super::region::{Region, Water};
use super::shapes::{Basin, Contours, Ellipsoid, Faceted, ellipsoid, polyhedron, upwards};
use crate::initial::{Outlines, Site, Vote};
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::options::Options;
use refraxel_core::{Aabb, Camera, LevelSet, Ray, Vec3};

/// Steps and strength of the smoothing of a hull's surface, theory (2.31).
const SMOOTHING: (u32, f32) = (10, 0.6);
/// How far a body reaches into the ground that it stands on [voxel]: what lies there is not seen, but a gap above the
/// ground would be another surface.
const SUNK: f32 = 2.0;

/// What views say about shapes.
pub(super) struct Views<'a> {
    pub outlines: &'a Outlines,
    pub vote: Vote,
    /// Rays inside masks.
    pub rays: &'a [Ray<f32>],
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

impl Outlined {
    fn new(surface: &LevelSet<f32>, views: &Views, ground: Option<Plane>, options: &Options) -> Self {
        let under = ground.map(|p| Plane::facing(-p.normal(), -p.offset()));
        let contours = Contours::new(views.outlines, surface, under.as_ref());
        let round = contours.as_ref().and_then(|c| ellipsoid(c, options.shape.ellipsoid));
        let may_have_faces = round.is_none() && options.shape.faces.is_on();
        let contours = contours.filter(|_| may_have_faces);
        let found = contours.and_then(|c| polyhedron(&c, surface, under.as_ref()));
        let faceted = found.map(|Faceted { body, .. }| Polyhedron {
            base: body.base.map(|p| Plane::facing(p.normal(), p.offset() + SUNK * surface.voxel())),
            ..body
        });
        Self { round, faceted }
    }
}

/// How far water reaches behind what any view shows of its surface [voxel].
const BEYOND: f32 = 3.0;

/// Water below an open surface, if all views look down on it.
fn water(site: &Site, views: &Views, up: Vec3<f32>) -> Option<Water> {
    let basin = Basin { bounds: site.bounds, up, voxel: site.domain().voxel() };
    let range = basin.levels(views.outlines)?.range;
    let above = |c: &Camera| up.dot(c.world_from_camera.translation.cast()) > range[1];
    if !views.outlines.cameras().all(above) {
        return None;
    }
    let highest = basin.water(views.outlines, range[1], BEYOND * basin.voxel).surface;
    Some(Water { highest, up, range })
}

impl Region {
    /// The bodies of a visual hull, down to what they stand on, with flat faces where they may have some, their surfaces
    /// smoothed. `found` is the box where something is.
    pub(super) fn hulls(
        site: Site,
        found: &Aabb<f32>,
        views: &Views,
        ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
        options: &Options,
    ) -> Vec<Self> {
        let distance = views.outlines.hull(&site.domain(), &views.vote).distance;
        // Far from the surface the estimate is rough; only its sign counts there.
        let reach = 4.0 * site.domain().voxel();
        let near = distance.iter().map(|d| d.clamp(-reach, reach)).collect();
        let whole = LevelSet::from_coefficients(site.bounds, site.resolution, near);
        let mut whole = whole.unwrap_or_else(|| unreachable!("distances are finite"));
        whole.redistance();
        let bodies = parts(&whole, found);
        let is_shared = bodies.len() > 1;
        let region = |surface: LevelSet<f32>| {
            let ground = ground(&surface);
            let Outlined { round, faceted } = Outlined::new(&surface, views, ground, options);
            let up = upwards(ground.as_ref(), views.outlines.cameras());
            let is_tried = options.search.rare.is_on() && !is_shared;
            let water = up.filter(|_| is_tried).and_then(|up| water(&site, views, up));
            let hull = match &round {
                Some(body) => Self::round(site, body, surface, ground, options),
                None => Self::hull(site, surface, views, ground, options),
            };
            Self { is_shared, faceted, round, up, water, ..hull }
        };
        bodies.into_iter().map(region).collect()
    }

    /// An ellipsoid on what it stands on, instead of a hull.
    fn round(
        site: Site,
        body: &Ellipsoid,
        hull: LevelSet<f32>,
        ground: Option<Plane>,
        options: &Options,
    ) -> Self {
        let base = sunk(ground, &hull);
        let under = |x: Vec3<f32>| base.map_or(f32::MIN, |b| b.height(x));
        let distance = |x: Vec3<f32>| (body.distance(x.cast()) as f32).max(under(x));
        let mut surface = LevelSet::from_samples(site.bounds, site.resolution, distance);
        surface.redistance();
        Self::new(site, surface, options)
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
            return Self { solid: Some(solid), ..Self::new(site, surface, options) };
        }
        let bounds = body(&|f| f.large);
        if bounds.planes().next().is_some() {
            surface = bounds.cut(&surface);
        }
        surface.redistance();
        Self::new(site, surface, options)
    }
}
