//! The shape of a region from silhouettes.

use super::facets::{Face, faces, fills};
use super::region::Region;
use crate::initial::{Outlines, Site, Vote};
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::options::Options;
use refraxel_core::{LevelSet, Ray};

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

impl Region {
    /// The visual hull down to what it stands on, with flat faces where it may have some, its surface smoothed.
    pub(super) fn hull(
        site: Site,
        views: &Views,
        ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
        options: &Options,
    ) -> Self {
        let distance = views.outlines.hull(&site.domain(), &views.vote).distance;
        // Far from the surface the estimate is rough; only its sign counts there.
        let reach = 4.0 * site.domain().voxel();
        let near = distance.iter().map(|d| d.clamp(-reach, reach)).collect();
        let surface = LevelSet::from_coefficients(site.bounds, site.resolution, near);
        let mut surface = surface.unwrap_or_else(|| unreachable!("distances are finite"));
        surface.redistance();
        let ground = ground(&surface);
        let base = ground.map(|p| Plane::facing(-p.normal(), SUNK * surface.voxel() - p.offset()));
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
